#!/usr/bin/env bash
# Runs the given targets of make one after the other, whatever becomes of each, and closes with one count over all.
# usage: tests/ci.sh "[+]TARGET [VARIABLE=VALUE...]" ...
# Each ends its output with a line "N passed, N failed"; one that fails without counting a failure, or says nothing,
# counts as one failure. Tests wait a good part of their time, for a browser or a clock: what a target's tests need
# (TARGET-build) is built beside those of the target before it, by what they leave of the processor. So is a target with
# a + made, one that computes and waits for nothing, beside all that follow it; what it says comes after they have ended.
set -uo pipefail
work=$(mktemp -d) ahead=
trap 'kill $(jobs -p) 2>/dev/null; rm -rf "$work"' EXIT
passed=0 failed=0

prepare() { # NICENESS TARGET [VARIABLE=VALUE...]: what fails here is said when the target itself is made
    nice -n "$1" make "$2-build" "${@:3}" >/dev/null 2>&1
}
run() { # NICENESS LOG TARGET [VARIABLE=VALUE...]: the status of make
    local log=$2 begun=$SECONDS status
    printf '\n== make %s\n' "${*:3}"
    nice -n "$1" make "${@:3}" 2>&1 | tee "$log"
    status=${PIPESTATUS[0]}
    printf '== make %s: %s s\n' "${*:3}" $((SECONDS - begun))
    return "$status"
}
count() { # STATUS LOG TARGET [VARIABLE=VALUE...]
    local counts good=0 bad=0
    counts=$(grep -xE '[0-9]+ passed, [0-9]+ failed' "$2" | tail -1)
    [ -z "$counts" ] || read -r good _ bad _ <<<"$counts"
    if [ "$bad" -eq 0 ] && { [ "$1" -ne 0 ] || [ -z "$counts" ]; }; then
        echo "not ok make ${*:3}: exit status $1"
        bad=1
    fi
    passed=$((passed + good)) failed=$((failed + bad))
}

targets=("$@") beside=()
prepare 0 ${targets[0]}
for i in "${!targets[@]}"; do
    [ -z "$ahead" ] || wait "$ahead"
    ahead=
    if [[ ${targets[i]} == +* ]]; then
        run 10 "$work/$i" ${targets[i]#+} >"$work/$i.said" &
        beside[i]=$!
        continue
    fi
    for next in "${targets[@]:i+1}"; do
        prepare 10 ${next#+}
        [[ $next == +* ]] || break
    done &
    ahead=$!
    run 0 "$work/$i" ${targets[i]}
    count $? "$work/$i" ${targets[i]}
done
for i in "${!beside[@]}"; do
    wait "${beside[i]}"
    status=$?
    cat "$work/$i.said"
    count "$status" "$work/$i" ${targets[i]#+}
done
printf '\n== all: %s s\n' "$SECONDS"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
