#!/usr/bin/env bash
# Runs the C tests under valgrind: invalid reads and writes, what is used before it is set, blocks definitely lost.
# usage: tests/valgrind.sh BUILD_DIR [FILTER]    VALGRIND_SECONDS: the time that each program may take (60)
# FILTER: programs whose name contains it. A program that takes longer is ended and named: its first tests were seen.
# What the tests themselves say of their figures is not asked here: valgrind computes long double in 64 bits.
set -uo pipefail
build=$1 filter=${2:-} seconds=${VALGRIND_SECONDS:-60}
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Instructions that valgrind knows, and one thread: it runs them in turn.
export OPENBLAS_CORETYPE=Haswell OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
passed=0 failed=0 cut=0
for source in $(find tests/unit -name 'test_*.c' | sort); do
    name=$(basename "$source" .c)
    [[ $name == *"$filter"* ]] || continue
    SECONDS=0
    timeout --signal=INT "$seconds" stdbuf -oL valgrind -q --error-exitcode=99 --leak-check=full --show-leak-kinds=definite \
        --errors-for-leak-kinds=definite --suppressions=tests/valgrind.supp "$build/tests/$name" >"$log" 2>&1
    status=$?
    # A block that a program held when it was ended is not lost.
    if [ $status -eq 124 ] && ! grep -Eq '^==[0-9]*== (Invalid|Conditional|Use of|Mismatched|Syscall|Source and)' "$log"; then
        printf '%-34s ended after %s s: %s tests seen, no error\n' "$name" "$seconds" "$(grep -c '^ok ' "$log")"
        cut=$((cut + 1))
    elif [ $status -eq 99 ] || grep -q '^==[0-9]*== ' "$log"; then
        grep '^==' "$log" | head -60
        echo "not ok valgrind.$name"
        failed=$((failed + 1))
    else
        printf '%-34s no error %4s s\n' "$name" "$SECONDS"
        passed=$((passed + 1))
    fi
done
echo "$passed without error, $cut ended early without error, $failed with errors"
[ $failed -eq 0 ] && [ $((passed + cut)) -gt 0 ]
