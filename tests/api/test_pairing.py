"""Which sides of a contact touch each other: lists of groups, a side with itself, and never a body's own back."""
# not under ThreadSanitizer: about answers, not about threads
import math

import service
from service import check, expect
from two_bodies import SOLID, body

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=120"}


def answer_of(s, request):
    job = s.solved(request, "converged")
    return expect(s.get(f"/v1/jobs/{job['id']}/result?fields=pressure,reactions,displacements"), 200).json


def codes(answer):
    return {w["code"] for w in answer["summary"].get("warnings", [])}


def apart(a, b):
    return max(abs(x - y) for p, q in zip(a["displacements"], b["displacements"]) for x, y in zip(p, q))


def plates(kind, contacts, cells=((5, 1), (7, 1), (4, 1)), thick=1.0):
    """Plates that lie on each other under a pressure of 1; groups of all bottoms and tops, and b0, t0, b1, ... of each."""
    solid, n = kind in SOLID, len(cells)
    names = ("z0", "z1", "x0") if solid else ("bottom", "top", "left")

    def place(k):
        return (lambda x, y, z: (4 * x, 4 * y, thick * (k + z))) if solid else (lambda x, y: (10 * x, thick * (k + y)))
    groups = {"bottoms": [(k, names[0]) for k in range(n)], "tops": [(k, names[1]) for k in range(n)],
              "x": [(k, names[2]) for k in range(n)], **{f"b{k}": [(k, names[0])] for k in range(n)},
              **{f"t{k}": [(k, names[1])] for k in range(n)}}
    if solid:
        groups["y"] = [(k, "y0") for k in range(n)]
    return body([kind] * n, [(c[0], c[0], c[1]) if solid else c for c in cells], [place(k) for k in range(n)], groups,
                model="solid" if solid else "plane_strain", materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                supports=[{"on": "b0", "uz" if solid else "uy": 0}, {"on": "x", "ux": 0}] + ([{"on": "y", "uy": 0}] if solid else []),
                loads=[{"on": f"t{n - 1}", "pressure": 1}], contacts=contacts)


def fold(kind, contacts, cells=(31, 2), uneven=0.05, turn=0.0, mirror=1, depth=2, load=2.0, gap=0.4, **scene):
    """A strip bent back over itself with a gap, pressed together from above: `inner` faces itself; its halves but for the
    bend are `low` and `high`. turn: of the whole scene in the plane of the strip."""
    radius, thick, arm, solid = gap / 2, 0.5, 4.0, kind in SOLID
    total = 2 * arm + math.pi * radius

    def place(x, *t):
        s, d = total * (x + uneven * math.sin(2 * math.pi * x)), thick * t[-1]
        if s < arm:
            p = (arm - s, radius + thick - d)
        elif s > total - arm:
            p = (s - (total - arm), d - radius - thick)
        else:
            a, r = (s - arm) / radius, radius + thick - d
            p = (-r * math.sin(a), r * math.cos(a))
        p = (mirror * (math.cos(turn) * p[0] - math.sin(turn) * p[1]), math.sin(turn) * p[0] + math.cos(turn) * p[1])
        return (p[0], t[0], p[1]) if solid else p
    inner, outer = ("z1", "z0") if solid else ("top", "bottom")
    request = body([kind], [(cells[0], 1, cells[1]) if solid else cells], [place], {"inner": [(0, inner)], "outer": [(0, outer)]},
                   model="solid" if solid else "plane_strain", materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                   contacts=contacts, **scene)
    mesh = request["problem"]["mesh"]
    key = "faces" if solid else "edges"
    if mirror < 0:  # of a mirrored mesh nodes go round the other way
        turned = {"quad4": lambda e: [e[0], e[3], e[2], e[1]], "tri3": lambda e: [e[0], e[2], e[1]]}[kind]
        mesh["elements"][kind] = [turned(e) for e in mesh["elements"][kind]]

    def of(group, begin, end):
        sides = mesh["groups"][group][key]
        along = len(sides) // cells[0]
        return {key: sides[begin * along:end * along if end else None]}
    middle, third = cells[0] // 2, cells[0] // 3
    mesh["groups"].update(low=of("inner", 0, middle), high=of("inner", middle + 1, 0), held=of("outer", 0, third),
                          pushed=of("outer", cells[0] - third, 0))
    request["problem"].update(supports=[{"on": "held", **{u: 0 for u in (("ux", "uy", "uz") if solid else ("ux", "uy"))}}],
                              loads=[{"on": "pushed", "pressure": load}])
    return request


