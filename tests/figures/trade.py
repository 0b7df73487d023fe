"""What a whole error costs: the unknowns and seconds that bodies take to 10, 5, 2 and 1 %, refined where the error is and everywhere, by
estimate and guaranteed, with linear and quadratic elements; and what contact forces within 2 % take. Minutes; BUILD/trade.json.

usage: trade.py BUILD_DIR OUTPUT.json [NAME...]   only bodies whose names contain one of these; of forces "force of the ..."

Refined everywhere, each side of the first mesh is halved until the error is small enough or the next mesh has too many unknowns; what a
target takes is interpolated between two meshes (by logarithms), and beyond the last one its unknowns are extrapolated by its order: `reached` is
false then, and seconds are not known.
"""
import copy
import json
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "api"))
import forces  # noqa: E402  beside this file
import service  # noqa: E402  after its place is known

TARGETS = (0.1, 0.05, 0.02, 0.01)
MOST = {"guaranteed": 40000, "estimated": 150000}  # unknowns of meshes that are finer everywhere
TIME = 120
NONE = "-"


class Mesh:
    """Elements of one kind, tri3 or quad4; groups of edges, and of elements. arcs: [(centre, radius)]; new nodes between two that are that far
    from the centre are so, too; radius None: equally far, whatever that is."""

    def __init__(self, nodes, elements, edges, parts=None, arcs=()):
        self.nodes, self.elements, self.edges, self.parts, self.arcs = nodes, elements, edges, parts or {}, arcs

    def amid(self, arcs):
        """A function that gives the number of the node amid two, one for both elements beside it."""
        nodes, known = [list(x) for x in self.nodes], {}

        def middle(a, b):
            key = min(a, b), max(a, b)
            if key not in known:
                known[key] = len(nodes)
                nodes.append([(x + y) / 2 for x, y in zip(nodes[a], nodes[b])])
                for centre, wanted in arcs:
                    radius = [math.dist(nodes[k], centre) for k in (a, b)]
                    if all(abs(r - (wanted or radius[0])) < 1e-6 * r for r in radius):
                        nodes[-1] = [c + (x - c) * radius[0] / math.dist(nodes[-1], centre) for x, c in zip(nodes[-1], centre)]
            return known[key]
        return nodes, middle

    def halved(self):
        nodes, middle = self.amid(self.arcs)
        elements = []
        for e in self.elements:
            m = [middle(a, b) for a, b in zip(e, e[1:] + e[:1])]
            if len(e) == 3:
                elements += [[e[0], m[0], m[2]], [m[0], e[1], m[1]], [m[2], m[1], e[2]], m]
            else:
                nodes.append([sum(nodes[a][c] for a in e) / 4 for c in range(2)])
                c = len(nodes) - 1
                elements += [[e[0], m[0], c, m[3]], [m[0], e[1], m[1], c], [c, m[1], e[2], m[2]], [m[3], c, m[2], e[3]]]
        edges = {name: [half for a, b in pairs for half in ([a, middle(a, b)], [middle(a, b), b])] for name, pairs in self.edges.items()}
        return Mesh(nodes, elements, edges, {name: [4 * e + k for e in part for k in range(4)] for name, part in self.parts.items()}, self.arcs)

    def json(self, quadratic):
        nodes, middle = self.amid(())  # sides stay straight
        corners = len(self.elements[0])
        kind = {(3, False): "tri3", (4, False): "quad4", (3, True): "tri6", (4, True): "quad8"}[corners, quadratic]
        elements = [e + [middle(a, b) for a, b in zip(e, e[1:] + e[:1])] if quadratic else e for e in self.elements]
        groups = {name: {"edges": pairs} for name, pairs in self.edges.items()}
        groups.update({name: {"elements": part} for name, part in self.parts.items()})
        return {"nodes": nodes, "elements": {kind: elements}, "groups": groups}


def plate(size, cells, outside=lambda x, y: False):
    """A plate in quadrilaterals, without those whose middles are outside."""
    number, nodes, elements = {}, [], []

    def node(i, j):
        if (i, j) not in number:
            number[i, j] = len(nodes)
            nodes.append([size[0] * i / cells[0], size[1] * j / cells[1]])
        return number[i, j]

    for j in range(cells[1]):
        for i in range(cells[0]):
            if not outside(size[0] * (i + 0.5) / cells[0], size[1] * (j + 0.5) / cells[1]):
                elements.append([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)])
    sides = {(a, b) for e in elements for a, b in zip(e, e[1:] + e[:1])}
    border = [(a, b) for a, b in sorted(sides) if (b, a) not in sides]
    places = {"left": (0, 0), "right": (0, size[0]), "bottom": (1, 0), "top": (1, size[1])}
    return Mesh(nodes, elements, {name: [[a, b] for a, b in border if nodes[a][c] == nodes[b][c] == at] for name, (c, at) in places.items()})


