"""The memory that one solve may take: what does not fit with a factor goes on without one, what fits in no form is
refused, and the daemon lives through both. usage: test_memory.py BUILD_DIR [FILTER]
"""
# not under ThreadSanitizer: about answers, not about threads
# in the ordinary build too: a sanitizer has a heap of its own
import contextlib
import copy
import http.client
import itertools
import os
import pathlib
import random
import re
import threading
import time

import service
from service import INSTRUMENTED, MATRICES, PATIENT_S, SCENE, Skip, check, expect, options


def plate(cells, **solver):
    body = copy.deepcopy(SCENE)
    body["problem"]["mesh"]["box"]["cells"] = cells
    body["solver"] = {"accuracy": {"relative_error": 1e-8}, **solver}
    return body


def forms(summary):
    return {form["operator"]: form for form in summary["cost"]["considered"]}


def failed(s, body):
    job = s.solve(body)
    check(job["status"] == "failed", job)
    return job["error"]


@options("--memory", "10M")
def test_factor_does_not_fit(s):
    job = s.solve(plate([120, 40]))
    check(job["status"] == "successful", job)
    summary = job["summary"]
    check(summary["outcome"] == "converged" and summary["operator"] == "matrix_free", summary)
    check(summary["certificate"]["relative_error"] <= 1e-8, summary["certificate"])
    check(abs(summary["contact"]["reaction_sum"] + 10.54546589) < 1e-6, summary["contact"])
    check(summary["contact"]["active"] == 88, summary["contact"])
    considered = forms(summary)
    check(considered["matrix_free"]["fits"] and not considered["condensed"]["fits"], considered)
    check(considered["condensed"]["bytes"] > 10 << 20 >= summary["cost"]["actual"]["bytes"], summary["cost"])
    # What is small keeps its factor.
    check(s.solve(plate([30, 10]))["summary"]["operator"] == "condensed")


@options("--memory", "10M")
def test_no_form_fits(s):
    for body in plate([240, 80]), plate([2000, 2000]), plate([120, 40], operator="condensed"):
        error = failed(s, body)
        check(error["pointer"].startswith("/problem/mesh") and "--memory" in error["detail"], error)
        check(error["code"] == "memory_limit" and "bytes" in error["detail"], error)
    check("matrix_free" in failed(s, plate([120, 40], operator="condensed"))["detail"])
    expect(s.get("/healthz"), 200)
    check(s.solve(plate([30, 10]))["status"] == "successful")


def test_by_name(s):
    job = s.solve(plate([60, 20], operator="matrix_free"))
    summary = job["summary"]
    check(summary["outcome"] == "converged" and summary["operator"] == "matrix_free", summary)
    check(list(forms(summary)) == ["matrix_free"], summary["cost"])
    cost = s.solve(plate([60, 20]))["summary"]["cost"]
    check(cost["predicted"]["seconds"] > 0 and cost["predicted"]["flops"] > 0, cost)
    check(cost["predicted"]["bytes"] >= cost["actual"]["bytes"] > 0, cost)
    # The reply says the same of the body once it is cached, but for the setup that was spared.
    again = s.solve(plate([60, 20]))["summary"]["cost"]
    check(again["predicted"]["bytes"] == cost["predicted"]["bytes"], again)
    check(again["predicted"]["seconds"] < cost["predicted"]["seconds"], cost, again)


@options("--workers", "1")
def test_predicted_seconds_follow_what_jobs_took(s):
    body = plate([600, 200], operator="matrix_free")
    model = expect(s.post(body, query="?validate=true"), 200).json["predicted"]["seconds"]
    costs = [s.solve(body)["summary"]["cost"] for _ in range(4)]
    check(min(cost["actual"]["seconds"] for cost in costs) >= 0.05, "too short to count", costs)
    check(costs[1]["predicted"] == costs[2]["predicted"], costs)  # of two jobs nothing is learned
    pace = min(4, max(1 / 4, sorted(ratios(costs[:3]))[1]))
    check(abs(costs[3]["predicted"]["seconds"] - pace * costs[2]["predicted"]["seconds"]) <= 1e-6 * costs[3]["predicted"]["seconds"], costs)
    (only,) = costs[3]["considered"]
    check(only["seconds"] == costs[3]["predicted"]["seconds"], costs)
    counted = [max(1 / 4, min(4, ratio)) for ratio in ratios(costs[:3] + [{**costs[3], "predicted": costs[2]["predicted"]}])]
    later = expect(s.post(body, query="?validate=true"), 200).json["predicted"]["seconds"]
    check(min(counted) * model / 2 < later < 2 * max(counted) * model, later, model, counted)  # its process measures rates anew


