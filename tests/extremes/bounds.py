"""Guaranteed bounds on the whole error over true errors: scenes of `make theory`, of the gallery and of the documents, on a coarse mesh of every plane
element.
usage: bounds.py BUILD_DIR OUTPUT.json [NAME...]   only scenes whose names contain one of these

The true error follows from potential energies: of the answer, and of the body itself, which is in the interval that is guaranteed on a mesh refined from
the same coarse one, in quadratic triangles, to a tenth of the error. Where an answer stands in a round obstacle between its nodes, twice force times depth
is added to the interval. A bound below the least that the true error can be is false."""
import json
import math
import pathlib
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests" / part) for part in ("api", "figures")]
import service  # noqa: E402  after its place is known
import trade  # noqa: E402

PART = 0.1  # of the square of the true error, that its interval may be wide to either side
LENGTH, CURVATURE = 30, 1e-3  # of theory.h's blocks


def lines(cells, least, ratio):
    """Coordinates from 0 to LENGTH: cells of one size up to 1.5, then by a ratio."""
    at, size = [0.0], least
    while at[-1] < LENGTH - 1e-9:
        size = size if at[-1] < cells * least - 1e-9 else size * ratio
        at.append(min(LENGTH, at[-1] + size) if at[-1] + 1.5 * size < LENGTH else LENGTH)
    return at


def graded(curvature, per_width=4):
    at = lines(per_width * 3 // 2, 1.0 / per_width, 1.4)
    mesh = trade.plate([len(at) - 1] * 2, [len(at) - 1] * 2)
    for node in mesh.nodes:
        x, y = at[round(node[0])], at[round(node[1])]
        node[:] = [x, y + 0.5 * curvature * x * x * (1 - y / LENGTH)]
    return mesh, at


def theory():
    """name: (scene, mesh), as tests/support/theory.h has them."""
    held = [{"on": "left", "ux": 0}, {"on": "right", "ux": 0}]
    foot = [{**trade.plane("bottom", [0, 0]), "smooth": False}]
    found = {}
    for model, name in (("plane_strain", "Hertz, line"), ("axisymmetric", "Hertz, point")):
        force, area = (math.pi / 8 * CURVATURE, LENGTH) if model == "plane_strain" else (4 / 3 * CURVATURE, math.pi * LENGTH ** 2)
        found[name] = (trade.scene(model, 1, 0, supports=held if model == "plane_strain" else held[1:], loads=[{"on": "top", "pressure": force / area}],
                                   contacts=foot), graded(CURVATURE)[0])
    mesh, at = graded(0)
    mesh.edges["bottom"] = [pair for pair in mesh.edges["bottom"] if max(mesh.nodes[k][0] for k in pair) < 1 + 1e-9]
    found["flat punch"] = (trade.scene("plane_strain", 1, 0.3, supports=held, loads=[{"on": "top", "pressure": 0.5 / LENGTH}], contacts=foot), mesh)
    tube = trade.plate([1, 0.2], [4, 2])
    tube.nodes = [[1 + x, y] for x, y in tube.nodes]
    found["thick tube"] = (trade.scene("axisymmetric", 1000, 0.3, supports=[{"on": "bottom", "uy": 0}, {"on": "top", "uy": 0}],
                                       loads=[{"on": "left", "pressure": 3}]), tube)
    found["bent beam"] = (trade.scene("plane_stress", 1000, 0.3, supports=[{"on": "left", "ux": 0, "uy": 0}], loads=[{"on": "right", "force": [0, -1e-4]}]),
                          trade.plate([10, 1], [20, 2]))
    for problem, _ in found.values():
        if problem["model"] == "axisymmetric":
            problem.pop("thickness")
    return found


def triangles(mesh):
    if len(mesh.elements[0]) == 3:
        return mesh
    parts = {name: [2 * e + k for e in part for k in (0, 1)] for name, part in mesh.parts.items()}
    return trade.Mesh(mesh.nodes, [t for a, b, c, d in mesh.elements for t in ([a, b, c], [a, c, d])], mesh.edges, parts, mesh.arcs)


def solve(s, problem, mesh, accuracy, seconds=30):
    job = s.post({"problem": {**problem, "mesh": mesh, "kinematics": "fixed"}, "solver": {"accuracy": {**accuracy, "guaranteed": True}, "time_limit_s": seconds}}).json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=20").json
    return job["summary"] if job["status"] == "successful" else {"error": {"kind": None, "why": str(job["error"]["detail"])}}


def look(s, name, problem, mesh):
    """A row for each element; what is not proved has `why`."""
    rows, energies = [], None
    kinds = [(mesh, False), (mesh, True)] + ([(triangles(mesh), False), (triangles(mesh), True)] if len(mesh.elements[0]) == 4 else [])
    answers = [(next(iter(of.json(quadratic)["elements"])), solve(s, problem, of.json(quadratic), {})) for of, quadratic in kinds]
    told = [one["error"]["mesh"] or 0.2 for _, one in answers if one["error"]["kind"] == "guaranteed"]  # null: may be all of the answer
    if told:
        target = max(1e-4, 0.1 * min(told))
        fine = solve(s, problem, {**triangles(mesh).json(True), "refine": "auto"}, {"total": target})
        energies = (fine["error"]["energy_low"], fine["error"]["energy_high"]) if fine["error"]["kind"] == "guaranteed" else None
    for element, one in answers:
        if one["error"]["kind"] != "guaranteed" or not energies:
            rows.append({"name": name, "element": element, "why": one["error"].get("why") or "the finer mesh was not proved"})
            continue
        force = math.hypot(*(one["contact"].get("force") or [0]))
        sunk = 2 * force * (one["contact"].get("geometric_penetration") or 0)
        square = [2 * (one["energy"]["potential"] - energy) + by for energy, by in zip(reversed(energies), (-sunk, sunk))]
        bound = one["error"]["bound"]
        sharp = square[1] - square[0] <= 2 * PART * square[1]
        rows.append({"name": name, "element": element, "d": one["problem"]["d"], "bound": bound, "low": math.sqrt(max(0, square[0])), "high": math.sqrt(max(0, square[1])),
                     "true": math.sqrt(0.5 * sum(square)) if sharp else None, "ratio": bound / math.sqrt(0.5 * sum(square)) if sharp else None})
    return rows


def medians(rows):
    return {kind: statistics.median(ratios) for kind, elements in (("linear", ("tri3", "quad4")), ("quadratic", ("tri6", "quad8")))
            if (ratios := [row["ratio"] for row in rows if row["element"] in elements and row.get("ratio")])}


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    rows, names, s = [], sys.argv[3:], service.Service(sys.argv[1])
    try:
        s.start()
        for name, (problem, mesh) in {**theory(), **trade.bodies()}.items():
            if names and not any(one in name for one in names):
                continue
            for row in look(s, name, problem, mesh):
                rows.append(row)
                print(f"{name:20s} {row['element']:6s}", row.get("why") or f"bound {row['bound']:.4g}, true {row['low']:.4g} .. {row['high']:.4g}, ratio {row['ratio']}", flush=True)
    finally:
        s.stop()
    false = [row for row in rows if "bound" in row and row["bound"] < row["low"]]
    print(f"{len(rows)} rows, {len(false)} false, medians {medians(rows)}")
    with open(sys.argv[2], "w", encoding="utf-8") as out:
        json.dump({"rows": rows, "false": len(false)}, out)
    sys.exit(bool(false))


if __name__ == "__main__":
    main()
