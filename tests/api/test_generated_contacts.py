"""Some generated scenes of bodies that touch, in all their variations but refined; `make extremes` looks at a thousand."""
# not under sanitizers: answers as the optimizer has them, of all kinds of elements
import pathlib
import sys

import service
from service import check

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import generated_contacts  # noqa: after its place is known

SHARED = True  # one service for all tests


def test_generated_contacts(s):
    found = generated_contacts.run(s, service.some(range(40), 4), lambda *said, **_: None, refine=False)
    check(found["scenes"] >= 10 and not found["failures"], found["failures"])


def test_a_slender_cone_of_few_faces(s):
    """It was taken for a free form: the differences of its faces' mean normals said nothing of the axis."""
    found = generated_contacts.run(s, [61], lambda *said, **_: None, refine=False)
    check(not found["failures"], found["failures"])


def test_rows_that_seem_to_hold_a_body(s):
    """Of plates on each other the rows that press hardest were all between two of them, and K with these was factored with a
    pivot that rounding had left: precision_limit, by the order of the nodes."""
    found = generated_contacts.run(s, [930052], lambda *said, **_: None, refine=False)
    check(not found["failures"], found["failures"])


def test_a_nearly_flat_cylinder(s):
    """A radius of ninety times its width was found, or taken for a free form, by which node came first."""
    found = generated_contacts.run(s, [512072], lambda *said, **_: None, refine=False)
    check(not found["failures"], found["failures"])


def test_a_certificate_whose_rows_share_many_dofs(s):
    """A ball of hex20 in one of tet10: the rational numbers of its certificate grew without end."""
    if service.INSTRUMENTED:
        raise service.Skip("three seconds of processor without a sanitizer")
    answer, why = generated_contacts.Daemon(s).answer(generated_contacts.generate(2543).request(1))
    check(answer, why)


if __name__ == "__main__":
    service.main(globals())
