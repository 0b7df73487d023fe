#!/usr/bin/env bash
# Starts the daemon on a free port, solves the scenes of the gallery with the client, writes summaries and pictures.
# usage: tests/gallery.sh BUILD_DIR FOLDER [--keep]
# FOLDER gets NAME.txt (what the client prints) and NAME.svg; --keep copies the pictures into client/examples/gallery.
set -euo pipefail
build=$1 out=$2 keep=${3:-}
folder=$(mktemp -d)
daemon=

finish() {
    if [ -n "$daemon" ] && kill -TERM "$daemon" 2>/dev/null; then wait "$daemon" || true; fi
    rm -rf "$folder"
}
trap finish EXIT
trap 'exit 130' INT TERM

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
mkdir -p "$out"

# How each is drawn: a press fit to scale, the cylinder so that its contact shows; wide enough to read, below 150 kB.
scene() { # FILE PICTURE_OPTION...
    local name job
    name=$(basename "$1" .json)
    job=$("$build/uzawa" submit "$1" --wait --quiet)
    "$build/uzawa" status "$job" >"$out/$name.txt"
    "$build/uzawa" picture "$job" -o "$out/$name.svg" "${@:2}"
    [ "$keep" != --keep ] || cp "$out/$name.svg" "client/examples/gallery/$name.svg"
    printf '%-12s %s\n' "$name" "$(grep '^contact ' "$out/$name.txt")"
}
scene client/examples/gallery/cylinder.json --width 600 --factor 5
scene client/examples/gallery/press_fit.json --width 460 --factor 1
scene client/examples/gallery/gear.json --width 600
scene client/examples/gallery/bracket.json --width 600
scene tests/data/paper_body.json --width 600

status=0
kill -TERM "$daemon"
wait "$daemon" || status=$?
daemon=
echo "pictures and summaries are in $out"
exit "$status"
