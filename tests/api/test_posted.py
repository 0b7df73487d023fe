"""Random small problems from all of the range of double, judged in rational numbers; and some that were once judged wrongly.
`python3 tests/extremes/posted.py BUILD` posts thousands. usage: test_posted.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import sys

import service
from service import ROOT, check

sys.path[:0] = [str(ROOT / "tests" / "extremes")]

import posted  # noqa: E402  the path is set above

SHARED = True  # one service for all tests


def test_claims_are_true(s):
    for kind, count in ("range", 120), ("hard", 60):
        tally, wrong = posted.run(s, range(count // 4 if service.INSTRUMENTED else count), 7, kind)
        check(not wrong, *wrong)
        check(tally["feasible: converged"] > 0.4 * sum(tally.values()), tally)
        check(not any(end.endswith((", right", ", possible")) for end in tally), tally)


def test_claims_that_were_once_false(s):
    """Answers beside rows that contradict each other by far less than the displacements; answers that hang on what is below
    the rounding of double-double gaps; rows of denormal entries, on which the service failed; and a radius beyond doubles."""
    ones = [34, 236, 1985, 2289, 1102, 2741, 2834, 316, 2836]
    for seed, k in [(1, k) for k in ones] + [(2, 736), (3, 1199)]:  # the last one never ended
        tally, wrong = posted.run(s, [k], seed)
        check(not wrong, *wrong)


def test_right_answers_that_were_once_left_uncertified(s):
    """Loads that dwarf the forces of strain, slabs far narrower than the rounding of u; rows so near to each other that only
    more bits tell them apart, or with entries so far apart that few bits see them contradict each other; reactions that
    are denormal, or nothing, in the units of the load; and K that no factor of doubles knows."""
    digits = [91, 228, 258, 283, 344, 560, 1357, 1663, 1868, 2084, 2142, 2320, 2643, 2819]
    units = [76, 433, 719, 848, 935, 992, 1046, 1157, 1300, 1343, 1433, 1893, 1946, 2135, 2159, 2539, 2658, 2781]
    entries = [1101, 1102, 1379, 1916, 1958, 2227, 2597, 2741]
    for kind, seed, k in [("range", 1, k) for k in digits + units + entries] + [("hard", 1, 11), ("hard", 1, 785), ("hard", 2, 33)]:
        tally, wrong = posted.run(s, [k], seed, kind)
        check(not wrong, *wrong)
        check("feasible: converged" in tally, kind, seed, k, tally)


def test_a_contradiction_far_below_the_displacements(s):
    """u_1 <= -1 and u_1 >= -1 + 1e-9 although the load moves the body by 1e90."""
    K = posted.text_of([[2 * 2.0 ** -300, 2.0 ** -300], [2.0 ** -300, 3 * 2.0 ** -300]], 2, True)
    N = posted.text_of([[1.0, 0.0], [-1.0, 0.0]], 2, False)
    for hair, outcome in (1e-9, "infeasible"), (0, "converged"):
        job = s.solve({"problem": {"kind": "matrices", "K": K, "N": N, "h": [-1, 1 - hair], "p": [1, 4]}})
        check(job["summary"]["outcome"] == outcome, hair, job)


service.main(globals())
