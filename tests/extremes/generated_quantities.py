"""Generated scenes with quantities, each posted on a coarse mesh and on one many times finer: how many of the fine mesh's values lie in
the coarse mesh's intervals, and how wide these are over the true errors.
usage: generated_quantities.py BUILD_DIR OUTPUT.json [SCENES [FIRST]]

Bodies are boxes of every element and model: bars, blocks on planes, in holes, on circles, tables and lines, on springs and symmetric
halves, pushed by loads, supports and heat. The reference is quad8 or hex20, with cells of a quarter to a twelfth of the size, in space of a half to a quarter. Plane bodies are
solved with guaranteed intervals as well, on two grids, which have to have something in common: on their own obstacle, and on a polyline or a
table in its place, a hill, a hollow, or flat, with teeth or without, of few pieces or many; and so are blocks on each other."""
import copy
import random
import statistics

import generated_contacts as contacts
from two_bodies import body

PLANE = ("quad4", "quad4", "quad8", "tri3", "tri6")
SOLID = ("hex8", "hex8", "tet4", "hex20", "tet10")
# Values that are zero but for rounding; others are 1e-6 at least.
ZERO = 1e-9
# Cells along the shortest side of the reference; of that for what is proved, which is proved itself.
FINEST = {2: 48, 3: 8}
PROVED = 24
# Of proved intervals: rounding, beside numbers of about 1e-3 and more.
ROUNDING = 1e-12


