"""Generated scenes of bodies that touch, each posted to a daemon at its defaults, and again with its sides exchanged, refined,
bisected, turned, in other units and renumbered. usage: generated_contacts.py BUILD_DIR OUTPUT.json [SCENES [FIRST]]

What must hold of each: forces balance and are what equilibrium says; nothing pulls and nothing overlaps; a symmetric
scene has a symmetric answer; nodal pressures do not zigzag; the force is that of the refined mesh within the mesh's
error, and where elements are bisected, and of press fits Lame's; exchanging sides changes nothing; turning, units and numbers change rounding only."""
import http.client
import json
import math
import pathlib
import random
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import PLANE, SOLID, body

FIELDS = "reactions,gaps,pressure,displacements"
MIRRORED = ["quad4", "quad8", "hex8", "hex20"]  # of which a mesh can be symmetric


# ---- meshes

def stretch(rng, symmetric):
    """A map of [0, 1] to itself that makes cells of several sizes."""
    odd, even = 0.45 * rng.uniform(-1, 1), 0 if symmetric else 0.25 * rng.uniform(-1, 1)
    return lambda t: t + odd * math.sin(2 * math.pi * t) / (2 * math.pi) + even * math.sin(math.pi * t) / math.pi


def distorted(rng, dim, symmetric):
    """A map of the unit square or cube to itself that keeps its sides."""
    along = [stretch(rng, symmetric) for _ in range(dim)]
    bend = [0 if symmetric else rng.choice((0, 0.3)) * rng.uniform(-1, 1) for _ in range(dim)]

    def place(*t):
        t = [f(x) for f, x in zip(along, t)]
        bubble = math.prod(4 * x * (1 - x) for x in t)
        return [x + b * bubble * 0.25 for x, b in zip(t, bend)]
    return place


def cells_of(rng, dim, fine=1.0):
    """A few cells; along the first axes those that touch."""
    most = 12 if dim == 2 else 4
    return [max(2, round(fine * rng.randint(3, most)))] + [rng.randint(2, 3) for _ in range(dim - 1)] if dim == 2 else \
        [rng.randint(2, most), rng.randint(2, most), rng.randint(1, 2)]


def kind_of(rng, dim, symmetric=False):
    kinds = PLANE if dim == 2 else SOLID
    return rng.choice([k for k in kinds if k in MIRRORED] if symmetric else kinds)


class Scene:
    """What is generated: request(level) with 2^level as many cells along each axis, and what is known of its answer.

    force: sum of the forces on `on`, by contact, where equilibrium says it; pressure: its mean, where theory does;
    mirror: a map of points to their images in a symmetric scene; shape: what both surfaces are to be taken for; tolerance:
    by which force of refined meshes differ."""
    force = pressure = mirror = shape = None
    tolerance = 0.1
    even = True  # pressures are those of a smooth field on these meshes

    def __init__(self, family, kinds, cells, places, groups, **scene):
        self.family, self.kinds, self.cells, self.places, self.groups, self.scene = family, kinds, cells, places, groups, scene
        self.dim = 3 if kinds[0] in SOLID else 2

    def request(self, level=0):
        cells = [[n << level for n in part] for part in self.cells]
        return body(self.kinds, cells, self.places, self.groups, **self.scene)


def model_of(rng, dim):
    return "solid" if dim == 3 else rng.choice(["plane_strain", "plane_stress", "axisymmetric"])


def materials(rng, n):
    """Bodies' stiffness is that of one or of two materials: by part."""
    return [{"on": "all", "young": 10 ** rng.uniform(2, 5), "poisson": rng.uniform(0, 0.4)}]


def interface(rng, dim, width, symmetric, curved):
    """A surface on which both bodies stand: its height over x (and y)."""
    kind = rng.choice(["flat", "arc"] if symmetric else ["flat", "slope", "arc", "wave"]) if curved else "flat"
    if kind == "flat":
        return lambda *x: 0.0
    if kind == "slope":
        slopes = [rng.uniform(-0.3, 0.3) for _ in range(dim - 1)]
        return lambda *x: sum(s * t for s, t in zip(slopes, x))
    if kind == "arc":
        bend = rng.uniform(-0.4, 0.4) / width
        return lambda *x: bend * sum(t * t for t in x)
    height, phase = 0.06 * width * rng.uniform(-1, 1), rng.uniform(0, 3)
    return lambda *x: height * math.sin(3 * x[0] / width + phase) - height * math.sin(phase)