def ratios(costs):
    return [cost["actual"]["seconds"] / cost["predicted"]["seconds"] for cost in costs]


def free_memory_held(s):
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("RssAnon")) / 1024


@options("--workers", "1")
def test_a_short_text_of_many_parts(s):
    """Each of its contacts may touch all of the boundary: rows by the million. They are made where memory has a bound,
    not in the daemon, and what they tell of the request is told there."""
    def most():
        return int(re.search(r"VmHWM:\s*(\d+) kB", pathlib.Path(f"/proc/{s.process.pid}/status").read_text())[1]) >> 10
    body = {"problem": {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [10, 10, 1], "cells": [60, 60, 1]}},
                        "materials": [{"on": "all", "young": 5, "poisson": 0.3}],
                        "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}],
                        "loads": [{"on": "top", "pressure": 0.1}],
                        "contacts": [{"on": "boundary", "obstacle": {"sphere": {"center": [0, 0, -9 - k], "radius": 5}}}
                                     for k in range(200)]},
            "solver": {"warm_start": {"reactions": [0.0] * 5}}}
    before = most()
    job = s.post(body, {"Prefer": "wait=60"})
    check(most() < before + 50, "MB of the daemon", before, most())
    check(job.status == 200 and job.json["error"]["code"] == "size_mismatch", job)


@options("--workers", "1")
def test_large_requests_leave_nothing_behind(s):
    """What a request took is given back, whichever thread and so whichever arena of the heap it was in."""
    if INSTRUMENTED:
        raise Skip("the sanitizer has a heap of its own")
    body = {**MATRICES, "problem": {**MATRICES["problem"], "h": [0.5] * 400000}}  # refused once it is read
    s.solve(MATRICES)
    before = free_memory_held(s)
    connections = [http.client.HTTPConnection(s.host, s.port, timeout=60) for _ in range(40)]
    replies = []

    def post(connection):
        text = service.json.dumps(body)
        connection.request("POST", "/v1/jobs", text, {"Content-Type": "application/json"})
        reply = connection.getresponse()
        replies.append((reply.status, reply.read()))
    for one in connections:  # so that each has a thread, and its arena
        one.connect()
    for _ in range(2):
        threads = [threading.Thread(target=post, args=(one,)) for one in connections]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    check({status for status, _ in replies} <= {422, 503}, replies[0])
    grown = free_memory_held(s) - before
    for one in connections:
        one.close()
    check(grown < 64, grown)


def page_faults(s):
    """Of the process that solves."""
    if not s.solvers():
        s.solve(MATRICES)
    with open(f"/proc/{s.solvers()[0]}/stat", encoding="ascii") as file:
        return int(file.read().rsplit(")", 1)[1].split()[7])


def memory_shared(s):
    """MiB that the daemon and its processes have in common."""
    folder, blocks = f"/proc/{s.process.pid}/fd", 0
    for fd in os.listdir(folder):
        with contextlib.suppress(FileNotFoundError):  # it was closed just now
            if "memfd" in os.readlink(f"{folder}/{fd}"):
                blocks += os.stat(f"{folder}/{fd}").st_blocks
    return blocks * 512 / 2 ** 20


@options("--workers", "1", "--cache", "128M")
def test_the_next_body_lands_on_memory_that_is_there(s):
    if INSTRUMENTED:
        raise Skip("the sanitizer has a heap of its own")
    faults = []
    for k in range(7):
        before = page_faults(s)
        job = s.solve(plate([300 + k, 100], operator="condensed"))
        check(job["status"] == "successful" and not job["summary"]["factor"]["cached"], job)
        faults.append(page_faults(s) - before)
        time.sleep(1.2)  # for the housekeeper
        s.settle()
    check(faults[0] > 2000, faults)
    check(sorted(faults[-4:])[1] < faults[0] / 4, faults)
    # So does the next answer; what is shared goes once none follows.
    body, tries = plate([420, 140], operator="condensed"), 0
    s.solve(body)
    while memory_shared(s) < 1.5:  # unless it took so long to look that it has gone
        tries += 1
        check(tries < 5, memory_shared(s))
        s.solve(body)
    end = time.monotonic() + PATIENT_S
    while memory_shared(s) > 1.2:
        check(time.monotonic() < end, memory_shared(s))
        time.sleep(0.2)


