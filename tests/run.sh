#!/usr/bin/env bash
# Runs the test programs and counts their "ok", "not ok" and "skip" lines; the last line is "N passed, N failed".
# usage: tests/run.sh BUILD_DIR ["unit api browser guard hygiene"] [FILTER] [PROGRAMS]
# FILTER goes to each program, which runs the tests whose name contains it. PROGRAMS is a list of programs ("test_store
# api/test_http", of both kinds unless one is named); without it all run. A program that dies without a "not ok" line of its own counts as one failure.
set -uo pipefail
build=$1 kinds=${2:-unit api browser guard hygiene} filter=${3:-} programs=${4:-}
work=$(mktemp -d)
log=$work/log
trap 'rm -rf "$work"' EXIT
: >"$log"

# For builds with a sanitizer: what is known of the libraries, and where in our code it happened.
export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp ${TSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$PWD/tests/lsan.supp print_suppressions=0 ${LSAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1 ${UBSAN_OPTIONS:-}"
# A locale with a decimal comma, for the C tests that numbers are read and written without it.
locale=()
if localedef -i de_DE -f UTF-8 "$work/de_DE.UTF-8" >/dev/null 2>&1; then locale=(env "LOCPATH=$work"); fi

run_one() { # NAME COMMAND...
    local name=$1 out=$work/$kind.out status TIMEFORMAT='%U %S' user system
    shift
    SECONDS=0
    { time "$@" >"$out" 2>&1; } 2>"$work/$kind.time"
    status=$?
    read -r user system < <(tail -1 "$work/$kind.time")
    if [ $status -ne 0 ] && ! grep -q '^not ok ' "$out"; then
        echo "not ok $name: exit status $status" >>"$out"
    fi
    # Show failures with what led to them; successes stay one line per program.
    if grep -q '^not ok ' "$out"; then cat "$out"; else
        printf '%-34s %4s passed %4s s %4.0f s of processor\n' "$name" "$(grep -c '^ok ' "$out")" "$SECONDS" \
            "$(echo "$user + $system" | awk '{print $1 + $3}')"
        grep '^skip ' "$out"
    fi
    cat "$out" >>"$log"
}
wanted() { # NAME: of this kind
    [ -z "$programs" ] || [[ " $programs " == *" $1 "* || " $programs " == *" $kind/$1 "* ]]
}

run_kind() {
    local kind=$1 source script name
    case $kind in
    unit) for source in tests/unit/test_*.c; do
              name=$(basename "$source" .c)
              if wanted "$name"; then run_one "$name" "${locale[@]}" "$build/tests/$name" $filter; fi
          done ;;
    api) for script in tests/api/test_*.py; do
             name=$(basename "$script" .py)
             if wanted "$name"; then run_one "$name" /usr/bin/python3 -B "$script" "$build" $filter; fi
         done ;;
    browser) for script in tests/browser/test_*.py; do
                 name=$(basename "$script" .py)
                 if wanted "$name"; then run_one "$name" /usr/bin/python3 -B "$script" "$build" $filter; fi
             done ;;
    guard) run_one guard /usr/bin/python3 -B tests/guard/guard.py "$build" ;;
    hygiene) run_one lint tests/lint.sh ;;
    esac
}

# Two rows side by side: most programs keep one core busy.
run_row() { # KIND...
    local kind
    for kind in "$@"; do
        if [[ " $kinds " == *" $kind "* ]]; then run_kind "$kind"; fi
    done
}
run_row unit guard hygiene &
run_row api browser &
wait
passed=$(grep -c '^ok ' "$log") failed=$(grep -c '^not ok ' "$log") skipped=$(grep -c '^skip ' "$log")
[ "$skipped" -eq 0 ] || echo "$skipped skipped"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