class Scene:
    """A scene by its number, and its requests on coarse and fine grids."""

    def __init__(self, number):
        rng = random.Random(f"quantities {number}")
        self.number = number
        self.dim = 3 if rng.random() < 0.15 else 2
        self.model = "solid" if self.dim == 3 else rng.choice(("plane_strain", "plane_strain", "plane_stress", "axisymmetric"))
        self.size = [rng.choice((1, 1, 1.5, 2)) for _ in range(self.dim)]
        self.element = rng.choice(PLANE if self.dim == 2 else SOLID)
        self.poisson = rng.choice((0, 0.2, 0.3, 0.3, 0.4))
        self.formulation = rng.choice(("auto", "auto", "auto", "incompatible_modes", "bbar")) if self.element in ("quad4", "hex8") else "auto"
        self.grading = [rng.choice((1, 1, 1, 2, 0.5)) for _ in range(self.dim)]
        least, most = ((4, 12) if self.dim == 2 else (2, 4))
        self.n = rng.randint(least, most if self.element in ("quad4", "tri3", "hex8", "tet4") else (least + most) // 2)
        make = rng.choice((self.bar, self.block, self.pressed, self.pressed, self.held_aside, self.on_springs, self.heated))
        self.family = make.__name__
        self.supports, self.loads, self.contacts, self.quantities = [], [], [], [{"quantity": "strain_energy"}]
        make(rng)

    def down(self, value):
        return [0] * (self.dim - 1 if self.dim == 2 else 1) + [value] + ([0] if self.dim == 3 else [])

    def axes(self, **given):
        return {k: v for k, v in given.items() if self.dim == 3 or k != "uz"}

    def touch(self, rng, shapes, on="bottom"):
        """An obstacle that the body just stands on, or that has a hump below its middle."""
        width, depth = self.size[0], self.size[1]
        middle = [rng.uniform(0, width), -rng.choice((0.5, 1, 2, 5)) * width]
        kind = rng.choice(shapes)
        if self.model == "axisymmetric":
            middle[0] = 0.0
        shape = {"plane": {"plane": {"point": [0] * self.dim, "normal": self.down(1)}}}
        if self.dim == 2:
            shape["round"] = {"circle": {"center": middle, "radius": -middle[1]}}
            xs = [width * (-0.5 + k / 20) for k in range(41)]
            bump = rng.uniform(0.002, 0.01)
            shape["table"] = {"height": {"x": xs, "z": [-bump * ((x - middle[0]) / width) ** 2 * 4 for x in xs]}}
            shape["line"] = {"polyline": {"points": [[-0.6 * width, -0.04 * width], [middle[0], 0], [1.6 * width, -0.05 * width]]}}
        else:
            shape["round"] = {"sphere": {"center": [middle[0], middle[1], 0.5 * self.size[2]], "radius": -middle[1]}}
        self.contacts = [{"on": on, "obstacle": shape.get(kind, shape["plane"])}]
        self.quantities.append({"quantity": "contact.force", "on": on})
        ends = sorted(rng.uniform(-0.2, 1.2) * width for _ in range(2))
        if rng.random() < 0.5 or ends[1] - ends[0] < 0.3 * width or ends[1] < 0 or ends[0] > width:
            ends = [-width, 2 * width]
        low, high = [ends[0], -0.1 * depth, -1], [ends[1], 0.1 * depth, 1 + self.size[-1]]
        self.quantities.append({"quantity": "mean_pressure", "window": {"min": low[:self.dim], "max": high[:self.dim]}})

    def reaction(self, on):
        self.quantities.append({"quantity": "reaction", "on": on, "direction": self.down(1), "name": f"reaction_{on}"})

    def displacement(self, on, direction):
        self.quantities.append({"quantity": "displacement", "on": on, "direction": direction, "name": f"displacement_{on}"})

    def bar(self, rng):
        self.supports = [{"on": "bottom", **self.axes(ux=0, uy=0, uz=0)}]
        self.loads = [{"on": "top", "traction": [rng.choice((0, 1)), *self.down(1)[1:]]}]
        self.reaction("bottom")
        self.displacement("top", self.down(1))
        self.displacement("right", [1] + [0] * (self.dim - 1))

    def block(self, rng):
        """Supports on the left, which the contact touches, or on top."""
        clamped = rng.random() < 0.6 and self.model != "axisymmetric"
        self.supports = [{"on": "left", **self.axes(ux=0, uy=0, uz=0)}] if clamped else \
            [{"on": "left", "ux": 0}, *([{"on": "back", "uz": 0}] if self.dim == 3 else []), {"on": "top", "uy": -0.01}]
        if clamped:
            self.loads = [{"on": "top", "traction": self.down(-1)}, {"on": "right", "traction": [rng.uniform(0, 3), *[0] * (self.dim - 1)]}]
        self.touch(rng, ("plane", "plane", "table"))
        self.reaction("left" if clamped else "top")
        self.displacement("top" if clamped else "right", self.down(1) if clamped else [1] + [0] * (self.dim - 1))

    def pressed(self, rng):
        """By a support on top, or a traction on a body that symmetry holds."""
        moved = rng.random() < 0.6
        side = {"on": "left", "ux": 0}
        self.supports = [] if self.model == "axisymmetric" else [side]
        self.supports += [{"on": "back", "uz": 0}] if self.dim == 3 else []
        self.touch(rng, ("round", "round", "table", "line") if moved else ("round", "table"))
        if moved:
            self.supports.append({"on": "top", "uy": -rng.uniform(0.005, 0.02) * self.size[1], **({"ux": 0} if rng.random() < 0.5 else {})})
            self.reaction("top")
            self.displacement("right", [1] + [0] * (self.dim - 1))
        else:
            self.supports.append({"on": "top", "spring": [0, 1e-3, 0][:self.dim]})
            self.loads = [{"on": "top", "traction": self.down(-rng.uniform(2, 10))}]
            self.displacement("top", self.down(1))

    def held_aside(self, rng):
        """A bracket on its obstacle, away from its support."""
        self.size[0] = max(self.size[0], 2 * self.size[1])
        if self.model == "axisymmetric":
            self.model = "plane_strain"
        self.supports = [{"on": "left", **self.axes(ux=0, uy=0, uz=0)}]
        self.loads = [{"on": "top", "traction": self.down(-rng.uniform(1, 5))}]
        self.touch(rng, ("line", "round"))
        obstacle = self.contacts[0]["obstacle"]
        at = 0.8 * self.size[0]
        if "polyline" in obstacle:
            obstacle["polyline"]["points"][1] = [at, -0.001]
        for kind in ("circle", "sphere"):
            if kind in obstacle:
                obstacle[kind]["center"][0] = at
        self.reaction("left")
        self.displacement("right", self.down(1))

    def on_springs(self, rng):
        stiff = rng.choice((10, 300, 5000))
        self.supports = [{"on": "top", "spring": [stiff, stiff, stiff][:self.dim]}]
        self.loads = [{"on": "right", "traction": self.down(-1)}, {"on": "all", "body_force": self.down(-2)}]
        self.touch(rng, ("round", "plane"))
        self.reaction("top")
        self.displacement("right", self.down(1))

    def heated(self, rng):
        self.supports = [{"on": "left", **self.axes(ux=0, uy=0, uz=0)}] if self.model != "axisymmetric" else [{"on": "bottom", "uy": 0}]
        self.loads = [{"on": "all", "temperature": 1}]
        if self.model != "axisymmetric":
            self.touch(rng, ("plane",))
        self.reaction(self.supports[0]["on"])
        self.displacement("top", self.down(1))

    def may_be_proved(self):
        shapes = ("plane",) if self.model == "axisymmetric" else ("plane", "circle", "polyline", "height")
        return self.dim == 2 and all(any(shape in c["obstacle"] for shape in shapes) for c in self.contacts)

    def on_lines(self):
        """The same before a polyline or table that it just touches, by its number."""
        rng = random.Random(f"lines {self.number}")
        other, width, n = copy.copy(self), self.size[0], round(4 * 15 ** rng.random())
        bend, middle = rng.choice((-1, 0, 1)) * 10 ** rng.uniform(-2, -0.8), rng.uniform(0.1, 0.9)
        teeth = rng.choice((0, 1)) * 10 ** rng.uniform(-2.5, 0) / n
        xs = [width * (-0.3 + 1.6 * (k + rng.uniform(-0.3, 0.3)) / (n - 1)) for k in range(n)]
        ys = [width * (bend * (x / width - middle) ** 2 + teeth * rng.uniform(-0.5, 0.5)) for x in xs]

        def height(x):
            k = max(1, next((i for i in range(1, n) if xs[i] >= x), n - 1))
            return ys[k - 1] + (x - xs[k - 1]) / (xs[k] - xs[k - 1]) * (ys[k] - ys[k - 1])
        highest = max(height(x) for x in [0, width, *[x for x in xs if 0 < x < width]])
        ys = [y - highest for y in ys]
        shape = {"height": {"x": xs, "z": ys}} if rng.random() < 0.4 else {"polyline": {"points": [list(p) for p in zip(xs, ys)]}}
        other.contacts = [{**contact, "obstacle": shape} for contact in self.contacts]
        other.family = f"{self.family} on lines"
        return other

    def request(self, fine=False, finest=None):
        n = self.n if not fine else max(min(12 * self.n, finest or FINEST[self.dim]), 2 * self.n)
        n += fine and n % 2
        shortest = min(self.size)
        element = self.element if not fine else ("quad8" if self.dim == 2 else "hex20")
        cells = [max(1, round(n * size / shortest)) for size in self.size]
        mesh = {"box": {"size": self.size, "cells": cells, "element": element, "grading": self.grading}}
        scene = {"kind": "scene", "model": self.model, "mesh": mesh, "kinematics": "fixed",
                 "materials": [{"on": "all", "young": 1000, "poisson": self.poisson, "expansion": 1e-3}],
                 "supports": self.supports, "loads": self.loads, "contacts": self.contacts}
        if not fine:
            scene["formulation"] = self.formulation
        return {"problem": scene, "quantities": self.quantities}


class Blocks:
    """A block pressed on another, with room between them or too little, whose nodes meet or not: as Scene."""

    def __init__(self, number):
        rng = random.Random(f"blocks {number}")
        self.number, self.family = number, "blocks on each other"
        self.element, self.finer = rng.choice(PLANE), rng.choice((2, 3, 3))
        width, high = [rng.uniform(2, 4), rng.uniform(0.6, 3)], [rng.uniform(0.6, 2) for _ in range(2)]
        left = rng.uniform(-0.2, 1) * (width[0] - width[1]) if rng.random() < 0.7 else 0.5 * (width[0] - width[1])
        gap = rng.choice((0, 0, rng.uniform(-2e-3, 5e-3)))
        self.cells = [[rng.randint(2, 7), rng.randint(2, 3)] for _ in range(2)]
        if rng.random() < 0.3:  # nodes meet
            left, width[1] = width[0] / self.cells[0][0], width[0] / self.cells[0][0] * max(1, self.cells[0][0] - 2)
            self.cells[1][0] = max(1, self.cells[0][0] - 2) * rng.choice((1, 2))
        self.places = [lambda x, y: [width[0] * x, high[0] * y], lambda x, y: [left + width[1] * x, high[0] + gap + high[1] * y]]
        names = rng.choice((("foot", "floor"), ("floor", "foot")))
        push = -gap - rng.uniform(1e-3, 2e-2) * high[1]
        held = rng.choice(([{"on": "lid", "ux": 0, "uy": push}], [{"on": "lid", "uy": push}, {"on": "aside", "ux": 0}]))
        loads = [{"on": rng.choice(("rights", "aside")), "traction": [rng.uniform(-3, 3), rng.uniform(-3, 3)]}, {"on": "all", "body_force": [0, rng.uniform(-2, 0)]},
                 {"on": "all", "temperature": rng.uniform(-5, 5)}]
        self.scene = {"model": rng.choice(("plane_strain", "plane_stress")), "kinematics": "fixed",
                      "materials": [{"on": "all", "young": 1000, "poisson": rng.choice((0, 0.3, 0.45)), "expansion": 1e-3}],
                      "supports": [{"on": "base", "ux": 0, "uy": 0}, *held], "loads": [one for one in loads if rng.random() < 0.4],
                      "contacts": [{"on": names[0], "with": names[1]}]}
        self.quantities = [{"quantity": "strain_energy"}, {"quantity": "contact.force", "name": "force"}, {"quantity": "reaction", "on": "lid", "direction": [0, 1]},
                           {"quantity": "displacement", "on": "rights", "direction": [1, 0], "name": "aside"}]

    def request(self, fine=False, _finest=None):
        cells = [[n * (self.finer if fine else 1) for n in part] for part in self.cells]
        groups = {"base": [(0, "bottom")], "floor": [(0, "top")], "foot": [(1, "bottom")], "lid": [(1, "top")], "aside": [(1, "left")],
                  "rights": [(0, "right"), (1, "right")]}
        return {**body(["quad8" if fine else self.element] * 2, cells, self.places, groups, **self.scene), "quantities": self.quantities}


def prove(daemon, scene):
    """Two grids, the intervals and energies of both guaranteed: what of them has nothing in common, and rows of the coarse grid's."""
    summaries, false, rows = [], [], []
    for fine in (False, True):
        answer, why = daemon.answer({**scene.request(fine, PROVED), "solver": {"accuracy": {"guaranteed": True}}})
        if not answer:
            return [why], []
        summaries.append(answer["summary"])
    errors = [one["error"] for one in summaries]
    if any(error["kind"] != "guaranteed" for error in errors):
        return [], []

    def apart(a, b):
        return max(a[0] - b[1], b[0] - a[1]) > ROUNDING + 1e-9 * abs(b[0])
    if apart(*[(error["energy_low"], error["energy_high"]) for error in errors]):
        false.append(f"the least energy is in {errors[0]['energy_low']} .. {errors[0]['energy_high']}, and in {errors[1]['energy_low']} .. {errors[1]['energy_high']}")
    for a, b in zip(*[one["quantities"] for one in summaries]):
        if "guaranteed" not in (a["kind"], b["kind"]) or a["kind"] != b["kind"]:
            continue
        if apart((a["low"], a["high"]), (b["low"], b["high"])):
            false.append(f"{a['name']} is in {a['low']} .. {a['high']}, and in {b['low']} .. {b['high']}")
        error, half = abs(b["value"] - a["on_this_mesh"]), 0.5 * (a["high"] - a["low"])
        if error > 3 * (b["high"] - b["low"]) and error > ROUNDING:
            rows.append({"number": scene.number, "family": scene.family, "quantity": a["quantity"], "half": half, "error": error})
    return false, rows


def prove_cases(daemon, scene):
    """The scene's loads and two thirds of them as load cases of one job, and each alone: what is guaranteed of the one and not of the other."""
    def times(value, factor):
        return [factor * x for x in value] if isinstance(value, list) else factor * value

    loads = {name: [{key: value if key == "on" else times(value, factor) for key, value in load.items()} for load in scene.loads]
             for name, factor in (("all", 1), ("less", 2 / 3))}
    request = {**scene.request(), "solver": {"accuracy": {"guaranteed": True}}}
    together, why = daemon.answer({**request, "cases": [{"name": name, "loads": one} for name, one in loads.items()]})
    if not together:
        return [why]
    false = []
    for case in together["cases"]:
        alone, why = daemon.answer({**request, "problem": {**request["problem"], "loads": loads[case["name"]]}})
        if not alone:
            return [why]
        found = [(one["error"]["kind"], [(one["error"].get(key), 1) for key in ("energy_low", "energy_high")],
                  [(q[key], abs(q["value"])) for q in one["quantities"] if q["kind"] == "guaranteed" for key in ("low", "high")])
                 for one in (case["summary"], alone["summary"])]
        numbers = [one[1] + one[2] if one[0] == "guaranteed" else [] for one in found]
        if found[0][0] != found[1][0] or len(numbers[0]) != len(numbers[1]) or \
                any(abs(a - b) > 1e-6 * max(abs(b), size) + ROUNDING for (a, _), (b, size) in zip(*numbers)):
            false.append(f"case {case['name']} has {found[0]}, alone {found[1]}")
    return false


def run(s, numbers, say=print):
    """Looks at scenes by number: every interval with its reference, and what was false."""
    daemon, failures, rows, proved = contacts.Daemon(s), [], [], []
    contacts.FIELDS = "contact_status"
    for number in numbers:
        scene = Scene(number)
        coarse, why = daemon.answer(scene.request())
        fine, fine_why = daemon.answer(scene.request(True))
        if not coarse or not fine:
            failures.append((number, scene.family, why or fine_why))
            say(*failures[-1], flush=True)
            continue
        for a, b in zip(coarse["summary"]["quantities"], fine["summary"]["quantities"]):
            if abs(b["value"]) < ZERO:
                continue
            rows.append({"number": number, "family": scene.family, "element": scene.element, "model": scene.model, "dim": scene.dim, **a,
                         "true": b["value"], "own": b["on_this_mesh"], "reference": abs(b["value"] - b["on_this_mesh"])})
        proofs = [scene, *([scene.on_lines()] if scene.contacts and scene.model != "axisymmetric" else [])] if scene.may_be_proved() else []
        for which in [*proofs, Blocks(number)]:
            false, of = prove(daemon, which)
            proved += of
            if which is scene and scene.loads:
                false += prove_cases(daemon, scene)
            for one in false:
                failures.append((number, which.family, one))
                say(*failures[-1], flush=True)
    return {"scenes": len(numbers), "solves": daemon.solves, "failures": failures, "rows": rows, "proved": proved}


def told(rows):
    """By quantity, and of all: how many true values are in their intervals, of how many that the fine mesh tells; medians of half the width and of the
    middle's error over the error of the mesh's value; how many have no interval."""
    found = []
    for kind in [*sorted({r["quantity"] for r in rows}), "all"]:
        of = [r for r in rows if kind in (r["quantity"], "all")]
        off = [(r, abs(r["true"] - r["on_this_mesh"]), abs(r["true"] - r["value"]), 0.5 * (r["high"] - r["low"])) for r in of if r["low"] is not None]
        off = [o for o in off if o[1] > 3 * o[0]["reference"] and o[1] > 1e-7 * abs(o[0]["true"])]
        found.append({"quantity": kind, "inside": sum(o[2] <= o[3] for o in off), "of": len(off), "half": statistics.median([o[3] / o[1] for o in off] or [0]),
                      "middle": statistics.median([o[2] / o[1] for o in off] or [0]), "without": sum(r["low"] is None for r in of), "asked": len(of)})
    return found


def proved(rows):
    """The same of guaranteed intervals, by what the body is on."""
    found = []
    for where in ("", " on lines", " on each other"):
        ratios = [row["half"] / row["error"] for row in rows if row["family"].endswith(where or row["family"].split(" ")[0])]
        found.append({"where": where.strip(), "of": len(ratios), "half": statistics.median(ratios or [0])})
    return found


def look(s, numbers):
    found = run(s, numbers)
    found.update(told=told(found["rows"]), held=proved(found["proved"]))
    for one in found["held"]:
        print(f"guaranteed     {one['of']} {one['where']} whose error the fine mesh tells, half width over error of the mesh's value {one['half']:5.2f}")
    for one in found["told"]:
        print(f"{one['quantity']:14s} {one['inside']:4d} of {one['of']:4d} inside, half width over error of the mesh's value {one['half']:5.2f}, "
              f"error of the middle over it {one['middle']:5.2f}, {one['without']} without an interval")
    if found["told"][-1]["inside"] < 0.95 * found["told"][-1]["of"]:
        found["failures"].append("fewer than 95 of 100 values are in their intervals")
    return found


if __name__ == "__main__":
    contacts.command(__doc__, look, "scenes with quantities", 100)
