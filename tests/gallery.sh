#!/usr/bin/env bash
# Starts the daemon on a free port, solves the scenes of the gallery with the client, writes summaries and pictures.
# usage: tests/gallery.sh BUILD_DIR FOLDER [--keep]
# FOLDER gets NAME.txt (what the client prints), NAME.json (the finished job) and NAME.svg; --keep copies the pictures into client/examples/gallery.
set -euo pipefail
build=$1 out=$2 keep=${3:-}
# shellcheck source=tests/daemon.sh
. "$(dirname "$0")/daemon.sh"

start_daemon
mkdir -p "$out"

# How each is drawn: a press fit to scale, the cylinder so that its contact shows; wide enough to read, below 150 kB.
scene() { # FILE PICTURE_OPTION...
    local name job
    name=$(basename "$1" .json)
    job=$("$build/uzawa" submit "$1" --wait --quiet)
    "$build/uzawa" status "$job" >"$out/$name.txt"
    "$build/uzawa" status "$job" --json >"$out/$name.json"
    "$build/uzawa" picture "$job" -o "$out/$name.svg" "${@:2}"
    [ "$keep" != --keep ] || cp "$out/$name.svg" "client/examples/gallery/$name.svg"
    printf '%-12s %s\n' "$name" "$(grep '^contact ' "$out/$name.txt")"
}
scene client/examples/gallery/cylinder.json --width 600 --factor 5
scene client/examples/gallery/press_fit.json --width 460 --factor 1
scene client/examples/gallery/gear.json --width 600
scene client/examples/gallery/bracket.json --width 600
scene tests/data/paper_body.json --width 600

stop_daemon
echo "pictures and summaries are in $out"
exit "$status"
