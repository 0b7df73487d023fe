"""A contact force within 2 %: what the service needs for it from a coarse mesh, and what the best graded mesh does that is found by search.

Three bodies: tests/theory/roller.py's, half a block under a disc, and the press fit of the gallery on a mesh of its own; the block also from a mesh
that is coarser than those by hand. The true force is that of a
mesh many times finer. Meshes made by hand are of quad8 and tri6, graded towards the contact: of a family the one with the fewest unknowns whose force is
within 2 % of the true one, and whose next finer ones' are, too: what somebody would find who knew the answer; and the one with the fewest whose own
interval, by the same estimate, is that narrow: what somebody would find who did not.
"""
import copy
import itertools
import json
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests" / "api"), str(ROOT / "tests" / "theory")]
import roller  # noqa: E402  after its place is known
from two_bodies import body  # noqa: E402

WITHIN = 0.02
RINGS = ((10, 20.05), (20, 35))  # of the gallery's shaft and hub


def graded(t, steep):
    return math.sinh(steep * t) / math.sinh(steep)


def block(element, n, across, down):
    """Half a block under a disc, the contact at its upper left corner."""
    made = body([element], [(n, n)], [lambda x, y: (20 * graded(x, across), 40 - 40 * graded(1 - y, down))],
                {"bottom": [(0, "bottom")], "left": [(0, "left")], "top": [(0, "top")]}, model="plane_strain", thickness=1,
                materials=[{"on": "all", "young": 1000, "poisson": 0.3}], supports=[{"on": "bottom", "uy": 0}, {"on": "left", "ux": 0}],
                contacts=[{"on": "top", "obstacle": {"circle": {"center": [0, 69.75], "radius": 30}}}])
    return made["problem"]


def press_fit(element, around, shaft, hub):
    problem = json.loads((ROOT / "client" / "examples" / "gallery" / "press_fit.json").read_text())["problem"]

    def ring(inner, outer):
        return lambda x, y: [(inner + (outer - inner) * x) * f(0.5 * math.pi * y) for f in (math.cos, math.sin)]
    made = body([element] * 2, [(shaft, around), (hub, around)], [ring(*radii) for radii in RINGS],
                {"seat": [(0, "right")], "bore": [(1, "left")], "low": [(0, "bottom"), (1, "bottom")], "left": [(0, "top"), (1, "top")]})
    mesh, each = made["problem"]["mesh"], around * (1 if element.startswith("quad") else 2)
    mesh["groups"].update(shaft={"elements": list(range(shaft * each))}, hub={"elements": list(range(shaft * each, (shaft + hub) * each))})
    return {**problem, "mesh": mesh}


def rolled(element, n, steep):
    return roller.request(element, n, False, steep)["problem"]


# name: on, maker, first meshes, those by hand, the finest
BODIES = {"roller": ("top", rolled, [("quad8", 16, 1), ("tri6", 16, 1)], list(itertools.product(("quad8", "tri6"), (10, 12, 14, 16, 20), (0.7, 0.8, 0.9))),
                     ("quad8", 64, 1)),
          "block under a disc": ("top", block, [("quad8", 4, 0.1, 0.1), ("tri6", 4, 0.1, 0.1), ("quad8", 2, 0.1, 0.1), ("tri6", 2, 0.1, 0.1)],
                                 list(itertools.product(("quad8", "tri6"), (3, 4, 5, 6), (1.5, 2.5, 3.5), (1.5, 3, 4.5))), ("quad8", 48, 3, 4)),
          "press fit": ("seat", press_fit, [("quad8", 4, 1, 2), ("tri6", 4, 1, 2)],
                        [(e, k, *n) for e, k, n in itertools.product(("quad8", "tri6"), (2, 3, 4, 6), ((1, 1), (1, 2), (2, 2), (2, 3)))],
                        ("quad8", 24, 10, 16))}


def solve(s, problem, on, accuracy=None):
    asked = {"solver": {"accuracy": accuracy, "time_limit_s": 60}} if accuracy else {"quantities": [{"quantity": "contact.force", "on": on}]}
    job = s.post({"problem": problem, **asked}).json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=20").json
    if job["status"] != "successful":
        raise RuntimeError(job["error"])
    return job["summary"]


def by_hand(s, make, on, meshes, true):
    """(unknowns, element, force) of the best of them, the coarsest of those that have only good ones beyond, by element and grading; and the least
    unknowns of those whose intervals are good, None: none is."""
    families, sure = {}, []
    for mesh in meshes:
        summary = solve(s, make(*mesh), on)
        found = summary["quantities"][0]
        families.setdefault((mesh[0], *mesh[2:]), []).append((summary["problem"]["d"], mesh[0], found["on_this_mesh"]))
        if found["low"] is not None and 0.5 * (found["high"] - found["low"]) <= WITHIN * found["value"]:
            sure.append(summary["problem"]["d"])
    best = []
    for family in families.values():
        good = list(itertools.takewhile(lambda one: abs(one[2] / true - 1) <= WITHIN, sorted(family, reverse=True)))
        best += good[-1:]
    return min(best), min(sure, default=None)


def measured(s, names):
    """Rows of the bodies whose names contain one of these; all where there are none."""
    rows = []
    for name, (on, make, first, hand, finest) in BODIES.items():
        if names and not any(one in f"force of the {name}" for one in names):
            continue
        true = solve(s, make(*finest), on)["quantities"][0]["on_this_mesh"]
        (unknowns, element, force), sure = by_hand(s, make, on, hand, true)
        for mesh in first:
            problem = copy.deepcopy(make(*mesh))
            problem["mesh"]["refine"] = "auto"
            summary = solve(s, problem, on, {"quantity": "contact.force", "on": on, "relative": WITHIN})
            found = summary["quantities"][0]
            ladder = summary["mesh"]["ladder"]
            title = f"{name}, {mesh[0]}" + ("" if mesh[0] not in [row["element"] for row in rows if row["body"] == name] else f" from {mesh[1]}")
            rows.append({"name": title, "body": name, "first": ladder[0]["d"], "element": mesh[0], "outcome": summary["outcome"], "d": summary["problem"]["d"],
                         "grids": len(ladder), "low": found["low"], "value": found["value"], "high": found["high"], "true": true,
                         "seconds": summary["timings_s"]["total"], "hand": unknowns, "hand_element": element, "hand_force": force, "sure": sure})
            print(f"{name:20s} {mesh[0]}: {summary['outcome']}, {rows[-1]['d']} unknowns from {rows[-1]['first']}, {found['low']:.6g} .. {found['high']:.6g} of {true:.6g}; "
                  f"by hand {unknowns} {element}, {force:.6g}; told to be within it {sure}", flush=True)
    return rows
