"""Up to which load small deformation suffices, and up to which `auto` takes it: bodies that bend, press and slide, of which the load grows.
usage: large_thresholds.py BUILD_DIR OUTPUT.json [BODIES]

Of each body two loads are found by bisection: from which on the answer of small deformation (kinematics fixed, linear law) is off by more than
a twentieth of that of large deformation (kinematics finite), and from which on auto's answer is not that of small deformation, or under the
linear law has the warning large_deformation (large_strain is of the stress at one place, which has no part in this). What an answer is off by is found here, from displacements, forces and energies of both answers; large
deformation that has no answer is off by more than anything. The errors need not grow with the load: what counts is looked at on both sides
of auto's own load. There small deformation may not be off by more than was tolerable (wrong), and with a quarter more load it must be (early)."""
import json
import math
import pathlib
import random
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import body  # noqa

LAWS = ("neo_hooke", "linear", "neo_hooke_isochoric", "st_venant_kirchhoff")
TOLERABLE, LEAST, STEPS, BODIES = 0.05, 1e-4, 10, 48
# What the equations of both answers may leave, of what is compared.
ROUNDING = 1e-3
KEYS = ("ux", "uy", "uz")


def box(*spans):
    """Of the unit cube, to (low, high) along each axis."""
    return lambda *t: [a + (b - a) * x for (a, b), x in zip(spans, t)]


def ring(inner, wide, angle=math.pi / 2, start=0.0):
    return lambda x, y: [(inner + wide * x) * math.cos(start + angle * y), (inner + wide * x) * math.sin(start + angle * y)]


def scene(kinds, cells, places, groups, **more):
    return body(kinds, cells, places, {name: [(0, side) if isinstance(side, str) else side] for name, side in groups.items()}, **more)["problem"]


def plane(rng):
    return rng.choice(("quad8", "quad4", "tri6"))


# Each returns a problem under a load of `size`, 1 at most, which is far too much for small deformation.

def cantilever(rng, size):
    long = rng.uniform(8, 30)
    return scene(("quad8",), [(int(long), 1)], [box((0, long), (0, 1))], {"foot": "left", "end": "right"}, model=rng.choice(("plane_strain", "plane_stress")),
                 supports=[{"on": "foot", "ux": 0, "uy": 0}], loads=[{"on": "end", "traction": [0, -size / long ** 2]}])


def leaning_column(rng, size):
    long, lean = rng.uniform(10, 20), rng.uniform(0.02, 0.3)
    place = box((0, long), (0, 1))
    bent = lambda x, y: [place(x, y)[0], place(x, y)[1] + lean * x * x]  # noqa: E731  what it is bent by
    return scene(("quad8",), [(int(long), 1)], [bent], {"foot": "left", "end": "right"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}], loads=[{"on": "end", "traction": [-size / long ** 2, 0]}])


def squeezed_block(rng, size):
    return scene((plane(rng),), [(6, 4)], [box((0, rng.uniform(1, 3)), (0, 1))], {"under": "bottom", "top": "top"}, model=rng.choice(("plane_strain", "plane_stress")),
                 supports=[{"on": "top", "ux": 0.5 * size * rng.uniform(-1, 1), "uy": -0.4 * size}],
                 contacts=[{"on": "under", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}])


def block_over_roller(rng, size):
    long, radius = rng.uniform(2, 4), rng.uniform(1, 4)
    return scene((plane(rng),), [(12, 4)], [box((0, long), (0, 1))], {"under": "bottom", "top": "top"}, model="plane_strain",
                 supports=[{"on": "top", "ux": -size * rng.uniform(0, 1), "uy": -0.3 * size}],
                 contacts=[{"on": "under", "obstacle": {"circle": {"center": [5 / 12 * long, -radius], "radius": radius}}}])


def strip_over_roller(rng, size):
    """Held at one end, bent over a roller by the other one."""
    long, radius = rng.uniform(8, 16), rng.uniform(1, 3)
    return scene(("quad8",), [(2 * int(long), 1)], [box((0, long), (0, 0.5))], {"under": "bottom", "foot": "left", "end": "right"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}], loads=[{"on": "end", "traction": [0, -0.3 * size / long]}],
                 contacts=[{"on": "under", "obstacle": {"circle": {"center": [0.6 * long, -radius], "radius": radius}}}])


