"""Generated bodies on rigid obstacles, each posted to a daemon at its defaults, and again mirrored, turned, in other units and refined.
usage: generated_obstacles.py BUILD_DIR OUTPUT.json [SCENES [FIRST [KINEMATICS [FAMILY]]]]

What must hold of each: its mirror image has the mirrored answer; turning and units change rounding only; nothing pulls or stands in
the obstacle; and the force is that of the mesh refined twice, or a warning says that it is not to be trusted. Obstacles have ridges,
grooves and corners, half of them exactly where nodes are. Families: ground, what lies below the body; enclosing, holes, bowls and
polygons; revolved, bodies of revolution on such obstacles."""
import math
import random
import sys

import generated_contacts as contacts
from generated_contacts import distorted, in_units, kind_of, off_by, rotation, turned
from two_bodies import EDGES, body

# By how much a force may differ from that of the mesh refined twice without a warning, and how many of the scenes may.
TOLERANCE = 0.35


# ---- obstacles: dictionaries of a request, and their images

def mirror_obstacle(obstacle, flip):
    """The image of an obstacle. A line that goes on with the obstacle on its right does so backwards."""
    kind, of = next(iter(obstacle.items()))
    if kind == "polyline":
        return {kind: {"points": [flip(p) for p in reversed(of["points"])]}}
    if kind == "height":
        z = [row[::-1] for row in of["z"]] if "y" in of else of["z"][::-1]
        return {kind: {**of, "x": [-x for x in reversed(of["x"])], "z": z}}
    return {kind: {k: flip(v) if isinstance(v, list) else v for k, v in of.items()}}


def turn_obstacle(obstacle, R):
    """None: a table stays upright."""
    kind, of = next(iter(obstacle.items()))

    def turn(x):
        return [sum(r * t for r, t in zip(row, x)) for row in R]
    if kind == "height":
        return None
    return {kind: {k: [turn(p) for p in v] if k == "points" else turn(v) if isinstance(v, list) else v for k, v in of.items()}}


def scale_obstacle(obstacle, length):
    kind, of = next(iter(obstacle.items()))

    def scale(v):
        return [scale(t) for t in v] if isinstance(v, list) else v if isinstance(v, bool) else length * v
    return {kind: {k: v if k in ("normal", "axis") else scale(v) for k, v in of.items()}}


def with_obstacle(request, make):
    scene = dict(request["problem"])
    scene["contacts"] = [{**c, "obstacle": make(c["obstacle"])} for c in scene["contacts"]]
    return {"problem": scene}


def mirrored(request, axis=0):
    """Nodes at -x, or -y; elements and sides go around the other way."""
    def flip(x):
        return [-t if c == axis else t for c, t in enumerate(x)]

    def order(kind):
        shape = kind.rstrip("0123456789")
        if shape in ("tri", "quad"):
            n = 3 if shape == "tri" else 4
            corners = [0, *range(n - 1, 0, -1)]
            return corners + ([n + (n - 1 - k) for k in range(n)] if kind in ("tri6", "quad8") else [])
        corners = {"hex": [4, 5, 6, 7, 0, 1, 2, 3], "tet": [0, 2, 1, 3], "wedge": [3, 4, 5, 0, 1, 2]}[shape]
        edges = [frozenset(e) for e in EDGES[shape]]
        middles = [len(corners) + edges.index(frozenset(corners[a] for a in e)) for e in EDGES[shape]]
        return corners + (middles if kind in ("hex20", "tet10", "wedge15") else [])
    scene = dict(request["problem"])
    mesh = scene["mesh"]
    scene["mesh"] = {**mesh, "nodes": [flip(x) for x in mesh["nodes"]],
                     "elements": {kind: [[e[k] for k in order(kind)] for e in list_] for kind, list_ in mesh["elements"].items()},
                     "groups": {name: {k: [side[::-1] if k == "edges" else [side[0], *side[:0:-1]] for side in sides]
                                       for k, sides in g.items()} for name, g in mesh["groups"].items()}}
    scene["supports"] = [{k: -v if k == ("ux", "uy")[axis] else v for k, v in s.items()} for s in scene["supports"]]
    return with_obstacle({"problem": scene}, lambda o: mirror_obstacle(o, flip))


