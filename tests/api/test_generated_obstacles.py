"""Some generated bodies on rigid obstacles, mirrored, turned and in other units; the
generator makes as many as are asked for: `tests/extremes/generated_obstacles.py BUILD OUT.json COUNT`."""
# not under ThreadSanitizer: about answers, not about threads
import pathlib
import sys

import service
from service import check

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_obstacles  # noqa: after its place is known


def test_nodes_on_ridges_and_corners(s):
    """Scenes whose answer was that of one flank, as rounding had it: another one mirrored or in other units."""
    found = generated_obstacles.run(s, [82, 205, 210, 213, 260, 355, 381, 405, 424, 535], lambda *said, **_: None, refine=False)
    check(not found["failures"], found["failures"])


def test_places_inside_sides_in_space(s):
    """Scenes whose rows inside sides were at places that followed from the order of corners, and nodes in grooves with one flank."""
    found = generated_obstacles.run(s, [41, 113, 131, 155, 173, 257, 494], lambda *said, **_: None, refine=False)
    check(not found["failures"], found["failures"])


def test_passes_that_went_back_and_forth_or_crept(s):
    """Scenes that did not settle in 30 passes."""
    daemon = generated_obstacles.contacts.Daemon(s)
    for number, how in ((30, "auto"), (334, "auto"), (470, "auto"), (575, "auto"), (300179, "auto"), (200316, "moving")):
        answer, why = daemon.answer(generated_obstacles.Scene(number).request(0, kinematics=how))
        check(answer, number, why)
        check(answer["summary"]["contact"]["geometry"]["passes"] < 30, answer["summary"]["contact"]["geometry"])


def test_overlap_that_is_not_due_to_sliding(s):
    """`auto` finds that the answer would not change where the body has moved to: sliding no longer explains the overlap."""
    answer, why = generated_obstacles.contacts.Daemon(s).answer(generated_obstacles.Scene(92).request())
    check(answer, why)
    geometry = answer["summary"]["contact"]["geometry"]
    check(geometry["kinematics"] == "fixed" and geometry["sliding"] > 0.05 and geometry["change"] < 0.05, geometry)
    check([w["code"] for w in answer["summary"]["warnings"]] == ["overlap"], answer["summary"]["warnings"])


if __name__ == "__main__":
    service.main(globals())
