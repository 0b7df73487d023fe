"""A body of large deformation that touches itself: a fold as two groups have it, a ring pressed flat as half of it on a plane, a strip
that faces nothing at rest, and generated ones that must not pass through themselves unsaid.
usage: test_self_contact.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import collections
import random

import numpy

import service
from service import check, some
from test_interpenetration import LAWS, answers, folded, passes_through, squeezed, told
from test_pairing import fold
from two_bodies import SOLID

SHARED = True  # one service for all tests

INNER = [{"on": "inner", "with": "inner"}]


def finite_fold(kind, contacts, law="neo_hooke", **more):
    request = fold(kind, contacts, kinematics="finite", **more)
    request["problem"]["materials"][0]["law"] = law
    return request


def only(s, request, outcome="converged"):
    (found,) = answers(s, request)
    check(found["summary"]["outcome"] == outcome, found["summary"])
    return found


def apart(one, other):
    return numpy.abs(numpy.array(one["displacements"]) - other["displacements"]).max()


def test_a_side_touches_itself_as_two_groups_do(s):
    for kind, law in some(list(zip(("quad4", "quad8", "tri6", "hex8"), LAWS + LAWS[:1]))):
        pair = only(s, finite_fold(kind, [{"on": "low", "with": "high"}], law))
        for contact in [{"on": "inner", "with": "inner"}, {"on": "high", "with": "low"}] + ([{"on": "boundary", "with": "boundary"}] if kind == "quad4" else []):
            itself = only(s, finite_fold(kind, [contact], law))
            summary = itself["summary"]
            check(summary["contact"]["reaction_sum"] < -1 and apart(itself, pair) < 1e-10, kind, law, contact, apart(itself, pair))
            check(not told(itself) and abs(summary["finite"]["least_gap"] - pair["summary"]["finite"]["least_gap"]) < 1e-9, kind, contact, summary)
            check(contact["on"] == "high" or max(map(abs, summary["resultants"]["contacts"][0]["force"])) < 1e-9, "a surface does not push itself", summary)


def test_turned_and_mirrored_folds_are_the_same(s):
    for kind in ("quad4", "hex8"):
        sums = [only(s, finite_fold(kind, INNER, turn=turn, mirror=mirror))["summary"]["contact"]["reaction_sum"]
                for turn, mirror in [(0.0, 1), (0.7, 1)] + ([(0.0, -1), (2.5, -1)] if kind == "quad4" else [])]
        check(all(abs(one / sums[0] - 1) < 1e-8 for one in sums) and sums[0] < -1, kind, sums)


def ring(kind, cells, down, half=False):
    """Crown and foot are pressed together; half of it on a plane of symmetry."""
    request = squeezed(kind, "neo_hooke", random.Random(0), cells=cells, inner=0.8, down=down, half=half)
    plane = {"on": "inner", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}
    request["problem"]["contacts"] = [plane] if half else INNER
    return request


def test_a_ring_pressed_flat_is_as_half_of_it_on_a_plane(s):
    """Rows of two surfaces and of nodes on a plane: apart by what the mesh loses."""
    for kind, cells, off in some((("quad4", (64, 3), 5e-3), ("quad8", (48, 2), 1e-3))):
        whole, half = only(s, ring(kind, cells, 0.85)), only(s, ring(kind, (cells[0] // 2, cells[1]), 0.85, half=True))
        force = [one["summary"]["resultants"]["supports"][0]["force"][1] for one in (whole, half)]
        check(abs(force[0] / force[1] - 1) < off and force[0] < -0.02, kind, force)
        check(whole["summary"]["contact"]["reaction_sum"] < -0.015 and not told(whole), kind, whole["summary"]["contact"])


def test_a_side_that_faces_nothing_at_rest(s):
    """It may come to face itself where large deformation leads it; small does not."""
    request = folded("quad4", "neo_hooke", random.Random(0), turn=3)  # pushed back, its end hardly turned
    free = answers(s, request)[0]
    request["problem"]["contacts"] = [{"on": "up", "with": "up"}]
    held = answers(s, request)
    check(apart(held[0], free) < 1e-9 and held[0]["summary"]["contact"]["candidates"] > 0, "not there yet", apart(held[0], free))
    check(held[1]["summary"]["contact"]["reaction_sum"] < 0, held[1]["summary"]["contact"])
    over = folded("quad4", "neo_hooke", random.Random(0))  # turned over: its end is held above what lies still
    over["problem"]["contacts"] = [{"on": "up", "with": "up"}]
    above = answers(s, over)[1]["summary"]
    high = over["problem"]["supports"][1]["rigid"]["uy"]
    check(above["outcome"] == "converged" and above["contact"]["reaction_sum"] == 0 and abs(above["finite"]["least_gap"] - (high - 0.3)) < 2e-3, high, above)
    small = finite_fold("quad4", [{"on": "outer", "with": "outer"}])
    small["problem"].update(kinematics="moving", materials=[{"on": "all", "young": 1000, "poisson": 0.3}])
    reply = s.post(small, {"Prefer": "wait=60"})
    said = reply.json if reply.status == 422 else reply.json["error"]
    check("faces" in said["detail"] and said["pointer"] == "/problem/contacts/0/on", said)


def test_nothing_passes_through_itself_unsaid(s):
    """Of 30 folds and rings with contact with themselves: what has converged without a warning is nowhere inside of itself by more
    than what may be left between rows."""
    said, count = [], collections.Counter()
    for k in some(range(30)):
        rng = random.Random(f"itself {k}")
        kind = rng.choice(("quad4", "quad4", "tri3", "quad8", "tri6")) if k % 10 else "hex8"
        law = rng.choice(LAWS)
        if k % 2 and kind not in SOLID:
            request = squeezed(kind, law, rng)
            request["problem"]["contacts"] = INNER
        else:
            request = finite_fold(kind, INNER, law, cells=(2 * rng.randint(10, 15) + 1, rng.randint(1, 2)),
                                  load=rng.uniform(0.5, 8), gap=rng.uniform(0.35, 0.6))
        request["solver"] = {"time_limit_s": 20}
        for answer in answers(s, request):
            deep, _ = passes_through(request["problem"]["mesh"], answer["displacements"], 0.05)
            summary = answer["summary"]
            touches = summary["contact"]["reaction_sum"] < 0
            count[summary["outcome"], touches] += 1
            if deep and summary["outcome"] == "converged" and not told(answer):
                said.append((k, kind, summary["finite"]))
    check(not said, said, count)
    check(count["converged", True] > len(some(range(30))) // 3, count)


if __name__ == "__main__":
    service.main(globals())
