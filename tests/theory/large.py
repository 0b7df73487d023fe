"""Scenes of large deformation whose answers are known, at the daemon's defaults: closed forms (a block that is squeezed, a tube
over a rod), Euler's elastica with its stretch, and what finer meshes converge to: rings between plates, a block over a roller on
meshes up to 32 elements high, an arch. What is off, contact problems and parts of the load, and the time over that of one solve of small
deformation on the same mesh. usage: large.py BUILD_DIR OUTPUT.json [ONLY=part of a name]

A time is that of the processor in the processes that solve, with nothing in the cache, the least of RUNS, small and large
deformation by turns."""
import json
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import arch  # noqa: after its place is known
import service  # noqa
from two_bodies import plate  # noqa

RUNS = 7
FIELDS = "summary,displacements,stress"
ENGLISH = {"neo_hooke": "neo-Hooke", "neo_hooke_isochoric": "neo-Hooke, isochoric", "st_venant_kirchhoff": "St. Venant and Kirchhoff"}


def scene(element, cells, place, supports, law="neo_hooke", young=1, poisson=0.3, **more):
    nodes, quads, edges = plate(element, cells, 0, place)
    groups = {side: {"edges": [[edge[0], edge[-1]] for edge in on]} for side, on in edges.items()}
    return {"problem": {"kind": "scene", "model": "plane_strain", "kinematics": "finite", "supports": supports,
                        "mesh": {"nodes": nodes, "elements": {element: quads}, "groups": groups},
                        "materials": [{"on": "all", "young": young, "poisson": poisson, "law": law}], **more}}


def on_plane(side, point, normal):
    return [{"on": side, "obstacle": {"plane": {"point": point, "normal": normal}}}]


def on_circle(side, center, radius):
    return [{"on": side, "obstacle": {"circle": {"center": center, "radius": radius}}}]


def box(wide, high):
    return lambda x, y: (wide * x, high * y)


def part_of_ring(inner, wide):
    return lambda x, y: ((inner + wide * x) * math.cos(math.pi / 2 * y), (inner + wide * x) * math.sin(math.pi / 2 * y))


def block(element, law, down=0.3):
    return scene(element, (4, 4), box(1, 1), [{"on": "left", "ux": 0}, {"on": "top", "uy": -down}], law,
                 contacts=on_plane("bottom", [0, 0], [0, 1]))


def cantilever(element="quad8"):
    young, thick, long = 1.2e6, 0.2, 10
    shear = 10 * young * thick ** 3 / 12 / long ** 2 / thick
    return scene(element, (50, 2), box(long, thick), [{"on": "left", "ux": 0, "uy": 0}], "st_venant_kirchhoff", young, 0.0,
                 loads=[{"on": "right", "traction": [0, -shear]}])


def ring(up, law="neo_hooke", poisson=0.3, cells=(4, 96)):
    """A quarter, whose lower end goes up by `up`, against a plate that touches its crown."""
    return scene("quad8", cells, part_of_ring(9.5, 1), [{"on": "bottom", "uy": up}, {"on": "top", "ux": 0}], law, 1, poisson,
                 contacts=on_plane("right", [0, 10.5], [0, -1]))


def roller(element, high, aside):
    return scene(element, (4 * high, high), box(4, 1), [{"on": "top", "ux": -aside, "uy": -0.2}], contacts=on_circle("bottom", [1, -2], 2))


def tube(radius, element="quad8"):
    return scene(element, (8, 16), part_of_ring(1, 1), [{"on": "bottom", "uy": 0}, {"on": "top", "ux": 0}],
                 contacts=on_circle("left", [0, 0], radius))


def cube(element, cells):
    """On a ball, squeezed by a fifth."""
    return {"problem": {"kind": "scene", "model": "solid", "kinematics": "finite",
                        "mesh": {"box": {"size": [1, 1, 1], "cells": [cells] * 3, "element": element}},
                        "materials": [{"on": "all", "young": 1, "poisson": 0.3, "law": "neo_hooke"}],
                        "supports": [{"on": "left", "ux": 0}, {"on": "back", "uz": 0}, {"on": "top", "uy": -0.2}],
                        "contacts": [{"on": "bottom", "obstacle": {"sphere": {"center": [0, -1.5, 0], "radius": 1.5}}}]}}