def profile(rng, width, size, places):
    """A piecewise straight ground below a body of this width: x and y, touching it to a depth of `size`."""
    kind = rng.choice(["ridge", "ridge", "teeth", "groove", "step", "random", "sampled"])
    at = rng.choice(places) if rng.random() < 0.5 else rng.uniform(-0.4, 0.4) * width
    far = 3 * width
    if kind == "ridge":
        slopes = [rng.choice((0.05, 0.2, 0.6, 1.5)) * rng.uniform(0.7, 1.4)] * 2
        if rng.random() < 0.4:
            slopes[1] = rng.uniform(0.05, 1.5)
        return kind, [at - far, at, at + far], [size - far * slopes[0], size, size - far * slopes[1]]
    if kind == "teeth":
        wide = rng.uniform(0.03, 0.4) * width
        low = -rng.uniform(0, 2) * size
        return kind, [-far, at - wide, at, at + wide, far], [low, low, size, low, low]
    if kind == "groove":
        slope = rng.choice((0.01, 0.05, 0.3))
        return kind, [at - far, at, at + far], [size - 0.3 * width * slope + far * slope, size - 0.3 * width * slope,
                                                size - 0.3 * width * slope + far * slope]
    if kind == "step":
        wide, low = rng.choice((0.01, 0.1)) * width, -rng.uniform(0.5, 10) * size
        return kind, [-far, at, at + wide, far], [size, size, low, low]
    n = rng.randint(4, 9)
    xs = sorted(rng.uniform(-0.7, 0.7) * width for _ in range(n))
    if kind == "random":
        return kind, [-far, *xs, far], [-size, *(rng.uniform(-3, 1) * size for _ in xs), -size]
    bend, n = rng.uniform(0.3, 3) / width, 200
    xs = [width * (-1 + 2 * k / n) for k in range(n + 1)]
    return kind, xs, [size - 0.5 * bend * (x - at) ** 2 for x in xs]


FAMILIES = {"ground": "obstacles", "enclosing": "enclosing", "revolved": "revolved"}  # and what their random numbers begin with


