#!/usr/bin/env bash
# Starts the daemon on a free port, solves the paper's body with the client, shows the answer, stops the daemon.
# usage: tests/demo.sh BUILD_DIR
set -euo pipefail
build=$1
folder=$(mktemp -d)
daemon=

finish() {
    if [ -n "$daemon" ] && kill -TERM "$daemon" 2>/dev/null; then wait "$daemon" || true; fi
    rm -rf "$folder"
}
trap finish EXIT
trap 'exit 130' INT TERM

step() { printf '\n\033[1m%s\033[0m\n' "$*"; }
if [ ! -t 1 ] || [ -n "${NO_COLOR:-}" ]; then step() { printf '\n%s\n' "$*"; }; fi

"$build/uzawad" --listen 127.0.0.1:0 --db "$folder/contact.db" >"$folder/out" 2>"$folder/log" &
daemon=$!
for _ in $(seq 200); do
    grep -q '^listening on ' "$folder/out" && break
    kill -0 "$daemon" 2>/dev/null || break
    sleep 0.05
done
if ! grep -q '^listening on ' "$folder/out"; then
    echo "the daemon did not start; its log says:" >&2
    cat "$folder/log" >&2
    exit 1
fi
UZAWA_SERVER=$(sed -n 's/^listening on //p' "$folder/out")
export UZAWA_SERVER
body=tests/data/paper_body_120.json

step "A steel plate, 60 x 20 x 5 mm in 120 x 40 elements, pressed on a rigid plane: $body"
job=$("$build/uzawa" submit "$body" --wait --quiet --progress)
"$build/uzawa" status "$job"

step "How the answer converged"
"$build/uzawa" history "$job" --plot

step "The same body again: its factor is in the cache"
again=$("$build/uzawa" submit "$body" --wait --quiet)
"$build/uzawa" status "$again" | grep -E '^(factor|time) '

step "Stopping the daemon"
kill -TERM "$daemon"
status=0
wait "$daemon" || status=$?
daemon=
echo "it ended with status $status"
exit "$status"
