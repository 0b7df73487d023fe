"""Large deformation of bodies that only obstacles or other bodies hold, pressed on by their loads: closed forms, the same bodies held by
supports, limit loads, and what is refused, has no answer, or slides off."""
# not under ThreadSanitizer: about answers, not about threads
import copy
import math

import service
from service import check, expect
from two_bodies import body

SHARED = True  # one service for all tests

ROOT = math.sqrt(0.5)
FLOOR = {"plane": {"point": [0, 0], "normal": [0, 1]}}


def block(force, law="neo_hooke", held=False, **problem):
    """A block on a plane, its left side on a plane of symmetry; held: by its bottom in place of the plane."""
    return {"problem": {"kind": "scene", "model": "plane_strain", "kinematics": "finite",
                        "mesh": {"box": {"size": [1, 1], "cells": [2, 2], "element": "quad8"}},
                        "materials": [{"on": "all", "young": 1, "poisson": 0.3, "law": law}],
                        "supports": [{"on": "left", "ux": 0}] + [{"on": "bottom", "uy": 0}] * held,
                        "contacts": [{"on": "bottom", "obstacle": FLOOR}][held:],
                        "loads": [{"on": "top", "traction": [0, -force]}], **problem}}


def answer(s, request, case=None):
    job = s.solved(request)["id"]
    return expect(s.get(f"/v1/jobs/{job}/result?fields=summary,displacements,nodes" + (f"&case={case}" if case else "")), 200).json


def converged(found, parts=1, qps=6):
    summary = found["summary"]
    check(summary["outcome"] == "converged" and summary["finite"]["definite"] and summary["finite"]["residual"] <= 1e-8, summary)
    check(summary["finite"]["steps"] == parts and summary["finite"]["qps"] <= qps, summary["finite"])
    return summary


def farthest(one, other):
    return max(math.dist(a, b) for a, b in zip(one["displacements"], other["displacements"]))


def under_a_die(force, law, kind="quad4", cells=2):
    """The block under a rigid die, which keeps its top flat and pushes with the force: the die goes up and down alone."""
    request = body((kind, kind), ((cells, cells), (1, 1)), [lambda x, y: (x, y), lambda x, y: (2.2 * x - 0.3, 1 + 0.2 * y)],
                   {"left": [(0, "left")], "bottom": [(0, "bottom")], "top": [(0, "top")], "face": [(1, "bottom")], "back": [(1, "top")]},
                   model="plane_strain", kinematics="finite", materials=block(0, law)["problem"]["materials"], loads=[{"on": "back", "traction": [0, -force / 2.2]}],
                   supports=[{"on": "left", "ux": 0}, {"on": "die", "rigid": {"point": [0.5, 1.1], "ux": 0, "rz": 0}}],
                   contacts=[{"on": "bottom", "obstacle": FLOOR}, {"on": "top", "with": "face"}])
    mesh = request["problem"]["mesh"]
    mesh["groups"]["die"] = {"elements": [len(mesh["elements"][kind]) - 1]}
    return request


def test_a_block_that_a_die_presses_on_a_plane_has_its_closed_form(s):
    for law, force in (("neo_hooke", 0.45842392), ("neo_hooke_isochoric", 0.47813424), ("st_venant_kirchhoff", 0.19615385)):
        found = answer(s, under_a_die(force, law))
        summary = converged(found)
        check(abs(min(u[1] for u in found["displacements"]) + 0.3) < 1e-7, law, found["displacements"])
        check(all(abs(one["normal_force"] - force) < 1e-8 for one in summary["resultants"]["contacts"]), summary["resultants"])


def test_a_limit_load_is_found(s):
    """Of St. Venant and Kirchhoff's law 0.21148362, of one element, which can do nothing else."""
    law = "st_venant_kirchhoff"
    below, above = (answer(s, under_a_die(force, law, cells=1)) for force in (0.2114, 0.2116))
    converged(below, qps=10)
    borne = 0.2116 * above["summary"]["finite"]["load"]
    check(above["summary"]["outcome"] == "unstable" and 0.999 * 0.21148362 < borne <= 0.21148362, above["summary"]["finite"])
    # a top that may tilt gives way before, on the plane as on its supports
    ended = [answer(s, block(0.25, law, held))["summary"] for held in (False, True)]
    check(all(one["outcome"] == "unstable" for one in ended) and ended[0]["finite"]["load"] == ended[1]["finite"]["load"], ended)
    check(abs(0.25 * ended[0]["finite"]["load"] - 0.18229828) < 2e-4, ended[0]["finite"])


def test_it_is_the_same_as_on_supports(s):
    gap = [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.25], "normal": [0, 1]}}}]
    held = answer(s, block(0.25, held=True))
    for request, down in ((block(0.25), 0), (block(0.25, contacts=gap), 0.25)):
        found = answer(s, request)
        converged(found)
        moved = {"displacements": [[u[0], u[1] + down] for u in found["displacements"]]}
        check(farthest(moved, held) < 1e-7 and abs(found["summary"]["contact"]["force"][1] - 0.25) < 1e-7, farthest(moved, held))


