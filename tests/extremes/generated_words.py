"""Generated scenes, each posted to a daemon in other words, which have to be answered alike: mirrored, turned by right angles and by any
angle, moved, in other units, renumbered, its parts in another order, its loads halved, as a load case, along a path, its ties exchanged.
usage: generated_words.py BUILD_DIR OUTPUT.json [SCENES [FIRST]]

Scenes combine what may stand together: bodies of every element and model, one, two that are tied or touch, of small and large deformation or
whichever it takes, on clamps, springs, rollers, rigid groups, obstacles, or on an obstacle alone and stabilized; loads on sides, in bodies, by
warmth and at points with moments; load cases, paths, quantities, meshes to be refined, levels of accuracy and operators. Compared are the outcome,
displacements, forces, energies, errors, intervals of quantities, warnings, and what small deformation errs by; where a scene is refused or
fails, it is so in all words."""
import copy
import json
import math
import random

import generated_contacts as contacts
from generated_large import LAWS, order
from two_bodies import body

AXES = ("ux", "uy", "uz")
FIELDS = "summary,displacements"
NEAR, TOLD = 1e-6, 2e-3  # of displacements, forces and energies over the largest; of what is told of errors
UNSTEADY = {"time_limit", "iteration_limit", "moving_geometry", "precision_limit"}  # outcomes that another way of rounding may change
QUIET = 1e-15  # strain energy by stiffness, below which nothing is deformed: what is told of strains is rounding


# ---- the scenes