def ring_between_plates(rng, size):
    inner = rng.uniform(3, 12)
    return scene(("quad8",), [(1, 20)], [ring(inner, 1)], {"end": "bottom", "crown": "top", "out": "right"}, model="plane_strain",
                 supports=[{"on": "end", "uy": 0.5 * size * inner}, {"on": "crown", "ux": 0}],
                 contacts=[{"on": "out", "obstacle": {"plane": {"point": [0, inner + 1], "normal": [0, -1]}}}])


def tube_over_rod(rng, size):
    return scene(("quad8",), [(3, 6)], [ring(1, rng.uniform(0.2, 1.5))], {"end": "bottom", "crown": "top", "bore": "left"}, model="plane_strain",
                 supports=[{"on": "end", "uy": 0}, {"on": "crown", "ux": 0}],
                 contacts=[{"on": "bore", "obstacle": {"circle": {"center": [0, 0], "radius": 1 + 0.5 * size}}}])


def clamped_arch(rng, size):
    radius, half = rng.uniform(10, 25), rng.uniform(0.3, 0.7)
    return scene(("quad8",), [(1, 16)], [ring(radius, 0.5, half, math.pi / 2 - half)], {"foot": "bottom", "crown": "top"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}, {"on": "crown", "ux": 0, "uy": -0.5 * size * radius * (1 - math.cos(half))}])


def two_blocks(rng, size):
    long = rng.uniform(2, 4)
    return scene(("quad8", "quad8"), [(8, 2), (4, 3)], [box((0, long), (-1, 0)), box((0.3 * long, 0.7 * long), (0, rng.uniform(0.5, 1.5)))],
                 {"foot": "bottom", "on": "top", "under": (1, "bottom"), "held": (1, "top")}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}, {"on": "held", "ux": 0.4 * size * rng.uniform(-1, 1), "uy": -0.4 * size}],
                 contacts=[{"on": "under", "with": "on"}])


def two_rings(rng, size):
    """Quarters, the crown of one below that of the other: symmetric to where they touch."""
    inner = rng.uniform(2, 6)
    upper = lambda x, y: [(inner + 1 - x) * math.cos(math.pi / 2 * y), 2 * (inner + 1) - (inner + 1 - x) * math.sin(math.pi / 2 * y)]  # noqa: E731
    return scene(("quad8", "quad8"), [(1, 14), (1, 17)], [ring(inner, 1), upper],
                 {"foot": "bottom", "crown": "top", "out": "right", "held": (1, "bottom"), "low": (1, "top"), "outer": (1, "left")}, model="plane_strain",
                 supports=[{"on": "foot", "uy": 0}, {"on": "crown", "ux": 0}, {"on": "held", "uy": -0.6 * size * inner}, {"on": "low", "ux": 0}],
                 contacts=[{"on": "outer", "with": "out"}])


def plate_under_load(rng, size):
    """A round plate whose rim is on a plane, pressed down in its middle."""
    wide, thick = rng.uniform(4, 12), rng.uniform(0.4, 1)
    lifted = lambda x, y: [wide * x, thick * y + 0.02 * wide * (1 - x * x)]  # noqa: E731  its middle stands free
    made = scene(("quad8",), [(12, 1)], [lifted], {"under": "bottom", "top": "top", "axis": "left"}, model="axisymmetric",
                 supports=[{"on": "axis", "ux": 0, "uy": -0.3 * size * wide}], loads=[{"on": "top", "traction": [0, -size * (thick / wide) ** 3]}],
                 contacts=[{"on": "under", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}])
    under = made["mesh"]["groups"]["under"]
    under["edges"] = under["edges"][6:]  # what is held cannot give way
    return made


def straight_column(rng, size):
    """It buckles."""
    long = rng.uniform(15, 60)
    return scene(("quad8",), [(16, 1)], [box((0, long), (0, 1))], {"foot": "left", "end": "right"}, model=rng.choice(("plane_strain", "plane_stress")),
                 supports=[{"on": "foot", "ux": 0, "uy": 0}], loads=[{"on": "end", "traction": [-4 * size / long ** 2, 0]}])


