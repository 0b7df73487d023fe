"""Large deformation by the daemon, CalculiX and GetFEM: the same meshes of quad8 in plane strain, the same laws.
usage: large.py BUILD_DIR OUTPUT.json [ONLY=part of a name]

A block squeezed on a plane, a cantilever that bends by more than a right angle, a ring between plates, a block over a
roller and moved along it, a tube over a rod; each on two meshes. Compared are the force through the contact (of the
cantilever: how far its end has gone) and seconds of processor, medians of three runs, or of nine where they are short, of
which each is the whole (ours: the mean of jobs one after the other, of five, or of half a second): of the
daemon from request to answer, of CalculiX from deck to answer, of GetFEM from the mesh to the answer without the start
of Python. What differs: CalculiX makes a plane mesh one of bricks one deep, its contact is a penalty, of 100 E for the length
of a side, and its obstacles are elements that do not move, of circles 128 chords; GetFEM's is an augmented Lagrangian with
linear multipliers. CalculiX takes increments as it does by itself; of GetFEM the line search counts that takes the least,
with the load at once, or in parts where Newton's method fails. Either has 30 seconds at most. An answer that is off by more
than a fiftieth is none."""
import json
import math
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "api"))
import service  # noqa: E402  the path is set above
from two_bodies import plate  # noqa: E402

RUNS, SHORT_RUNS, SHORT, LIMIT, AGREED = 3, 9, 0.5, 30, 0.02
SEARCHES = ("default", "simplest", "basic")
DISC, CHORDS = 1 / 2, 128  # an obstacle's elements: how deep, of its radius; how many half around
SIDES = {(0, 1): 1, (1, 2): 2, (2, 3): 3, (3, 0): 4}


class Scene:
    """supports: [(side, {axis: value})]; obstacle: {"side", "plane": (point, normal) or "circle": (center, radius, overlap)}"""

    def __init__(self, name, cells, place, law, supports, obstacle=None, young=1.0, poisson=0.3, traction=None, probe=None):
        self.name, self.law, self.supports, self.obstacle = name, law, supports, obstacle
        self.young, self.poisson, self.traction, self.probe = young, poisson, traction, probe
        self.nodes, self.cells, self.edges = plate("quad8", cells, 0, place)
        amid = {frozenset(e[k:k + 2] if k < 3 else (e[3], e[0])): e[4 + k] for e in self.cells for k in range(4)}
        self.on = {side: sorted({k for a, b in edges for k in (a, b, amid.get(frozenset((a, b)), a))}) for side, edges in
                   ((side, [(e[0], e[-1]) for e in edges]) for side, edges in self.edges.items())}

    def places(self, side):
        return [self.nodes[k] for k in self.on[side]]


def scenes(fine):
    n = 2 if fine else 1
    law = "neo_hooke_isochoric"  # the one of ours that CalculiX has, too

    def ring(inner, wide):
        return lambda x, y: ((inner + wide * x) * math.cos(math.pi / 2 * y), (inner + wide * x) * math.sin(math.pi / 2 * y))

    def box(wide, high):
        return lambda x, y: (wide * x, high * y)

    def name(text):
        return text + (" fine" if fine else "")
    yield Scene(name("A block"), (8 * n, 8 * n), box(1, 1), law, [("left", {0: 0.0}), ("top", {1: -0.3})],
                {"side": "bottom", "plane": ([0, 0], [0, 1])}, probe=[1, 1])
    thick, young = 0.2, 1.2e6
    shear = 10 * young * thick ** 3 / 12 / 10 ** 2 / thick
    yield Scene(name("B cantilever"), (50 * n, 2 * n), box(10, thick), "st_venant_kirchhoff", [("left", {0: 0.0, 1: 0.0})], None, young, 0.0,
                ("right", [0, -shear]), [10, thick / 2])
    yield Scene(name("D ring"), (2 * n, 48 * n), ring(9.5, 1), law, [("bottom", {1: 5.25}), ("top", {0: 0.0})],
                {"side": "right", "plane": ([0, 10.5], [0, -1])}, probe=[10.5, 0])
    for aside in (0, 1, 2):
        yield Scene(name(f"F roller, {aside} aside"), (32 * n, 8 * n), box(4, 1), law, [("top", {0: -float(aside), 1: -0.2})],
                    {"side": "bottom", "circle": ([1, -2], 2.0, 0.0)}, probe=[0, 0])
    yield Scene(name("J tube"), (4 * n, 8 * n), ring(1, 1), law, [("bottom", {1: 0.0}), ("top", {0: 0.0})],
                {"side": "left", "circle": ([0, 0], 1.5, 0.5)}, probe=[2, 0])