class Scene:
    def __init__(self, number):
        self.rng = rng = random.Random(f"words {number}")
        self.number, self.dim = number, 3 if rng.random() < 0.25 else 2
        self.model = "solid" if self.dim == 3 else rng.choice(("plane_strain", "plane_strain", "plane_stress", "axisymmetric"))
        self.kinematics = rng.choice(("finite", "finite", "auto", "auto", "fixed"))
        self.law = rng.choice(LAWS) if self.kinematics == "finite" or self.kinematics == "auto" and rng.random() < 0.6 else "linear"
        self.large = self.kinematics == "finite"
        self.family = rng.choice(("one", "one", "one", "tied", "touching"))
        kinds = ["quad4", "quad8", "tri3", "tri6"] if self.dim == 2 else ["hex8", "hex20", "tet4", "tet10"]
        self.kinds = [rng.choice(kinds) for _ in range(1 if self.family == "one" else 2)]
        self.refine = self.family != "touching" and self.dim == 2 and rng.random() < 0.2
        if self.refine:
            self.kinds = self.kinds[:1] * len(self.kinds)
        self.size = [rng.choice((1, 1.5, 2, 4)), 1, 1][:self.dim]
        self.stiff = 10 ** rng.uniform(0, 5)
        self.request = self.make()
        self.features = [self.family, self.model, self.kinematics, self.law, "-".join(self.kinds), *self.features]

    def part(self, k, top):
        rng = self.rng
        bend = [rng.uniform(-0.05, 0.05) if rng.random() < 0.6 and not self.family == "tied" else 0.0 for _ in range(2)]
        ring = rng.choice((0, 1)) if self.model == "axisymmetric" else 0
        self.ring = getattr(self, "ring", ring)
        gap = 0.0 if self.family == "tied" or not top else rng.choice((0, 0.01))

        def place(x, y, *z):
            low = 1 + gap if top else 0
            return [self.ring + self.size[0] * x + bend[0] * (self.ring or 1) * math.sin(3 * x) * y * (1 - x), low + y + bend[1] * math.sin(3 * y) * x * (1 - y) * y, *z]
        return place

    def make(self):
        rng, dim = self.rng, self.dim
        self.features = []
        parts = len(self.kinds)
        few = rng.random() < 0.35  # of few elements
        cells = [[rng.randint(1, 2) if few else rng.randint(2, 5 if dim == 2 else 3) for _ in range(dim)] for _ in range(parts)]
        names = ("bottom", "top", "left", "right") if dim == 2 else ("y0", "y1", "x0", "x1")
        groups = {"foot": [(0, names[0])], "head": [(parts - 1, names[1])], "left": [(k, names[2]) for k in range(parts)],
                  "right": [(k, names[3]) for k in range(parts)], "tip": [(parts - 1, names[3])]}
        if dim == 3:
            groups["back"] = [(k, "z0") for k in range(parts)]
        if parts == 2:
            groups["roof"], groups["floor"] = [(0, names[1])], [(1, names[0])]
        self.supports, self.loads, self.contacts, more = [], [], [], {}
        self.hold()
        self.load()
        if self.family == "tied":
            more["ties"] = [{"on": "roof", "to": "floor"}]
        elif self.family == "touching":
            self.contacts.append({"on": "roof", "with": "floor"})
            if not any(s["on"] == "head" for s in self.supports):
                self.supports.append(self.some_axes("head", 0))
        material = {"on": "all", "young": self.stiff, "poisson": rng.choice((0, 0.3, 0.3, 0.45)), "expansion": 0.5}
        if self.law != "linear":
            material["law"] = self.law
        if self.model.startswith("plane"):
            more["thickness"] = rng.choice((1, 0.5, 3))
        if self.stabilized:
            more["stabilize"] = True
        if rng.random() < 0.2:
            more["units"] = {"length": "mm", "force": "N"}
        request = body(self.kinds, cells, [self.part(k, k == 1) for k in range(parts)], groups, model=self.model, kinematics=self.kinematics,
                       materials=[material], supports=self.supports, loads=self.loads, contacts=self.contacts, **more)
        if self.refine:
            request["problem"]["mesh"]["refine"] = "auto"
        self.ask(request)
        return request

    def some_axes(self, on, least):
        axes = ["uy"] if self.model == "axisymmetric" else list(AXES[:self.dim])
        return {"on": on, **{axis: 0 for axis in axes[least:] or axes}}

    def hold(self):
        rng, dim = self.rng, self.dim
        how = rng.choice(("clamp", "clamp", "symmetry", "springs", "rigid foot", "plane", "round", "alone", "wall"))
        self.stabilized, self.pressed = False, how in ("plane", "round", "alone")
        across = [] if dim == 2 else [{"on": "back", "uz": 0}]
        if self.model == "axisymmetric" and how in ("wall",):
            how = "clamp"
        aside = [{"on": "left", "ux": 0}] if self.model != "axisymmetric" else []
        if how == "clamp":
            self.supports = [self.some_axes("foot", 0)]
        elif how == "wall":
            self.supports = [self.some_axes("left", 0)]
        elif how == "symmetry":
            self.supports = [*aside, {"on": "foot", "uy": 0}, *across]
        elif how == "springs":
            spring = [rng.uniform(0.1, 2) * self.stiff for _ in range(dim)]
            if self.model == "axisymmetric":
                spring[0] = 0
            self.supports = [{"on": "foot", "spring": spring}, *across] + ([*aside] if rng.random() < 0.5 and self.model != "axisymmetric" or dim == 3 else [])
            if self.large or self.law != "linear":
                self.supports += [one for one in aside if one not in self.supports]
        elif how == "rigid foot":
            turn = {} if self.model == "axisymmetric" else {"rz": rng.choice((0, 3))} if dim == 2 else {"rx": 0, "ry": 0, "rz": rng.choice((0, 5))}
            self.supports = [{"on": "foot", "rigid": {"point": [0.3] + [0] * (dim - 1), **{a: 0 for a in AXES[:dim] if not (self.model == "axisymmetric" and a == "ux")}, **turn}}]
        elif how in ("plane", "round"):
            self.supports = [*aside, *across]
            self.on_obstacle(how)
        else:  # nothing but the obstacle
            self.stabilized = True
            self.on_obstacle("plane")
        self.features.append(how)

    def on_obstacle(self, how):
        dim = self.dim
        if how == "plane" or self.model == "axisymmetric":
            obstacle = {"plane": {"point": [0] * dim, "normal": [0, 1, 0][:dim]}}
        else:
            radius = self.rng.uniform(1, 4)
            obstacle = {"circle" if dim == 2 else "sphere": {"center": [self.rng.uniform(0, 1) * self.size[0], -radius, 0.5][:dim], "radius": radius}}
        self.contacts.append({"on": "foot", "obstacle": obstacle})

    def load(self):
        rng, dim = self.rng, self.dim
        size = 10 ** rng.uniform(-4, -1) * self.stiff  # of stress
        depth = self.size[0]
        choices = ["traction", "pressure", "moved", "point", "rigid head", "weight", "warm", "node"] if not self.pressed else ["pressure", "moved", "point", "rigid head", "weight"]
        for how in rng.sample(choices, 1 if rng.random() < 0.7 else 2):
            down = [0, -1, 0][:dim]
            way = [rng.uniform(-0.5, 0.5), -1, rng.uniform(-0.3, 0.3)][:dim] if not self.pressed else down
            if self.model == "axisymmetric":
                way = [0, -1]
            if how == "traction":
                self.loads.append({"on": "head", "traction": [size * w for w in way]})
            elif how == "pressure":
                self.loads.append({"on": "head", "pressure": size})
            elif how == "moved" and not any(s["on"] == "head" for s in self.supports):
                self.supports.append({**self.some_axes("head", 1 if self.pressed else 0), "uy": -rng.uniform(0.01, 0.2)})
            elif how in ("point", "rigid head") and self.model != "axisymmetric":
                one = {"on": "head", "force": [depth * size * w for w in way], "at": [rng.uniform(0.3, 0.7) * depth, rng.choice((2, 2.5)), 0.5][:dim]}
                if dim == 2 and rng.random() < 0.5 and not self.pressed:
                    one["moment"] = [rng.uniform(-0.3, 0.3) * size * depth]
                if how == "rigid head" and not any(s["on"] == "head" for s in self.supports):
                    self.supports.append({"on": "head", "rigid": {"point": [0.4] + [1] * (dim - 1)}})
                self.loads.append(one)
            elif how == "weight":
                self.loads.append({"on": "all", "body_force": [size * w for w in way]})
            elif how == "warm":
                self.loads.append({"on": "all", "temperature": rng.choice((-1, 1)) * rng.uniform(0.01, 0.2)})
            elif how == "node" and self.model != "axisymmetric":
                self.loads.append({"node": rng.randint(0, 3), "force": [0.1 * size * w for w in way]})
            self.features.append(how)

    def ask(self, request):
        rng, dim = self.rng, self.dim
        problem, solver = request["problem"], {}
        if self.refine:
            solver["accuracy"] = {"total": rng.choice((0.15, 0.2, 0.3))}
            solver["time_limit_s"] = 20
        elif rng.random() < 0.3:
            solver["accuracy"] = rng.choice(("quick", "balanced", "precise", "exact"))
        elif rng.random() < 0.15 and self.dim == 2 and self.law == "linear":
            solver["accuracy"] = {"guaranteed": True}
        if rng.random() < 0.2 and not self.stabilized:
            solver["operator"] = rng.choice(("matrix_free", "condensed", "factored"))
        if rng.random() < 0.5:
            request["quantities"] = [{"quantity": "strain_energy", "name": "energy"}]
            request["quantities"].append({"quantity": "displacement", "on": rng.choice(("tip", "head")), "direction": [0, 1, 0][:dim], "name": "way"})
            held = [s["on"] for s in problem["supports"] if "spring" not in s]
            if held:
                request["quantities"].append({"quantity": "reaction", "on": held[0], "direction": [0, 1, 0][:dim], "name": "held"})
            if problem["contacts"]:
                request["quantities"].append({"quantity": "contact.force", "on": problem["contacts"][0]["on"], "name": "force"})
            if self.model == "axisymmetric":
                request["quantities"] = [q for q in request["quantities"] if q["quantity"] != "reaction"]
            self.features.append("quantities")
        if rng.random() < 0.25:
            half = [{k: [t / 2 for t in v] if isinstance(v, list) and k not in ("at",) else v / 2 if isinstance(v, float) else v for k, v in one.items()} for one in problem["loads"]]
            request["cases"] = [{"name": "whole"}, {"name": "half", "loads": half}, {"name": "none", "loads": []}][:rng.randint(1, 3)]
            self.features.append("cases")
        if self.large and rng.random() < 0.25 and not self.refine and "cases" not in request:
            request["cases"] = [{"name": "way", "steps": [round(rng.uniform(0.3, 0.9), 2), 1]}]
            self.features.append("steps")
        if solver:
            request["solver"] = solver
            self.features.append(json.dumps(solver))


