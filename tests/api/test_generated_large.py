"""Answers of large deformation held against code of its own, a few of the generator's: `make extremes FILTER=large` has 500.
usage: test_generated_large.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import pathlib
import random
import sys

import numpy

from service import check, some
from two_bodies import body

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_large  # noqa: after its place is known
import service  # noqa
from generated_contacts import exchanged, renumbered  # noqa

CHECKER = pathlib.Path(sys.argv[1]) / "large-checker"

SHARED = True


def test_generated_large_deformation(s):
    """All elements, models and laws; some are mirrored."""
    outcomes, scenes = {}, [generated_large.Scene(number) for number in range(24)]
    false = [said for said in (generated_large.look(s, scene.number, outcomes, CHECKER) for scene in scenes) if said]
    check(not false, false)
    check(outcomes["converged"] > 20, outcomes)
    for key, kinds in (("element", 4), ("model", 3), ("law", 3)):
        check(len({getattr(scene, key) for scene in scenes}) == kinds, key)


def test_generated_bodies_that_lean_on_their_obstacle(s):
    """A force presses them on; some roll off, and the load of some pushes them away."""
    outcomes, numbers = {}, [n for n in range(500, 540) if generated_large.Scene(n).model == "plane_strain"]
    false = [said for said in (generated_large.look(s, number, outcomes, CHECKER, True) for number in numbers) if said]
    check(not false, false)
    check(outcomes["converged"] >= len(numbers) / 2, outcomes)


def test_an_answer_that_is_off_is_seen(s):
    """By a ten-thousandth at one node away from the contact, so far that a cell is inside out, by a millionth at one on the
    obstacle, and where a force is left out."""
    scene = next(one for one in map(generated_large.Scene, range(24)) if one.pull and not one.steps)
    found = generated_large.answers(s, scene.request())[0][0]
    check(scene.wrong(found, 1, CHECKER) == [], scene.number)
    inner = max(range(len(scene.nodes)), key=lambda n: (n not in {k for side in scene.side["top"] for k in side}, scene.nodes[n][1]))
    found["displacements"][inner][0] += 1e-4
    check(any("left over" in one for one in scene.wrong(found, 1, CHECKER)), scene.wrong(found, 1, CHECKER))
    found["displacements"][inner][0] += 2 * scene.long
    check(any("inverted" in one for one in scene.wrong(found, 1, CHECKER)), scene.wrong(found, 1, CHECKER))
    found["displacements"][inner][0] -= 2 * scene.long + 1e-4
    lowest = min((n for side in scene.side["bottom"] for n in side), key=lambda n: scene.nodes[n][1] + found["displacements"][n][1] if not scene.radius else
                 numpy.hypot(scene.nodes[n][0] + found["displacements"][n][0] - scene.center, scene.nodes[n][1] + found["displacements"][n][1] + scene.radius))
    found["displacements"][lowest][1] -= 1e-6
    check(any("deep" in one for one in scene.wrong(found, 1, CHECKER)), scene.wrong(found, 1, CHECKER))
    found["displacements"][lowest][1] += 1e-6
    scene.pull = None
    check(any("left over" in one for one in scene.wrong(found, 1, CHECKER)), "the traction is not missed")


def pair(number):
    """A block on another one, which its upper side presses on it and moves along it."""
    rng = random.Random(f"pair {number}")
    solid = number % 5 == 4
    kinds = [rng.choice(("hex8", "tet4") if solid else ("quad4", "quad8", "tri3", "tri6")) for _ in range(2)]
    long, wide = rng.uniform(1.5, 3), rng.uniform(0.6, 1.2)
    left, above = rng.uniform(0, long - wide), 1 + rng.uniform(0, 0.05)
    cells = [[rng.randint(3, 6), 2], [rng.randint(2, 4), 2]]
    if solid:
        cells = [[*one, n] for one, n in zip(cells, (2, rng.randint(1, 2)))]
    places = [lambda x, y, *z: (long * x, y, *z), lambda x, y, *z: (left + wide * x, above + 0.8 * y, *(0.1 + 0.8 * t for t in z))]
    low, high = ("y0", "y1") if solid else ("bottom", "top")
    groups = {"foot": [(0, low)], "floor": [(0, high)], "sole": [(1, low)], "head": [(1, high)]}
    across = {"uz": 0} if solid else {}
    on = rng.choice((("sole", "floor"), ("floor", "sole")))
    model = "solid" if solid else rng.choice(("plane_strain", "plane_stress"))
    return body(kinds, cells, places, groups, model=model, kinematics="finite",
                materials=[{"on": "all", "young": 1, "poisson": rng.uniform(0, 0.4), "law": rng.choice(generated_large.LAWS)}],
                supports=[{"on": "foot", "ux": 0, "uy": 0, **across},
                          {"on": "head", "ux": rng.uniform(-0.6, 0.6), "uy": -rng.uniform(0.1, 0.3), **across}],
                contacts=[{"on": on[0], "with": on[1]}])


def test_images_and_numbers_change_rounding_only(s):
    """Of bodies on obstacles and of pairs: mirrored along x, their nodes, elements and sides in another order, and the other surface
    named first. Whether it has converged, and where it is."""
    said, converged = [], 0
    scenes = [one for one in map(generated_large.Scene, range(60)) if one.model != "axisymmetric" and not one.steps][:25]
    requests = [(f"body {one.number}", one.request()) for one in scenes] + [(f"pair {k}", pair(k)) for k in range(25)]
    for name, request in some(requests):
        base = generated_large.answers(s, request)[0][0]
        images = {"mirrored": (generated_large.mirrored(request), None), "renumbered": renumbered(request, random.Random(name))}
        if "with" in request["problem"]["contacts"][0]:
            images["exchanged"] = (exchanged(request), None)
        converged += base["summary"]["outcome"] == "converged"
        for how, (image, number) in images.items():
            other = generated_large.answers(s, image)[0][0]
            u = numpy.array(other["displacements"])
            u = u[number] if number else u
            u[:, 0] *= -1 if how == "mirrored" else 1
            apart = numpy.abs(u - base["displacements"]).max() / max(numpy.abs(u).max(), 1e-300)
            if other["summary"]["outcome"] != base["summary"]["outcome"] or (base["summary"]["outcome"] == "converged" and not apart < 1e-8):
                said.append(f"{name} {how}: {base['summary']['outcome']}, {other['summary']['outcome']}, apart {apart:.2g}")
    check(not said, "; ".join(said))
    check(converged > 0.75 * len(some(requests)), converged)  # others stand too deep in obstacles between nodes


if __name__ == "__main__":
    service.main(globals())
