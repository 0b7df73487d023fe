#!/usr/bin/env bash
# Posts a request and follows the job's Server-Sent Events until it has ended: a line for each.
# usage: watch.sh REQUEST.json
set -euo pipefail
server=${UZAWA_SERVER:-http://127.0.0.1:8080}
[ $# -eq 1 ] || { sed -n 's/^# usage/usage/p' "$0" >&2; exit 2; }
call() { curl -sS --fail-with-body "$@" ${UZAWA_TOKEN:+-H "Authorization: Bearer $UZAWA_TOKEN"}; }

id=$(call "$server/v1/jobs" -H 'Content-Type: application/json' --data-binary @"$1" | jq -r .id)
call -N "$server/v1/jobs/$id/events" | while IFS= read -r line; do
    case $line in
    data:*) jq -r 'if .status then "\(.status) \(.summary.outcome // "")"
                   else "\(.progress) %  iteration \(.iteration // "-")  error at most \(.error_bound // "unknown")" end' <<<"${line#data:}" ;;
    esac
done
