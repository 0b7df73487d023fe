"""What a solid in contact costs without a factor, by shapes, materials, elements and load cases.
usage: solids.py BUILD_DIR OUTPUT.json [CELLS=32] [RUNS=3]

The cube of tests/peers/gamg.py with CELLS cells along a side: as a box of equal hex8, whose K is no matrix, and as hex8
whose inner nodes were moved; seconds of processor of a daemon at its defaults, in one thread, from request to answer,
certified to 1e-6. Ratios are of runs one after the other, medians of RUNS; many cases are run once. What two threads spare is measured by the clock, and says
something on a machine that does nothing else. Iterations of conjugate gradients on boxes are counted by BUILD_DIR/bench, which also measures what two
threads can do here at most."""
import copy
import itertools
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / folder) for folder in ("api", "peers")]
import cubes  # noqa: E402  the paths are set above
import service  # noqa: E402

CASES = 50
JUMP, NEARLY = 1e4, 0.49


def with_ball(asked, nodes, elements):
    """Stiff elements in a ball that no plane of the mesh touches."""
    middle = numpy.array(nodes)[elements].mean(axis=1)
    inside = numpy.linalg.norm(middle - numpy.array([0.47, 0.53, 0.49]) * cubes.SIDE, axis=1) < 0.27 * cubes.SIDE
    problem = asked["problem"]
    for name, part, young in (("ball", inside, JUMP * cubes.YOUNG), ("rest", ~inside, cubes.YOUNG)):
        problem["mesh"]["groups"][name] = {"elements": numpy.flatnonzero(part).tolist()}
        problem["materials"].append({"on": name, "young": young, "poisson": cubes.POISSON})
    del problem["materials"][0]
    return asked


def nearly_incompressible(asked):
    asked["problem"]["materials"][0]["poisson"] = NEARLY
    return asked


def of_element(asked, element, n):
    asked["problem"]["mesh"]["box"].update(element=element, cells=3 * [n])
    return asked


def without_contact(asked):
    del asked["problem"]["contacts"]
    return asked


def with_cases(asked):
    """Pull and pressure grow and shrink, so that the contact does."""
    cases = []
    for k in range(CASES):
        loads = copy.deepcopy(asked["problem"]["loads"])
        loads[0]["traction"][1] *= 1 + 0.5 * math.sin(0.37 * k)
        loads[1]["traction"][0] *= 1 + 0.5 * math.cos(0.11 * k)
        cases.append({"name": str(k), "loads": loads})
    asked["cases"] = cases
    return asked


def ratio(build, runs, one, other, per=lambda first, second: 1.0):
    """Of cold solves of the second over the first, and of those with the body in the cache; the second's summary."""
    cold, cached = [], []
    for _ in range(runs):
        (a, b), first = cubes.by_daemon(build, one)
        (c, d), second = cubes.by_daemon(build, other)
        cold.append(c / a * per(first, second))
        cached.append(d / b * per(first, second))
    return statistics.median(cold), statistics.median(cached), second


def many_cases(build, asked):
    """Seconds of a body that is new with all its cases, and what was answered."""
    s = service.Service(build, "--workers", "1", "--threads", "1")
    try:
        s.start()
        before = s.settle()
        job = cubes.answer(s, asked)
        return s.settle() - before, job["summary"]
    finally:
        s.stop()


def ratios(build, n, runs):
    nodes, elements, faces = cubes.mesh("hex8", n)
    plain = {kind: lambda kind=kind: cubes.request(kind, n, nodes, elements, faces) for kind in ("box", "hex8")}
    per_unknown = lambda first, second: first["problem"]["d"] / second["problem"]["d"]  # noqa: E731
    rows = [("stiff ball, E times 10,000", "hex8", 4, plain["hex8"](), with_ball(plain["hex8"](), nodes, elements), None)]
    for kind in plain:
        rows.append((f"Poisson's ratio {NEARLY}", kind, 4, plain[kind](), nearly_incompressible(plain[kind]()), None))
    rows.append(("`tet10` over `tet4`, per unknown", "tet10", 2, of_element(plain["box"](), "tet4", n), of_element(plain["box"](), "tet10", n // 2), per_unknown))
    for kind in plain:
        rows.append(("with contact over without", kind, 1.5, without_contact(plain[kind]()), plain[kind](), None))
    for what, kind, target, one, other, per in rows:
        cold, cached, summary = ratio(build, runs, one, other, *([per] if per else []))
        yield {"what": what, "mesh": kind, "unknowns": summary["problem"]["d"], "target": target, "unit": "", "cold": cold, "cached": cached, "operator": summary["operator"]}
    for kind, target in (("box", 3), ("hex8", 10)):
        seconds, summary = many_cases(build, with_cases(plain[kind]()))
        yield {"what": f"{CASES} load cases", "mesh": kind, "unknowns": summary["problem"]["d"], "target": target, "unit": "s", "cold": seconds, "cached": None, "operator": summary["operator"]}


def clocks(build, threads, asked):
    """Seconds by the clock of a body that is new and of another load on it, by so many threads."""
    s = service.Service(build, "--workers", "1", "--threads", str(threads))
    seconds = []
    try:
        s.start()
        for factor in (1.0, 1.03):
            s.settle()
            loads = [{**load, "traction": [factor * t for t in load["traction"]]} for load in asked["problem"]["loads"]]
            begin = time.monotonic()
            job = cubes.answer(s, {**asked, "problem": {**asked["problem"], "loads": loads}})
            seconds.append(time.monotonic() - begin)
        return (*seconds, job["summary"])
    finally:
        s.stop()


def speedups(build, n, runs):
    nodes, elements, faces = cubes.mesh("hex8", n)
    for kind, target in (("box", 1.7), ("hex8", 1.4)):
        asked = cubes.request(kind, n, nodes, elements, faces)
        pairs = [(clocks(build, 1, asked), clocks(build, 2, asked)) for _ in range(runs)]
        cold, cached = (statistics.median(one[k] / two[k] for one, two in pairs) for k in (0, 1))
        yield {"what": "one thread over two, by the clock", "mesh": kind, "unknowns": pairs[0][1][2]["problem"]["d"], "target": target, "unit": "", "cold": cold, "cached": cached, "operator": pairs[0][1][2]["operator"]}


def by_bench(build, what):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / f"{what}.json"
        subprocess.run([f"{build}/bench", str(out), what], check=True)
        return json.loads(out.read_text(encoding="utf-8"))


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    given = {"CELLS": 32, "RUNS": 3, **{key: int(value) for key, value in (word.split("=") for word in sys.argv[3:])}}
    found = {"runs": given["RUNS"], **by_bench(sys.argv[1], "cycles"), **by_bench(sys.argv[1], "roof"), "rows": []}
    for row in itertools.chain(ratios(sys.argv[1], given["CELLS"], given["RUNS"]), speedups(sys.argv[1], given["CELLS"], given["RUNS"])):
        print(f"{row['what']:34s} {row['mesh']:6s} {row['unknowns']:8d} {row['cold']:8.2f} {row['cached'] or math.nan:8.2f}  (target {row['target']}) {row['operator']}", flush=True)
        found["rows"].append(row)
    pathlib.Path(sys.argv[2]).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
