"""Estimated errors of meshes in space against true ones: generated solids, each in all four kinds of bricks and tetrahedra, and in a mesh of
hex20 that is many times finer, whose energy tells what the others are off by.
usage: generated_solids.py BUILD_DIR OUTPUT.json [SCENES [FIRST]]

Bodies are boxes, wedges whose sides lean, boxes with their inner nodes moved at random, and ones with a re-entrant edge; clamped or held by
symmetry, pushed by tractions, body forces or a moved side; half of them on a plane or a ball. They have no curved sides, so
that all meshes are of one body. Twice the difference of two potential energies is the square of the error in the energy norm, and of the rest
of the contact; what the fine mesh itself is off by is added, by its own estimate, and may be a quarter of the square. Rows that stand in a
curved obstacle between their nodes have no such energy: where what that may come to is a fifth of the error or more, it is left out."""
import math
import random
import statistics

import generated_contacts as contacts
import two_bodies
from two_bodies import brick

ELEMENTS = ("hex8", "tet4", "hex20", "tet10")
FINEST = 2000  # cells of the reference
# Of what was told over what is true: medians, and each.
LOW, HIGH, LEAST = 0.7, 1.5, 0.3


class Scene:
    """A body by its number, and its requests."""

    def __init__(self, number):
        rng = random.Random(f"solids {number}")
        self.number = number
        self.family = rng.choice(("block", "wedge", "moved nodes", "re-entrant"))
        self.size = [rng.choice((1, 1, 1.5, 2)) for _ in range(3)]
        n = rng.choice((2, 2, 3))
        self.cells = [max(1, round(n * size / min(self.size))) for size in self.size]
        self.cells = [2 * ((k + 1) // 2) for k in self.cells] if self.family == "re-entrant" else self.cells
        self.lean = [rng.uniform(-0.4, 0.6) for _ in range(2)] if self.family == "wedge" else [0, 0]
        self.moved = self.family == "moved nodes"
        self.scene = {"model": "solid", "kinematics": "fixed", "materials": [{"on": "all", "young": 1000, "poisson": rng.choice((0, 0.3, 0.3, 0.4))}],
                      "supports": [{"on": "x0", "ux": 0}, {"on": "z0", "uz": 0}], "loads": [], "contacts": []}
        touches = rng.random() < 0.5
        if touches:
            self.on = rng.choice(("plane", "ball"))
            middle = [0, 0] if rng.random() < 0.5 else [rng.uniform(0, 1) * self.size[0], rng.uniform(0, 1) * self.size[2]]
            radius = rng.uniform(1.5, 5) * max(self.size)
            sphere = {"center": [middle[0], -radius, middle[1]], "radius": radius}
            shape = {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}} if self.on == "plane" else {"sphere": sphere}
            self.scene["contacts"] = [{"on": "y0", "obstacle": shape}]
        else:
            self.on = "nothing"
            self.scene["supports"] = [{"on": "y0", "ux": 0, "uy": 0, "uz": 0}] if rng.random() < 0.6 else [*self.scene["supports"], {"on": "y0", "uy": 0}]
        if touches and rng.random() < 0.6:
            self.scene["supports"].append({"on": "y1", "uy": -rng.uniform(0.01, 0.03) * self.size[1], **({"ux": 0} if rng.random() < 0.5 else {})})
        else:
            self.scene["supports"] += [{"on": "y1", "spring": [1, 30, 1]}] if touches else []
            self.scene["loads"].append({"on": "y1", "traction": [rng.uniform(-1, 1), -rng.uniform(5, 20) if touches else rng.uniform(-3, 3), rng.uniform(-1, 1)]})
        if rng.random() < 0.5:
            self.scene["loads"].append({"on": "x1", "traction": [rng.uniform(-3, 3) for _ in range(3)]})
        if rng.random() < 0.3:
            self.scene["loads"].append({"on": "all", "body_force": [rng.uniform(-3, 3) for _ in range(3)]})

    def place(self, x, y, z):
        return [self.size[0] * x * (1 + self.lean[0] * y), self.size[1] * y, self.size[2] * z * (1 + self.lean[1] * y)]

    def request(self, element, cells):
        """The body in so many cells along its sides; inner corners of coarse meshes are moved where the family says so."""
        kind, (nodes, elements, faces) = element, brick(element, cells, 0, self.place)
        if self.family == "re-entrant":  # without a quarter, along z
            elements = [e for e in elements if not self.is_cut([sum(nodes[k][c] for k in e[:4 if element[0] == "t" else 8]) for c in range(3)],
                                                               4 if element[0] == "t" else 8)]
            used = {k for e in elements for k in e}
            number = {k: i for i, k in enumerate(sorted(used))}
            nodes, elements = [nodes[k] for k in sorted(used)], [[number[k] for k in e] for e in elements]
            faces = {name: [[number[k] for k in face] for face in side if used.issuperset(face)] for name, side in faces.items()}
            faces = {name: side for name, side in faces.items() if side}
        if self.moved and cells == self.cells:
            self.move(nodes, elements, 4 if element[0] == "t" else 8, cells)
        mesh = {"nodes": nodes, "elements": {kind: elements}, "groups": {name: {"faces": side} for name, side in faces.items()}}
        return {"problem": {"kind": "scene", "mesh": mesh, **self.scene}}

    def is_cut(self, total, corners):
        return total[0] > 0.5 * corners * self.size[0] and total[1] > 0.5 * corners * self.size[1]

    def move(self, nodes, elements, corners, cells):
        """Inner corners by a fifth of a cell, the same in all meshes; nodes amid edges stay amid."""
        ends = {tuple(sorted((e[a], e[b]))): e[corners + k] for e in elements
                for k, (a, b) in enumerate(two_bodies.EDGES["tet" if corners == 4 else "hex"]) if len(e) > corners}
        for k in {k for e in elements for k in e[:corners]}:
            at = [round(x * n / size) for x, n, size in zip(nodes[k], cells, self.size)]
            if all(0 < i < n for i, n in zip(at, cells)):
                rng = random.Random(f"{self.number} {at}")
                nodes[k] = [x + rng.uniform(-0.2, 0.2) * size / n for x, size, n in zip(nodes[k], self.size, cells)]
        for (a, b), k in ends.items():
            nodes[k] = [(x + y) / 2 for x, y in zip(nodes[a], nodes[b])]

    def finest(self, most):
        times = 2
        while math.prod((times + 1) * n for n in self.cells) <= most:
            times += 1
        return [times * n for n in self.cells]


def seen(answer):
    """Energy, strain energy, estimated error relative to the norm, and force times depth of what stands in the obstacle."""
    s = answer["summary"]
    depth = s["contact"].get("geometric_penetration") or 0
    return s["energy"]["potential"], s["energy"]["strain"], s["error"]["mesh"], depth * math.hypot(*(s["contact"].get("force") or [0]))


def look(daemon, scene, finest):
    """Rows of the scene's meshes, or why there are none."""
    fine, why = daemon.answer(scene.request("hex20", scene.finest(finest)))
    if not fine:
        return [], why
    energy, strain, own, sunk = seen(fine)
    rows = []
    for element in ELEMENTS:
        coarse, why = daemon.answer(scene.request(element, scene.cells))
        if not coarse:
            return rows, f"{element}: {why}"
        above, _, told, deep = seen(coarse)
        square = 2 * (above - energy) + own ** 2 * 2 * strain
        if not (square > 0 and told is not None) or own ** 2 * 2 * strain > 0.25 * square or deep + sunk > 0.2 * square:
            continue
        norm = math.sqrt(2 * strain)
        rows.append({"number": scene.number, "family": scene.family, "on": scene.on, "element": element, "told": told, "true": math.sqrt(square) / norm})
    return rows, None


def run(s, numbers, say=print, finest=FINEST):
    daemon, failures, rows = contacts.Daemon(s), [], []
    contacts.FIELDS = "contact_status"
    for number in numbers:
        scene = Scene(number)
        found, why = look(daemon, scene, finest)
        rows += found
        if why:
            failures.append((number, scene.family, why))
        for row in found:
            if row["told"] < LEAST * row["true"]:
                failures.append((number, scene.family, f"{row['element']}: {row['told']:.3g} was told of {row['true']:.3g}"))
        for one in failures:
            if one[0] == number:
                say(*one, flush=True)
    return {"scenes": len(numbers), "solves": daemon.solves, "failures": failures, "rows": rows}


def medians(rows):
    """element: (count, median, least, largest) of what was told over what is true."""
    found = {}
    for element in ELEMENTS:
        ratios = sorted(row["told"] / row["true"] for row in rows if row["element"] == element)
        if ratios:
            found[element] = (len(ratios), statistics.median(ratios), ratios[0], ratios[-1])
    return found


def judged(s, numbers):
    found = run(s, numbers)
    for element, (count, median, least, largest) in medians(found["rows"]).items():
        print(f"{element:6s} {count:4d} meshes, told over true: median {median:.2f}, {least:.2f} .. {largest:.2f}")
        if not LOW <= median <= HIGH:
            found["failures"].append((element, f"median {median}"))
    return found


if __name__ == "__main__":
    contacts.command(__doc__, judged, "solids", 40)
