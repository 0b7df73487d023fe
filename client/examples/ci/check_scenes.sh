#!/usr/bin/env bash
# Solves every scene of a folder with `uzawa`, and leaves a JUnit report of each. A scene's own "assert" says what its
# answer must be. With a git revision, what has drifted since then fails too.
# usage: check_scenes.sh FOLDER REPORTS [REVISION]     exit status 1: one is not as it should be
set -uo pipefail
folder=$1 reports=$2 revision=${3:-}
tolerance=${TOLERANCE:-1e-3}
failed=0
mkdir -p "$reports"

# The id of the same scene's job as it was in the revision; nothing where it was not there.
baseline_of() { # SCENE
    git show "$revision:./$1" 2>/dev/null | uzawa submit - --wait --quiet
}

for scene in "$folder"/*.json; do
    name=$(basename "$scene" .json)
    compare=()
    if [ -n "$revision" ] && git cat-file -e "$revision:./$scene" 2>/dev/null && id=$(baseline_of "$scene"); then
        compare=(--baseline "$id" --tolerance "$tolerance")
    fi
    echo "== $name"
    uzawa submit "$scene" --wait --tag ci --junit "$reports/$name.xml" "${compare[@]}" || failed=1
done
exit $failed
