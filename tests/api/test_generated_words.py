"""Some generated scenes in other words; python3 tests/extremes/generated_words.py has as many as are asked for."""
# not under sanitizers: answers as the optimizer has them, of all kinds of elements
import pathlib
import random
import sys

import service
from service import check

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_words  # noqa: after its place is known

SHARED = True  # one service for all tests

# What was answered otherwise in other words, or refused: forces of warmth compared (59), points in large units (102, 103), a turned press (84),
# a tie of linear and quadratic sides renumbered (126), a rigid group that was moved (215), rectangles cut along a diagonal by rounding (91047); a case that nothing holds (91041).
FOUND = [59, 84, 102, 103, 126, 215, 91041, 91047]


def look(s, numbers):
    return generated_words.run(s, numbers, lambda *said, **_: None)


def test_scenes_that_were_answered_otherwise(s):
    found = look(s, service.some(FOUND, 3))
    check(not found["failures"], found["failures"])


def test_generated_scenes(s):
    found = look(s, service.some(range(2000, 2024), 6))
    check(not found["failures"] and found["outcomes"].get("converged", 0) >= found["scenes"] / 2, found)


def test_another_scene_is_seen(s):
    """A load that is larger by a thousandth, and a support that is missing."""
    scene = next(one for one in map(generated_words.Scene, range(2000, 3000)) if one.family == "one" and one.kinematics == "fixed" and "clamp" in one.features
                 and "traction" in one.features and not one.refine and "cases" not in one.request)
    daemon, said = generated_words.Daemon(s), []
    found, _ = daemon.answers(scene.request)
    for change in ("none", "load", "support"):
        word = next(one for one in generated_words.words(scene, random.Random(1)) if one.name == "mirrored")
        if change == "load":
            load = next(one for one in word.request["problem"]["loads"] if "traction" in one)
            load["traction"] = [1.001 * t for t in load["traction"]]
        elif change == "support":
            word.request["problem"]["supports"][0].pop("ux")
        other, _ = daemon.answers(word.request)
        false = []
        if not isinstance(other, str):
            generated_words.compare(scene, word, found[None], other[None], lambda holds, *words: holds or false.append(words))
        said.append(bool(false) or isinstance(other, str))
    check(said == [False, True, True], said)


if __name__ == "__main__":
    service.main(globals())
