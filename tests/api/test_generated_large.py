"""Answers of large deformation held against code of its own, a few of the generator's: `make extremes FILTER=large` has 500.
usage: test_generated_large.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import pathlib
import sys

import numpy

from service import check

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_large  # noqa: after its place is known
import service  # noqa

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


if __name__ == "__main__":
    service.main(globals())