# ---- other words

def mapped(request, M, length=1.0, force=1.0, shift=None):
    """Turned by M, an orthogonal matrix, in other units, moved by shift. Axes that M does not keep become normals."""
    request = copy.deepcopy(request)
    problem, dim = request["problem"], len(M)
    flip = round(M[0][0] * M[1][1] - M[0][1] * M[1][0]) if dim == 2 else \
        round(sum(M[0][i] * (M[1][(i + 1) % 3] * M[2][(i + 2) % 3] - M[1][(i + 2) % 3] * M[2][(i + 1) % 3]) for i in range(3)))
    along = all(abs(t) in (0, 1) for row in M for t in row)
    shift = shift or [0] * dim
    stress = force / length ** 2

    def turn(x, scale=1.0):
        return [scale * sum(r * t for r, t in zip(row, x)) for row in M]

    def point(x):
        return [a + length * b for a, b in zip(turn(x, length), shift)]
    mesh = problem["mesh"]
    mesh["nodes"] = [point(x) for x in mesh["nodes"]]
    if flip < 0:
        mesh["elements"] = {kind: [[cell[k] for k in order(kind)] for cell in cells] for kind, cells in mesh["elements"].items()}
        mesh["groups"] = {name: {kind: [side[::-1] for side in sides] if kind != "nodes" else sides for kind, sides in group.items()} for name, group in mesh["groups"].items()}
    if "thickness" in problem:
        problem["thickness"] *= length
    for one in problem["materials"]:
        one["young"] *= stress
    supports = []
    for one in problem["supports"]:
        held = {axis: one[axis] for axis in AXES[:dim] if axis in one}
        one = {key: value for key, value in one.items() if key not in held}
        for c, axis in enumerate(AXES[:dim]):
            if axis in held and along:
                to = next(i for i in range(dim) if M[i][c])
                one[AXES[to]] = M[to][c] * held[axis] * length
            elif axis in held:
                supports.append({"on": one["on"], "normal": [row[c] for row in M], "u": held[axis] * length})
        if "normal" in one:
            one["normal"], one["u"] = turn(one["normal"]), one["u"] * length
        if "spring" in one:
            one["spring"] = [abs(t) for t in turn(one["spring"], force / length)]
        if "rigid" in one:
            rigid = one["rigid"]
            moved = {axis: rigid.pop(axis) for axis in AXES[:dim] if axis in rigid}
            rigid["point"] = point(rigid["point"])
            for c, axis in enumerate(AXES[:dim]):
                if axis in moved:
                    to = next(i for i in range(dim) if M[i][c])
                    rigid[AXES[to]] = M[to][c] * moved[axis] * length
            if dim == 2 and "rz" in rigid:
                rigid["rz"] *= flip
            turns = [rigid.pop(axis) if axis in rigid else None for axis in ("rx", "ry", "rz")] if dim == 3 else []
            for c, value in enumerate(turns):
                if value is not None:
                    to = next(i for i in range(dim) if M[i][c])
                    rigid[("rx", "ry", "rz")[to]] = flip * M[to][c] * value
        if len(one) > 1:
            supports.append(one)
    problem["supports"] = supports
    for loads in [problem["loads"]] + [case["loads"] for case in request.get("cases", []) if "loads" in case]:
        for one in loads:
            for key, scale in (("traction", stress), ("force", force), ("body_force", stress / length)):
                if key in one:
                    one[key] = turn(one[key], scale)
            if "pressure" in one:
                one["pressure"] *= stress
            if "at" in one:
                one["at"] = point(one["at"])
            if "moment" in one:
                one["moment"] = [flip * force * length * t for t in one["moment"]]
    for one in problem["contacts"]:
        for shape in one.get("obstacle", {}).values():
            for key in ("point", "center"):
                if key in shape:
                    shape[key] = point(shape[key])
            if "normal" in shape:
                shape["normal"] = turn(shape["normal"])
            if "radius" in shape:
                shape["radius"] *= length
    for one in request.get("quantities", []):
        if "direction" in one:
            one["direction"] = turn(one["direction"])
    return request