def scene(model, young, poisson, **more):
    return {"kind": "scene", "model": model, "thickness": 1, "materials": [{"on": "all", "young": young, "poisson": poisson}], "supports": [],
            "loads": [], **more}


def plane(on, point, normal=(0, 1)):
    return {"on": on, "obstacle": {"plane": {"point": list(point), "normal": list(normal)}}}


def from_gallery(name):
    """A scene of the gallery with its mesh; of bodies in numbers."""
    problem = json.loads((ROOT / "client" / "examples" / "gallery" / f"{name}.json").read_text())["problem"]
    given = problem.pop("mesh")
    kind, = given["elements"]
    edges = {group: what["edges"] for group, what in given["groups"].items() if "edges" in what}
    return problem, Mesh(given["nodes"], given["elements"][kind], edges,
                         {group: what["elements"] for group, what in given["groups"].items() if "elements" in what}, [((0, 0), None)])


def bracket():
    """That of the gallery: a file of Gmsh (4.1, in text) with triangles, of which its groups are read; the rim of the hole is round."""
    problem = json.loads((ROOT / "client" / "examples" / "gallery" / "bracket.json").read_text())["problem"]
    part = {}
    for piece in problem.pop("mesh")["gmsh"].split("$End")[:-1]:
        title, *lines = piece[piece.index("$") + 1:].splitlines()
        part[title] = [line.split() for line in lines if line.strip()]
    names = {(int(dim), int(tag)): name.strip('"') for dim, tag, name in part["PhysicalNames"][1:]}
    points, curves, surfaces = (int(n) for n in part["Entities"][0][:3])
    groups = {}  # (dimension, entity): names
    for dim, lines in ((1, part["Entities"][1 + points:1 + points + curves]), (2, part["Entities"][1 + points + curves:1 + points + curves + surfaces])):
        groups.update({(dim, int(line[0])): [names[dim, int(tag)] for tag in line[8:8 + int(line[7])]] for line in lines})
    nodes, number, at = [], {}, 1
    while at < len(part["Nodes"]):
        count = int(part["Nodes"][at][3])
        for tag, place in zip(part["Nodes"][at + 1:at + 1 + count], part["Nodes"][at + 1 + count:at + 1 + 2 * count]):
            number[tag[0]] = len(nodes)
            nodes.append([float(x) for x in place[:2]])
        at += 1 + 2 * count
    elements, edges, parts, at = [], {}, {}, 1
    while at < len(part["Elements"]):
        dim, entity, _, count = (int(x) for x in part["Elements"][at])
        for line in part["Elements"][at + 1:at + 1 + count]:
            for name in groups.get((dim, entity), []):
                if dim == 1:
                    edges.setdefault(name, []).append([number[x] for x in line[1:]])
                else:
                    parts.setdefault(name, []).append(len(elements))
            if dim == 2:
                elements.append([number[x] for x in line[1:]])
        at += 1 + count
    return problem, Mesh(nodes, elements, edges, parts, [((9, 48), 5)])


def bodies():
    """name: (scene without a mesh, first mesh)"""
    paper = json.loads((ROOT / "tests" / "data" / "paper_body.json").read_text())["problem"]
    paper.pop("mesh")
    corner = scene("plane_strain", 200e3, 0.3, supports=[{"on": "top", "ux": 0, "uy": 0}], loads=[{"on": "left", "traction": [0, -0.5]}],
                   contacts=[plane("bottom", [0, -2e-4])])
    hertz = scene("plane_strain", 1000, 0.3, supports=[{"on": "bottom", "uy": 0}, {"on": "left", "ux": 0}],
                  contacts=[{"on": "top", "obstacle": {"circle": {"center": [0, 69.75], "radius": 30}}}])
    beam = scene("plane_strain", 5, 0.45, supports=[{"on": "left", "ux": 0, "uy": 0}], loads=[{"on": "top", "pressure": 0.01}],
                 contacts=[{"on": "bottom", "obstacle": {"circle": {"center": [30, -20], "radius": 19}}}])  # README.md's
    gear = json.loads((ROOT / "client" / "examples" / "gallery" / "gear.json").read_text())["problem"]
    origin = gear.pop("mesh")["box"]["origin"]
    gear["kinematics"] = "fixed"  # else errors are those of contact that moves as well
    block = plate([60, 20], [30, 10])
    block.nodes = [[x + o for x, o in zip(node, origin)] for node in block.nodes]
    return {"paper's body": (paper, plate([60, 20], [6, 2])),
            "L with a corner": (corner, plate([60, 60], [4, 4], lambda x, y: x > 30 and y > 30)),
            "block under a disc": (hertz, plate([20, 40], [4, 8])),
            "beam on a disc": (beam, plate([40, 10], [16, 4])), "bracket": bracket(), "gear": (gear, block),
            "press fit": from_gallery("press_fit"), "cylinder": from_gallery("cylinder")}