def stack(rng, dim):
    """A block on another, or on and over its edge: pressed by a load that must come through, or by a motion."""
    symmetric = rng.random() < 0.25
    model = model_of(rng, dim)
    symmetric = symmetric and model != "axisymmetric"
    kinds = [kind_of(rng, dim, symmetric) for _ in range(2)]
    width = [rng.uniform(4, 12)] * 2
    if rng.random() < 0.6:
        width[rng.randint(0, 1)] *= rng.uniform(0.25, 0.9)
    shift = 0 if symmetric or model == "axisymmetric" or rng.random() < 0.5 else rng.uniform(-0.3, 0.3) * max(width)
    axis = [0, rng.choice((0, rng.uniform(0.5, 10)))][model == "axisymmetric"]
    left = [axis if model == "axisymmetric" else -0.5 * w for w in width]
    left[1] += shift
    deep = [rng.uniform(2, 6) for _ in range(2)]
    high = [rng.uniform(2, 5) for _ in range(2)]
    curved = rng.random() < 0.6
    f = interface(rng, dim, max(width), symmetric, curved)
    maps = [distorted(rng, dim, symmetric) for _ in range(2)]

    def place(k):
        def at(*t):
            t = maps[k](*t)
            x = [left[k] + width[k] * t[0]] + ([deep[k] * (t[1] - 0.5)] if dim == 3 else [])
            base = f(x[0] - left[0] - 0.5 * width[0], *x[1:])
            return (*x, base + (t[-1] - 1) * (high[0] + base) if k == 0 else base + t[-1] * (high[1] - base))
        return at
    names = [("left", "right", "bottom", "top"), ("x0", "x1", "z0", "z1")][dim == 3]
    groups = {"low": [(0, names[3])], "high": [(1, names[2])], "base": [(0, names[2])], "head": [(1, names[3])],
              "lefts": [(0, names[0]), (1, names[0])], "high_left": [(1, names[0])], "rights": [(1, names[1])]}
    vertical, zero = ("uy" if dim == 2 else "uz"), {"ux": 0} if dim == 2 else {"ux": 0, "uy": 0}
    supports = [{"on": "base", vertical: 0, **(zero if model != "axisymmetric" else {})}]
    if model != "axisymmetric":
        supports.append({"on": rng.choice(["lefts", "high_left"]), "ux": 0})
        if symmetric:
            supports[-1]["on"] = "high_left"
            supports.append({"on": "rights", "ux": 0})
    elif axis == 0:
        supports.append({"on": "lefts", "ux": 0})
    if dim == 3:
        groups["high_front"] = [(1, "y0")]
        supports.append({"on": "high_front", "uy": 0})
    loads, pushed = [], rng.random() < 0.3
    pressure = materials_ = None
    materials_ = materials(rng, 2)
    if pushed:
        supports.append({"on": "head", vertical: -rng.uniform(1e-4, 1e-2) * high[1]})
    else:
        pressure = 10 ** rng.uniform(-4, -2) * materials_[0]["young"]
        loads.append({"on": "head", "pressure": pressure})
    on = rng.choice([("low", "high"), ("high", "low")])
    scene = Scene("stack", kinds, [cells_of(rng, dim) for _ in range(2)], [place(0), place(1)], groups, model=model,
                  materials=materials_, supports=supports, loads=loads, contacts=[{"on": on[0], "with": on[1]}])
    if model.startswith("plane"):
        scene.scene["thickness"] = rng.uniform(0.5, 3)
    scene.even = not curved
    if not pushed:
        area = math.pi * ((left[1] + width[1]) ** 2 - left[1] ** 2) if model == "axisymmetric" else \
            width[1] * (scene.scene["thickness"] if dim == 2 else deep[1])
        sign = -1 if on[0] == "low" else 1
        scene.force = [[None] * (dim - 1) + [sign * pressure * area]]
    if symmetric and dim == 2:
        scene.mirror = lambda x: [-x[0], x[1]]
    return scene


def lame(young, interference, inner, middle, outer):
    """Pressure between two rings in plane stress, or with free ends."""
    return interference * young / middle / ((outer**2 + middle**2) / (outer**2 - middle**2) +
                                             (middle**2 + inner**2) / (middle**2 - inner**2))


