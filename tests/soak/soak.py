"""The long forms of what tests/api/test_soak.py does shortly: usage: soak.py BUILD_DIR [FILTER].

Prints a table; exit status 1 if a figure that must be 0 is not. Each run takes its row's place in BUILD_DIR/soak.json, with when, of
which commit and beside what it was measured, and the other rows stay: what is timed may be measured alone on a quiet machine, the
rest beside other work, several at once.
"""
import fcntl
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests/api"), str(ROOT / "tests/figures")]

import daemons  # noqa: E402  the path is set above
import malformed  # noqa: E402
import no_memory  # noqa: E402
import orders  # noqa: E402
import overhead  # noqa: E402
import scenarios  # noqa: E402
import stamp  # noqa: E402
import streams  # noqa: E402
from scenarios import PAPER, ZERO  # noqa: E402


def unit(build, program, times):
    """A C test at `times` its usual length: how many of its tests failed, and the counts that it says of itself, "# 7 jobs"."""
    done = subprocess.run([os.path.join(build, "tests", program)], capture_output=True, text=True, check=False,
                          env={**os.environ, "SOAK": str(times)})
    said = [part for line in done.stdout.splitlines() if line.startswith("# ") for part in line[2:].split(", ")]
    counts = [re.fullmatch(r"(\d+) ([a-z ]+)", part) for part in said]
    return {"errors": done.stdout.count("not ok ") + (done.returncode != 0),
            **{found[2].replace(" ", "_"): int(found[1]) for found in counts if found}}


RUNS = [
    ("500 x kill -9, 16 posting clients", lambda b: scenarios.endings(b, 500, signal.SIGKILL)),
    ("200 x SIGTERM under load", lambda b: scenarios.endings(b, 200, signal.SIGTERM)),
    ("500 x kill -9 of a worker, 16 posting clients", lambda b: scenarios.killed_workers(b, 500)),
    ("a mixed load of ten minutes: kills of workers, dismissals, reloads", lambda b: scenarios.week(b, 600)),
    ("three daemons and PostgreSQL: 500 faults, 16 posting clients", lambda b: daemons.faults(b, 500)),
    ("two daemons: one dies", daemons.node_dies),
    ("three daemons: upgrade from the version before", daemons.upgrade),
    ("three daemons: 1,500 jobs of 200 bodies", lambda b: daemons.zipf(b, 1500, cells=(16, 16, 10), cache="3000M")),
    ("30 x 10 body, default solver, PostgreSQL", lambda b: daemons.throughput(b, 20, True)),
    ("1,000 power losses, faults at every write, 1,000 damaged files", lambda b: unit(b, "test_store_faults", 10)),
    ("1,000 slow clients, /healthz", lambda b: scenarios.slow_clients(b, 1000, 20)),
    ("2,000 event streams, 1,000 long polls", streams.crowds),
    ("200,000 malformed requests", lambda b: malformed.malformed(b, 200000)),
    ("every allocation of a job fails", no_memory.failing),
    ("200 requests in random orders, cold and cached", lambda b: orders.counted(b, 200, 5)),
    ("600 x 200 cells: HTTP against the library", overhead.overhead),
    ("cancel", lambda b: scenarios.cancels(b, 200)),
    ("cancel while ordering and factoring", lambda b: scenarios.cancels(b, 50, scenarios.LARGE)),
    ("30 x 10 body, default solver", lambda b: scenarios.throughput(b, 20)),
    ("30 x 10 body, accelerated_restart", lambda b: scenarios.throughput(b, 20, PAPER)),
    ("30 x 10 body, acknowledged only", lambda b: scenarios.throughput(b, 10, None, 64, "wait=0")),
    ("one million jobs in the database", lambda b: scenarios.full_database(b, 1000000)),
    ("100,000 jobs", lambda b: scenarios.leaks(b, 100000)),
]


def as_text(figures):
    return ", ".join(f"{key} {value}" for key, value in figures.items())


def keep(path, row):
    """The row in its place among those of earlier runs, and of others that run at the same time."""
    with open(f"{path}.lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        old = json.loads(path.read_text())["rows"] if path.exists() else []
        rows = {one["name"]: one for one in old if isinstance(one["figures"], dict)}
        rows[row["name"]] = row
        order = {name: k for k, (name, _) in enumerate(RUNS)}
        stamp.write_whole(path, {"rows": sorted(rows.values(), key=lambda one: order.get(one["name"], len(order)))})


def main():
    build, wanted = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else ""
    failed, names = False, [name for name, _ in RUNS]
    if not any(wanted in name for name in names):
        sys.exit(f"soak: no name contains {wanted!r}; there are: {', '.join(names)}")
    print("| what | figures | s |\n|---|---|---|")
    for name, run in RUNS:
        if wanted not in name:
            continue
        begun, watch = time.monotonic(), stamp.Watch()
        figures = run(build)
        wrong = [key for key in ZERO if figures.get(key)]
        failed = failed or bool(wrong)
        row = {"name": name, "figures": figures, "wrong": wrong, "seconds": round(time.monotonic() - begun), "stamp": watch.stamp(ROOT)}
        print(f"| {name} | {'**WRONG** ' if wrong else ''}{as_text(figures)} | {row['seconds']} |", flush=True)
        keep(pathlib.Path(build) / "soak.json", row)
    sys.exit(failed)


if __name__ == "__main__":
    main()
