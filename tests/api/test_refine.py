"""Runs that go on where others stopped. usage: test_refine.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import subprocess
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
AS_JSON = {"Content-Type": "application/json"}


def scene(error, **solver):
    return {**copy.deepcopy(SCENE), "solver": {"method": "accelerated_restart", "accuracy": {"relative_error": error}, **solver}}


def refine(s, job, body, headers=WAIT, status=200, code=None):
    return expect(s.request("POST", f"/v1/jobs/{job}/refine", body, headers), status, code)


def refined(s, job, error=1e-6, **more):
    """The new job, which must have ended well."""
    new = refine(s, job, {"accuracy": {"relative_error": error}, **more}).json
    check(new["status"] == "successful" and new["id"] != job, new)
    return new


def answer(s, job, query=""):
    fields = "?fields=summary,reactions,gaps,displacements"
    return expect(s.get(f"/v1/jobs/{job}/result{fields}{query}"), 200).json


def rows(s, job, query=""):
    """The history without its seconds."""
    found = expect(s.get(f"/v1/jobs/{job}/history{query}"), 200).json["rows"]
    seconds = [row[1] for row in found]
    check(seconds == sorted(seconds), "time goes back", seconds)
    return [row[:1] + row[2:] for row in found]


def check_history(s, new, whole, parts, query=""):
    """The history of a run in parts, of which the summaries of all but the last are given, is that of the whole run, bit
    for bit; but each run's rows claim no more than its own certificate."""
    got, expected = rows(s, new, query), rows(s, whole, query)
    columns = expect(s.get(f"/v1/jobs/{new}/history{query}"), 200).json["columns"]
    bound = columns.index("error_bound") - 1  # rows() leaves the seconds out
    check(len(got) == len(expected), len(got), len(expected))
    for mine, theirs in zip(got, expected):
        check(mine[:bound] + mine[bound + 1:] == theirs[:bound] + theirs[bound + 1:], "another history", mine, theirs)
        least = max([part["certificate"]["absolute_error"] for part in parts if mine[0] <= part["iterations"]] + [theirs[bound]])
        # a body that was solved more often knows its norm better: as in check_same
        check(mine[bound] == least or abs(mine[bound] - least) <= 1e-6 * least and theirs is expected[-1], mine, theirs, least)


def check_same(a, b, *what):
    for field in ("reactions", "gaps", "displacements"):
        check(a[field] == b[field], *what, field)
    for field in ("outcome", "method", "operator", "iterations", "restarts", "alpha", "contact"):
        check(a["summary"][field] == b["summary"][field], *what, field, a["summary"], b["summary"])
    # A body that was solved more often knows its norm better, which may change a bound in digits that say nothing.
    bounds = [one["summary"]["certificate"] for one in (a, b)]
    check(bounds[0]["residual"] == bounds[1]["residual"], *what, bounds)
    for field in ("relative_error", "absolute_error", "gap"):
        check(abs(bounds[0][field] - bounds[1][field]) <= 1e-6 * bounds[1][field], *what, field, bounds)


# ---------------------------------------------------------------- the same run

def check_continues(s, **solver):
    """Stopped at 1e-3 and refined to 1e-6 is the run to 1e-6, bit for bit."""
    first = s.solved(scene(1e-3, **solver))
    whole = s.solved(scene(1e-6, **solver))
    new = refined(s, first["id"])
    check(new["summary"]["started_from"] == "continued", new)
    check(0 < first["summary"]["iterations"] < whole["summary"]["iterations"], first["summary"], whole["summary"])
    check_same(answer(s, new["id"]), answer(s, whole["id"]), solver)
    check_history(s, new["id"], whole["id"], [first["summary"]])
    check({"rel": "refines", "href": f"/v1/jobs/{first['id']}"} in new["links"], new["links"])


def test_continues_bit_for_bit(s):
    check_continues(s)


def test_other_methods_and_operators(s):
    check_continues(s, operator="factored")
    check_continues(s, method="accelerated")
    check_continues(s, method="uzawa", max_iterations=1000000)


def test_step_by_step(s):
    jobs = [s.solved(scene(1e-1))]
    for error in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        jobs.append(refined(s, jobs[-1]["id"], error))
    whole = s.solved(scene(1e-6))["id"]
    check_same(answer(s, jobs[-1]["id"]), answer(s, whole))
    check_history(s, jobs[-1]["id"], whole, [job["summary"] for job in jobs[:-1]])


def test_across_a_restart_of_the_service(s):
    first, whole = s.solved(scene(1e-3))["id"], s.solved(scene(1e-6))["id"]
    s.restart()
    check_same(answer(s, refined(s, first)["id"]), answer(s, whole))