def test_plates_do_not_touch_their_own_backs(s):
    """Two plates of quad4 gave 10,989 where 10 acts, as each bottom met its own top."""
    for kind, n in (("quad4", 2), ("quad4", 3), ("tri6", 3), ("hex8", 2), ("tet4", 3)):
        for on, other in (("bottoms", "tops"), ("tops", "bottoms"), ("boundary", "boundary")):
            a = answer_of(s, plates(kind, [{"on": on, "with": other}], ((3, 1), (4, 1), (2, 1))[:n]))
            check(all(abs(p - 1) < 1e-10 for p in a["pressure"]) and not codes(a), kind, n, on, codes(a))
    a = answer_of(s, plates("quad4", [{"on": "bottoms", "with": "tops", "discretization": "nodes"}]))
    allowed = {"nodes_against_faces", "overlap", "coarse_mesh"}
    check(abs(a["summary"]["contact"]["reaction_sum"] + 20) < 1e-9 and codes(a) <= allowed, codes(a))


def test_plates_thinner_than_their_sides(s):
    """The nearest layer alone counts, although all of them are within a side's size."""
    for kind in ("quad4", "hex8"):
        a = answer_of(s, plates(kind, [{"on": "bottoms", "with": "tops"}], ((3, 1), (4, 1), (2, 1)), thick=0.1))
        check(all(abs(p - 1) < 1e-9 for p in a["pressure"]), kind, min(a["pressure"]), max(a["pressure"]))


def test_lists_are_the_pairs_that_they_hold(s):
    pairs = answer_of(s, plates("quad4", [{"on": "b1", "with": "t0"}, {"on": "b2", "with": "t1"}]))
    lists = [plates("quad4", [{"on": on, "with": other}]) for on, other in
             ((["b1", "b2"], ["t0", "t1"]), (["b2", "b1"], ["t1", "t0"]), (["t1", "t0"], ["b1", "b2"]),
              (["b1", "t0", "b2", "t1"], ["b1", "t0", "b2", "t1"]), (["tops", "b1"], ["bottoms", "t0"]))]
    answers = [answer_of(s, request) for request in lists]
    for a in answers:
        check(apart(a, pairs) < 1e-14 and len(a["reactions"]) == len(pairs["reactions"]), apart(a, pairs))
    check(answers[0]["displacements"] == answers[1]["displacements"])
    names = [a["summary"]["resultants"]["contacts"][0]["on"] for a in answers[:3]]
    check(names == ["b1 + b2", "b1 + b2", "t0 + t1"], names)
    forces = [a["summary"]["resultants"]["contacts"][0]["force"][1] for a in answers]
    check(all(abs(f - want) < 1e-9 for f, want in zip(forces, (20, 20, -20, 0))), forces)


def test_long_lists_have_names_of_their_own(s):
    """Of the same beginning, cut to what a name may have."""
    one = [f"{c}{k}" for k in range(3) for c in "bt"]
    request = plates("quad4", [{"on": "bottoms", "with": "tops"}])
    groups = request["problem"]["mesh"]["groups"]
    long = "the_bottom_or_the_top_of_a_plate_"
    groups.update({long + k: groups[k] for k in one})
    request["problem"]["contacts"] = [{"on": [long + "b1", long + "b2"], "with": [long + "t0", long + "t1"]}]
    a = answer_of(s, request)
    check(all(abs(p - 1) < 1e-10 for p in a["pressure"]))
    surfaces = [x["group"] for x in a["summary"]["contact"]["surfaces"]]
    check(surfaces[0] != surfaces[1] and all(len(x) < 64 and "#" in x for x in surfaces), surfaces)


