#!/usr/bin/env bash
# Runs the test programs and counts their "ok", "not ok" and "skip" lines; the last line is "N passed, N failed".
# usage: tests/run.sh BUILD_DIR ["unit api browser guard hygiene"] [FILTER] [PROGRAMS]
# FILTER goes to each program, which runs the tests whose name contains it; "test_http" is all of that program,
# "test_http.not_found" some of it, as the lines of a run name them. PROGRAMS is a list of such ("test_store api/test_http
# unit/test_json_scan.memory", of both kinds unless one is named); without it all run. A program that dies without a
# "not ok" line of its own counts as one failure.
set -uo pipefail
build=$1 kinds=${2:-unit api browser guard hygiene} filter=${3:-} programs=${4:-}
if [[ $filter == test_* ]]; then programs=$filter filter=; fi
work=$(mktemp -d)
log=$work/log
limit=1800 # seconds of one program that hangs: what takes a minute alone takes ten beside others
trap 'rm -rf "$work"' EXIT
: >"$log"

# For builds with a sanitizer: what is known of the libraries, and where in our code it happened.
export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp ${TSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$PWD/tests/lsan.supp print_suppressions=0 ${LSAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1 ${UBSAN_OPTIONS:-}"
# As in the service, one thread of BLAS (a program that wants more says so): four programs run at a time. And a locale
# with a decimal comma, for the C tests that numbers are read and written without it.
unit_env=(env OPENBLAS_NUM_THREADS=1)
if [[ " $kinds " == *" unit "* ]] && { [ -d "$build/locale/de_DE.UTF-8" ] || { mkdir -p "$build/locale" &&
    localedef -i de_DE -f UTF-8 "$work/de_DE.UTF-8" >/dev/null 2>&1 && mv "$work/de_DE.UTF-8" "$build/locale/"; }; }; then
    unit_env+=("LOCPATH=$(realpath "$build")/locale")
fi

run_one() { # KIND NAME COMMAND...
    local kind=$1 name=$2 out=$work/$1.$2.$RANDOM.out status TIMEFORMAT='%U %S' user system
    shift 2
    SECONDS=0
    { time timeout -k 10 "$limit" "$@" >"$out" 2>&1; } 2>"$out.time"
    status=$?
    read -r user system < <(tail -1 "$out.time")
    if [ $status -eq 124 ]; then
        echo "not ok $name: not over after $limit s"
    elif [ $status -ne 0 ] && ! grep -q '^not ok ' "$out"; then
        echo "not ok $name: exit status $status"
    fi >>"$out"
    # Show failures with what led to them; successes stay one line per program.
    if grep -q '^not ok ' "$out"; then cat "$out"; elif [ -z "$filter" ] || grep -q '^ok \|^skip ' "$out"; then
        printf '%-34s %4s passed %4s s %4.0f s of processor\n' "$name" "$(grep -c '^ok ' "$out")" "$SECONDS" \
            "$(awk "BEGIN {print $user + $system}")"
        grep '^skip ' "$out"
    fi
    cat "$out" >>"$log"
}
wanted() { # NAME: of this kind, and the part of it, if it is not to run as a whole
    local one
    [ -n "$programs" ] || echo "$kind $1"
    for one in $programs; do
        case ${one#"$kind"/} in "$1") echo "$kind $1" ;; "$1".*) echo "$kind $1 ${one#*.}" ;; esac
    done
}

list_kind() { # KIND: a line "KIND NAME [PART]" for each of its programs
    local kind=$1 file
    case $kind in
    unit | api | browser) for file in $(find tests/"$kind" -name 'test_*.c' -printf '%f\n' -o -name 'test_*.py' -printf '%f\n' | sort); do
                              wanted "${file%.*}"
                          done ;;
    guard | hygiene) echo "$kind $kind" ;;
    esac
}
run_program() { # KIND NAME [PART]
    local kind=$1 name=$2 filter=${3:-$filter}
    case $kind in
    unit) run_one "$kind" "$name" "${unit_env[@]}" "$build/tests/$name" $filter ;;
    api | browser) run_one "$kind" "$name" /usr/bin/python3 -B "tests/$kind/$name.py" "$build" $filter ;;
    guard) run_one "$kind" guard /usr/bin/python3 -B tests/guard/guard.py "$build" ;;
    hygiene) run_one "$kind" lint tests/lint.sh ;;
    esac
}

# Rows, each of which takes the next program that nobody has. A row for each core begins with those that compute, the
# longest first, and one more than that begin with those that wait for a browser, a clock or a database half of their
# time, so that there is something to compute meanwhile; a row that is through with its own goes on with the others'.
for kind in browser api guard unit hygiene; do
    if [[ " $kinds " == *" $kind "* ]]; then list_kind "$kind"; fi
done >"$work/waiting"
tac "$work/waiting" >"$work/computing"
run_row() { # LIST
    local kind name part
    while read -r kind name part <&3; do
        if mkdir "$work/$kind.$name.$part" 2>/dev/null; then run_program "$kind" "$name" "$part" 3<&-; fi
    done 3<"$work/$1"
}
SECONDS=0
run_row waiting &
for ((row = 0; row < $(nproc); row++)); do
    run_row computing &
    run_row waiting &
done
wait
cat "$work"/*.time 2>/dev/null | awk -v cores="$(nproc)" -v wall="$SECONDS" \
    '{used += $1 + $2} END {printf "%.0f s of processor in %d s on %d cores\n", used, wall, cores}'
passed=$(grep -c '^ok ' "$log") failed=$(grep -c '^not ok ' "$log") skipped=$(grep -c '^skip ' "$log")
[ "$skipped" -eq 0 ] || echo "$skipped skipped"
[ -z "$filter$programs" ] || [ $((passed + failed + skipped)) -gt 0 ] || echo "no test's name contains '${3:-$4}'"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