def press(rng, dim):
    """A sector of a shaft in a hub, too thick by a little; facets that do not match."""
    kinds = [kind_of(rng, dim) for _ in range(2)]
    inner, middle, outer = sorted(rng.uniform(0.3, 1.2) for _ in range(2))[0] * 8, 12, 12 * rng.uniform(1.3, 2.2)
    angle = math.radians(rng.choice([60, 90, 150]))
    young, over = 10 ** rng.uniform(3, 5), middle * 10 ** rng.uniform(-3.3, -2.3)
    maps = [distorted(rng, dim, False) for _ in range(2)]
    model = "solid" if dim == 3 else "plane_stress"
    long = rng.uniform(1, 3)

    def ring(k, a, b):
        def at(*t):
            t = maps[k](*t)
            r, phi = a + (b - a) * t[0], angle * t[1]
            return (r * math.cos(phi), r * math.sin(phi), *(long * z for z in t[2:]))
        return at
    names = [("left", "right", "bottom", "top"), ("x0", "x1", "y0", "y1")][dim == 3]
    groups = {"shaft": [(0, names[1])], "hub": [(1, names[0])], "first": [(0, names[2]), (1, names[2])],
              "last": [(0, names[3]), (1, names[3])], "end": [(0, "z0"), (1, "z0")]}
    supports = [{"on": "first", "normal": [0, 1, 0][:dim], "u": 0},
                {"on": "last", "normal": [-math.sin(angle), math.cos(angle), 0][:dim], "u": 0}]
    if dim == 3:
        supports.append({"on": "end", "uz": 0})
    else:
        del groups["end"]
    on = rng.choice([("shaft", "hub"), ("hub", "shaft")])
    around = [math.ceil(math.degrees(angle) / rng.uniform(2, 6)) for _ in range(2)]  # up to ten degrees where stretched
    cells = [[rng.randint(2, 4), n] + ([rng.randint(1, 2)] if dim == 3 else []) for n in around]
    scene = Scene("press fit", kinds, cells, [ring(0, inner, middle + over), ring(1, middle, outer)], groups, model=model,
                  materials=[{"on": "all", "young": young, "poisson": 0.3}], supports=supports, loads=[],
                  contacts=[{"on": on[0], "with": on[1]}])
    scene.pressure = lame(young, over, inner, middle, outer)
    return scene


def sleeve(rng, dim):
    """A press fit as bodies of revolution: the interface is along the axis."""
    kinds = [kind_of(rng, 2) for _ in range(2)]
    inner, middle, outer = rng.uniform(1, 8), 12, 12 * rng.uniform(1.3, 2.2)
    young, over, long = 10 ** rng.uniform(3, 5), middle * 10 ** rng.uniform(-5, -3), rng.uniform(4, 20)
    maps = [distorted(rng, 2, False) for _ in range(2)]

    def ring(k, a, b):
        def at(*t):
            t = maps[k](*t)
            return a + (b - a) * t[0], long * t[1]
        return at
    on = rng.choice([("shaft", "hub"), ("hub", "shaft")])
    scene = Scene("sleeve", kinds, [[rng.randint(2, 4), rng.randint(3, 10)] for _ in range(2)],
                  [ring(0, inner, middle + over), ring(1, middle, outer)],
                  {"shaft": [(0, "right")], "hub": [(1, "left")], "ends": [(0, "bottom"), (1, "bottom")]}, model="axisymmetric",
                  materials=[{"on": "all", "young": young, "poisson": 0.3}], supports=[{"on": "ends", "uy": 0}], loads=[],
                  contacts=[{"on": on[0], "with": on[1]}])
    scene.pressure = lame(young, over, inner, middle, outer)
    return scene


def revolved(rng, dim):
    """A cone in a cone, a ring in a tube around it, a ball in a shell: bodies of revolution, or sectors of them, too thick by a
    little. The part in between is known exactly, of the meridian or in space."""
    shape = rng.choice(["cone", "torus", "sphere"])
    kinds = [kind_of(rng, dim) for _ in range(2)]
    inner, middle, outer = rng.uniform(2, 8), 12, 12 * rng.uniform(1.3, 1.8)
    young, over = 10 ** rng.uniform(3, 5), middle * 10 ** rng.uniform(-3.3, -2.3)
    far = middle * rng.uniform(2.2, 6) if shape == "torus" else 0  # from the axis to the middle of the tube
    long, sector = rng.uniform(4, 12), math.radians(rng.choice([20, 30, 60]))
    slope = rng.uniform(-1, 1) * min(0.4, (inner - 1) / long)
    end = math.pi if shape == "torus" else math.radians(rng.uniform(40, 75))
    maps = [distorted(rng, dim, False) for _ in range(2)]

    def part(k, a, b):
        def at(*t):
            t = maps[k](*t)
            r = a + (b - a) * t[0]
            x, z = (r - slope * long * t[1], long * t[1]) if shape == "cone" else \
                (far + r * math.cos(end * t[1]), r * math.sin(end * t[1]))
            return (x, z) if dim == 2 else (x * math.cos(sector * t[2]), -x * math.sin(sector * t[2]), z)
        return at
    names = [("left", "right", "bottom", "top"), ("x0", "x1", "y0", "y1")][dim == 3]
    groups = {"plug": [(0, names[1])], "socket": [(1, names[0])], "ends": [(k, names[j]) for k in range(2) for j in ([2, 3] if shape == "torus" else [2])]}
    supports = [{"on": "ends", "uy" if dim == 2 else "uz": 0}]
    if dim == 3:
        groups.update(first=[(0, "z0"), (1, "z0")], last=[(0, "z1"), (1, "z1")])
        supports += [{"on": "first", "normal": [0, 1, 0], "u": 0}, {"on": "last", "normal": [math.sin(sector), math.cos(sector), 0], "u": 0}]
    on = rng.choice([("plug", "socket"), ("socket", "plug")])
    along = math.degrees(end) / (rng.uniform(4, 9) if dim == 2 else rng.uniform(12, 20)) if shape != "cone" else rng.uniform(4, 9)
    cells = [[2, max(3, math.ceil(along * rng.uniform(0.7, 1.3)))] + [max(2, math.ceil(math.degrees(sector) / rng.uniform(8, 15)))] * (dim - 2)
             for _ in range(2)]
    scene = Scene(f"revolved {shape}", kinds, cells,
                  [part(0, inner, middle + over), part(1, middle, outer)], groups, model="axisymmetric" if dim == 2 else "solid",
                  materials=[{"on": "all", "young": young, "poisson": 0.3}], supports=supports, loads=[],
                  contacts=[{"on": on[0], "with": on[1]}])
    scene.shape = shape if dim == 3 else None
    scene.even = False  # pressures change along the meridian, and at free ends
    return scene


