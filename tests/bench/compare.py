"""Ratios between two results of `make bench`: times by name, and instruction counts.

usage: compare.py OLD.json NEW.json [THRESHOLD]

A ratio above 1 is slower: of rates (MB/s) it is the old one over the new one. The status is 1 where a time's median has
grown by more than THRESHOLD (1.1) and its fastest run is slower than the old slowest one, so that noise alone does not
fail, or where an instruction count has grown by more than 5 %. Rows that only one of them has are listed.
"""
import json
import pathlib
import sys

MORE_IS_BETTER = {"MB/s"}
COUNTS = ("instructions", "library_calls")
COUNT_LIMIT = 1.05


def by_name(rows):
    return {row["name"]: row for row in rows}


def over(a, b):
    return a / b if b else float("inf") if a else 1.0


def time_row(name, old, new, threshold):
    """(name, old, new, ratio, failed)"""
    if new.get("unit") in MORE_IS_BETTER:
        return name, old["median"], new["median"], over(old["median"], new["median"]), \
            over(old["median"], new["median"]) > threshold and new["max"] < old["min"]
    return name, old["median"], new["median"], over(new["median"], old["median"]), \
        over(new["median"], old["median"]) > threshold and new["min"] > old["max"]


def rows_of(old, new, threshold):
    """Every row that both have, and the names that only one has."""
    rows, lone = [], []
    for key in ("ratios", "instructions"):
        before, after = by_name(old.get(key, [])), by_name(new.get(key, []))
        lone += [f"{name} ({'old' if name in before else 'new'} only)" for name in before.keys() ^ after.keys()]
        for name in (name for name in before if name in after):
            if key == "ratios":
                rows.append(time_row(name, before[name], after[name], threshold))
                continue
            for what in COUNTS:
                ratio = over(after[name][what], before[name][what])
                rows.append((f"{name} {what}", before[name][what], after[name][what], ratio, ratio > COUNT_LIMIT))
    return rows, sorted(lone)


def main():
    if len(sys.argv) not in (3, 4) or not all(sys.argv[1:3]):
        print("usage: make bench-compare OLD=a.json NEW=b.json [THRESHOLD=1.1]", file=sys.stderr)
        return 2
    try:
        old, new = (json.loads(pathlib.Path(path).read_text()) for path in sys.argv[1:3])
        threshold = float(sys.argv[3]) if len(sys.argv) == 4 else 1.1
    except (OSError, ValueError) as why:
        print(f"bench-compare: {why}", file=sys.stderr)
        return 2
    rows, lone = rows_of(old, new, threshold)
    print(f"{'':44} {'old':>12} {'new':>12} {'ratio':>7}")
    for name, before, after, ratio, failed in rows:
        print(f"{name:44} {before:12.6g} {after:12.6g} {ratio:7.3f}{'  SLOWER' if failed else ''}")
    for name in lone:
        print(f"{name:44} not compared")
    failures = sum(row[4] for row in rows)
    print(f"{len(rows)} compared, {failures} slower than {threshold:g} (times, beyond their scatter) or {COUNT_LIMIT:g} (counts)")
    return 1 if failures or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
