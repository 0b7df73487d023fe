"""Bodies that only the obstacle holds, as a client sees them. usage: test_semicoercive.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import math
import subprocess

import service
from service import SCENE, check, expect
from two_bodies import body

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
K = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 -1\n2 2 1\n"
N = "%%MatrixMarket matrix coordinate real general\n1 2 1\n1 2 1\n"


def block(load=-0.05, **more):
    """A block on a plane with a roller at its left side: nothing but the plane holds it along y."""
    request = copy.deepcopy(SCENE)
    request["problem"].update(supports=[{"on": "left", "ux": 0}], loads=[{"on": "top", "traction": [0, load]}])
    return {**request, "solver": {}, **more}


def chain(*p):
    """Two springs' ends that nothing but one row of N holds."""
    return {"problem": {"kind": "matrices", "K": K, "N": N, "h": [0.5], "p": list(p)}, "solver": {"semidefinite": True}}


def ended(s, body, status="successful"):
    job = expect(s.post(body, WAIT), 200).json
    check(job["status"] == status, job)
    return job


def error_of(s, body):
    return ended(s, body, "failed")["error"]


# ---------------------------------------------------------------- solved

def test_a_pressed_block(s):
    summary = ended(s, block())["summary"]
    check(summary["outcome"] == "converged" and summary["certificate"]["relative_error"] <= 1e-8, summary)
    semi, force = summary["semicoercive"], summary["contact"]["force"]
    check(semi["free_modes"] == 1 and semi["held"] > 0 and 0 < len(semi["held_by_rows"]) <= 8, semi)
    scene = SCENE["problem"]
    pressed = 0.05 * scene["mesh"]["box"]["size"][0] * scene.get("thickness", 1)
    check(abs(force[0]) < 1e-6 * pressed and abs(force[1] - pressed) < 1e-6 * pressed, force)


def test_matrices(s):
    job = ended(s, chain(1, 1))
    result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions"), 200).json
    check(job["summary"]["semicoercive"]["free_modes"] == 1, job["summary"])
    for have, want in zip(result["displacements"] + result["reactions"], (1.5, 0.5, -2)):
        check(abs(have - want) < 1e-7, result)


def test_an_ordinary_body_says_nothing_of_it(s):
    check("semicoercive" not in ended(s, SCENE)["summary"], "semicoercive")


def test_rounding_holds_nothing(s):
    """Loads that sum to rounding along a free motion press on nothing, also where that rounding finds an obstacle."""
    pressed = json.loads((service.ROOT / "tests/data/scenes/held_by_rounding.json").read_text())
    plate = {"kind": "scene", "model": "plane_strain", "mesh": {"box": {"origin": [6.2, 4.64], "size": [1.8, 1], "cells": [3, 2]}},
             "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "loads": [{"on": "top", "pressure": 1}],
             "supports": [{"on": "top", "rigid": {"point": [6.2 + 1.8 / 2, 5.64], "ux": 0, "uy": 0}}],
             "contacts": [{"on": "bottom", "obstacle": {"circle": {"center": [6.2 + 1.8 / 2, 4.64 - 5.01], "radius": 5}}}]}
    for body in pressed, {"problem": plate}:
        summary = ended(s, body)["summary"]
        check(summary["outcome"] == "loose" and summary["certificate"]["relative_error"] is None, summary)
        check("may lie anywhere" in summary["message"] and summary["semicoercive"]["held"] == 0, summary)
    # what is wedged without a load is held
    wedged = {**plate, "loads": [], "supports": [{"on": "top", "normal": [0, 1], "u": 0}], "contacts": [
        {"on": side, "obstacle": {"plane": {"point": [6.2 + (0.01 if way > 0 else 1.79), 0], "normal": [way, 0]}}}
        for side, way in (("left", 1), ("right", -1))]}
    summary = ended(s, {"problem": wedged})["summary"]
    check(summary["outcome"] == "converged" and summary["contact"]["reaction_sum"] < -10, summary)


# ---------------------------------------------------------------- refused