def limited():
    """Of a process that begins: LIMIT seconds of processor."""
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT))


def measured(scene, force, probe):
    """What is compared."""
    return math.hypot(*force) if scene.obstacle else math.hypot(*probe)


# ---- the daemon

def request(scene):
    keys = ("ux", "uy")
    obstacle, problem = scene.obstacle, {"kind": "scene", "model": "plane_strain", "kinematics": "finite"}
    problem["mesh"] = {"nodes": scene.nodes, "elements": {"quad8": scene.cells},
                       "groups": {side: {"edges": [[e[0], e[-1]] for e in edges]} for side, edges in scene.edges.items()}}
    problem["materials"] = [{"on": "all", "young": scene.young, "poisson": scene.poisson, "law": scene.law}]
    problem["supports"] = [{"on": side, **{keys[c]: value for c, value in held.items()}} for side, held in scene.supports]
    if scene.traction:
        problem["loads"] = [{"on": scene.traction[0], "traction": scene.traction[1]}]
    if obstacle:
        shape = ({"plane": dict(zip(("point", "normal"), obstacle["plane"]))} if "plane" in obstacle
                 else {"circle": dict(zip(("center", "radius"), obstacle["circle"]))})
        problem["contacts"] = [{"on": obstacle["side"], "obstacle": shape}]
    return {"problem": problem}


def by_daemon(s, scene):
    """(what is compared, seconds, contact problems)"""
    body, took = request(scene), []
    for _ in range(RUNS):
        before, jobs = s.settle(), []
        while len(jobs) < 5 or s.spent() - before < SHORT:
            jobs.append(s.solve(body))
        took.append((s.spent() - before) / len(jobs))
    summary = jobs[0]["summary"]
    if summary["outcome"] != "converged":
        return None, statistics.median(took), summary["finite"]["qps"]
    found = s.get(f"/v1/jobs/{jobs[0]['id']}/result?fields=displacements").json
    at = min(range(len(scene.nodes)), key=lambda k: math.dist(scene.nodes[k], scene.probe))
    return measured(scene, summary["contact"]["force"], found["displacements"][at]), statistics.median(took), summary["finite"]["qps"]


# ---- CalculiX

def wall(scene):
    """Nodes of an obstacle's face, such that matter is to their right, and of its back."""
    obstacle = scene.obstacle
    if "plane" in obstacle:
        (x, y), (a, b) = obstacle["plane"]
        wide = 4 * max(math.hypot(*place) for place in scene.nodes)
        ends = [(x + b * wide, y - a * wide), (x - b * wide, y + a * wide)]
        return ends, [(p - a * wide, q - b * wide) for p, q in ends]
    (x, y), radius, _ = obstacle["circle"]
    way = [math.pi * (1.5 * k / CHORDS - 0.25) for k in range(CHORDS + 1)]
    return tuple([(x + r * math.cos(t), y + r * math.sin(t)) for t in way] for r in (radius, DISC * radius))