def test_a_side_touches_itself_as_two_groups_do(s):
    for kind in service.some(("quad4", "tri6", "quad8", "hex8")):
        for way in ("fixed", "moving"):
            for rows in ("surfaces", "nodes"):
                if kind in ("tri6", "hex8") and rows == "nodes":
                    continue
                extra = {"discretization": rows}
                asked = [{"on": "inner", "with": "inner"}, {"on": "low", "with": "high"}, {"on": "high", "with": "low"},
                         {"on": "boundary", "with": "inner"}]
                answers = [answer_of(s, fold(kind, [{**c, **extra}], kinematics=way)) for c in asked]
                sums = [a["summary"]["contact"]["reaction_sum"] for a in answers]
                check(sums[0] < -1 and answers[0]["summary"]["contact"]["geometric_penetration"] < 5e-3, kind, way, extra, sums)
                if rows == "surfaces":  # the bend is far from touching; passes end at 1e-8
                    check(all(apart(a, answers[0]) < (1e-9 if way == "fixed" else 1e-6) for a in answers[1:]), kind, way, extra, [apart(a, answers[0]) for a in answers])
                else:  # which nodes are slaves differs
                    check(all(abs(x / sums[0] - 1) < 5e-3 for x in sums), kind, way, extra, sums)
                check(not codes(answers[0]) & {"overlap", "deep_overlap"}, kind, way, extra, codes(answers[0]))
                force = answers[0]["summary"]["resultants"]["contacts"][0]["force"]
                check(max(map(abs, force)) < 1e-9, "a surface does not push itself", force)


def test_arms_are_no_contact_of_the_bend(s):
    """Sides of the bend that an arm covers in part had rows whose gaps were extended to zero: 15 % too much force, and no end."""
    asked = [fold("hex20", [{"on": on, "with": other, "smooth": False}], kinematics="moving", cells=(31, 1), gap=0.515, load=2.5)
             for on, other in (("inner", "inner"), ("low", "high"))]
    asked += [fold("tet10", [{"on": on, "with": other, "smooth": False}], kinematics="fixed", cells=(21, 2), uneven=0.026, gap=0.2883,
                   load=1.3623) for on, other in (("inner", "inner"), ("low", "high"))]  # -8.72 for -2.88
    sums = [answer_of(s, request)["summary"]["contact"]["reaction_sum"] for request in asked]
    check(abs(sums[0] / sums[1] - 1) < 1e-6 and sums[0] < -1, sums)
    check(abs(sums[2] / sums[3] - 1) < 1e-6 and sums[2] < -1, sums)


def test_bends_that_no_quadric_follows(s):
    """Of few sides from an arm into its bend and on: the quadrics through their nodes were up to 400,000 lengths off the sides."""
    for cells, force in service.some(((31, -4.351), (51, -4.553), (81, -4.605))):
        answer = answer_of(s, fold("hex8", [{"on": "inner", "with": "inner"}], cells=(cells, 2), kinematics="fixed"))
        check(abs(answer["summary"]["contact"]["reaction_sum"] / force - 1) < 0.01, cells, answer["summary"]["contact"])
        check("free_form" in codes(answer), cells, codes(answer))


def test_answers_of_folds_are_refined(s):
    """Where contact has moved there are other rows than the body has at rest, where whoever goes on begins."""
    for way in ("fixed", "moving"):
        request = fold("quad4", [{"on": "inner", "with": "inner"}], kinematics=way)
        request["solver"] = {"method": "accelerated_restart", "accuracy": {"relative_error": 1e-2}}
        first = expect(s.post(request, WAIT), 200).json
        refined = expect(s.request("POST", f"/v1/jobs/{first['id']}/refine", {"accuracy": {"relative_error": 1e-9}}, WAIT), 200).json
        request["solver"]["accuracy"]["relative_error"] = 1e-9
        whole = answer_of(s, request)["summary"]
        check(refined["status"] == "successful" and refined["summary"]["outcome"] == "converged", way, refined)
        check(refined["summary"]["started_from"] == ("continued" if way == "fixed" else "warm"), way, refined)
        sums = [one["contact"]["reaction_sum"] for one in (first["summary"], refined["summary"], whole)]
        check(abs(sums[1] / sums[2] - 1) < 1e-8 < abs(sums[0] / sums[2] - 1), way, sums)


