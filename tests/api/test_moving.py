"""Contact that moves, through the service: what is asked for, what is told, and all that is computed from an answer."""
# not under ThreadSanitizer: about answers, not about threads
import copy

import service
from service import check, expect

SHARED = True  # one service for all tests

BUMP = {"problem": {"kind": "scene", "model": "plane_strain",
                    "mesh": {"box": {"origin": [-5, 0], "size": [10, 5], "cells": [20, 10]}},
                    "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                    "supports": [{"on": "top", "ux": 1, "uy": -0.1}],
                    "contacts": [{"on": "bottom", "obstacle": {"circle": {"center": [0, -20], "radius": 20}}}]}}


def bump(kinematics, **solver):
    body = copy.deepcopy(BUMP)
    body["problem"]["kinematics"] = kinematics
    if solver:
        body["solver"] = solver
    return body


def answer(s, body):
    job = s.post(body)
    expect(job, 202)
    check(s.wait_status(job.json["id"], "successful", "failed")["status"] == "successful", job)
    return job.json["id"], s.get(f"/v1/jobs/{job.json['id']}/result").json


def test_a_block_slid_along_a_bump(s):
    _, fixed = answer(s, bump("fixed"))
    geometry = fixed["summary"]["contact"]["geometry"]
    check(fixed["summary"]["contact"]["force"][1] > 112 and geometry["kinematics"] == "fixed", geometry)
    check(geometry["sliding"] > 0.1 and [w["code"] for w in fixed["summary"]["warnings"]] == ["coarse_mesh", "sliding"], fixed["summary"]["warnings"])
    _, small = answer(s, bump("small"))  # another word for it
    check(small["reactions"] == fixed["reactions"] and small["summary"]["contact"]["geometry"] == geometry, small["summary"]["contact"])
    for kinematics in ("moving", "auto"):
        name, moving = answer(s, bump(kinematics))
        contact = moving["summary"]["contact"]
        check(abs(contact["force"][1] - 84.1659) < 1e-3 and abs(contact["force"][0] - 0.0607) < 1e-3, contact)
        check(contact["geometry"]["kinematics"] == "moving" and 3 < contact["geometry"]["passes"] < 10, contact)
        check(contact["geometry"]["left"] <= 1e-8, contact)
        check([w["code"] for w in moving["summary"]["warnings"]] == ["coarse_mesh"], moving["summary"]["warnings"])
        check(moving["summary"]["factor"]["reused"]["factor"], moving["summary"]["factor"])
        # what is computed from the answer finds the rows again
        for of in ("result.vtu", "deformed.svg", "surface", "result?fields=contact_status,von_mises"):
            expect(s.get(f"/v1/jobs/{name}/{of}"), 200)


def test_cases_have_rows_of_their_own(s):
    """A block of 4 cells hangs by springs over a bar; one load leaves it, the other pushes it along, to other nodes."""
    nodes = [[x, y] for y in (0, 1) for x in range(13)] + [[1.1 + 1.3 * x, 1 + y] for y in (0, 1) for x in range(5)]
    quads = [[x, x + 1, x + 14, x + 13] for x in range(12)] + [[26 + x, 27 + x, 32 + x, 31 + x] for x in range(4)]
    groups = {"floor": {"nodes": list(range(13))}, "bar": {"edges": [[x, x + 1] for x in range(13, 25)]},
              "under": {"edges": [[x, x + 1] for x in range(26, 30)]}, "lid": {"edges": [[x, x + 1] for x in range(31, 35)]},
              "block": {"elements": list(range(12, 16))}}
    push = [{"on": "lid", "pressure": 1}]
    aside = [{"on": "block", "body_force": [2, 0]}]
    body = {"problem": {"kind": "scene", "model": "plane_strain", "mesh": {"nodes": nodes, "elements": {"quad4": quads}, "groups": groups},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "kinematics": "moving",
                        "supports": [{"on": "floor", "ux": 0, "uy": 0}, {"on": "lid", "spring": [0.9, 0.01]}],
                        "contacts": [{"on": "bar", "with": "under"}]},
            "cases": [{"name": "pushed", "loads": push}, {"name": "aside", "loads": push + aside}]}
    name, whole = answer(s, body)
    rows = [len(case["reactions"]) for case in whole["cases"]]
    check(len(whole["contact_nodes"]) == rows[0] and "contact_nodes" not in whole["cases"][0], rows)
    check(whole["cases"][1]["summary"]["contact"]["geometry"]["kinematics"] == "moving", whole["cases"][1]["summary"])
    check(len(whole["cases"][1]["contact_nodes"]) == rows[1] and whole["cases"][1]["contact_nodes"] != whole["contact_nodes"], rows)
    one = s.get(f"/v1/jobs/{name}/result?case=aside").json
    check(one["contact_nodes"] == whole["cases"][1]["contact_nodes"] and len(one["reactions"]) == rows[1], one)


def test_what_moves_is_not_verified(s):
    name, moving = answer(s, bump("moving"))
    vectors = s.get(f"/v1/jobs/{name}/result?fields=displacements,reactions").json
    body = bump("moving")
    body["answer"] = {"displacements": vectors["displacements"], "reactions": vectors["reactions"]}
    refused = s.request("POST", "/v1/verify", body)
    expect(refused, 422)
    check(refused.json["pointer"] == "/problem/kinematics", refused)


if __name__ == "__main__":
    service.main(globals())
