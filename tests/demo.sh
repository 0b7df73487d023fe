#!/usr/bin/env bash
# Starts the daemon on a free port, solves the paper's body with the client, shows the answer, stops the daemon.
# usage: tests/demo.sh BUILD_DIR
set -euo pipefail
build=$1
# shellcheck source=tests/daemon.sh
. "$(dirname "$0")/daemon.sh"

step() { printf '\n\033[1m%s\033[0m\n' "$*"; }
if [ ! -t 1 ] || [ -n "${NO_COLOR:-}" ]; then step() { printf '\n%s\n' "$*"; }; fi

start_daemon
body=tests/data/paper_body_120.json

step "A steel plate, 60 x 20 x 5 mm in 120 x 40 elements, pressed on a rigid plane: $body"
job=$("$build/uzawa" submit "$body")
"$build/uzawa" wait "$job" --progress

step "How the answer converged"
"$build/uzawa" history "$job" --plot

step "The same body again: its factor is in the cache"
again=$("$build/uzawa" submit "$body" --wait --quiet)
"$build/uzawa" status "$again" | grep -E '^(factor|time) '

stop_daemon
[ "$status" -eq 0 ] || echo "the daemon ended with status $status"
step "Go on: \"make run\" starts the service, http://127.0.0.1:8080/ in a browser is its page, docs/tutorial.md goes on from here"
exit "$status"
