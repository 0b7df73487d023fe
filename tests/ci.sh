#!/usr/bin/env bash
# Runs the given commands one after the other, whatever becomes of each, and closes with one count over all of them.
# usage: tests/ci.sh "COMMAND..." ...
# Each command ends its output with a line "N passed, N failed"; one that fails without counting a failure, or says
# nothing, counts as one failure.
set -uo pipefail
log=$(mktemp)
trap 'rm -f "$log"' EXIT
passed=0 failed=0 total=0

run() { # COMMAND...
    local status counts good=0 bad=0
    printf '\n== %s\n' "$*"
    SECONDS=0
    "$@" 2>&1 | tee "$log"
    status=${PIPESTATUS[0]}
    counts=$(grep -xE '[0-9]+ passed, [0-9]+ failed' "$log" | tail -1)
    [ -z "$counts" ] || read -r good _ bad _ <<<"$counts"
    if [ "$bad" -eq 0 ] && { [ "$status" -ne 0 ] || [ -z "$counts" ]; }; then
        echo "not ok $*: exit status $status"
        bad=1
    fi
    printf '== %s: %s s\n' "$*" "$SECONDS"
    total=$((total + SECONDS)) passed=$((passed + good)) failed=$((failed + bad))
}

for command in "$@"; do run $command; done
printf '\n== all: %s s\n' "$total"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