def balls(rng, dim):
    """A patch of a hollow ball in another, between four planes through the centre: Lame's pressure everywhere."""
    kinds = [kind_of(rng, 3) for _ in range(2)]
    inner, middle, outer, end = rng.uniform(3, 8), 12, 12 * rng.uniform(1.3, 2), math.radians(rng.choice([20, 30, 45]))
    young, poisson, over = 10 ** rng.uniform(3, 5), rng.uniform(0, 0.4), middle * 10 ** rng.uniform(-3.3, -2.3)
    maps = [distorted(rng, 3, False) for _ in range(2)]

    def shell(k, a, b):
        def at(*t):
            t = maps[k](*t)
            way = (math.tan(end * t[0]), math.tan(end * t[1]), 1.0)
            r = (a + (b - a) * t[2]) / math.sqrt(sum(x * x for x in way))
            return tuple(r * x for x in way)
        return at
    groups = {"ball": [(0, "z1")], "socket": [(1, "z0")], **{side: [(0, side), (1, side)] for side in ("x0", "x1", "y0", "y1")}}
    supports = [{"on": "x0", "ux": 0}, {"on": "y0", "uy": 0}, {"on": "x1", "normal": [math.cos(end), 0, -math.sin(end)], "u": 0},
                {"on": "y1", "normal": [0, math.cos(end), -math.sin(end)], "u": 0}]
    on = rng.choice([("ball", "socket"), ("socket", "ball")])
    cells = [[rng.randint(3, 5), rng.randint(3, 5), 2] for _ in range(2)]
    scene = Scene("balls", kinds, cells, [shell(0, inner, middle + over), shell(1, middle, outer)], groups, model="solid",
                  materials=[{"on": "all", "young": young, "poisson": poisson}], supports=supports, loads=[],
                  contacts=[{"on": on[0], "with": on[1]}])
    give = ((1 - 2 * poisson) * middle**3 + 0.5 * (1 + poisson) * outer**3) / (outer**3 - middle**3) + \
        ((1 - 2 * poisson) * middle**3 + 0.5 * (1 + poisson) * inner**3) / (middle**3 - inner**3)
    scene.pressure, scene.shape = young * over / middle / give, "sphere"
    return scene


def roller(rng, dim):
    """A part of a ring pressed into a block: contact is a small part of both sides."""
    symmetric = rng.random() < 0.3 and dim == 2
    kinds = [kind_of(rng, dim, symmetric) for _ in range(2)]
    radius, deep, high = rng.uniform(4, 12), rng.uniform(1, 3), rng.uniform(3, 8)
    half = math.radians(rng.uniform(30, 75))
    width = 2 * radius * rng.uniform(0.8, 1.5)
    maps = [distorted(rng, dim, symmetric) for _ in range(2)]

    def block(*t):
        t = maps[0](*t)
        return (width * (t[0] - 0.5), *(deep * (y - 0.5) for y in t[1:-1]), high * (t[-1] - 1))

    def ring(*t):
        t = maps[1](*t)
        r, phi = radius * (1 - 0.6 * t[-1]), half * (2 * t[0] - 1)
        return (r * math.sin(phi), *(deep * (y - 0.5) for y in t[1:-1]), radius - r * math.cos(phi))
    names = [("left", "right", "bottom", "top"), ("x0", "x1", "z0", "z1")][dim == 3]
    groups = {"low": [(0, names[3])], "round": [(1, names[2])], "base": [(0, names[2])], "hole": [(1, names[3])]}
    vertical = "uy" if dim == 2 else "uz"
    fixed = {"ux": 0, "uy": 0, vertical: 0}
    supports = [{"on": "base", **fixed}, {"on": "hole", **fixed, vertical: -radius * 10 ** rng.uniform(-2.5, -1.7)}]
    on = rng.choice([("low", "round"), ("round", "low")])
    cells = [[rng.randint(10, 20), 4], [rng.randint(10, 20), 3]] if dim == 2 else [[rng.randint(9, 14), 2, 2], [rng.randint(9, 14), 1, 2]]
    scene = Scene("roller", kinds, cells, [block, ring], groups, model="solid" if dim == 3 else "plane_strain",
                  materials=materials(rng, 2), supports=supports, loads=[], contacts=[{"on": on[0], "with": on[1]}])
    scene.tolerance = 0.5 if dim == 2 else 0.75  # a few sides touch
    scene.even = False
    if symmetric:
        scene.mirror = lambda x: [-x[0], x[1]]
    return scene


