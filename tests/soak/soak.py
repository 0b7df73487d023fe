"""The long forms of what tests/api/test_soak.py does shortly: usage: soak.py BUILD_DIR [FILTER].

Prints a table; exit status 1 if a figure that must be 0 is not.
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))

import malformed  # noqa: E402  the path is set above
import no_memory  # noqa: E402
import overhead  # noqa: E402
import scenarios  # noqa: E402
import streams  # noqa: E402
from scenarios import PAPER, ZERO  # noqa: E402


def unit(build, program, times):
    """A C test at `times` its usual length: how many of its tests failed, and what it says of itself."""
    done = subprocess.run([os.path.join(build, "tests", program)], capture_output=True, text=True, check=False,
                          env={**os.environ, "SOAK": str(times)})
    said = [line[2:] for line in done.stdout.splitlines() if line.startswith("# ")]
    return {"errors": done.stdout.count("not ok ") + (done.returncode != 0), "": "; ".join(said[-3:])}


RUNS = [
    ("500 x kill -9, 16 posting clients", lambda b: scenarios.endings(b, 500, signal.SIGKILL)),
    ("200 x SIGTERM under load", lambda b: scenarios.endings(b, 200, signal.SIGTERM)),
    ("1,000 power losses, faults at every write, 1,000 damaged files", lambda b: unit(b, "test_store_faults", 10)),
    ("1,000 slow clients, /healthz", lambda b: scenarios.slow_clients(b, 1000, 20)),
    ("2,000 event streams, 1,000 long polls", streams.crowds),
    ("200,000 malformed requests", lambda b: malformed.malformed(b, 200000)),
    ("every allocation of a job fails", no_memory.failing),
    ("600 x 200 cells: HTTP against the library", overhead.overhead),
    ("cancel", lambda b: scenarios.cancels(b, 200)),
    ("cancel while ordering and factoring", lambda b: scenarios.cancels(b, 50, scenarios.LARGE)),
    ("30 x 10 body, default solver", lambda b: scenarios.throughput(b, 20)),
    ("30 x 10 body, accelerated_restart", lambda b: scenarios.throughput(b, 20, PAPER)),
    ("30 x 10 body, acknowledged only", lambda b: scenarios.throughput(b, 10, None, 64, "wait=0")),
    ("one million jobs in the database", lambda b: scenarios.full_database(b, 1000000)),
    ("100,000 jobs", lambda b: scenarios.leaks(b, 100000)),
]


def main():
    build, wanted = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else ""
    failed, rows = False, []
    print("| what | figures | s |\n|---|---|---|")
    for name, run in RUNS:
        if wanted not in name:
            continue
        begun = time.monotonic()
        figures = run(build)
        wrong = [key for key in ZERO if figures.get(key)]
        failed = failed or bool(wrong)
        text = ", ".join(f"{key} {value}".strip() for key, value in figures.items())
        text = f"{'**WRONG** ' if wrong else ''}{text}"
        rows.append({"name": name, "figures": text, "seconds": round(time.monotonic() - begun)})
        print(f"| {name} | {text} | {rows[-1]['seconds']} |", flush=True)
        (pathlib.Path(build) / "soak.json").write_text(json.dumps({"rows": rows}))
    sys.exit(failed)


if __name__ == "__main__":
    main()
