#!/usr/bin/env bash
# Solves every scene of a folder with `uzawa`, and leaves a JUnit report of each. A scene's own "assert" says what its
# answer must be. With a git revision, what has drifted since then fails too.
# usage: check_scenes.sh FOLDER REPORTS [REVISION]     exit status 1: one is not as it should be
set -uo pipefail
folder=$1 reports=$2 revision=${3:-}
tolerance=${TOLERANCE:-1e-3}
failed=0
mkdir -p "$reports"

if [ -n "$revision" ] && ! git -C "$folder" rev-parse --verify --quiet "$revision^{commit}" >/dev/null; then
    echo "$revision is no revision of this checkout: nothing can be compared" >&2
    exit 2
fi

# The id of the same scene's job as it was in the revision, however it ended: --baseline judges what it is worth.
baseline_of() { # SCENE
    git -C "$folder" show "$revision:./$1" | uzawa submit - --wait --quiet
}

for scene in "$folder"/*.json; do
    name=$(basename "$scene" .json)
    compare=()
    if [ -n "$revision" ] && git -C "$folder" cat-file -e "$revision:./$name.json" 2>/dev/null; then
        id=$(baseline_of "$name.json")
        if [ -n "$id" ]; then compare=(--baseline "$id" --tolerance "$tolerance"); else failed=1; fi
    fi
    echo "== $name"
    uzawa submit "$scene" --wait --tag ci --junit "$reports/$name.xml" "${compare[@]}" || failed=1
done
exit $failed