def pocket(rng, dim):
    """A block pressed into the corner of two others, which alone hold it: two contacts, or one around the corner."""
    kinds = [kind_of(rng, 2) for _ in range(3)]
    width, high, thick = rng.uniform(4, 10), rng.uniform(4, 10), rng.uniform(2, 4)
    more = [rng.choice((0, rng.uniform(0.5, 3))) for _ in range(2)]
    maps = [distorted(rng, 2, False) for _ in range(3)]

    def box(k, x0, y0, x1, y1):
        def at(*t):
            t = maps[k](*t)
            return x0 + (x1 - x0) * t[0], y0 + (y1 - y0) * t[1]
        return at
    places = [box(0, -more[0], -thick, width, 0), box(1, width, 0, width + thick, high + more[1]), box(2, 0, 0, width, high)]
    groups = {"floor": [(0, "top")], "wall": [(1, "left")], "under": [(2, "bottom")], "beside": [(2, "right")],
              "corner": [(2, "bottom"), (2, "right")], "both": [(0, "top"), (1, "left")], "base": [(0, "bottom")],
              "back": [(1, "right")], "head": [(2, "top")], "tail": [(2, "left")]}
    pressures = [rng.uniform(0.1, 1), rng.uniform(0.1, 1)]
    contacts = [[{"on": "under", "with": "floor"}, {"on": "beside", "with": "wall"}],
                [{"on": "corner", "with": "both"}], [{"on": "both", "with": "corner"}]][rng.randint(0, 2)]
    scene = Scene("pocket", kinds, [[rng.randint(3, 8), rng.randint(2, 4)], [rng.randint(2, 4), rng.randint(3, 8)],
                                    [rng.randint(3, 8), rng.randint(3, 8)]], places, groups, model="plane_strain",
                  materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                  supports=[{"on": "base", "ux": 0, "uy": 0}, {"on": "back", "ux": 0, "uy": 0}],
                  loads=[{"on": "head", "pressure": pressures[0]}, {"on": "tail", "pressure": pressures[1]}], contacts=contacts)
    down, aside = pressures[0] * width, -pressures[1] * high
    sign = -1 if contacts[0]["on"] == "both" else 1
    scene.even = False  # corners
    scene.force = [[0, down], [aside, 0]] if len(contacts) == 2 else [[sign * aside, sign * down]]
    return scene


def layers(rng, dim):
    """Plates on each other: the same load through all contacts."""
    n = rng.randint(3, 4)
    kinds = [kind_of(rng, dim) for _ in range(n)]
    width, deep = rng.uniform(5, 10), rng.uniform(2, 4)
    level = [0.0]
    for _ in range(n):
        level.append(level[-1] + rng.uniform(1, 3))
    slopes = [rng.choice((0, rng.uniform(-0.08, 0.08))) if 0 < k < n else 0 for k in range(n + 1)]
    maps = [distorted(rng, dim, False) for _ in range(n)]

    def plate(k):
        def at(*t):
            t = maps[k](*t)
            x = width * (t[0] - 0.5)
            ends = [level[j] + slopes[j] * x for j in (k, k + 1)]
            return (x, *(deep * (y - 0.5) for y in t[1:-1]), ends[0] + (ends[1] - ends[0]) * t[-1])
        return at
    names = [("left", "bottom", "top"), ("x0", "z0", "z1")][dim == 3]
    groups = {"base": [(0, names[1])], "head": [(n - 1, names[2])], "lefts": [(k, names[0]) for k in range(n)]}
    for k in range(n - 1):
        groups[f"top{k}"], groups[f"bottom{k}"] = [(k, names[2])], [(k + 1, names[1])]
    supports = [{"on": "base", "uy" if dim == 2 else "uz": 0}, {"on": "lefts", "ux": 0}]
    if dim == 3:
        groups["fronts"] = [(k, "y0") for k in range(n)]
        supports.append({"on": "fronts", "uy": 0})
    scene = Scene("layers", kinds, [[rng.randint(2, 9 if dim == 2 else 3) for _ in range(dim - 1)] + [rng.randint(1, 2)] for _ in range(n)],
                  [plate(k) for k in range(n)], groups, model="solid" if dim == 3 else "plane_strain", materials=materials(rng, 2),
                  supports=supports, loads=[{"on": "head", "pressure": 1}],
                  contacts=[{"on": f"top{k}", "with": f"bottom{k}"} for k in range(n - 1)])
    scene.force = [[None] * (dim - 1) + [-width * (deep if dim == 3 else 1)]] * (n - 1)
    return scene


