#!/usr/bin/env bash
# Solves the request in a file with curl and jq, and says where it touches, how hard, and how sure that is.
# usage: submit_and_wait.sh REQUEST.json     exit status 0: certified as asked, and every assertion passes
set -euo pipefail
server=${UZAWA_SERVER:-http://127.0.0.1:8080}
[ $# -eq 1 ] || { sed -n 's/^# usage/usage/p' "$0" >&2; exit 2; }

# Fails with the service's reason. A repeated POST with the same key is the same job.
call() { curl -sS --fail-with-body --retry 5 --retry-connrefused "$@" ${UZAWA_TOKEN:+-H "Authorization: Bearer $UZAWA_TOKEN"}; }

job=$(call "$server/v1/jobs" -H 'Content-Type: application/json' -H "Idempotency-Key: $(uuidgen 2>/dev/null || echo $RANDOM$RANDOM$RANDOM$$)" \
    -H 'Prefer: wait=10' --data-binary @"$1") || { jq -r '"refused: \(.pointer // "") \(.detail)"' <<<"$job" >&2; exit 1; }
id=$(jq -r .id <<<"$job")
while jq -e '.status == "accepted" or .status == "running"' <<<"$job" >/dev/null; do
    job=$(call "$server/v1/jobs/$id" -H 'Prefer: wait=30')
done
jq -r 'if .status == "failed" then "failed: \(.error.detail)" else .summary |
    "\(.outcome): \(.contact.active) of \(.contact.candidates) points touch",
    (.contact.max_pressure_at // empty | "the largest pressure is at node \(.node), \(.x)"),
    "the exact displacements are within \(.certificate.relative_error) of these (relative, energy norm)",
    (.assertions // [] | .[] | "\(.result): \(.name // .quantity) = \(.value) \(.reason // "")") end' <<<"$job"
jq -e '.summary.outcome == "converged" and .summary.assertions_passed != false' <<<"$job" >/dev/null