def along(places, t):
    """From one place to the next, each as long."""
    k = min(int(t * (len(places) - 1)), len(places) - 2)
    part = t * (len(places) - 1) - k
    return [p + part * (q - p) for p, q in zip(places[k], places[k + 1])]


def frame(rng, size):
    """A beam on two legs, loaded from above, and a little aside or not at all: it sways."""
    high, wide, thick, aside = rng.uniform(15, 30), rng.uniform(10, 40), rng.uniform(0.7, 1.2), rng.choice((0.0, 0.01, 0.1))
    outer, inner = [[0, 0], [0, high], [wide, high], [wide, 0]], [[thick, 0], [thick, high - thick], [wide - thick, high - thick], [wide - thick, 0]]
    made = scene(("quad8",), [(1, 24)], [lambda x, y: [p + x * (q - p) for p, q in zip(along(inner, 1 - y), along(outer, 1 - y))]],
                 {"foot": "bottom", "other": "top", "out": "right"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}, {"on": "other", "ux": 0, "uy": 0}],
                 loads=[{"on": "out", "traction": [aside * size / high ** 2, -8 * size / high ** 2 / wide]}])
    out = made["mesh"]["groups"]["out"]
    out["edges"] = out["edges"][8:16]
    return made


def loaded_arch(rng, size):
    """Shallow, clamped, under a load: it snaps through."""
    radius, half = rng.uniform(20, 60), rng.uniform(0.15, 0.4)
    return scene(("quad8",), [(1, 16)], [ring(radius, 0.5, half, math.pi / 2 - half)], {"foot": "bottom", "crown": "top", "out": "right"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}, {"on": "crown", "ux": 0}], loads=[{"on": "out", "traction": [0, -0.1 * size * half ** 2 / radius]}])


def string(rng, size):
    """Held at both ends and loaded across: it becomes stiffer."""
    long = rng.uniform(10, 40)
    return scene(("quad8",), [(20, 1)], [box((0, long), (0, 1))], {"foot": "left", "end": "right", "top": "top"}, model="plane_strain",
                 supports=[{"on": "foot", "ux": 0, "uy": 0}, {"on": "end", "ux": 0, "uy": 0}], loads=[{"on": "top", "traction": [0, -100 * size / long ** 4]}])


def solid(rng, size):
    """A bar that bends, or a block on a ball or a plane."""
    long, kind = rng.uniform(1, 6), rng.choice(("hex20", "tet10"))
    if rng.random() < 0.5:
        return scene((kind,), [(2 + int(long), 1, 1)], [box((0, long), (0, 1), (0, rng.uniform(0.5, 1)))], {"foot": "x0", "end": "x1"}, model="solid",
                     supports=[{"on": "foot", "ux": 0, "uy": 0, "uz": 0}], loads=[{"on": "end", "traction": [0, -0.3 * size / long, 0.1 * size / long]}])
    obstacle = {"sphere": {"center": [0.5 * long, -4, 0.4], "radius": 4}} if rng.random() < 0.5 else {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}
    return scene((kind,), [(2, 1, 2)], [box((0, long), (0, 1), (0, 0.8))], {"under": "y0", "top": "y1"}, model="solid",
                 supports=[{"on": "top", "ux": 0.3 * size, "uy": -0.4 * size, "uz": 0}], contacts=[{"on": "under", "obstacle": obstacle}])


KINDS = (cantilever, leaning_column, squeezed_block, block_over_roller, strip_over_roller, ring_between_plates, tube_over_rod, clamped_arch,
         two_blocks, two_rings, plate_under_load, solid, straight_column, frame, loaded_arch, string)