def test_rounding_of_turned_loads_is_none(s):
    """A block on a plane, another one on it, that presses both; the lower one is pushed to its wall. Turned by an angle, what rounding left of
    that push along the way up was taken for a load, and the stack refused as not pressed on, at 63 of 72 angles."""
    forces = []
    for degrees in (0, 0.3, 45.3, 90.3, 200.3, 305.3):
        a = math.radians(degrees)
        across, up = [math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]
        request = body(["quad4", "tri3"], [(3, 1), (3, 1)], [lambda x, y, k=k: [2 * x * c + (y + k) * u for c, u in zip(across, up)] for k in (0, 1)],
                       {"wall": [(0, "left"), (1, "left")], "foot": [(0, "bottom")], "roof": [(0, "top")], "floor": [(1, "bottom")], "top": [(1, "top")],
                        "side": [(0, "right")]},
                       model="plane_strain", kinematics="fixed", materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                       supports=[{"on": "wall", "normal": across, "u": 0}],
                       loads=[{"on": "top", "pressure": 3}, {"on": "side", "traction": [-t for t in across]}],
                       contacts=[{"on": "foot", "obstacle": {"plane": {"point": [0, 0], "normal": up}}}, {"on": "floor", "with": "roof"}])
        forces.append(ended(s, request)["summary"]["contact"]["reaction_sum"])
    check(all(abs(f / forces[0] - 1) < 1e-6 for f in forces), forces)


def test_the_motion_is_named(s):
    error = error_of(s, block(0.05))
    check(error["code"] == "free_body" and error["pointer"] == "/problem/loads", error)
    check("translation along +y" in error["detail"], error)
    error = error_of(s, chain(-1, -1))
    check(error["code"] == "free_body" and error["pointer"] == "/problem/p" and "dof 0" in error["detail"], error)
    error = expect(s.post(block(problem={**block()["problem"], "contacts": []})), 422, "free_body").json
    check(error["pointer"] == "/problem/supports" and "translation along y" in error["detail"], error)


def test_what_nothing_holds_is_stabilized(s):
    """The answer of the body that a support holds, within what the springs are said to bear at most."""
    free = {"problem": {**block()["problem"], "supports": []}}
    check("or stabilize" in expect(s.post(free), 422, "free_body").json["detail"], "the error says how")
    held = ended(s, block())
    soft = ended(s, {"problem": {**free["problem"], "stabilize": True}})
    summary = soft["summary"]
    warning, = [one for one in summary["warnings"] if one["code"] == "stabilized"]
    check(0 < warning["value"] < 1e-5 and "hold what" not in warning["message"], warning)
    a, b = (expect(s.get(f"/v1/jobs/{job['id']}/result?fields=reactions"), 200).json["reactions"] for job in (held, soft))
    apart = sum(abs(x - y) for x, y in zip(a, b)) / sum(map(abs, a))
    check(0 < apart < 3 * warning["value"], apart, warning)
    springs = summary["resultants"]["supports"][-1]
    check(springs["on"] == "every outer side" and abs(springs["force"][1]) < warning["value"] * summary["contact"]["force"][1], springs)
    # what is pushed where nothing holds it is told
    pushed = {**free["problem"], "stabilize": True, "loads": [*free["problem"]["loads"], {"on": "left", "pressure": 0.01}]}
    told, = [one for one in ended(s, {"problem": pushed})["summary"]["warnings"] if one["code"] == "stabilized"]
    check(told["value"] > 0.01 and "hold what is pushed" in told["message"], told)