def force(axis, factor=1.0):
    return lambda found, _: factor * found["summary"]["contact"]["force"][axis]


def moved(where, axis, factor=1.0):
    def of(found, request):
        nodes = request["problem"]["mesh"]["nodes"]
        at = min(range(len(nodes)), key=lambda k: math.dist(nodes[k], where))
        return factor * found["displacements"][at][axis]
    return of


def bore(radius):
    """The pressure of a rod that lengthens its quarter of a circle: by the force along an axis."""
    return lambda found, _: found["summary"]["contact"]["force"][0] / radius


def scenes():
    """(name, request, [(what, true, of)], how far off it may be)"""
    for law, true in (("neo_hooke", 0.45842392), ("neo_hooke_isochoric", 0.47813424), ("st_venant_kirchhoff", 0.19615385)):
        yield f"A block, 30 % lower, {ENGLISH[law]}", block("quad8", law), [("force", true, force(1))], 1e-6
    yield "A block, quad4", block("quad4", "neo_hooke"), [("force", 0.45842392, force(1))], 1e-6
    yield "B cantilever", cantilever(), [("w / L", 0.811192, moved([10, 0.1], 1, -0.1)), ("u / L", 0.555479, moved([10, 0.1], 0, -0.1))], 2e-3
    for up, true in ((0.525, 5.9166e-4), (1.05, 1.11042e-3)):
        yield f"D ring, {round(up / 0.105)} % lower", ring(up), [("force", true, force(1, -2))], 2e-3
    yield "D ring, half as high", ring(5.25), [("force", 5.7399e-3, force(1, -2)), ("outer side moves by", 3.23773, moved([10.5, 0], 0))], 2e-3
    yield "D ring, half as high, St. Venant and Kirchhoff", ring(5.25, "st_venant_kirchhoff"), [("force", 5.650e-3, force(1, -2))], 2e-3
    for percent in (20, 24, 27, 30):
        yield f"ring of rubber, nu = 0.499, {percent} % lower", ring(10.5 * percent / 100, "neo_hooke_isochoric", 0.499), [], None
    for element, may in (("quad8", 2e-3), ("quad4", 1e-2)):
        for aside, true in ROLLER.items():
            yield f"F block over a roller, {aside} aside, {element}", roller(element, 8 if element == "quad8" else 16, aside), [("force", true, force(1))], may
    for radius, pressure, outer, hoop in ((1.5, 0.15335612, 2.34524417, 0.48507586), (1.1, 0.04624617, 2.06485078, None)):
        yield (f"J tube over a rod of {radius}", tube(radius),
               [("pressure", pressure, bore(radius)), ("outer radius", outer, lambda found, request: 2 + moved([2, 0], 0)(found, request))] +
               ([("hoop stress at the bore", hoop, lambda found, request: found["stress"][request["problem"]["mesh"]["nodes"].index([1, 0])][1])] if hoop else []), 5e-3)
    for element, cells in (("hex8", 8), ("tet10", 4), ("hex20", 4)):
        yield f"cube on a ball, {element}", cube(element, cells), [("force", 0.0616, force(1))], 2e-2


REFINED = {"quad8": (4, 8, 16), "quad4": (8, 16, 32)}
ROLLER = {0: 0.34405, 1: 0.36159, 2: 0.34405}


def solved(s, request, fields):
    reply = s.post(request)
    service.check(reply.status == 202, reply)
    job = reply.json["id"]
    end = s.wait_status(job, "successful", "failed", seconds=300)
    service.check(end["status"] == "successful", end)
    return s.get(f"/v1/jobs/{job}/result?fields={fields}").json