def unit(dim):
    return [[float(i == j) for j in range(dim)] for i in range(dim)]


def quarter(dim, rng):
    """One of the turns of a square or a cube."""
    if dim == 2:
        c, s = rng.choice(((0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)))
        return [[c, -s], [s, c]]
    while True:
        axes, signs = rng.sample(range(3), 3), [rng.choice((-1.0, 1.0)) for _ in range(3)]
        M = [[signs[i] * (axes[i] == j) for j in range(3)] for i in range(3)]
        if M != unit(3) and round(sum(M[0][i] * (M[1][(i + 1) % 3] * M[2][(i + 2) % 3] - M[1][(i + 2) % 3] * M[2][(i + 1) % 3]) for i in range(3))) > 0:
            return M


class Word:
    """Another way to say a scene: the request, and how its answer is that of the scene."""

    def __init__(self, name, request, M, length=1.0, force=1.0, number=None, case=None, near=NEAR):
        self.name, self.request, self.M, self.length, self.force, self.number, self.case, self.near = name, request, M, length, force, number, case, near


def reordered(request, rng):
    request = copy.deepcopy(request)
    problem = request["problem"]
    for key in ("supports", "loads", "contacts", "materials"):
        rng.shuffle(problem[key])
    for tie in problem.get("ties", []):
        tie["on"], tie["to"] = tie["to"], tie["on"]
    names = list(problem["mesh"]["groups"].items())
    rng.shuffle(names)
    problem["mesh"]["groups"] = dict(names)
    rng.shuffle(request.get("quantities", []))
    halves = []
    for one in problem["loads"]:  # warmth adds up, too
        half = {k: [t / 2 for t in v] if k in ("traction", "force", "body_force", "moment") else v / 2 if k in ("pressure", "temperature") else v for k, v in one.items()}
        halves += [half, copy.deepcopy(half)]
    problem["loads"] = halves
    return request