def mirror(found):
    return {(round(-x, 9) + 0.0, round(y, 9)): (-u, v) for (x, y), (u, v) in zip(found["nodes"], found["displacements"])}


def test_planes_alone_hold_it(s):
    """A square on its corner between two planes, without any support, under its weight: mirrored, as the scene is."""
    square = body(("quad8",), ((4, 4),), [lambda x, y: (ROOT * (x - y), ROOT * (x + y))], {"right": [(0, "bottom")], "left": [(0, "left")]},
                  model="plane_strain", kinematics="finite", materials=block(0)["problem"]["materials"], supports=[],
                  loads=[{"on": "all", "body_force": [0, -0.2]}],
                  contacts=[{"on": side, "obstacle": {"plane": {"point": [0, 0], "normal": [sign * ROOT, ROOT]}}}
                            for side, sign in (("right", -1), ("left", 1))])
    found = answer(s, square)
    check(all(abs(one["normal_force"] - 0.2 * ROOT) < 1e-8 for one in converged(found)["resultants"]["contacts"]), found["summary"])
    other = mirror(found)
    check(max(math.dist(u, other[round(x, 9) + 0.0, round(y, 9)]) for (x, y), u in zip(found["nodes"], found["displacements"])) < 1e-8)


def half_disc(weight, law="neo_hooke", **problem):
    """Of radius 1 on a plane: the square mapped to it."""
    place = lambda x, y: (x * math.sqrt(1 - (2 * y - 1) ** 2 / 2), 1 + (2 * y - 1) * math.sqrt(1 - x * x / 2))
    return body(("quad8",), ((3, 6),), [place], {"round": [(0, "right"), (0, "bottom")], "left": [(0, "left")]}, model="plane_strain",
                materials=block(0, law)["problem"]["materials"], supports=[{"on": "left", "ux": 0}],
                loads=[{"on": "all", "body_force": [0, -weight]}], contacts=[{"on": "round", "obstacle": FLOOR}],
                **{"kinematics": "finite", **problem})


def test_round_bodies_and_round_obstacles(s):
    disc = converged(answer(s, half_disc(0.1)))
    check(abs(disc["contact"]["force"][1] - 0.05 * math.pi) < 1e-4 and disc["contact"]["active"] > 3, disc["contact"])
    over = block(0.1, mesh={"box": {"size": [2, 1], "cells": [8, 4], "element": "quad8"}},
                 contacts=[{"on": "bottom", "obstacle": {"circle": {"center": [0, -2], "radius": 2}}}])
    check(abs(converged(answer(s, over))["contact"]["force"][1] - 0.2) < 1e-7)


def test_bodies_on_bodies(s):
    """Each presses the next one, and the lowest a plane; which of two sides is the finer one does not matter."""
    for cells in ((2, 2), (3, 2)), ((3, 2), (2, 2)):
        request = body(("quad8", "quad8"), cells, [lambda x, y: (x, y), lambda x, y: (0.6 * x, 1 + y)],
                       {"left": [(0, "left"), (1, "left")], "low": [(0, "bottom")], "middle": [(0, "top")], "under": [(1, "bottom")],
                        "high": [(1, "top")]}, model="plane_strain", kinematics="finite", materials=block(0)["problem"]["materials"],
                       supports=[{"on": "left", "ux": 0}], loads=[{"on": "high", "traction": [0, -0.1]}],
                       contacts=[{"on": "low", "obstacle": FLOOR}, {"on": "middle", "with": "under"}])
        summary = converged(answer(s, request))
        check(all(abs(one["force"][1] - 0.06) < 1e-8 for one in summary["resultants"]["contacts"][:1]), summary["resultants"])


def test_solids(s):
    """On a plane, two sides on planes of symmetry: uniaxial stress, by each element the same; and on a sphere."""
    cube = block(0, model="solid", mesh={"box": {"size": [1, 1, 1], "cells": [2, 2, 2], "element": "hex8"}},
                 supports=[{"on": "left", "ux": 0}, {"on": "back", "uz": 0}], loads=[{"on": "top", "traction": [0, -0.1, 0]}],
                 contacts=[{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}}])
    found = answer(s, cube)
    converged(found)
    along, across = 1 + min(u[1] for u in found["displacements"]), 1 + max(u[0] for u in found["displacements"])
    mu, lame, J = 0.5 / 1.3, 0.3 / 1.3 / 0.4, along * across ** 2  # P = mu (F - F^-T) + lambda ln J F^-T
    check(abs(mu * (along - 1 / along) + lame * math.log(J) / along + 0.1) < 1e-7, along)
    check(abs(mu * (across - 1 / across) + lame * math.log(J) / across) < 1e-7, across)
    sphere = copy.deepcopy(cube)
    sphere["problem"]["contacts"][0]["obstacle"] = {"sphere": {"center": [0, -3, 0], "radius": 3}}
    check(abs(converged(answer(s, sphere))["contact"]["force"][1] - 0.1) < 1e-7)