def test_iterations_count_from_the_first_run(s):
    first = s.solved(scene(1e-6, max_iterations=100))
    check(first["summary"]["outcome"] == "iteration_limit", first)
    still = refined(s, first["id"])
    check(still["summary"]["outcome"] == "iteration_limit" and still["summary"]["iterations"] == 100, still)
    whole = refined(s, still["id"], max_iterations=1000)
    check(whole["summary"]["outcome"] == "converged", whole)
    check_same(answer(s, whole["id"]), answer(s, s.solved(scene(1e-6))["id"]))


def test_looser_takes_no_iteration(s):
    first = s.solved(scene(1e-6))
    new = refined(s, first["id"], 1e-2)
    check(new["summary"]["iterations"] == first["summary"]["iterations"], new)
    check(new["summary"]["outcome"] == "converged" and new["summary"]["requested_error"] == 1e-2, new)
    check(answer(s, new["id"])["reactions"] == answer(s, first["id"])["reactions"], "other reactions")
    check(rows(s, new["id"]) == rows(s, first["id"]), "another history")


def test_a_method_without_iterations(s):
    first = s.solved(scene(1e-3, method="active_set"))
    new = refined(s, first["id"], 1e-10)
    check(new["summary"]["outcome"] == "converged" and new["summary"]["method"] == "active_set", new)
    check(new["summary"]["certificate"]["relative_error"] <= 1e-10, new)


def test_auto(s):
    first = s.solved(scene(1e-2, method="auto"))
    whole = s.solved(scene(1e-10, method="auto"))
    new = refined(s, first["id"], 1e-10)
    for one in (whole, new):
        check(one["summary"]["outcome"] == "converged", one)
        check(one["summary"]["certificate"]["relative_error"] <= 1e-10, one)
    check(abs(new["summary"]["energy"]["primal"] / whole["summary"]["energy"]["primal"] - 1) < 1e-12, new, whole)


def test_the_papers_rule_gives_way(s):
    first = s.solved(scene(1e-2, stopping="paper", epsilon=1e-2))
    new = refined(s, first["id"], 1e-7)
    check(new["summary"]["outcome"] == "converged" and new["summary"]["requested_error"] == 1e-7, new)
    check(new["summary"]["iterations"] > first["summary"]["iterations"], first, new)


def test_matrices_and_tags(s):
    first = s.solved({**MATRICES, "tags": ["mine"], "solver": {"accuracy": "quick"}})
    new = refine(s, first["id"], {"accuracy": "exact"}).json
    check(new["status"] == "successful" and new["tags"] == ["mine"], new)
    check(new["summary"]["requested_error"] < 1e-10, new)
    check([job["id"] for job in expect(s.get("/v1/jobs?tag=mine"), 200).json["jobs"]] == [new["id"], first["id"]])


# ---------------------------------------------------------------- load cases

CASES = [{"name": "light", "loads": [{"on": "top", "traction": [0, -0.05]}]},
         {"name": "heavy", "loads": SCENE["problem"]["loads"]},
         {"name": "none", "loads": []}]


def test_cases(s):
    first = s.solved({**scene(1e-3), "cases": CASES})
    whole = s.solved({**scene(1e-6), "cases": CASES})
    new = refined(s, first["id"])
    check(new["summary"]["started_from"] == "continued", new)
    check(new["summary"]["iterations"] == whole["summary"]["iterations"], new, whole)
    for case in CASES:
        query = f"&case={case['name']}"
        check_same(answer(s, new["id"], query), answer(s, whole["id"], query), case["name"])
        check_history(s, new["id"], whole["id"], [answer(s, first["id"], query)["summary"]], "?" + query[1:])


# ---------------------------------------------------------------- the old job

def test_the_old_job_may_go(s):
    first, whole = s.solved(scene(1e-3)), s.solved(scene(1e-6))["id"]
    new = refined(s, first["id"])["id"]
    expect(s.request("DELETE", f"/v1/jobs/{first['id']}"), 204)
    check_same(answer(s, new), answer(s, whole))
    check_history(s, new, whole, [first["summary"]])
    newest = refined(s, new, 1e-8)
    check(newest["summary"]["started_from"] == "continued", newest)


@options("--workers", "1")
def test_the_old_job_goes_first(s):
    first, whole = s.solved(scene(1e-3))["id"], s.solved(scene(1e-6))["id"]
    blocking = expect(s.post(ENDLESS), 202).json["id"]
    reply = refine(s, first, {"accuracy": {"relative_error": 1e-6}}, {}, 202)
    new = reply.json["id"]
    check(reply.headers["location"] == f"/v1/jobs/{new}", reply)
    expect(s.request("DELETE", f"/v1/jobs/{first}"), 204)
    expect(s.request("DELETE", f"/v1/jobs/{blocking}"), 200)
    ended = s.wait_status(new, "successful")
    check(ended["summary"]["started_from"] == "zero", ended)
    check_same(answer(s, new), answer(s, whole))
    check(rows(s, new) == rows(s, whole), "another history")


