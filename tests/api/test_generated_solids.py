"""Estimated errors of solids, a few of the generator's: `make extremes FILTER=solids` has more of them, against finer meshes.
usage: test_generated_solids.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import pathlib
import sys

from service import check

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_solids  # noqa: after its place is known
import service  # noqa

SHARED = True
LOW = 0.6  # of the median of three


def test_estimates_of_solids(s):
    """Of smooth ones and of one with a re-entrant edge, in all elements."""
    found = generated_solids.run(s, (3, 7, 9), lambda *said, **_: None, finest=400)
    check(not found["failures"], found["failures"])
    for element, (count, median, least, largest) in generated_solids.medians(found["rows"]).items():
        check(count > 0 and generated_solids.LEAST < least and LOW <= median <= generated_solids.HIGH and largest < generated_solids.HIGH, element, median, least, largest)
    check({row["element"] for row in found["rows"]} == set(generated_solids.ELEMENTS), found["rows"])


if __name__ == "__main__":
    service.main(globals())