FAMILIES = [(stack, 2), (press, 2), (roller, 2), (pocket, 2), (layers, 2), (sleeve, 2), (stack, 2), (press, 2),
            (stack, 3), (press, 3), (layers, 3), (roller, 3), (revolved, 2), (revolved, 3), (revolved, 3), (balls, 3)]


def generate(number):
    rng = random.Random(f"contacts {number}")
    make, dim = FAMILIES[number % len(FAMILIES)]
    return make(rng, dim)


# ---- variations

def exchanged(request):
    contacts = [{**c, "on": c["with"], "with": c["on"]} for c in request["problem"]["contacts"]]
    return {"problem": {**request["problem"], "contacts": contacts}}


def bisected(request, error):
    scene = request["problem"]
    return {"problem": {**scene, "mesh": {**scene["mesh"], "refine": "auto"}}, "solver": {"accuracy": {"total": error}, "time_limit_s": 60}}


def turned(request, R):
    """Rotated by R, a matrix; what supports hold along axes they hold along the turned ones."""
    def turn(x):
        return [sum(r * t for r, t in zip(row, x)) for row in R]
    scene = dict(request["problem"])
    scene["mesh"] = {**scene["mesh"], "nodes": [turn(x) for x in scene["mesh"]["nodes"]]}
    supports = []
    for s in scene["supports"]:
        if "normal" in s:
            supports.append({**s, "normal": turn(s["normal"])})
        for c, name in enumerate(("ux", "uy", "uz")[:len(R)]):
            if name in s:
                supports.append({"on": s["on"], "normal": [row[c] for row in R], "u": s[name]})
    scene["supports"] = supports
    return {"problem": scene}


def in_units(request, length, force):
    """In other units of length and force. All loads are pressures."""
    scene = dict(request["problem"])
    stress = force / length**2
    scene["mesh"] = {**scene["mesh"], "nodes": [[length * t for t in x] for x in scene["mesh"]["nodes"]]}
    scene["materials"] = [{**m, "young": stress * m["young"]} for m in scene["materials"]]
    scene["supports"] = [{k: length * v if k in ("ux", "uy", "uz", "u") else v for k, v in s.items()} for s in scene["supports"]]
    scene["loads"] = [{**one, "pressure": stress * one["pressure"]} for one in scene["loads"]]
    if "thickness" in scene:
        scene["thickness"] *= length
    return {"problem": scene}


def renumbered(request, rng):
    """Nodes, elements and sides in another order. Returns the request and the new number of each node."""
    scene = dict(request["problem"])
    nodes = scene["mesh"]["nodes"]
    number = list(range(len(nodes)))
    rng.shuffle(number)
    moved = [None] * len(nodes)
    for k, x in zip(number, nodes):
        moved[k] = x

    def again(lists):
        lists = [[number[k] for k in one] for one in lists]
        rng.shuffle(lists)
        return lists
    kind = "faces" if len(nodes[0]) == 3 else "edges"
    scene["mesh"] = {"nodes": moved, "elements": {k: again(v) for k, v in scene["mesh"]["elements"].items()},
                     "groups": {name: {"nodes": [number[k] for k in g["nodes"]]} if "nodes" in g else {kind: again(g[kind])}
                                for name, g in scene["mesh"]["groups"].items()}}
    return {"problem": scene}, number