class Scene:
    def __init__(self, number, kinematics="auto", family="ground"):
        rng = random.Random(f"{FAMILIES[family]} {number}")
        self.dim = dim = 3 if number % 3 == 2 and family != "revolved" else 2
        self.kind, self.symmetric = kind_of(rng, dim), False
        width, high, deep = rng.uniform(4, 12), rng.uniform(2, 6), rng.uniform(3, 8)
        self.cells = [2 * rng.randint(2, 8), rng.randint(2, 4)] if dim == 2 else [2 * rng.randint(1, 3), rng.randint(2, 5), rng.randint(1, 2)]
        even = rng.random() < 0.5
        within = (lambda *t: list(t)) if even else distorted(rng, dim, False)
        under = rng.choice(["flat", "flat", "arc", "wedge", "corner"])
        under = under if even or under != "wedge" else "flat"  # whose tip is a node
        turning = family == "revolved"
        self.axis = 1 if turning else 0  # that is mirrored
        inside = rng.choice((0, 0, rng.uniform(0.3, 3) * width)) if turning else -0.5 * width  # where the body begins
        middle = 0 if inside == 0 else 0.5  # of what is below it, in its widths
        shift = inside + middle * width
        slope, bend = rng.choice((0.05, 0.2, 0.5)), rng.uniform(0.05, 1.2) / width
        bottom = {"flat": lambda x: 0.0, "arc": lambda x: 0.5 * bend * x * x, "wedge": lambda x: slope * abs(x), "corner": lambda x: 0.0}[under]

        def place(*t):
            t = within(*t)
            x, y, z = width * (t[0] - middle), [deep * (s - 0.5) for s in t[1:-1]], t[-1]
            return (x + shift, *y, bottom(x) + z * (high + 0.3 * width - bottom(x)))
        self.place = place
        names = [("bottom", "top", "left", "right"), ("z0", "z1", "x0", "x1")][dim == 3]
        self.groups = {"on": [(0, names[0])] + ([(0, names[3])] if under == "corner" else []), "head": [(0, names[1])]}
        size = width * 10 ** rng.uniform(-3, -1.7)
        places = [width * (k / self.cells[0] - 0.5) for k in range(1, self.cells[0])]
        make = {"ground": self.obstacle, "enclosing": self.enclosing, "revolved": self.revolved}[family]
        obstacle, shape = make(rng, width, deep, size, places, *[inside, high] * (family != "ground"))
        vertical = "uy" if dim == 2 else "uz"
        aside = rng.choice((0, 0, rng.uniform(-3, 3) * size)) if inside != 0 else 0
        motion = {"ux": aside, vertical: 0, **({"uy": 0} if dim == 3 else {})}
        self.family = f"{dim}D {self.kind:7s} {under:6s} {shape}"
        self.scene = {"kinematics": kinematics, "model": "solid" if dim == 3 else "axisymmetric" if turning else rng.choice(["plane_strain", "plane_stress"]),
                      "materials": [{"on": "all", "young": 1000, "poisson": rng.uniform(0, 0.4)}],
                      "supports": [{"on": "head", **motion}], "loads": [], "contacts": [{"on": "on", "obstacle": obstacle}]}
        if inside == 0:
            self.groups["axis"] = [(0, names[2])]
            self.scene["supports"].append({"on": "axis", "ux": 0})

    def enclosing(self, rng, width, deep, size, places, inside, high):
        """The inside of a round hole, a polygon, or a hole with straight sides, around the body or below it."""
        kind = rng.choice(["circle", "polygon", "hole"] if self.dim == 2 else ["sphere", "cylinder"])
        at = rng.choice((0, rng.uniform(-0.1, 0.1) * width))
        radius = width * rng.uniform(1.0, 4)
        middle = 0.5 * width + inside
        if kind == "circle":
            return {"circle": {"center": [middle + at, size + radius], "radius": radius, "inside": True}}, "in circle"
        if kind == "sphere":
            return {"sphere": {"center": [at, 0, size + radius], "radius": radius, "inside": True}}, "in sphere"
        if kind == "cylinder":
            return {"cylinder": {"point": [at, 0, size + radius], "axis": rng.choice(([0, 1, 0], [1, 0, 0])), "radius": radius,
                                 "inside": True}}, "in cylinder"
        if kind == "polygon":  # the obstacle: it goes round clockwise
            n, turn, radius = rng.randint(3, 8), rng.choice((0, rng.uniform(0, 1))), width * 10 ** rng.uniform(-1, 0.5)
            angles = [0.5 * math.pi - 2 * math.pi * (k + turn) / n for k in range(n)]
            rays = [radius * rng.choice((1, rng.uniform(0.4, 1))) for _ in angles]
            at = rng.choice(places) if rng.random() < 0.5 else rng.uniform(-0.3, 0.3) * width
            points = [[middle + at + r * math.cos(a), r * math.sin(a)] for r, a in zip(rays, angles)]
            top = max(p[1] for p in points)
            points = [[x, y - top + size] for x, y in points]
        else:
            wide, over = 0.5 * width - rng.uniform(0, 1) * size, 4 * (high + width)
            floor = [[middle + at, size - rng.choice((0, 0.02, 0.2)) * width]] * rng.randint(0, 1)
            points = [[middle - wide - rng.uniform(0, 0.5) * width, size], *floor, [middle + wide, size],
                      [middle + wide + 0.8 * width, over], [middle - wide - rng.uniform(0.8, 1.3) * width, over]]  # clear of the head
        return {"polyline": {"points": [*points, points[0]]}}, kind

    def revolved(self, rng, width, deep, size, places, inside, high):
        """Seen in the plane of a meridian: spheres, rings, cones, and what a line makes."""
        kind = rng.choice(["plane", "sphere", "ring", "line", "line", "enclosing"])
        middle = inside + 0.5 * width
        radius = width * 10 ** rng.uniform(-0.5, 1)
        if kind == "plane":
            return {"plane": {"point": [middle, size], "normal": [rng.choice((0, rng.uniform(-0.1, 0.1))), 1]}}, kind
        if kind == "sphere":  # it touches in a circle, or at the axis
            foot = math.hypot(radius, inside) if rng.random() < 0.5 else radius
            return {"circle": {"center": [0, size - radius * math.sqrt(max(0.1, 1 - (inside / foot) ** 2))], "radius": radius}}, kind
        if kind == "ring":
            radius = min(radius, 0.4 * (inside + width))
            at = max(1.1 * radius, inside + rng.uniform(0.2, 0.8) * width)
            return {"circle": {"center": [at, size - radius], "radius": radius}}, kind
        if kind == "enclosing":
            return self.enclosing(rng, width, deep, size, places, inside, high)
        shape, x, z = profile(rng, width, size, places)
        return {"polyline": {"points": [[middle + s, t] for s, t in zip(x, z)]}}, "line " + shape

    def obstacle(self, rng, width, deep, size, places):
        kind = rng.choice(["plane", "round", "polyline", "height", "height"] if self.dim == 2 else
                          ["plane", "sphere", "cylinder", "height", "height", "table"])
        at = rng.choice((0, rng.uniform(-0.3, 0.3) * width))
        radius = width * 10 ** rng.uniform(-0.7, 1)
        zeros = [0] * (self.dim - 2)
        if kind == "plane":
            return {"plane": {"point": [0, *zeros, size], "normal": [rng.choice((0, rng.uniform(-0.1, 0.1))), *zeros, 1]}}, kind
        if kind == "round":
            return {"circle": {"center": [at, size - radius], "radius": radius}}, kind
        if kind == "sphere":
            return {"sphere": {"center": [at, rng.uniform(-0.2, 0.2) * deep, size - radius], "radius": radius}}, kind
        if kind == "cylinder":
            return {"cylinder": {"point": [at, 0, size - radius], "axis": rng.choice(([0, 1, 0], [1, 0, 0])), "radius": radius}}, kind
        if kind == "table":
            n = [rng.randint(3, 6) for _ in range(2)]
            x = [width * (-0.6 + 1.2 * k / (n[0] - 1)) + (0 if rng.random() < 0.5 else rng.uniform(-0.05, 0.05) * width) for k in range(n[0])]
            y = [deep * (-0.6 + 1.2 * k / (n[1] - 1)) for k in range(n[1])]
            return {"height": {"x": x, "y": y, "z": [[rng.uniform(-2, 1) * size for _ in x] for _ in y]}}, kind
        shape, x, z = profile(rng, width, size, places)
        if self.dim == 3:
            return {"height": {"x": x, "y": [-deep, deep], "z": [z, z]}}, "table " + shape
        return ({"height": {"x": x, "z": z}} if kind == "height" else {"polyline": {"points": [list(p) for p in zip(x, z)]}}), f"{kind} {shape}"

    def request(self, level=0, **keys):
        return body([self.kind], [[n << level for n in self.cells]], [self.place], self.groups, **{**self.scene, **keys})