def test_a_dismissed_job_goes_on(s):
    job = expect(s.post({**scene(1e-6, method="uzawa"), "solver": {"method": "uzawa", "alpha": 1.0,
                                                                    "max_iterations": 1000000000}}), 202).json["id"]
    end = time.monotonic() + PATIENT_S
    while len(expect(s.get(f"/v1/jobs/{job}/history"), 200).json["rows"]) < 3:
        check(time.monotonic() < end, "it does not iterate")
        time.sleep(0.02)
    expect(s.request("DELETE", f"/v1/jobs/{job}"), 200)
    ended = s.wait_status(job, "dismissed")
    new = refine(s, job, {"accuracy": "quick", "max_iterations": ended["summary"]["iterations"] + 10}).json
    check(new["status"] == "successful" and new["summary"]["started_from"] == "continued", new)
    check(new["summary"]["iterations"] <= ended["summary"]["iterations"] + 10, ended, new)


# ---------------------------------------------------------------- what is refused

def test_jobs_without_an_answer(s):
    body = {"accuracy": "precise"}
    running = expect(s.post(ENDLESS), 202).json["id"]
    failed = expect(s.post({"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("1 1 2", "1 1 -2")}},
                           WAIT), 200).json["id"]
    torn = copy.deepcopy(MATRICES)
    torn["problem"]["N"] = "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 1 -1\n"
    torn["problem"]["h"] = [-1, -1]
    torn = s.solved(torn)["id"]
    given = expect(s.request("POST", "/v1/verify", {**MATRICES, "answer": {"displacements": [0.5, 2], "reactions": [-1]}},
                             WAIT), 200).json["job"]
    refine(s, "0" * 32, body, status=404, code="not_found")
    refine(s, running, body, status=409, code="not_ended")
    refine(s, failed, body, status=409, code="job_failed")
    refine(s, torn, body, status=409, code="no_result")
    refine(s, given, body, status=409, code="not_solved_here")


def test_bodies_that_are_refused(s):
    job = s.solved(MATRICES)["id"]
    count = len(expect(s.get("/v1/jobs"), 200).json["jobs"])
    for body, code, pointer in (({}, "missing_key", ""), ({"accuracy": 1}, "wrong_type", "/accuracy"),
                                ({"accuracy": "exactly"}, "not_allowed", "/accuracy"),
                                ({"accuracy": "balanced"}, "not_allowed", "/accuracy"),
                                ({"accuracy": {"relative_error": 2}}, "out_of_range", "/accuracy/relative_error"),
                                ({"accuracy": "quick", "method": "uzawa"}, "unknown_key", "/method"),
                                ({"accuracy": "quick", "time_limit_s": 0}, "out_of_range", "/time_limit_s")):
        problem = refine(s, job, body, status=422, code=code).json
        check(problem["pointer"] == pointer, body, problem)
    expect(s.request("POST", f"/v1/jobs/{job}/refine", b"{", AS_JSON), 400, "json_syntax")
    expect(s.request("GET", f"/v1/jobs/{job}/refine"), 405, "method_not_allowed")
    check(len(expect(s.get("/v1/jobs"), 200).json["jobs"]) == count, "a refused request made a job")


def test_idempotency(s):
    job = s.solved(scene(1e-3))["id"]
    headers = {**WAIT, "Idempotency-Key": "again"}
    one = refine(s, job, {"accuracy": "precise"}, headers).json["id"]
    check(refine(s, job, {"accuracy": "precise"}, headers).json["id"] == one, "two jobs")
    refine(s, job, {"accuracy": "quick"}, headers, 422, "idempotency_key_reused")


# ---------------------------------------------------------------- the client

def client(s, *words):
    return subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", *words],
                          capture_output=True, text=True, timeout=60)


def test_client(s):
    job = s.solved(scene(1e-3))["id"]
    done = client(s, "refine", job, "--accuracy", "1e-8", "--wait")
    check(done.returncode == 0 and "continued from another job" in done.stdout, done)
    done = client(s, "refine", job, "-a", "exact", "--json", "-w")
    check(json.loads(done.stdout)["status"] == "successful", done)
    done = client(s, "refine", job, "--accuracy", "precise")
    check(done.returncode == 0 and len(done.stdout.strip()) == 32, done)
    check(client(s, "wait", done.stdout.strip()).returncode == 0, "the job that was made")
    done = client(s, "refine", job, "--accuracy", "1e-12", "--max-iterations", "60", "--time-limit", "9", "--wait")
    check(done.returncode == 7 and "iteration_limit" in done.stdout, done)
    check(client(s, "refine", job).returncode == 2, "no accuracy")
    done = client(s, "refine", job, "--accuracy", "ecxact")
    check(done.returncode == 4 and '"exact"' in done.stderr and "at /accuracy" in done.stderr, done)
    check(client(s, "refine", "0" * 32, "--accuracy", "exact").returncode == 4, "no such job")


if __name__ == "__main__":
    service.main(globals())
