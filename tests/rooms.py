"""The folders of solver, server and client, and who needs whom: prints the order they stand in, fails on a cycle.

An arrow goes from a folder to another whose header it includes or whose function it calls; the second finds what a public
header would hide. usage: tests/rooms.py [--arrows]"""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEFINED = re.compile(r"^(?!static\b|typedef\b)[a-z][\w\s*]*?\b(\w+)\([^;]*$", re.M)
USED = re.compile(r"\b(\w+)\s*\(")
INCLUDED = re.compile(r'^#include "([^"]+)"', re.M)


def without_comments(text):
    return re.sub(r'/\*.*?\*/|"(?:\\.|[^"\\])*"', " ", text, flags=re.S)


def arrows(top):
    """{(from, to): {"file -> file", ...}} of the folders below top."""
    folder = {path: str(path.parent.relative_to(ROOT / top)) for path in sorted((ROOT / top).rglob("*.[ch]"))}
    text = {path: path.read_text(encoding="utf-8") for path in folder}
    home, found = {}, collections.defaultdict(set)
    for path in folder:
        if path.suffix == ".c":
            for name in DEFINED.findall(without_comments(text[path])):
                home[name] = path
    for path, room in folder.items():
        needs = [ROOT / top / name for name in INCLUDED.findall(text[path])]
        if path.suffix == ".c":
            needs += [home[name] for name in set(USED.findall(without_comments(text[path]))) if name in home]
        for other in needs:
            if other in folder and folder[other] != room:
                found[room, folder[other]].add(f"{path.relative_to(ROOT)} -> {other.relative_to(ROOT)}")
    return found, set(folder.values())


def ordered(found, rooms):
    """The rooms, each behind those that it needs; what is left over is in a cycle."""
    left, order = set(rooms), []
    while True:
        free = sorted(room for room in left if not any((room, other) in found for other in left))
        if not free:
            return order, left
        order += free
        left -= set(free)


def main():
    bad = False
    for top in ("solver", "server", "client"):
        found, rooms = arrows(top)
        order, left = ordered(found, rooms)
        print(f"{top}: {' < '.join(order)}")
        if "--arrows" in sys.argv:
            for (room, other), files in sorted(found.items()):
                print(f"    {room} -> {other} ({len(files)})")
        for (room, other), files in sorted(found.items()):
            if room in left and other in left:
                bad = True
                print(f"{top}: in a cycle: {room} -> {other}: {', '.join(sorted(files)[:6])}")
    return bad


if __name__ == "__main__":
    sys.exit(main())
