#!/usr/bin/env bash
# Runs every fuzz target for SECONDS, one per core at a time, and prints one "ok" or "not ok" line for each; the last
# line counts them.
# usage: tests/fuzz/run.sh BUILD_DIR SECONDS [TARGET...]
# An input that breaks a target stays in BUILD_DIR/fuzz/found; `BUILD_DIR/fuzz/TARGET FILE` runs it again.
set -uo pipefail
build=$1 seconds=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$build/fuzz/found"
/usr/bin/python3 -B tests/fuzz/seeds.py "$work/seeds" || exit 1
targets=("$@")
[ $# -gt 0 ] || for source in tests/fuzz/fuzz_*.c; do targets+=("$(basename "$source" .c)"); done

kind() { # TARGET: what its inputs are
    case $1 in fuzz_mm*) echo mm ;; fuzz_gmsh*) echo gmsh ;; fuzz_abaqus*) echo abaqus ;; fuzz_nastran*) echo nastran ;; fuzz_vtk*) echo vtk ;; fuzz_surface*) echo surface ;; fuzz_numpy*) echo numpy ;; *) echo json ;; esac
}
statistic() { # NAME LOG
    sed -n "s/^stat::$1: *//p" "$2"
}
fuzz() { # TARGET
    local target=$1 log=$work/$1.log of
    of=$(kind "$target")
    mkdir -p "$work/$target"
    if "$build/fuzz/$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=1024 -max_len=20000 -print_final_stats=1 \
        -dict="$work/seeds/$of.dict" -artifact_prefix="$build/fuzz/found/$target-" \
        "$work/$target" "$work/seeds/$of" >"$log" 2>&1; then
        printf 'ok %s: %s inputs, %s new ones kept\n' "$target" "$(statistic number_of_executed_units "$log")" \
            "$(statistic new_units_added "$log")"
    else
        grep -v '^#[0-9]' "$log" | tail -60
        echo "not ok $target"
        return 1
    fi
}

# One per core at a time.
passed=0 failed=0 running=0
collect() {
    if wait -n; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
    running=$((running - 1))
}
for target in "${targets[@]}"; do
    [ "$running" -lt "$(nproc)" ] || collect
    fuzz "$target" &
    running=$((running + 1))
done
while [ "$running" -gt 0 ]; do collect; done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