def cube(n):
    return {"problem": {"kind": "scene", "model": "solid", "kinematics": "fixed",  # nothing to compare with
                        "mesh": {"box": {"origin": [0, 0, -1], "size": [1, 1, 1], "cells": [n, n, n], "element": "hex8"}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": 0}],
                        "contacts": [{"on": "front", "obstacle": {"sphere": {"center": [0.5, 0.5, 1.98], "radius": 2}}}]},
            "solver": {"accuracy": {"relative_error": 1e-6}}}


def crumbly_cube(n):
    """Tetrahedra, six to a cell, every other one of which is nearly nothing, by chance."""
    def node(*at):
        return at[0] + (n + 1) * (at[1] + (n + 1) * at[2])
    nodes = [[x / n, y / n, z / n - 1] for z in range(n + 1) for y in range(n + 1) for x in range(n + 1)]
    elements, sides = [], {"back": [], "front": []}
    for z, y, x in itertools.product(range(n), repeat=3):
        for first, second, third in itertools.permutations(range(3)):
            corners = [[x, y, z]]
            for axis in first, second, third:
                corners.append([c + (a == axis) for a, c in enumerate(corners[-1])])
            if (first, second, third) not in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # odd ones have the other hand
                corners[1], corners[2] = corners[2], corners[1]
            elements.append([node(*c) for c in corners])
            for name, height in ("back", 0), ("front", n):
                side = [node(*c) for c in corners if c[2] == height]
                if len(side) == 3:
                    sides[name].append(side)
    chance, body = random.Random(1), cube(n)
    parts = [chance.random() < 0.5 for _ in elements]
    body["problem"]["mesh"] = {"nodes": nodes, "elements": {"tet4": elements}, "groups": {
        **{name: {"faces": faces} for name, faces in sides.items()},
        **{name: {"elements": [e for e, part in enumerate(parts) if part == is_stiff]} for name, is_stiff in
           (("stiff", True), ("soft", False))}}}
    body["problem"]["materials"] = [{"on": "stiff", "young": 1000, "poisson": 0.3}, {"on": "soft", "young": 1e-5, "poisson": 0.3}]
    return body


@options("--memory", "620M")
def test_what_was_regretted_is_taken_where_nothing_else_fits(s):
    """A factor is told to fit by its least, and does not by what it is: conjugate gradients, however many they are."""
    job = s.solve(crumbly_cube(28))
    check(job["status"] == "successful", job)
    check(job["summary"]["outcome"] == "converged" and job["summary"]["operator"] == "matrix_free", job["summary"])


FORMS = "condensed", "factored", "matrix_free"


@options("--workers", "1", "--cache", "1")
def test_a_summary_tells_by_how_much_the_process_grew(s):
    """On a daemon that keeps nothing and has done no more than what any first job does: each form within a tenth."""
    if INSTRUMENTED:
        raise Skip("the sanitizer has a heap of its own")

    def resident(name):
        with open(f"/proc/{s.solvers()[0]}/status", encoding="ascii") as file:
            return 1024 * next(int(line.split()[1]) for line in file if line.startswith(name))
    seen = {}
    for body, forms_of in (plate([450, 150]), FORMS), (cube(16), FORMS), (cube(22), FORMS[2:]):
        for form in forms_of:
            s.end()
            s.start()
            s.solve(plate([30, 10]))
            before = resident("VmRSS")
            body["solver"]["operator"] = form
            told = s.solve(body)["summary"]["cost"]["actual"]["bytes"]
            seen[body["problem"]["mesh"]["box"]["cells"][0], form] = round(told / (resident("VmHWM") - before), 3)
    check(all(0.9 <= ratio <= 1.1 for ratio in seen.values()), seen)


if __name__ == "__main__":
    service.main(globals())