def test_turned_and_mirrored_folds_are_the_same(s):
    for kind, contact in (("quad4", {"on": "inner", "with": "inner"}), ("tri3", {"on": "boundary", "with": "boundary"})):
        a = answer_of(s, fold(kind, [contact]))["summary"]["contact"]["reaction_sum"]
        for turn, mirror in ((0.7, 1), (0.0, -1), (2.5, -1)):
            b = answer_of(s, fold(kind, [contact], turn=turn, mirror=mirror))["summary"]["contact"]["reaction_sum"]
            check(abs(b / a - 1) < 1e-10, kind, turn, mirror, a, b)


def test_what_does_not_close_has_no_force(s):
    for way in ("fixed", "moving"):
        for rows in ("surfaces", "nodes"):
            a = answer_of(s, fold("quad4", [{"on": "boundary", "with": "boundary", "discretization": rows}], load=-2.0, kinematics=way))
            check(max(map(abs, a["reactions"])) == 0 and a["summary"]["contact"]["active"] == 0, way, rows, a["summary"]["contact"])


def test_arms_that_overlap_are_pushed_apart(s):
    """At rest the arms stand 0.02 in each other: no back is deep enough to be taken for that, nor that for a back."""
    def closed(contact):
        request = fold("quad4", [contact], load=0.0)
        mesh = request["problem"]["mesh"]
        low = {k for e in mesh["groups"]["high"]["edges"] for k in e}
        for k, x in enumerate(mesh["nodes"]):  # the free arm is bent towards the other one
            if x[0] > 0 and x[1] < 0:
                x[1] += 0.42 * x[0] / 4
        check(low)
        return answer_of(s, request)
    a, b = closed({"on": "inner", "with": "inner"}), closed({"on": "low", "with": "high"})
    check(a["summary"]["contact"]["reaction_sum"] < -1e-3 and apart(a, b) < 1e-10, apart(a, b), a["summary"]["contact"])
    check(a["summary"]["contact"]["geometric_penetration"] < 1e-3, a["summary"]["contact"])


def test_what_is_named_twice_or_not_at_all_is_refused(s):
    def refused(contacts, *words, **groups):
        request = plates("quad4", contacts)
        request["problem"]["mesh"]["groups"].update(groups)
        reply = s.post(request, WAIT)
        said = str(reply.json)
        check((reply.status == 422 or reply.json["status"] == "failed") and all(w in said for w in words), said)

    refused([{"on": "b1", "with": "t0"}, {"on": "t0", "with": "b1"}], "/contacts/1", "contact 0", "once")
    refused([{"on": "tops", "with": "bottoms"}, {"on": "b2", "with": "t1"}], "/contacts/1", "tops", "once")
    refused([{"on": "b1", "with": "t0"}, {"on": "x", "with": "x"}, {"on": ["b1", "b2"], "with": ["t0", "t1"]}], "/contacts/2", "contact 0")
    refused([{"on": ["b1", "b9"], "with": "t0"}], "/contacts/0/on", "b9")
    refused([{"on": "b1", "with": ["t0", "all"]}], "/contacts/0/with", "all", "edges")
    refused([{"on": [], "with": "t0"}], "/contacts/0/on")
    refused([{"on": ["b1", 2], "with": "t0"}], "/contacts/0/on/1")
    refused([{"on": "b1", "with": "b1"}], "/contacts/0/on", "faces")
    refused([{"on": ["b1", "b2"], "with": "t0"}], "another name", **{"b1 + b2": {"edges": [[0, 1]]}})


def test_obstacles_take_lists_too(s):
    def box(*on):
        return {"problem": {"kind": "scene", "model": "plane_strain", "mesh": {"box": {"size": [4, 2], "cells": [4, 2]}},
                            "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                            "supports": [{"on": "right", "ux": 0}, {"on": "top", "uy": -0.01}],
                            "contacts": [{"on": o, "obstacle": {"circle": {"center": [-1, -1.01], "radius": 1.6}}}
                                         for o in on]}}
    both = answer_of(s, box(["bottom", "left"]))
    check(abs(both["summary"]["contact"]["reaction_sum"]) > 1e-3, both["summary"]["contact"])
    check(s.post(box(["bottom", "middle"])).status == 422)


if __name__ == "__main__":
    service.main(globals())