def words(scene, rng):
    request, dim = scene.request, scene.dim
    solid = scene.model != "axisymmetric"
    sign = [1.0] * dim
    sign[rng.randrange(dim) if solid else 1] = -1.0
    yield Word("mirrored", mapped(request, [[s * t for t in row] for s, row in zip(sign, unit(dim))]), [[s * t for t in row] for s, row in zip(sign, unit(dim))])
    length, force = 10 ** rng.uniform(-9, 9), 10 ** rng.uniform(-9, 9)
    yield Word("in other units", mapped(request, unit(dim), length, force), unit(dim), length, force)
    if solid:
        M = quarter(dim, rng)
        yield Word("by a quarter", mapped(request, M), M)
        yield Word("moved", mapped(request, unit(dim), shift=[rng.uniform(-1, 1) * rng.choice((30, 3000)) for _ in range(dim)]), unit(dim))
        rigid = [s for s in request["problem"]["supports"] if "rigid" in s]
        if not any("spring" in s for s in request["problem"]["supports"]) and not scene.stabilized and \
                not any(key in s["rigid"] for s in rigid for key in AXES + ("rx", "ry", "rz")):
            M = contacts.rotation(rng, dim)
            yield Word("turned", mapped(request, M), M)
    again, number = renumbered(request, rng)
    yield Word("renumbered", again, unit(dim), number=number)
    yield Word("in another order", reordered(request, rng), unit(dim))
    if "cases" not in request:
        yield Word("as a case", {**request, "cases": [{"name": "other", "loads": []}, {"name": "it", "loads": request["problem"]["loads"]}]}, unit(dim), case="it")
        if scene.large and not scene.refine:
            yield Word("along a path", {**request, "cases": [{"name": "it", "steps": [0.5, 1]}]}, unit(dim), case="it")