def told_by(task, name):
    """What the system tells of a thread; nothing of one that has ended since."""
    try:
        return (task / name).read_text(encoding="utf-8").split()
    except FileNotFoundError:
        return []


def spent(process, inside=False):
    """Seconds of processor of the processes below this one."""
    tasks = list(pathlib.Path(f"/proc/{process}/task").iterdir())
    own = sum(int(first) for task in tasks for first in told_by(task, "schedstat")[:1]) / 1e9 if inside else 0.0
    return own + sum(spent(child, True) for task in tasks for child in told_by(task, "children"))


def timed(s, request, fields):
    before = spent(s.process.pid)
    found = solved(s, request, fields)
    return found, spent(s.process.pid) - before


def measured(s, request):
    """The answer, and the least seconds of it and of one solve of small deformation."""
    linear = [{key: value for key, value in material.items() if key != "law"} for material in request["problem"]["materials"]]
    small = {**request, "problem": {**request["problem"], "kinematics": "fixed", "materials": linear}}
    least = [math.inf, math.inf]
    for _ in range(RUNS):
        found, large_s = timed(s, request, FIELDS)
        least = [min(a, b) for a, b in zip(least, (large_s, timed(s, small, "summary")[1]))]
    return found, *least


def row_of(s, name, request, told, may):
    found, large_s, small_s = measured(s, request)
    summary = found["summary"]
    finite = summary["finite"]
    row = {"scene": name, "unknowns": summary["problem"]["d"], "outcome": summary["outcome"], "qps": finite["qps"], "steps": finite["steps"], "most": finite["most"],
           "seconds": large_s, "over_small": large_s / small_s, "told": []}
    service.check(summary["outcome"] == "converged", name, summary["outcome"], summary["message"])
    for what, true, of in told:
        value = of(found, request)
        row["told"].append({"what": what, "value": value, "true": true, "off": value / true - 1})
        service.check(abs(value / true - 1) <= may, name, what, value, true)
    text = "; ".join(f"{one['what']} {one['value']:.7g} ({100 * one['off']:+.2g} %)" for one in row["told"])
    print(f"{name:50s} {row['qps']:3d} QPs {row['steps']:2d} parts {1e3 * large_s:8.1f} ms, {row['over_small']:5.1f} small solves; {text}", flush=True)
    return row


def refined(s, element, high, aside):
    """The block over the roller, by elements through its height."""
    summary = solved(s, roller(element, high, aside), "summary")["summary"]
    force = summary["contact"]["force"][1]
    row = {"element": element, "high": high, "aside": aside, "unknowns": summary["problem"]["d"], "force": force, "off": force / ROLLER[aside] - 1, "qps": summary["finite"]["qps"]}
    print(f"{element} {high:3d} high, {aside} aside: {force:.6f} ({100 * row['off']:+.3f} %), {row['qps']} QPs", flush=True)
    return row


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    only = "".join(option[5:] for option in sys.argv[3:] if option.startswith("ONLY="))
    s = service.Service(sys.argv[1], "--cache", "1")
    try:
        s.start()
        rows = [row_of(s, *one) for one in scenes() if only in one[0]]
        heights = [] if only else [refined(s, element, high, aside) for element, all_heights in REFINED.items() for aside in (0, 1) for high in all_heights]
        if not only:
            job = s.solve(arch.request(32, 2))
            last = s.get(f"/v1/jobs/{job['id']}/result").json["cases"][-1]["summary"]
            print(f"clamped arch: {last['outcome']} beyond {last['finite']['part']:.5f}", flush=True)
            rows.append({"scene": "clamped arch, along a path", "unknowns": last["problem"]["d"], "outcome": last["outcome"], "qps": job["summary"]["finite"]["qps"], "steps": None,
                         "told": [{"what": "limit load", "value": last["finite"]["part"], "true": 0.5730, "off": last["finite"]["part"] / 0.5730 - 1}]})
    finally:
        s.stop()
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"rows": rows, "refined": heights}), encoding="utf-8")


if __name__ == "__main__":
    main()
