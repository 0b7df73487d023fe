"""The certificate of answers from elsewhere. usage: test_verify.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import subprocess
import urllib.request

import service
from service import ENDLESS, MATRICES, SCENE, check, expect, options

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
RIGHT = {"displacements": [0.5, 2], "reactions": [-1]}  # of MATRICES


def solved(s, request):
    job = s.solved(request)
    fields = "?fields=displacements,reactions,summary"
    return expect(s.get(f"/v1/jobs/{job['id']}/result{fields}"), 200).json


def verify(s, request, answer, error=1e-6, headers=None, status=200, code=None, **more):
    body = {"problem": request["problem"], "answer": {k: answer[k] for k in ("displacements", "reactions")},
            "solver": {"accuracy": {"relative_error": error}}, **more}
    return expect(s.request("POST", "/v1/verify", body, headers), status, code)


def energy_error(a, b):
    """||a - b||_K of MATRICES, whose K is diagonal."""
    return (2 * (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5


# ---------------------------------------------------------------- verdicts

def test_a_result_fed_back_is_verified(s):
    for request in (SCENE, MATRICES):
        answer = solved(s, request)
        result = verify(s, request, answer).json
        summary = result["summary"]
        check(summary["outcome"] == "verified" and summary["method"] == "given", summary)
        check(summary["certificate"]["relative_error"] <= summary["requested_error"] == 1e-6, summary)
        check(result["reactions"] == answer["reactions"] and len(result["gaps"]) == len(answer["reactions"]), result)
        check(summary["contact"]["active"] == answer["summary"]["contact"]["active"], summary)


def test_of_few_elements_as_much_is_told_as_where_they_are_solved(s):
    """Of one hex8 half of the error was told."""
    request = {"problem": {"kind": "scene", "kinematics": "fixed", "model": "solid", "mesh": {"box": {"size": [1.5, 1, 2], "cells": [1, 1, 1], "element": "hex8"}},
                           "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "supports": [{"on": "bottom", "ux": 0, "uy": 0, "uz": 0}],
                           "loads": [{"on": "all", "body_force": [0, -2, 0]}]}}
    answer = solved(s, request)
    told, again = answer["summary"]["error"]["mesh"], verify(s, request, answer).json["summary"]
    check(told > 0.5 and abs(again["error"]["mesh"] / told - 1) < 1e-6 and again["outcome"] == "verified", told, again["error"])


def test_flat_displacements_of_a_scene(s):
    answer = solved(s, SCENE)
    flat = {**answer, "displacements": [x for point in answer["displacements"] for x in point]}
    points, numbers = (verify(s, SCENE, one).json["summary"] for one in (answer, flat))
    for field in ("outcome", "certificate", "energy", "contact"):
        check(points[field] == numbers[field], field, points, numbers)
    check(numbers["outcome"] == "verified", numbers)


def test_a_perturbed_answer_is_not(s):
    for u, r in (([0.5, 2.1], [-1]), ([0.5, 2], [-1.1]), ([0.4, 2], [-1]), ([0.6, 2], [-1]), ([0.5, 2], [1]), ([0, 0], [0])):
        result = verify(s, MATRICES, {"displacements": u, "reactions": r}, 1e-3).json
        certificate = result["summary"]["certificate"]
        check(result["summary"]["outcome"] == "not_verified", u, r, result)
        bound = certificate["absolute_error"]
        if bound is not None and u[0] <= 0.5:  # a penetrating u is repaired before it is bounded
            check(energy_error(u, [0.5, 2]) <= bound * (1 + 1e-12), u, r, certificate)
        check(abs(result["gaps"][0] - (0.5 - u[0])) < 1e-12 and result["reactions"] == r, result)


def test_the_bound_is_truthful_in_a_scene(s):
    answer = solved(s, SCENE)
    for share in (1e-5, 1e-3, 1e-1):
        u = [[x * (1 - share), y * (1 - share)] for x, y in answer["displacements"]]
        summary = verify(s, SCENE, {**answer, "displacements": u}, 1e-6).json["summary"]
        check(summary["outcome"] == "not_verified", share, summary)
        # u scaled by 1 - t is off by about t ||u||: the bound must not be below that
        check(summary["certificate"]["relative_error"] >= 0.9 * share, share, summary["certificate"])


def test_the_accuracy_decides(s):
    close = {"displacements": [0.5, 2 + 1e-5], "reactions": [-1]}
    check(verify(s, MATRICES, close, 1e-4).json["summary"]["outcome"] == "verified", "close enough")
    check(verify(s, MATRICES, close, 1e-7).json["summary"]["outcome"] == "not_verified", "not close enough")


def test_a_large_answer(s):
    """More points than jansson values would be allowed for."""
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = [320, 320]
    request["solver"] = {"accuracy": "precise"}
    job = expect(s.post(request, WAIT), 200).json["id"]
    with urllib.request.urlopen(f"http://{s.host}:{s.port}/v1/jobs/{job}/result?fields=reactions,displacements") as reply:
        answer = json.load(reply)
    result = verify(s, request, answer, 1e-7, WAIT).json
    check(result["summary"]["outcome"] == "verified", result["summary"])


# ---------------------------------------------------------------- a job like any other

def test_it_is_a_job(s):
    job = verify(s, MATRICES, RIGHT, tags=["given"]).json["job"]
    found = expect(s.get("/v1/jobs?tag=given"), 200).json["jobs"]
    check([j["id"] for j in found] == [job] and found[0]["summary"]["outcome"] == "verified", found)
    result = expect(s.get(f"/v1/jobs/{job}/result?fields=displacements,reactions,gaps"), 200).json
    check(result["displacements"] == RIGHT["displacements"], result)
    check("started_from" not in result["summary"], result)
    expect(s.request("DELETE", f"/v1/jobs/{job}"), 204)


@options("--workers", "1")
def test_it_waits_its_turn(s):
    blocking = expect(s.post(ENDLESS), 202).json["id"]
    s.wait_status(blocking, "running")
    reply = verify(s, MATRICES, RIGHT, headers={"Prefer": "wait=1"}, status=202)
    job = reply.json["id"]
    check(reply.headers["location"] == f"/v1/jobs/{job}" and reply.headers["preference-applied"] == "wait=1", reply)
    check(verify(s, MATRICES, RIGHT, headers={"Prefer": "wait=0"}, status=202).json["status"] == "accepted", "waited")
    s.restart()  # it is on disk
    expect(s.request("DELETE", f"/v1/jobs/{blocking}"), 200)
    check(s.wait_status(job, "successful")["summary"]["outcome"] == "verified", "not verified after a restart")


def test_idempotency(s):
    headers = {"Idempotency-Key": "v"}
    one = verify(s, MATRICES, RIGHT, headers=headers).json
    check(verify(s, MATRICES, RIGHT, headers=headers).json == one, "another job")
    verify(s, MATRICES, RIGHT, 1e-5, headers, 422, "idempotency_key_reused")


# ---------------------------------------------------------------- what is refused

@options()
def test_what_is_refused(s):
    for answer, code, pointer in (
            ({"displacements": [0.5], "reactions": [-1]}, "size_mismatch", "/answer/displacements"),
            ({"displacements": [0.5, 2], "reactions": []}, "size_mismatch", "/answer/reactions"),
            ({"displacements": [[0.5, 2]], "reactions": [-1]}, "size_mismatch", "/answer/displacements"),
            ({"displacements": [None, 2], "reactions": [-1]}, "wrong_type", "/answer/displacements/0")):
        check(verify(s, MATRICES, answer, status=422, code=code).json["pointer"] == pointer, answer)
    for key in ("cases", "method"):
        verify(s, MATRICES, RIGHT, status=422, code="unknown_key", **{key: []})
    expect(s.post({**MATRICES, "answer": RIGHT}), 422, "unknown_key")
    expect(s.get("/v1/verify"), 405)
    check(expect(s.get("/v1/jobs"), 200).json["jobs"] == [], "a refused request made a job")


def test_a_problem_that_cannot_be_factored(s):
    bad = {"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("1 1 2", "1 1 -2")}}
    problem = verify(s, bad, RIGHT, status=422).json
    check(problem["code"] == "not_positive_definite" and problem["pointer"] == "/problem/K", problem)


def test_displacements_against_the_supports(s):
    answer = solved(s, SCENE)
    answer["displacements"][0] = [1e-3, 0]  # node 0 is on the left, which is held
    problem = verify(s, SCENE, answer, status=422).json
    check(problem["pointer"] == "/answer/displacements" and "node 0" in problem["detail"], problem)


# ---------------------------------------------------------------- the client

def test_client(s):
    def run(answer, *words, error=1e-6):
        body = {"problem": MATRICES["problem"], "answer": answer, "solver": {"accuracy": {"relative_error": error}}}
        return subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", "verify", "-", *words],
                              input=json.dumps(body), capture_output=True, text=True, timeout=60)
    done = run(RIGHT)
    check(done.returncode == 0 and "outcome     verified" in done.stdout, done)
    check("asked for 1e-06: met" in done.stdout, done.stdout)
    done = run({"displacements": [0.5, 3], "reactions": [-1]})
    check(done.returncode == 7 and "outcome     not_verified" in done.stdout and "not met" in done.stdout, done)
    done = run(RIGHT, "--quiet")
    check(done.returncode == 0 and done.stdout == "", done)
    check(json.loads(run(RIGHT, "--json").stdout)["summary"]["outcome"] == "verified", "no JSON")
    done = run({"displacements": [0.5], "reactions": [-1]})
    check(done.returncode == 4 and "at /answer/displacements" in done.stderr, done)


if __name__ == "__main__":
    service.main(globals())