def ask(s, problem, accuracy, mesh):
    """What the service says of it: unknowns, error, seconds; None where it has no such answer."""
    job = s.post({"problem": {**copy.deepcopy(problem), "mesh": mesh}, "solver": {"accuracy": accuracy, "time_limit_s": TIME}}).json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=20").json
    if job["status"] != "successful":
        print("   ", job.get("error"), flush=True)
        return None
    error = job["summary"]["error"]
    if accuracy.get("guaranteed") and error["kind"] != "guaranteed":
        print("   ", error.get("why"), flush=True)
        return None
    return {"d": job["summary"]["problem"]["d"], "dual": error.get("dual_unknowns"), "error": error["total"], "seconds": job["summary"]["timings_s"]["total"],
            "reached": job["summary"]["outcome"] == "converged"}


def everywhere(s, problem, mesh, quadratic, way):
    """[answer] on finer and finer meshes."""
    found = []
    accuracy = {"guaranteed": True} if way == "guaranteed" else {"relative_error": 1e-8}
    while len(mesh.nodes) * (6 if quadratic else 2) < MOST[way]:
        found.append(ask(s, problem, accuracy, mesh.json(quadratic)))
        if not found[-1] or (found[-1]["error"] or 9) <= TARGETS[-1]:
            break
        mesh = mesh.halved()
    return [one for one in found if one and one["error"]]


def at_target(found, target):
    """Between the two meshes about a target, or beyond the last by its order."""
    if len(found) < 2:
        return None
    after = next((k for k, one in enumerate(found) if one["error"] <= target), len(found) - 1)
    a, b = found[max(0, after - 1)], found[max(1, after)]
    if after == 0 and a["error"] <= target:
        return {"d": a["d"], "seconds": a["seconds"], "reached": True}
    part = math.log(a["error"] / target) / math.log(a["error"] / b["error"])
    reached = b["error"] <= target
    return {"d": a["d"] * (b["d"] / a["d"]) ** part, "seconds": a["seconds"] * (b["seconds"] / a["seconds"]) ** part if reached else None, "reached": reached}


def order(found):
    """Of the error in unknowns, from the last two meshes."""
    if len(found) < 2:
        return None
    a, b = found[-2:]
    if a["d"] == b["d"]:
        return None
    return math.log(a["error"] / b["error"]) / math.log(b["d"] / a["d"])


def shown(one):
    return "-" if not one else f"{'' if one['reached'] else '~'}{one['d']:.0f} ({NONE if one['seconds'] is None else '%.2f s' % one['seconds']})"


def main():
    build, out, names = sys.argv[1], sys.argv[2], sys.argv[3:]
    rows, s = [], service.Service(build)
    try:
        s.start()
        for name, (problem, mesh) in bodies().items():
            if names and not any(one in name for one in names):
                continue
            ask(s, problem, {"relative_error": 1e-8}, mesh.json(False))  # starts what later ones find running
            for kind in ("linear", "quadratic"):
                for way in ("estimated", "guaranteed"):
                    uniform = everywhere(s, problem, mesh, kind == "quadratic", way)
                    if not uniform:
                        continue
                    first = {**mesh.json(kind == "quadratic"), "refine": "auto"}
                    adaptive = [ask(s, problem, {"total": t, "guaranteed": way == "guaranteed"}, first) for t in TARGETS]
                    reached = [one for one in adaptive if one and one["reached"]]
                    row = {"name": f"{name}, {kind}, {way}", "body": name, "elements": kind, "way": way, "targets": list(TARGETS),
                           "uniform": [at_target(uniform, t) for t in TARGETS], "adaptive": adaptive,
                           "order_uniform": order(uniform), "order_adaptive": order([reached[0], reached[-1]]) if len(reached) > 1 else None}
                    rows.append(row)
                    told = [f"{100 * t:g} %: {shown(a)} of {shown(u)}" for t, a, u in zip(TARGETS, adaptive, row["uniform"])]
                    print(f"{row['name']:45s} {'; '.join(told)}", flush=True)
        found = forces.measured(s, names)
    finally:
        s.stop()
    pathlib.Path(out).write_text(json.dumps({"rows": rows, "forces": found}))


if __name__ == "__main__":
    main()