def renumbered(request, rng):
    again, number = contacts.renumbered(request, rng)
    again = {**request, "problem": copy.deepcopy(again["problem"])}
    again["problem"]["mesh"].update({"refine": "auto"} if "refine" in request["problem"]["mesh"] else {})
    for loads in [again["problem"]["loads"]]:
        for one in loads:
            if "node" in one:
                one["node"] = number[one["node"]]
    if "cases" in again:
        again["cases"] = copy.deepcopy(again["cases"])
        for case in again["cases"]:
            for one in case.get("loads", []):
                if "node" in one:
                    one["node"] = number[one["node"]]
    return again, number


# ---- answers

class Daemon(contacts.Daemon):
    def answers(self, request):
        """By case; or the code of what was refused, with its words."""
        self.solves += 1
        job = self.ask("POST", "/v1/jobs", request)
        while job.get("status") in ("accepted", "running"):
            job = self.ask("GET", f"/v1/jobs/{job['id']}")
        if job.get("status") != "successful":
            problem = job.get("error") or job
            return problem.get("code"), problem.get("detail")
        found = self.ask("GET", f"/v1/jobs/{job['id']}/result?fields={FIELDS}")
        return {case["name"]: case for case in found["cases"]} if "cases" in found else {None: found}, None


def number_of(value):
    return value if value is not None else math.nan


def compare(scene, word, found, other, claim):
    """One case of the scene with one of what was said otherwise."""
    summary, image = found["summary"], other["summary"]
    dim, M, L, F = scene.dim, word.M, word.length, word.force
    if {summary["outcome"], image["outcome"]} & UNSTEADY or abs(number_of(summary["energy"].get("strain"))) < QUIET * scene.stiff:
        return
    claim(summary["outcome"] == image["outcome"], "outcome", summary["outcome"], image["outcome"], image.get("message"))
    if summary["outcome"] not in ("converged", "mesh_limit") or image["outcome"] != summary["outcome"]:
        return
    near, told = word.near, TOLD
    accuracy = summary["certificate"].get("relative_error") or summary["error"]["equations"] or 0
    near, told = max(near, 4 * accuracy), max(told, 40 * accuracy)
    energy = max(abs(number_of(summary["energy"]["strain"])), abs(summary["energy"]["primal"] or 0))
    same_grid = len(found["displacements"]) == len(other["displacements"])
    if scene.refine:  # which element is divided next may hang on rounding
        near, told = 0.3, 1.0
    else:
        claim(same_grid, "nodes")
    back = [[sum(M[i][c] * u[i] for i in range(dim)) / L for c in range(dim)] for u in other["displacements"]]
    if word.number:
        back = [back[word.number[k]] for k in range(len(word.number))] if len(back) == len(word.number) else back
    most = max((abs(t) for u in found["displacements"] for t in u), default=0)
    if not scene.refine and same_grid:
        off = max(abs(a - b) for u, v in zip(found["displacements"], back) for a, b in zip(u, v))
        claim(off <= near * most + 1e-10, "displacements", off, "of", most)
    a, b = number_of(summary["energy"]["strain"]), number_of(image["energy"]["strain"]) / F / L
    claim(abs(a - b) <= 2 * near * max(energy, 1e-300) + 1e-14 * scene.stiff or math.isnan(a) and math.isnan(b), "strain energy", a, b)
    for key in ("mesh", "total"):
        a, b = summary["error"].get(key), image["error"].get(key)
        claim((a is None) == (b is None), f"error.{key}", a, b)
        if a is not None and b is not None:
            claim(abs(a - b) <= told * max(a, b) + 1e-5, f"error.{key}", a, b)
    claim(summary["error"]["kind"] == image["error"]["kind"], "kind", summary["error"], image["error"])
    if not scene.refine:
        claim(abs(summary["contact"]["active"] - image["contact"]["active"]) <= 2 or accuracy > 1e-6, "active", summary["contact"]["active"], image["contact"]["active"])
        codes = [sorted(w["code"] for w in one.get("warnings", [])) for one in (summary, image)]
        claim(codes[0] == codes[1], "warnings", *codes)
        small = [one.get("small_deformation", {}).get("error") for one in (summary, image)]
        claim((small[0] is None) == (small[1] is None), "small_deformation", *small)
        if small[0] is not None and small[1] is not None:
            claim(abs(small[0] - small[1]) <= 0.02 * small[0] + max(1e-5, accuracy), "small_deformation", *small)
        claim(("finite" in summary) == ("finite" in image), "finite", "finite" in summary)
        force = max((abs(t) for one in summary["resultants"]["supports"] + summary["resultants"]["contacts"] for t in one["force"]), default=0)
        if word.name != "in another order":
            for one, two in zip(summary["resultants"]["contacts"], image["resultants"]["contacts"]):
                turned = [sum(M[i][c] * two["force"][i] for i in range(dim)) / F for c in range(dim)]
                claim(max(abs(s - t) for s, t in zip(one["force"], turned)) <= 10 * near * force + 1e-12 * scene.stiff, "force", one["force"], turned)
    by_name = {q["name"]: q for q in image.get("quantities", [])}
    for one in summary.get("quantities", []):
        two = by_name[one["name"]]
        unit_of = {"strain_energy": F * L, "displacement": L, "reaction": F, "contact.force": F}[one["quantity"]]
        claim((one["low"] is None) == (two["low"] is None), one["name"], one, two)
        scale = {"strain_energy": energy, "displacement": most}.get(one["quantity"], 0) or max((abs(t) for s in summary["resultants"]["supports"] + summary["resultants"]["contacts"] for t in s["force"]), default=0)
        if not scene.refine:
            claim(abs(one["on_this_mesh"] - two["on_this_mesh"] / unit_of) <= 20 * near * scale + 1e-12 * scene.stiff, one["name"], one["on_this_mesh"], two["on_this_mesh"] / unit_of)
        if one["low"] is not None and two["low"] is not None:  # halves of the width of what has no error are rounding, too
            width = (one["high"] - one["low"], (two["high"] - two["low"]) / unit_of)
            slack = NEAR * scale + 1e-12 * scene.stiff
            claim(scene.refine or abs(width[0] - width[1]) <= 0.2 * max(width) + (20 * near + 1e-3) * scale + slack, one["name"], "widths", *width, "of", scale)
            claim(one["low"] <= two["high"] / unit_of + slack and two["low"] / unit_of <= one["high"] + slack, one["name"], "intervals apart", one["low"], one["high"], two["low"] / unit_of)