def refused(s, request):
    said = s.post(request, {"Prefer": "wait=60"}).json
    return said.get("error", said)


def test_what_nothing_holds_is_refused_and_named(s):
    for request, where, motion in ((block(0.1, supports=[]), "/problem/supports", "translation along x"),
                                   (block(-0.1), "/problem/loads", "translation along +y"), (block(0), "/problem/loads", "costs nothing")):
        error = refused(s, request)
        check(error["code"] == "free_body" and error["pointer"] == where and motion in error["detail"], error)
    sprung = answer(s, block(0.1, supports=[], stabilize=True))["summary"]
    check(sprung["outcome"] == "converged" and [one["code"] for one in sprung["warnings"]] == ["stabilized"], sprung)


def test_a_case_that_nothing_presses_on_has_no_answer(s):
    for cases, outcomes in (([{"name": "a", "steps": [0.5, 1, 0.25, 0]}], {"a 1": "converged", "a 3": "converged", "a": "unheld"}),
                            ([{"name": name, "loads": block(0.25 * sign)["problem"]["loads"]} for name, sign in (("down", 1), ("up", -1))],
                             {"down": "converged", "up": "unheld"})):
        request = {**block(0.25), "cases": cases}
        if len(cases) > 1:
            request["problem"].pop("loads")
        job = s.solved(request)["id"]
        for name, outcome in outcomes.items():
            found = expect(s.get(f"/v1/jobs/{job}/result?fields=summary&case={name.replace(' ', '%20')}"), 200).json["summary"]
            check(found["outcome"] == outcome, name, found)
            if outcome == "converged" and name != "down":
                check(abs(found["contact"]["force"][1] - 0.25 * found["finite"]["part"]) < 1e-7, found)


def test_a_body_that_slides_off_its_obstacle_has_a_last_load(s):
    """Half a beam on a roller: it bends until its end slides over it, under the same load however much it is to bear."""
    def beam(load):
        return block(load, mesh={"box": {"size": [10, 0.5], "cells": [20, 1], "element": "quad8"}},
                     contacts=[{"on": "bottom", "obstacle": {"circle": {"center": [8, -1], "radius": 1}}}])
    converged(answer(s, beam(1e-5)))
    ended = [answer(s, beam(load))["summary"] for load in (1e-4, 1e-3)]
    borne = [load * one["finite"]["load"] for load, one in zip((1e-4, 1e-3), ended)]
    check(all(one["outcome"] == "unstable" for one in ended) and abs(borne[0] / borne[1] - 1) < 2e-3, borne)


def test_auto_goes_on_by_itself(s):
    small, large, linear = (answer(s, half_disc(weight, law, kinematics="auto"))["summary"]
                            for weight, law in ((0.01, "neo_hooke"), (0.1, "neo_hooke"), (0.1, "linear")))
    check(small["small_deformation"]["error"] < 0.05 and small["semicoercive"]["free_modes"] == 1 and "finite" not in small, small)
    check(large["small_deformation"]["error"] > 0.05 and large["finite"]["load"] == 1, large)
    check("large_deformation" in [one["code"] for one in linear["warnings"]] and linear["semicoercive"]["free_modes"] == 1, linear)


def test_what_one_node_sets_is_no_deformation(s):
    """How far a disc comes down until its lowest node holds it is as much as ten times what its other nodes move to each other by."""
    few, some = (answer(s, half_disc(weight, "linear", kinematics="auto"))["summary"] for weight in (0.001, 0.01))
    large = answer(s, half_disc(0.001, "st_venant_kirchhoff"))
    small = answer(s, half_disc(0.001, "linear", kinematics="small"))
    apart = [[a - b for a, b in zip(u, v)] for u, v in zip(large["displacements"], small["displacements"])]
    n, down, off = len(apart), *(sum(u[1] for u in one) / len(apart) for one in (large["displacements"], apart))
    along = sum(u[0] for u in large["displacements"]) / n
    deformed = math.sqrt(sum((u - along) ** 2 + (v - down) ** 2 for u, v in large["displacements"]))
    shape = math.sqrt(sum(u ** 2 + (v - off) ** 2 for u, v in apart)) / deformed
    error = max(shape, abs(off) / math.hypot(down, deformed / math.sqrt(n)))
    check(abs(few["small_deformation"]["error"] / error - 1) < 1e-6 and 0.01 < error < 0.03, error, few["small_deformation"])
    check([["large_deformation" in [one["code"] for one in found["warnings"]], found["small_deformation"]["error"] > 0.05]
           for found in (few, some)] == [[False, False], [True, True]], few, some)


if __name__ == "__main__":
    service.main(globals())
