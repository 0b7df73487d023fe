"""Runs a measuring program that writes BUILD/NAME.json, and adds to that file when, of which commit and beside what it was measured.

usage: measure.py BUILD NAME [--part] COMMAND...

--part: the program measures some of its rows; the others stay as they were, each with its own stamp. A file that has all rows of
one run, or had them before a part was renewed, says "whole". The exit status is the command's: where it fails, the file is what it was and BUILD/NAME.failed.json what the program wrote.
"""
import json
import pathlib
import subprocess
import sys

import stamp

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ROWS = {"bench": ("ratios", "name"), "bench-size": ("sizes", "d"), "trade": ("rows", "name"), "peers-large": ("rows", "scene")}  # programs whose rows are renewed one by one, and what names a row


def merged(name, new, old):
    """The old rows with the new ones in their places; each has the stamp of its own run."""
    key, by = ROWS[name]
    rows = {}
    for one in (old, new):
        rows.update({row[by]: {"stamp": stamp.brief(one.get("stamp", {})), **row} for row in one.get(key, [])})
    return {**old, **new, "whole": old.get("whole", False), key: list(rows.values())}


def main():
    arguments = sys.argv[1:]
    part = arguments[2:3] == ["--part"]
    command = arguments[3 if part else 2:]
    if not command:
        sys.exit(__doc__)
    name = arguments[1]
    target = pathlib.Path(arguments[0]) / f"{name}.json"
    before = target.read_bytes() if target.exists() else None
    watch = stamp.Watch()
    status = subprocess.run(command, check=False).returncode
    if status:
        if target.exists():
            target.replace(target.with_name(f"{name}.failed.json"))
        if before is not None:
            target.write_bytes(before)
        sys.exit(status)
    new = {"stamp": {**stamp.machine(), **watch.stamp(ROOT)}, "whole": not part, **json.loads(target.read_text())}
    stamp.write_whole(target, merged(name, new, json.loads(before)) if part and before and name in ROWS else new)


if __name__ == "__main__":
    main()
