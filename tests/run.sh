#!/usr/bin/env bash
# Runs the test programs and counts their "ok", "not ok" and "skip" lines.
# usage: tests/run.sh BUILD_DIR ["unit api hygiene"] [FILTER]
# A program that dies without a "not ok" line of its own counts as one failure.
set -uo pipefail
build=$1 kinds=${2:-unit api hygiene} filter=${3:-}
log=$(mktemp)
trap 'rm -f "$log"' EXIT

run_one() { # NAME COMMAND...
    local name=$1 out status
    shift
    out=$(mktemp)
    "$@" >"$out" 2>&1
    status=$?
    if [ $status -ne 0 ] && ! grep -q '^not ok ' "$out"; then
        echo "not ok $name: exit status $status" >>"$out"
    fi
    # Show failures with what led to them; successes stay one line per program.
    if grep -q '^not ok ' "$out"; then cat "$out"; else
        printf '%-44s %s passed\n' "$name" "$(grep -c '^ok ' "$out")"
        grep '^skip ' "$out"
    fi
    cat "$out" >>"$log"
    rm -f "$out"
}

for kind in $kinds; do
    case $kind in
    unit) for source in tests/unit/test_*.c; do
              name=$(basename "$source" .c)
              run_one "$name" "$build/tests/$name" $filter
          done ;;
    api) for script in tests/api/test_*.py; do
             run_one "$(basename "$script" .py)" /usr/bin/python3 -B "$script" "$build" $filter
         done ;;
    hygiene) run_one lint tests/lint.sh ;;
    esac
done
passed=$(grep -c '^ok ' "$log") failed=$(grep -c '^not ok ' "$log") skipped=$(grep -c '^skip ' "$log")
if [ "$skipped" -gt 0 ]; then echo "$passed passed, $failed failed, $skipped skipped"
else echo "$passed passed, $failed failed"; fi
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