def deck(scene):
    lines = ["*NODE, NSET=ALL"] + [f"{k + 1}, {x:.15g}, {y:.15g}" for k, (x, y) in enumerate(scene.nodes)]
    lines += ["*ELEMENT, TYPE=CPE8, ELSET=BODY"] + [", ".join(str(i + 1) for i in [k, *e]) for k, e in enumerate(scene.cells)]
    shear, bulk = scene.young / 2 / (1 + scene.poisson), scene.young / 3 / (1 - 2 * scene.poisson)
    lines += ["*MATERIAL, NAME=M"] + (["*HYPERELASTIC, NEO HOOKE", f"{shear / 2:.15g}, {2 / bulk:.15g}"] if scene.law == "neo_hooke_isochoric"
                                      else ["*ELASTIC", f"{scene.young:.15g}, {scene.poisson}"])
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=M", "1."]
    if scene.obstacle:
        face, back = wall(scene)
        first, n = len(scene.nodes) + 1, len(face)
        lines += ["*NODE, NSET=RIGID"] + [f"{first + k}, {x:.15g}, {y:.15g}" for k, (x, y) in enumerate(face + back)]
        lines += ["*ELEMENT, TYPE=CPE4, ELSET=WALL"]
        lines += [f"{len(scene.cells) + k + 1}, {first + k}, {first + k + 1}, {first + n + k + 1}, {first + n + k}" for k in range(n - 1)]
        lines += ["*MATERIAL, NAME=W", "*ELASTIC", f"{scene.young:.15g}, 0.", "*SOLID SECTION, ELSET=WALL, MATERIAL=W", "1."]
        lines += ["*SURFACE, NAME=MASTER, TYPE=ELEMENT"] + [f"{len(scene.cells) + k + 1}, S1" for k in range(n - 1)]
        owner = {frozenset((e[a], e[b])): (k + 1, side) for k, e in enumerate(scene.cells) for (a, b), side in SIDES.items()}
        lines += ["*SURFACE, NAME=SLAVE, TYPE=ELEMENT"]
        lines += ["{}, S{}".format(*owner[frozenset((e[0], e[-1]))]) for e in scene.edges[scene.obstacle["side"]]]
        side = min(math.dist(scene.nodes[e[a]], scene.nodes[e[b]]) for e in scene.cells for a, b in SIDES)
        lines += ["*SURFACE INTERACTION, NAME=I", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
                  f"{100 * scene.young / side:.6g}, {1e-8 * scene.young:.6g}", "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE", "SLAVE, MASTER"]
    lines += ["*STEP, NLGEOM, INC=1000", "*STATIC", "1., 1.", "*BOUNDARY"]
    lines += [f"{k + 1}, {c + 1}, {c + 1}, {value:.15g}" for side, held in scene.supports for c, value in held.items() for k in scene.on[side]]
    lines += ["RIGID, 1, 2, 0."] if scene.obstacle else []
    if scene.traction:
        lines += ["*CLOAD"] + [f"{k + 1}, {c + 1}, {f:.15g}" for k, force in spread(scene).items() for c, f in enumerate(force) if f]
    lines += ["*NODE PRINT, NSET=RIGID, TOTALS=ONLY, FREQUENCY=100000", "RF"] if scene.obstacle else []
    return "\n".join(lines + ["*NODE PRINT, NSET=ALL, FREQUENCY=100000", "U", "*END STEP"]) + "\n"


def spread(scene):
    """The traction as forces at nodes: Simpson's rule on each edge, which is that of quadratic sides."""
    side, on = scene.traction
    force = {}
    for a, b in ((e[0], e[-1]) for e in scene.edges[side]):
        x, y = scene.nodes[a], scene.nodes[b]
        middle = min(scene.on[side], key=lambda k: math.dist(scene.nodes[k], [(p + q) / 2 for p, q in zip(x, y)]))
        for k, share in ((a, 1 / 6), (middle, 2 / 3), (b, 1 / 6)):
            force[k] = [f + share * math.dist(x, y) * t for f, t in zip(force.get(k, (0, 0)), on)]
    return force