def force_of(answer):
    return answer["summary"]["contact"]["force"]


def distance(a, b):
    return math.sqrt(sum((s - t) ** 2 for s, t in zip(a, b)))


def look(scene, daemon, rng, refine=True):
    """What is false of a scene: a list of words."""
    false = []
    request = scene.request()
    answer, why = daemon.answer(request)
    image, other_why = daemon.answer(mirrored(request, scene.axis))
    if not answer or not image:
        return [f"base: {why}"] if not answer and not image else [f"only one of two images: {why or other_why}"]
    size = math.hypot(*force_of(answer)) or 1e-300
    u = answer["displacements"]
    back = [[-t if c == scene.axis else t for c, t in enumerate(x)] for x in image["displacements"]]
    if off_by(u, back) > 1e-6:
        false.append(f"mirrored: {force_of(answer)} {force_of(image)}")
    if max(answer["reactions"], default=0) > 1e-9 * size:
        false.append("pulls")
    for R in ([[0, -1], [1, 0]] if scene.dim == 2 else [[0, 0, 1], [1, 0, 0], [0, 1, 0]], rotation(rng, scene.dim)):
        if scene.axis or turn_obstacle(request["problem"]["contacts"][0]["obstacle"], R) is None:
            continue
        other, why = daemon.answer(with_obstacle(turned(request, R), lambda o: turn_obstacle(o, R)))
        back = other and [[sum(R[i][c] * x[i] for i in range(scene.dim)) for c in range(scene.dim)] for x in other["displacements"]]
        if not other or off_by(u, back) > 1e-6:
            false.append(f"turned: {why or off_by(u, back)}")
    length, stress = 10 ** rng.uniform(-6, 6), 10 ** rng.uniform(-6, 6)
    other, why = daemon.answer(with_obstacle(in_units(request, length, stress), lambda o: scale_obstacle(o, length)))
    scaled = other and [[t / length for t in x] for x in other["displacements"]]
    if not other or off_by(u, scaled) > 1e-6:
        false.append(f"units: {why or off_by(u, scaled)}")
    warnings = [w["code"] for w in answer["summary"].get("warnings", [])]
    if refine and not warnings:
        fine, why = daemon.answer(scene.request(2 if scene.dim == 2 else 1))
        off = fine and distance(force_of(fine), force_of(answer)) / max(math.hypot(*force_of(fine)), size)
        if not fine or off > TOLERANCE:
            false.append(f"refined: {why or (round(off, 2), force_of(answer), force_of(fine))}")
    return false


def run(s, numbers, say=print, refine=True, kinematics="auto", family="ground"):
    """Looks at scenes by number; returns what was counted, and what was false of which."""
    daemon, failures = contacts.Daemon(s), []
    for k in numbers:
        scene = Scene(k, kinematics, family)
        false = look(scene, daemon, random.Random(f"variations {k}"), refine)
        if false:
            failures.append((k, scene.family, false))
            say(*failures[-1], flush=True)
    return {"scenes": len(numbers), "solves": daemon.solves, "failures": failures}


def run_all(s, numbers):
    """Of the family that was asked for; else a third as many of each other one as of the first."""
    how, family = [*sys.argv[5:], *["auto", ""][len(sys.argv[5:]):]][:2]
    found = [run(s, numbers if name in (family, "ground") else numbers[:(len(numbers) + 2) // 3], kinematics=how, family=name)
             for name in FAMILIES if family in ("", name)]
    return {"scenes": sum(f["scenes"] for f in found), "solves": sum(f["solves"] for f in found),
            "failures": [x for f in found for x in f["failures"]]}


if __name__ == "__main__":
    contacts.command(__doc__, run_all, "bodies on obstacles", 300)