class Body:
    def __init__(self, number):
        self.number, self.kind = number, KINDS[number % len(KINDS)]
        self.law = LAWS[(number // len(KINDS) + number) % len(LAWS)]
        self.poisson = random.Random(f"law {number}").uniform(0, 0.4)

    def request(self, size, kinematics, law):
        problem = self.kind(random.Random(f"threshold {self.number}"), size)
        return {"problem": {**problem, "kinematics": kinematics, "materials": [{"on": "all", "young": 1, "poisson": self.poisson, "law": law}]}}

    def answer(self, s, size, kinematics, law, fields="summary"):
        """None: it was refused."""
        reply = s.post(self.request(size, kinematics, law))
        service.check(reply.status == 202, reply)
        if s.wait_status(reply.json["id"], "successful", "failed", seconds=120)["status"] == "failed":
            return None
        return s.get(f"/v1/jobs/{reply.json['id']}/result?fields={fields}").json

    def error(self, s, size):
        """What small deformation is off by; NaN where it has no answer itself."""
        # under the linear law auto's own answer is of small deformation, with contact that moves where that matters
        small = self.answer(s, size, "auto" if self.law == "linear" else "fixed", "linear", "summary,displacements")
        large = self.answer(s, size, "finite", "st_venant_kirchhoff" if self.law == "linear" else self.law, "summary,displacements")
        if not small or small["summary"]["outcome"] != "converged":
            return math.nan
        return off(small, large) if large and large["summary"]["outcome"] == "converged" else math.inf

    def stays(self, s, size):
        """Does auto leave it at small deformation, of a linear law without a word?"""
        found = self.answer(s, size, "auto", self.law)
        if not found:
            return False
        summary = found["summary"]
        warned = self.law == "linear" and any(one["code"] == "large_deformation" for one in summary["warnings"])
        return summary["outcome"] == "converged" and "finite" not in summary and not warned


def off(small, large):
    """The largest of displacements' mean squares, without what carries the whole body, of forces and of the energy norm."""
    u, v = (numpy.array(one["displacements"]) for one in (small, large))
    errors = [math.sqrt(((u - v) ** 2).sum() / ((v - v.mean(0)) ** 2).sum())]
    energies = [one["summary"]["energy"]["strain"] for one in (small, large)]
    if energies[1] <= 1e-15:  # nothing is strained: forces are rounding, too
        return errors[0]
    forces = [numpy.array([x["force"] for name in ("contacts", "supports") for x in one["summary"]["resultants"][name]]) for one in (small, large)]
    errors.append(numpy.sqrt(((forces[0] - forces[1]) ** 2).sum(1)).max() / numpy.sqrt((forces[1] ** 2).sum(1)).max())
    return max(*errors, abs(math.sqrt(energies[0] / energies[1]) - 1))


def load_where(ends):
    """Up to where `ends` is false, and from where on true, a hundredth apart; None: nowhere in between."""
    low, high = LEAST, 1.0
    if ends(low) or not ends(high):
        return None
    for _ in range(STEPS):
        size = math.sqrt(low * high)
        low, high = (low, size) if ends(size) else (size, high)
    return low, high


def look(s, number):
    """The row of a body."""
    one = Body(number)
    errs = load_where(lambda size: not one.error(s, size) <= TOLERABLE)
    goes = load_where(lambda size: not one.stays(s, size))
    row = {"body": one.kind.__name__, "law": one.law, "number": number, "suffices": errs and errs[0], "chosen": goes and goes[0]}
    if errs and goes:
        below, above = one.error(s, goes[0]), one.error(s, goes[0] / 0.8)
        row.update(ratio=goes[0] / errs[0], off=below, off_above=above if math.isfinite(above) else None,
                   wrong=bool(below > TOLERABLE * (1 + ROUNDING)), early=bool(above <= TOLERABLE))
    return row


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    s, rows = service.Service(sys.argv[1]), []
    try:
        s.start()
        for number in range(int(sys.argv[3]) if len(sys.argv) > 3 else BODIES):
            rows.append(look(s, number))
            print({key: f"{value:.4g}" if isinstance(value, float) else value for key, value in rows[-1].items()}, flush=True)
    finally:
        s.stop()
    told = [row for row in rows if "ratio" in row]
    wrong, early = ([row["number"] for row in told if row[which]] for which in ("wrong", "early"))
    print(f"{len(told)} of {len(rows)} bodies have both loads; wrong: {wrong}, early: {early}")
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"rows": rows}), encoding="utf-8")
    sys.exit(1 if wrong or early or len(told) < 0.9 * len(rows) else 0)


if __name__ == "__main__":
    main()