def look(scene, daemon, rng):
    false = []

    def claim_of(word):
        def claim(holds, *said):
            if not holds:
                false.append(f"{word}: " + " ".join(f"{w:.6g}" if isinstance(w, float) else str(w) for w in said)[:400])
        return claim
    found, why = daemon.answers(scene.request)
    claim_of("itself")(not isinstance(found, str) or found not in ("process_died", "internal"), found, why)
    for word in words(scene, rng):
        claim = claim_of(word.name)
        other, said = daemon.answers(word.request)
        if isinstance(found, str) or isinstance(other, str):
            claim(isinstance(found, str) and isinstance(other, str) and found == other or word.name == "as a case" and isinstance(found, str), "refused", found if isinstance(found, str) else "answered", why, "|",
                  other if isinstance(other, str) else "answered", said)
            continue
        for name, case in found.items():
            twin = other.get(word.case if word.case else name)
            claim(twin is not None, "no case", name)
            if twin:
                compare(scene, word, case, twin, claim)
    outcome = found if isinstance(found, str) else "/".join(sorted({case["summary"]["outcome"] for case in found.values()}))
    return false, outcome, why


def run(s, numbers, say=print):
    daemon, outcomes, failures = Daemon(s), {}, []
    for k in numbers:
        scene = Scene(k)
        false, outcome, why = look(scene, daemon, random.Random(f"said {k}"))
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        if false:
            failures.append((k, outcome, scene.features, false))
            say(*failures[-1], flush=True)
    return {"scenes": len(numbers), "solves": daemon.solves, "outcomes": outcomes, "failures": failures}


if __name__ == "__main__":
    contacts.command(__doc__, run, "scenes in other words", 300)