def rotation(rng, dim):
    if dim == 2:
        a = rng.uniform(0, 2 * math.pi)
        return [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
    q = [rng.gauss(0, 1) for _ in range(4)]
    n = math.sqrt(sum(x * x for x in q))
    w, x, y, z = (t / n for t in q)
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


# ---- answers

class Daemon:
    """Posts without checking replies against the schemas, which takes longer than the solves."""

    def __init__(self, s):
        self.connection = http.client.HTTPConnection(s.host, s.port, timeout=120)
        self.solves = 0

    def ask(self, method, path, value=None):
        self.connection.request(method, path, json.dumps(value) if value is not None else None,
                                {"Content-Type": "application/json", "Prefer": "wait=100"})
        return json.loads(self.connection.getresponse().read())

    def answer(self, request):
        self.solves += 1
        job = self.ask("POST", "/v1/jobs", request)
        while job.get("status") in ("accepted", "running"):
            job = self.ask("GET", f"/v1/jobs/{job['id']}")
        if job.get("status") != "successful":
            return None, f"{job.get('detail') or job.get('error') or job}"
        if job["summary"]["outcome"] != "converged":
            return None, f"{job['summary']['outcome']}: {job['summary'].get('message')}"
        return self.ask("GET", f"/v1/jobs/{job['id']}/result?fields={FIELDS}"), None


def norm(rows):
    return math.sqrt(sum(t * t for row in rows for t in row))


def off_by(a, b):
    return norm([[s - t for s, t in zip(x, y)] for x, y in zip(a, b)]) / max(norm(a), 1e-300)


def forces_of(answer):
    return [c["force"] for c in answer["summary"]["resultants"]["contacts"]]


def pushed(answer):
    """How hard it is pressed: the sum of all reactions, whatever their directions."""
    return -sum(answer["reactions"])


def zigzag(answer):
    """Of nodal pressures in the plane, in their order along the side: the largest part of the mean by which one after the other is
    off the mean of its neighbours, to either side in turn, over six nodes all of which are pressed."""
    worst = 0.0
    xs = answer["nodes"]
    span = [max(x[c] for x in xs) - min(x[c] for x in xs) for c in range(2)]
    rows = sorted(zip(answer["contact_nodes"], answer["pressure"]), key=lambda r: (xs[r[0]][0] / span[0], xs[r[0]][1] / span[1]))
    p = [row[1] for row in rows]
    for k in range(len(p) - 7):
        window = p[k:k + 8]
        if min(window) <= 0:
            continue
        off = [window[j] - 0.5 * (window[j - 1] + window[j + 1]) for j in range(1, 7)]
        if all(a * b < 0 for a, b in zip(off, off[1:])):
            worst = max(worst, min(abs(t) for t in off) / (sum(window) / 8))
    return worst


def look(scene, daemon, rng, refine=True):
    """What is false of a scene: a list of words and numbers. refine: compare it with the refined mesh, too."""
    false = []

    def claim(holds, *words):
        if not holds:
            false.append(" ".join(f"{w:.3g}" if isinstance(w, float) else str(w) for w in words))
    request, level = scene.request(), 0
    answer, why = daemon.answer(request)
    while not answer and "concave or twisted" in str(why) and level < 2:  # so few quadratic elements cannot follow its curves
        level += 1
        request = scene.request(level)
        answer, why = daemon.answer(request)
    if not answer:
        return [f"base: {why}"]
    nodes, u, push = request["problem"]["mesh"]["nodes"], answer["displacements"], pushed(answer)
    size = max(abs(t) for x in nodes for t in x)
    largest = max(answer["pressure"] + [0.0])
    claim(push > 0, "no force")
    claim(max(answer["reactions"], default=0) <= 1e-9 * push, "pulls")
    claim(min(answer["gaps"], default=0) >= -1e-9 * size, "overlaps", min(answer["gaps"], default=0))
    claim(min(answer["pressure"], default=0) >= -1e-6 * largest, "negative pressure", min(answer["pressure"], default=0) / max(largest, 1e-300))
    claim(answer["summary"]["resultants"]["imbalance"] < 1e-6, "imbalance", answer["summary"]["resultants"]["imbalance"])
    for got, due in zip(forces_of(answer), scene.force or []):
        whole = max(abs(t) for t in due if t is not None)
        for a, b in zip(got, due):
            claim(b is None or abs(a - b) < 1e-6 * whole, "force", a, "due", b)
    if scene.pressure and push > 0:
        areas = [r / p for r, p in zip(answer["reactions"], answer["pressure"]) if p > 0]
        mean = push / abs(sum(areas)) if areas else 0
        told = answer["summary"]["error"]["mesh"] or 0  # a tenth, or half of what the mesh is said to be off by
        claim(abs(mean / scene.pressure - 1) < max(0.1, 0.5 * told), "mean pressure / Lame", mean / scene.pressure)
        claim(largest < 3 * scene.pressure, "largest pressure / Lame", largest / scene.pressure)
        open_rows = sum(p == 0 for p in answer["pressure"])
        claim(open_rows <= max(2, 0.02 * len(answer["pressure"])), "of a press fit is open:", open_rows)  # but at its ends
    taken_for = [x["shape"] for x in answer["summary"]["contact"].get("surfaces", [])]
    claim(not scene.shape or taken_for == [scene.shape] * 2, "shapes", scene.shape, taken_for)
    if scene.mirror:
        def place(x):
            return tuple(round(t / size, 9) + 0.0 for t in x)  # nodes of the two bodies may share a place: both are left out
        at = {}
        for k, x in enumerate(nodes):
            at.setdefault(place(x), []).append(k)
        pairs = [(u[k[0]], scene.mirror(u[j[0]])) for x, k in at.items() if len(k) == 1
                 for j in [at.get(place(scene.mirror(nodes[k[0]])), [])] if len(j) == 1]
        off = off_by([a for a, _ in pairs], [b for _, b in pairs])
        claim(len(pairs) > 4 and off < 1e-6, "not symmetric", off)
    other, why = daemon.answer(exchanged(request))
    claim(other and (other["displacements"] == u if len(scene.scene["contacts"]) == 1 else off_by(u, other["displacements"]) < 1e-6),
          "exchanged:", why or off_by(u, other["displacements"]))
    uneven = zigzag(answer) if scene.dim == 2 and scene.even else 0.0
    free_form = any(w["code"] == "free_form" for w in answer["summary"].get("warnings", []))
    finest = answer
    if not refine:
        claim(uneven < 0.3, "zigzag", uneven)
    elif not free_form:  # facets that stand for none of the known shapes are warned of
        # what a coarse mesh is off by, a finer one is off by less
        fine, why = daemon.answer(scene.request(level + 1))
        finer, more = daemon.answer(scene.request(level + 2)) if fine and abs(pushed(fine) - push) > scene.tolerance * push else (None, "")
        claim(fine and (not finer or abs(pushed(finer) - pushed(fine)) < 0.5 * abs(pushed(fine) - push)) and not more,
              "refined:", why or more or pushed(fine) / max(push, 1e-300))
        finest = finer or fine or answer
        claim(uneven < 0.3 or fine and zigzag(fine) < 0.75 * uneven, "zigzag", uneven)
    told = answer["summary"]["error"]["total"]
    rough = any(w["code"] in ("overlap", "facets", "free_form") for w in answer["summary"].get("warnings", []))  # not the body that is meant
    if refine and told and not rough and all(kind[:3] in ("tri", "qua", "tet") for kind in scene.kinds):
        # refined by the service where the error is: the same body, but for what curves are off their facets
        other, why = daemon.answer(bisected(request, max(0.03, 0.5 * told)))
        claim(other and abs(pushed(other) / max(pushed(finest), 1e-300) - 1) < max(scene.tolerance, told), "bisected:",
              why or pushed(other) / max(pushed(finest), 1e-300))
    if scene.scene["model"] != "axisymmetric":
        R = rotation(rng, scene.dim)
        other, why = daemon.answer(turned(request, R))
        back = other and [[sum(R[i][c] * x[i] for i in range(scene.dim)) for c in range(scene.dim)] for x in other["displacements"]]
        claim(other and off_by(u, back) < 1e-6, "turned:", why or off_by(u, back))
    length, force = 10 ** rng.uniform(-6, 6), 10 ** rng.uniform(-6, 6)
    other, why = daemon.answer(in_units(request, length, force))
    scaled = other and [[t / length for t in x] for x in other["displacements"]]
    claim(other and off_by(u, scaled) < 1e-6, "units:", why or off_by(u, scaled))
    again, number = renumbered(request, rng)
    other, why = daemon.answer(again)
    if other:
        slaves = [sorted({number[k] for k in answer["contact_nodes"]}), sorted(set(other["contact_nodes"]))]
        off = off_by(u, [other["displacements"][k] for k in number])
        claim(off < 1e-6 or slaves[0] != slaves[1] and abs(pushed(other) / push - 1) < scene.tolerance, "renumbered:", off)
    else:
        claim(False, "renumbered:", why)
    return false


def run(s, numbers, say=print, refine=True):
    """Looks at scenes by number; returns what was counted, and what was false of which."""
    daemon, counts, failures = Daemon(s), {}, []
    for k in numbers:
        scene = generate(k)
        false = look(scene, daemon, random.Random(f"variations {k}"), refine)
        name = f"{scene.family} {scene.dim}D"
        done = counts.setdefault(name, [0, 0])
        done[0] += 1
        done[1] += bool(false)
        if false:
            failures.append((k, name, "-".join(scene.kinds), scene.scene["model"], false))
            say(*failures[-1], flush=True)
    return {"scenes": sum(c[0] for c in counts.values()), "solves": daemon.solves, "families": counts, "failures": failures}


def command(doc, run, of, most=1000):
    """BUILD OUT [COUNT [FIRST]]: runs the scenes against a daemon of its own, tells what was false and writes it down."""
    if len(sys.argv) < 3:
        sys.exit(doc)
    count, first = (int(sys.argv[k]) if len(sys.argv) > k else d for k, d in ((3, most), (4, 0)))
    s = service.Service(sys.argv[1])
    began = time.time()
    try:
        s.start()
        found = run(s, range(first, first + count))
    finally:
        s.stop()
    for name, (scenes, false) in sorted(found.get("families", {}).items()):
        print(f"{name:14s} {scenes:5d} scenes {false:5d} false")
    print(f"{found['scenes']} {of}, {found['solves']} solves, {len(found['failures'])} false, {time.time() - began:.0f} s")
    with open(sys.argv[2], "w", encoding="utf-8") as out:
        json.dump(found, out)
    sys.exit(bool(found["failures"]))


if __name__ == "__main__":
    command(__doc__, run, "scenes of bodies that touch")
