#!/usr/bin/env bash
# Runs the given targets of make one after the other, whatever becomes of each, and closes with one count over all.
# usage: tests/ci.sh "TARGET [VARIABLE=VALUE...]" ...
# Each ends its output with a line "N passed, N failed"; one that fails without counting a failure, or says nothing,
# counts as one failure. Tests wait a good part of their time, for a browser or a clock: what a target's tests need
# (TARGET-build) is built beside those of the target before it, by what they leave of the processor.
set -uo pipefail
log=$(mktemp) ahead=
trap 'rm -f "$log"; [ -z "$ahead" ] || kill "$ahead" 2>/dev/null' EXIT
passed=0 failed=0

prepare() { # NICENESS TARGET [VARIABLE=VALUE...]: what fails here is said when the target itself is made
    nice -n "$1" make "$2-build" "${@:3}" >/dev/null 2>&1
}
run() { # TARGET [VARIABLE=VALUE...]
    local status counts good=0 bad=0
    make "$@" 2>&1 | tee "$log"
    status=${PIPESTATUS[0]}
    counts=$(grep -xE '[0-9]+ passed, [0-9]+ failed' "$log" | tail -1)
    [ -z "$counts" ] || read -r good _ bad _ <<<"$counts"
    if [ "$bad" -eq 0 ] && { [ "$status" -ne 0 ] || [ -z "$counts" ]; }; then
        echo "not ok make $*: exit status $status"
        bad=1
    fi
    passed=$((passed + good)) failed=$((failed + bad))
}

targets=("$@")
prepare 0 ${targets[0]}
for i in "${!targets[@]}"; do
    printf '\n== make %s\n' "${targets[i]}"
    begun=$SECONDS
    [ -z "$ahead" ] || wait "$ahead"
    ahead=
    if [ $((i + 1)) -lt ${#targets[@]} ]; then
        prepare 10 ${targets[i + 1]} &
        ahead=$!
    fi
    run ${targets[i]}
    printf '== make %s: %s s\n' "${targets[i]}" $((SECONDS - begun))
done
printf '\n== all: %s s\n' "$SECONDS"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
