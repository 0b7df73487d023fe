#!/usr/bin/env bash
# Has an answer certified that another program wrote: matrices and vectors in Matrix Market files.
# usage: verify.sh K.mtx N.mtx h.mtx p.mtx u.mtx r.mtx [RELATIVE_ERROR]     exit status 0: certified (default 1e-8)
set -euo pipefail
server=${UZAWA_SERVER:-http://127.0.0.1:8080}
[ $# -eq 6 ] || [ $# -eq 7 ] || { sed -n 's/^# usage/usage/p' "$0" >&2; exit 2; }
call() { curl -sS --fail-with-body --retry 5 --retry-connrefused "$@" ${UZAWA_TOKEN:+-H "Authorization: Bearer $UZAWA_TOKEN"}; }

result=$(jq -n --rawfile K "$1" --rawfile N "$2" --rawfile h "$3" --rawfile p "$4" --rawfile u "$5" --rawfile r "$6" \
        --argjson error "${7:-1e-8}" '{problem: {kind: "matrices", K: $K, N: $N, h: $h, p: $p},
                                       answer: {displacements: $u, reactions: $r},
                                       solver: {accuracy: {relative_error: $error}}}' |
    call "$server/v1/verify" -H 'Content-Type: application/json' -H 'Prefer: wait=60' --data-binary @-) ||
    { jq -r '"refused: \(.pointer // "") \(.detail)"' <<<"$result" >&2; exit 1; }
jq -r '.summary | "\(.outcome): relative error at most \(.certificate.relative_error), residual \(.certificate.residual.total)"' <<<"$result"
jq -e '.summary.outcome == "verified"' <<<"$result" >/dev/null
