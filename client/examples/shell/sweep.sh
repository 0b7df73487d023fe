#!/usr/bin/env bash
# One job with a load case for each value of a traction: contact and largest pressure of each, as CSV.
# usage: sweep.sh REQUEST.json FIRST LAST COUNT     varies the second component of the first load's traction
set -euo pipefail
server=${UZAWA_SERVER:-http://127.0.0.1:8080}
[ $# -eq 4 ] || { sed -n 's/^# usage/usage/p' "$0" >&2; exit 2; }
call() { curl -sS --fail-with-body --retry 5 --retry-connrefused "$@" ${UZAWA_TOKEN:+-H "Authorization: Bearer $UZAWA_TOKEN"}; }

id=$(jq --argjson first "$2" --argjson last "$3" --argjson n "$4" '
        .problem.loads as $loads
        | .cases = [range($n) | ($first + ($last - $first) * . / ([$n - 1, 1] | max)) as $t
                    | {name: "\($t)", loads: ($loads | .[0].traction[1] = $t)}]' "$1" |
    call "$server/v1/jobs" -H 'Content-Type: application/json' -H "Idempotency-Key: $(od -An -N16 -tx1 /dev/urandom | tr -d ' ')" \
        --data-binary @- | jq -r .id)
until call "$server/v1/jobs/$id" -H 'Prefer: wait=30' | jq -e '.status != "accepted" and .status != "running"' >/dev/null; do :; done
call "$server/v1/jobs/$id/result?fields=summary" | jq -r '
    ["traction", "contacts", "max_pressure", "certified_error"],
    (.cases[] | [.name, .summary.contact.active, .summary.contact.max_pressure, .summary.certificate.relative_error]) | @csv'
call "$server/v1/jobs/$id" | jq -e '.summary.outcome == "converged"' >/dev/null
