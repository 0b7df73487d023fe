"""Generated scenes of large deformation, held against code of its own: bodies of quad4, quad8, tri3 and hex8, bent at random, in plane
strain, as rings and as solids, of every law, some nearly incompressible, pressed on planes, circles and spheres by supports and loads, some of them warm or cold, along
paths too, a third of them with a side on springs or with nodes that are a rigid group. Then others in plane strain that lean on their obstacle:
a force presses their upper side on, which is held along it alone; some of them roll off.

What claims to have converged must be in equilibrium: with elements and laws written once more, in quadruple precision (large/checker.c),
forces vanish on free dofs away from the contact; on it they press, and along the obstacle there are none. No point of a fine grid in any
element is turned inside out, no node stands in the obstacle, supports are where they were put.
Every eighth is asked mirrored as well, and answered by the mirror image. usage: generated_large.py BUILD_DIR OUTPUT.json [SCENES]"""
import json
import math
import pathlib
import random
import subprocess
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import EDGES, plate  # noqa

LAWS = ("neo_hooke", "neo_hooke_isochoric", "st_venant_kirchhoff")
LEFT_OVER, DEEP, OFF, MIRRORED = 1e-6, 1e-8, 1e-9, 1e-8  # of the largest nodal force; of the body's extent


class Scene:
    """A block of one to three by one, bent; its lower side is on an obstacle, its upper one moves or is loaded (leaning)."""

    def __init__(self, number, leaning=False):
        rng = random.Random(f"large {number}")
        self.number, self.law = number, rng.choice(LAWS)
        self.element = rng.choice(("quad4", "quad8", "tri3", "hex8"))
        self.model = "solid" if self.element == "hex8" else rng.choice(("plane_strain", "axisymmetric"))
        self.long = rng.uniform(1, 3)
        ring = 2 if self.model == "axisymmetric" else 0
        bend = [rng.uniform(-0.06, 0.06) for _ in range(3)]
        place = lambda x, y: (ring + self.long * x + bend[0] * y * math.sin(4 * x), y + bend[1] * y * math.sin(3 * x + 1))
        if self.element == "hex8":
            self.nodes, self.cells, self.side = self.bricks(rng, place)
        else:
            nodes, cells, edges = plate("quad4" if self.element == "tri3" else self.element, (rng.randint(2, 6), rng.randint(2, 4)), 0, place)
            self.nodes, self.side = nodes, {name: [[e[0], e[-1]] for e in on] for name, on in edges.items()}
            self.cells = [t for a, b, c, d in cells for t in ([a, b, c], [a, c, d])] if self.element == "tri3" else cells
        self.poisson = rng.uniform(0, 0.42)
        if self.element in ("quad4", "hex8") and number % 5 == 4:  # of mean dilatation, as all are from 0.4 on
            self.poisson = random.Random(f"rubber {number}").uniform(0.4, 0.499)
        self.nodes, self.cells = numpy.array(self.nodes), numpy.array(self.cells)
        self.down, self.aside = rng.uniform(0.05, 0.35), 0 if ring else rng.choice((0, rng.uniform(-0.5, 0.5)))
        self.center, self.radius = (rng.uniform(0.2, 0.8) * self.long, rng.uniform(1, 4)) if not ring and rng.random() < 0.6 else (None, None)
        self.tilt = 0 if ring else rng.uniform(-0.15, 0.15)
        self.steps = [round(rng.uniform(0.2, 1), 2) for _ in range(rng.randint(1, 3))] + [1] if rng.random() < 0.3 else None
        beside = random.Random(f"held {number}")
        below, above = ({n for side in self.side[name] for n in side} for name in ("bottom", "top"))
        right = {n for side in self.side["right"] for n in side} if self.element != "hex8" else set(self.side.pop("right"))
        if self.element == "quad8":
            right |= {self.middle(*side) for side in self.side["right"]}
        self.group = sorted(right - below - above) if not ring and beside.random() < 0.25 else []
        flat = 0 if not self.group else numpy.linalg.matrix_rank(self.nodes[self.group] - self.nodes[self.group[0]], 1e-6)
        self.group = self.group if flat >= self.nodes.shape[1] - 1 else []  # what tells a rotation
        self.springs = [beside.uniform(0.05, 1), beside.uniform(0.05, 1)] if self.element != "hex8" and not ring and not self.group and beside.random() < 0.25 else None
        self.pull = [rng.uniform(-0.06, 0.06) for _ in range(2)] if self.element != "hex8" and not ring and rng.random() < 0.5 else None  # on its right side
        self.warm = rng.uniform(-0.1, 0.15) if rng.random() < 0.4 else 0.0
        self.press = random.Random(f"leaning {number}").uniform(0.02, 0.15) if leaning else 0.0
        if leaning:
            self.springs, self.aside = None, 0.2 * self.aside
            for a, b in self.side["top"] if self.element == "quad8" else ():  # loaded sides are straight
                self.nodes[self.middle(a, b)] = (self.nodes[a] + self.nodes[b]) / 2

    def bricks(self, rng, place):
        nx, ny, nz = rng.randint(1, 4), rng.randint(1, 3), rng.randint(1, 3)
        at = lambda i, j, k: i + (nx + 1) * (j + (ny + 1) * k)
        nodes = [[*place(i / nx, j / ny), k / nz] for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)]
        cells = [[at(i + p, j + q, k + r) for p, q, r in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
                 for k in range(nz) for j in range(ny) for i in range(nx)]
        faces = lambda j: [[at(i, j, k), at(i + 1, j, k), at(i + 1, j, k + 1), at(i, j, k + 1)] for k in range(nz) for i in range(nx)]
        return nodes, cells, {"bottom": faces(0), "top": faces(ny), "right": [at(nx, j, k) for j in range(ny + 1) for k in range(nz + 1)]}

    def obstacle(self):
        dim = self.nodes.shape[1]
        if self.radius:
            place = [self.center, -self.radius] + [0.4] * (dim - 2)
            return {"sphere" if dim == 3 else "circle": {"center": place, "radius": self.radius}}
        return {"plane": {"point": [0] * dim, "normal": [0, 1] + [0] * (dim - 2)}}

    def request(self):
        dim = self.nodes.shape[1]
        keys = ("ux", "uy", "uz")[:dim]
        groups = {name: {"edges" if dim == 2 else "faces": on} for name, on in self.side.items()}
        mesh = {"nodes": [[float(c) for c in node] for node in self.nodes], "elements": {self.element: self.cells.tolist()}, "groups": groups}
        top = {"ux": self.aside, **({"uz": 0} if dim == 3 else {})}
        problem = {"kind": "scene", "model": self.model, "kinematics": "finite", "mesh": mesh, "materials": [{"on": "all", "young": 1, "poisson": self.poisson, "law": self.law, "expansion": 0.5}],
                   "supports": [{"on": "top", **top, **({} if self.press else {"uy": -self.down})}], "contacts": [{"on": "bottom", "obstacle": self.obstacle()}]}
        problem["loads"] = [{"on": side, "traction": force} for side, force in self.tractions()] + ([{"on": "all", "temperature": 2 * self.warm}] if self.warm else [])
        if self.springs:
            problem["supports"].append({"on": "right", "spring": self.springs})
        if self.group:
            groups["plate"] = {"nodes": self.group}
            problem["supports"].append({"on": "plate", "rigid": {"point": [float(c) for c in self.nodes[self.group[0]]]}})
        self.held = {key: value for support in problem["supports"] for key, value in support.items() if key in keys}
        return {"problem": problem, **({"cases": [{"name": "way", "steps": self.steps}]} if self.steps else {})}

    def tractions(self):
        return [("right", self.pull)] * bool(self.pull) + [("top", [0, -self.press])] * bool(self.press)

    def left_over(self, found, part, checker):
        """What large/checker.c has to tell of an answer."""
        u, dim = numpy.array(found["displacements"]), self.nodes.shape[1]
        below, above = ({n for side in self.side[name] for n in side} for name in ("bottom", "top"))
        if self.element == "quad8":
            below, above = ({*on, *(self.middle(*side) for side in self.side[name])} for on, name in ((below, "bottom"), (above, "top")))
        held = [(n, "xyz".index(key[1]), value) for key, value in self.held.items() for n in sorted(above)]
        sides = [(a, b, self.middle(a, b) if self.element == "quad8" else -1, *force) for name, force in self.tractions() for a, b in self.side[name]]
        given = [self.element, self.model, self.law, self.poisson, part, self.warm, dim, len(self.nodes), len(self.cells), self.nodes, self.cells, u,
                 len(held), *held, len(below), sorted(below), len(sides), *sides]
        ground = [(a, b, self.middle(a, b) if self.element == "quad8" else -1) for a, b in self.side["right"]] if self.springs else []
        given += [len(ground), *(self.springs or []), *ground, len(self.group), *self.group]
        given += ["sphere", self.center, -self.radius, *([0.4] * (dim - 2)), self.radius] if self.radius else ["plane"]
        told = subprocess.run([checker], input=" ".join(text for one in given for text in texts(one)), capture_output=True, text=True, check=True).stdout
        return {name: float(value) for name, value in (line.split() for line in told.splitlines())}

    def middle(self, a, b):
        """The node between two corners of a quad8."""
        return next(int(cell[4 + m]) for cell in self.cells for m in range(4) if {int(cell[m]), int(cell[(m + 1) % 4])} == {a, b})

    def wrong(self, found, part, checker):
        """What is wrong with an answer that is said to have converged."""
        left = self.left_over(found, part, checker)
        most, dim = left["most"], self.nodes.shape[1]
        told = found["summary"]["contact"]["force"][:dim]
        force = max(abs(told[c] - left[f"total{c}"]) for c in range(1 if self.model == "axisymmetric" else 0, dim))
        limits = {"inverted": not left["det"] > 0, "support": not left["support"] <= OFF, "left over": not left["left"] <= LEFT_OVER * most,
                  "deep": not left["gap"] >= -DEEP * self.long, "along": not left["along"] <= LEFT_OVER * most,
                  "pulls": not left["press"] >= -LEFT_OVER * most,
                  "bent": not left["shape"] <= OFF * self.long, "not free": not left["free"] <= LEFT_OVER * most, "force": not force <= 10 * LEFT_OVER * most}
        return [f"{name}: {left}" for name, is_so in limits.items() if is_so]


def texts(value):
    """Of a number, or of all in a list: to the last bit."""
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return [text for one in value for text in texts(one)]
    return [float(value).hex() if isinstance(value, float) else str(value)]


CORNERS = {"tri": [0, 2, 1], "quad": [0, 3, 2, 1], "hex": [1, 0, 3, 2, 5, 4, 7, 6], "tet": [0, 2, 1, 3]}
MIDDLES = {"tri6": [(0, 1), (1, 2), (2, 0)], "quad8": [(0, 1), (1, 2), (2, 3), (3, 0)], "hex20": EDGES["hex"], "tet10": EDGES["tet"]}


def order(kind):
    """Of the nodes of a cell that has been mirrored, so that it is not inside out: corners, then what lies between them."""
    corners, edges = CORNERS[kind.rstrip("0123456789")], [set(edge) for edge in MIDDLES.get(kind, [])]
    return corners + [len(corners) + edges.index({corners[a], corners[b]}) for a, b in MIDDLES.get(kind, [])]


def mirrored(request):
    """Along x."""
    image = json.loads(json.dumps(request))
    problem = image["problem"]
    mesh = problem["mesh"]
    mesh["nodes"] = [[-x, *rest] for x, *rest in mesh["nodes"]]
    for kind, cells in mesh["elements"].items():
        for cell in cells:
            cell[:] = [cell[k] for k in order(kind)]
    for group in mesh["groups"].values():
        group.update({kind: [side[::-1] for side in sides] for kind, sides in group.items() if kind != "nodes"})
    for support in problem["supports"]:
        if "ux" in support:
            support["ux"] = -support["ux"]
        if "rigid" in support:
            support["rigid"]["point"][0] *= -1
    for load in problem.get("loads", []):
        if "traction" in load:
            load["traction"][0] *= -1
    for contact in problem["contacts"]:
        for shape in contact.get("obstacle", {}).values():
            if "center" in shape:
                shape["center"][0] *= -1
    return image


def answers(s, request):
    """Of every case; None: it was refused, with why."""
    reply = s.post(request)
    service.check(reply.status == 202, reply)
    end = s.wait_status(reply.json["id"], "successful", "failed", seconds=120)
    if end["status"] == "failed":
        return None, end["error"]["detail"]
    found = s.get(f"/v1/jobs/{reply.json['id']}/result?fields=summary,displacements").json
    return found.get("cases", [found]), ""


def look(s, number, outcomes, checker, leaning=False):
    """What is wrong with a scene's answers; of one that leans on its obstacle it is right to say that the load does not press it on."""
    scene = Scene(number, leaning)
    request, said = scene.request(), []
    cases, why = answers(s, request)
    if cases is None and leaning and why.startswith("the loads "):
        outcomes["refused"] = outcomes.get("refused", 0) + 1
        return []
    if cases is None:
        return [why]
    for case, part in zip(cases, scene.steps or [1]):
        outcome = case["summary"]["outcome"]
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        said += scene.wrong(case, part, checker) if outcome == "converged" else []
    if number % 8 == 0 and scene.model != "axisymmetric":
        images, _ = answers(s, mirrored(request))
        for case, image in zip(cases, images):
            flip = numpy.array(image["displacements"])
            flip[:, 0] *= -1
            apart = numpy.abs(flip - case["displacements"]).max() / numpy.abs(flip).max()
            if case["summary"]["outcome"] != image["summary"]["outcome"] or (apart > MIRRORED and case["summary"]["outcome"] == "converged"):
                said.append(f"mirrored: {image['summary']['outcome']}, apart {apart:.2g}")
    return [f"{scene.element} {scene.model} {scene.law}: {one}" for one in said]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    s, outcomes, false = service.Service(sys.argv[1]), {}, []
    try:
        s.start()
        count = int(sys.argv[3]) if len(sys.argv) > 3 else 500
        leaning = [number for number in range(count, 2 * count) if Scene(number).model == "plane_strain"]
        for number in [*range(count), *leaning]:
            said = look(s, number, outcomes, pathlib.Path(sys.argv[1]) / "large-checker", number >= count)
            if said:
                false.append(number)
                print(number, said, flush=True)
    finally:
        s.stop()
    print(f"{outcomes}, {len(false)} false")
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"outcomes": outcomes, "false": false}), encoding="utf-8")
    sys.exit(1 if false else 0)


if __name__ == "__main__":
    main()