def test_stabilized_bodies_of_each_kind(s):
    mesh = {"nodes": [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], "elements": {"hex8": [[0, 1, 3, 2, 4, 5, 7, 6]]},
            "groups": {"low": {"faces": [[0, 1, 3, 2]]}, "high": {"faces": [[4, 5, 7, 6]]}}}
    ring, solid = ({"kind": "scene", "model": model, "stabilize": True, "mesh": {"box": {"size": size, "cells": [4] * len(size)}},
                    "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "supports": [], "loads": [{"on": "top", "pressure": 1}],
                    "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0] * len(size), "normal": [0, 1, 0][:len(size)]}}}]}
                   for model, size in (("axisymmetric", [3, 1]), ("solid", [2, 1, 2])))
    given = {**solid, "mesh": mesh, "loads": [{"on": "high", "pressure": 1}],
             "contacts": [{"on": "low", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}],
             "materials": [{"on": "all", "orthotropic": {"young": [1000, 500, 800], "poisson": [0.2] * 3, "shear": [300] * 3}}]}
    for problem, force in ((ring, math.pi * 9), (solid, 4), (given, 1)):
        summary = ended(s, {"problem": problem})["summary"]
        value, = [one["value"] for one in summary["warnings"] if one["code"] == "stabilized"]
        check(summary["outcome"] == "converged" and 0 < value < 1e-5 and abs(max(summary["contact"]["force"]) / force - 1) <= value, value, summary["contact"])


def test_a_case_that_nothing_presses_on(s):
    """It has no answer, and takes none from the others; where the mesh is refined, too. Where it is alone it is refused."""
    loads = {"pressed": block(-0.05), "lifted": block(0.05), "none": block(0), "harder": block(-0.1)}
    cases = [{"name": name, "loads": one["problem"]["loads"] if name != "none" else []} for name, one in loads.items()]
    for mesh in {}, {"refine": "auto"}:
        request = block(cases=cases)
        request["problem"]["mesh"].update(mesh)
        job = ended(s, request)
        counts = job["summary"]["cases"]
        check(job["summary"]["outcome"] == "unheld" and counts["converged"] == counts["unheld"] == 2 and counts["worst"] == "lifted", counts)
        for name in "pressed", "harder":
            of = expect(s.get(f"/v1/jobs/{job['id']}/result?case={name}&fields=displacements,reactions"), 200).json
            check(of["summary"]["outcome"] == "converged" and None not in of["reactions"], of["summary"])
            alone = block(cases=[cases[0 if name == "pressed" else 3]])
            alone["problem"]["mesh"].update(mesh)
            check(math.isclose(ended(s, alone)["summary"]["contact"]["force"][1], of["summary"]["contact"]["force"][1], rel_tol=1e-7), name)
        of = expect(s.get(f"/v1/jobs/{job['id']}/result?case=lifted&fields=displacements"), 200).json
        for picture in "deformed.svg", "surface":
            expect(s.get(f"/v1/jobs/{job['id']}/{picture}?case=lifted"), 409, "no_result")
        check("along +y" in of["summary"]["message"] and set(sum(of["displacements"], [])) == {None}, of["summary"])
    check(error_of(s, block(cases=cases[1:3]))["pointer"] == "/cases/0/loads")
    springs = chain(1, 1)
    job = ended(s, {**springs, "cases": [{"name": "on", "p": [1, 1]}, {"name": "off", "p": [-1, -1]}]})
    check(job["summary"]["cases"]["converged"] == job["summary"]["cases"]["unheld"] == 1, job)


def test_it_cannot_be_verified(s):
    for body in block(), chain(1, 1):
        job = ended(s, body)["id"]
        result = expect(s.get(f"/v1/jobs/{job}/result?fields=displacements,reactions"), 200).json
        answer = {field: result[field] for field in ("displacements", "reactions")}
        reply = expect(s.request("POST", "/v1/verify", {"problem": body["problem"], "answer": answer}, WAIT), 422).json
        check("verified only where the supports alone hold the body" in reply["detail"], reply)


# ---------------------------------------------------------------- starts

def test_where_it_began_is_true(s):
    """Its rounds begin at zero whatever was given, and the summary and the history say so."""
    first = ended(s, block())["id"]
    warm = ended(s, block(solver={"warm_start": {"job": first}}))
    check(warm["summary"]["started_from"] == "zero", warm["summary"])
    refined = expect(s.request("POST", f"/v1/jobs/{first}/refine", {"accuracy": "exact"}, WAIT), 200).json
    check(refined["status"] == "successful" and refined["summary"]["started_from"] == "zero", refined)
    whole = ended(s, block(solver={"accuracy": "exact"}))["id"]
    rows = [[row[0] for row in expect(s.get(f"/v1/jobs/{job}/history"), 200).json["rows"]] for job in (refined["id"], whole)]
    check(rows[0] == rows[1], rows)


# ---------------------------------------------------------------- the client

def client(s, *words, text=None):
    return subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", *words],
                          input=text, capture_output=True, text=True, timeout=60)


def test_client(s):
    done = client(s, "submit", "-", "--wait", text=json.dumps(block()))
    check(done.returncode == 0 and "only the obstacle holds it: 1 free motion" in done.stdout, done)
    done = client(s, "submit", "-", "--wait", text=json.dumps(block(0.05)))
    check(done.returncode == 6 and "translation along +y" in done.stderr and "/problem/loads" in done.stderr, done)


def test_client_without_a_factor(s):
    body = {**copy.deepcopy(SCENE), "solver": {"operator": "matrix_free"}}
    done = client(s, "submit", "-", "--wait", text=json.dumps(body))
    check(done.returncode == 0 and "none: coarse levels of" in done.stdout and "0 entries" not in done.stdout, done)


def test_client_names_its_own_option(s):
    loads = [{"name": "a", "loads": []}, {"name": "b", "loads": block()["problem"]["loads"]}]
    done = client(s, "submit", "-", "--wait", "--quiet", text=json.dumps({**copy.deepcopy(SCENE), "cases": loads}))
    done = client(s, "history", done.stdout.strip())
    check(done.returncode == 4 and "--case NAME" in done.stderr and '"b"' in done.stderr, done)


if __name__ == "__main__":
    service.main(globals())