def by_calculix(scene):
    """(what is compared, seconds, iterations); None where there is no answer."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "job.inp").write_text(deck(scene), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        code = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, check=False, preexec_fn=limited,
                              env={"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"}).returncode
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        printed = (path / "job.dat").read_text(encoding="utf-8") if (path / "job.dat").exists() else ""
        told = (path / "job.sta").read_text(encoding="utf-8") if (path / "job.sta").exists() else ""
    tried = sum(int(line.split()[3]) for line in told.splitlines() if line.split()[:1] and line.split()[0].isdigit())
    if code != 0 or "displacements (" not in printed:
        return None, seconds, tried
    force = [float(x) for x in printed.split("total force", 1)[1].splitlines()[2].split()[:2]] if scene.obstacle else None
    at = min(range(len(scene.nodes)), key=lambda k: math.dist(scene.nodes[k], scene.probe)) + 1
    rows = [line.split() for line in printed.rsplit("displacements (", 1)[1].splitlines()]
    probe = next([float(x) for x in row[1:3]] for row in rows if len(row) == 4 and row[0] == str(at))
    return measured(scene, force, probe), seconds, tried


# ---- GetFEM

def by_getfem(scene, search):
    asked = {"nodes": scene.nodes, "cells": scene.cells, "law": scene.law, "young": scene.young, "poisson": scene.poisson,
             "supports": [{"places": scene.places(side), "u": list(held.items())} for side, held in scene.supports],
             "probe": scene.probe, "search": search}
    if scene.traction:
        asked["traction"] = {"places": scene.places(scene.traction[0]), "on": scene.traction[1]}
    if scene.obstacle:
        shape = (dict(zip(("point", "normal"), scene.obstacle["plane"])) if "plane" in scene.obstacle
                 else dict(zip(("center", "radius", "overlap"), scene.obstacle["circle"])))
        asked["obstacle"] = {"places": scene.places(scene.obstacle["side"]), **shape}
    done = subprocess.run(["/usr/bin/python3", "-B", HERE / "getfem_large.py"], input=json.dumps(asked), capture_output=True, text=True,
                          check=False, preexec_fn=limited,
                          env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"})
    if done.returncode < 0:  # LIMIT has ended it
        return None, LIMIT, 0
    if done.returncode > 0:
        sys.exit(done.stderr)
    found = json.loads(done.stdout.strip().splitlines()[-1])
    return (measured(scene, found["force"], found["probe"]) if found["load"] == 1 else None), found["seconds"], found["steps"]


# ---- the comparison

def repeated(once):
    """The median of RUNS, of more where these are short; one run where it takes long, or has no answer."""
    first = once()
    if first[0] is None or first[1] > 5:
        return first
    more = SHORT_RUNS if first[1] < SHORT else RUNS
    return first[0], statistics.median([first[1]] + [once()[1] for _ in range(more - 1)]), first[2]


def agrees(value, ours):
    return value is not None and ours is not None and abs(value / ours - 1) <= AGREED


def row_of(s, scene):
    ours, ours_s, qps = by_daemon(s, scene)
    found = {"calculix": repeated(lambda: by_calculix(scene))}
    tried = {search: by_getfem(scene, search) for search in SEARCHES}
    best = min(SEARCHES, key=lambda search: (not agrees(tried[search][0], ours), tried[search][1]))
    found["getfem"] = repeated(lambda: by_getfem(scene, best)) if tried[best][0] is not None else tried[best]
    times = [seconds for value, seconds, _ in found.values() if agrees(value, ours)]
    row = {"scene": scene.name, "unknowns": 2 * len(scene.nodes), "ours": ours, "ours_s": ours_s, "qps": qps, "search": best,
           "ratio": min(times) / max(ours_s, 1e-3) if times else None}
    text = f"{scene.name:22s} {row['unknowns']:8d} {ours if ours is not None else math.nan:10.5g} {ours_s:8.3f} {qps:4d}"
    for name, (value, seconds, steps) in found.items():
        row.update({name: value, f"{name}_s": seconds, f"{name}_steps": steps})
        text += f" {'-' if value is None else format(value, '.5g'):>10s}{' ' if agrees(value, ours) else '!'} {seconds:8.2f} {steps:5d}"
    print(f"{text} {'-' if not times else format(row['ratio'], '.1f'):>7s}", flush=True)
    return row


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    only = "".join(option[5:] for option in sys.argv[3:] if option.startswith("ONLY="))
    print(f"{'scene':22s} {'unknowns':>8s} {'ours':>10s} {'s':>8s} {'QPs':>4s} {'CalculiX':>10s}  {'s':>8s} {'steps':>5s} {'GetFEM':>10s}  {'s':>8s} {'steps':>5s} {'ratio':>7s}")
    s = service.Service(sys.argv[1])
    try:
        s.start()
        rows = [row_of(s, scene) for fine in (False, True) for scene in scenes(fine) if only in scene.name]
    finally:
        s.stop()
    print("! is no answer, or off by more than a fiftieth; ratio: the fewest seconds of the others that have one, over ours")
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"rows": rows}), encoding="utf-8")


if __name__ == "__main__":
    main()
