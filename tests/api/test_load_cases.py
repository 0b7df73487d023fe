"""Many loads on one body in one job, and starts near the answer. usage: test_load_cases.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import subprocess
import time
import urllib.request

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
TOP, RIGHT = {"on": "top", "traction": [0, -0.05]}, {"on": "right", "traction": [0.5, 0]}
LOADS = {"light": [TOP], "heavy": [TOP, RIGHT], "tripled": [TOP, {"on": "right", "traction": [1.5, 0]}], "none": []}
ALL = "?fields=summary,reactions,gaps,pressure,displacements"


def with_cases(names=LOADS, **more):
    return {**copy.deepcopy(SCENE), "cases": [{"name": name, "loads": LOADS[name]} for name in names], **more}


def alone(name, request=SCENE):
    request = copy.deepcopy(request)
    request["problem"]["loads"] = LOADS[name]
    return request


def result(s, job, query=""):
    return expect(s.get(f"/v1/jobs/{job}/result{query}"), 200).json


def close(x, y, scale=()):
    """Numbers or points that differ by no more than what both runs leave, each certified to 1e-6: relative to the largest,
    also of `scale`."""
    x, y, scale = ([number for item in one for number in (item if isinstance(item, list) else [item])]
                   for one in (x, y, scale))
    size = max(map(abs, x + y + scale))
    return len(x) == len(y) and all(abs(a - b) <= 1e-5 * size for a, b in zip(x, y))


# ---------------------------------------------------------------- answers

def test_each_case_is_what_a_job_of_its_own_gives(s):
    job = s.solved(with_cases())
    answer = result(s, job["id"], ALL)
    check([case["name"] for case in answer["cases"]] == list(LOADS), answer["cases"])
    for case in answer["cases"]:
        one = result(s, s.solved(alone(case["name"]))["id"], ALL)
        for field in ("reactions", "gaps", "pressure", "displacements"):
            scale = one["displacements"] if field == "gaps" else ()  # where all touch, gaps are rounding alone
            check(close(case[field], one[field], scale), case["name"], field)
        check(case["summary"]["outcome"] == one["summary"]["outcome"] == "converged", case["summary"], one["summary"])
        for side in ("primal", "dual"):
            check(close([case["summary"]["energy"][side]], [one["summary"]["energy"][side]]), case["name"], side)
        check(answer["nodes"] == one["nodes"] and answer["contact_nodes"] == one["contact_nodes"], case["name"])


def test_one_case_alone(s):
    job = s.solved(with_cases())
    everything = result(s, job["id"], ALL)
    for case in everything["cases"]:
        one = result(s, job["id"], f"{ALL}&case={case['name']}")
        check(one["job"] == job["id"] and one["case"] == case["name"] and "cases" not in one, one.keys())
        for field in ("summary", "reactions", "gaps", "pressure", "displacements"):
            check(one[field] == case[field], case["name"], field)
        check(one["nodes"] == everything["nodes"], case["name"])
    few = result(s, job["id"])
    check("displacements" not in few["cases"][0] and "nodes" not in few and few["contact_nodes"], few.keys())


@options()
def test_summary_of_the_job(s):
    job = s.solved(with_cases())
    summary = job["summary"]
    cases = {case["name"]: case["summary"] for case in result(s, job["id"])["cases"]}
    check(summary["outcome"] == "converged" and summary["message"] == "", summary)
    check(summary["cases"]["count"] == summary["cases"]["converged"] == 4, summary["cases"])
    errors = {name: case["certificate"]["relative_error"] for name, case in cases.items()}
    check(summary["certificate"]["relative_error"] == max(errors.values()), errors, summary)
    check(errors[summary["cases"]["worst"]] == max(errors.values()), errors, summary)
    for field in ("iterations", "restarts"):
        check(summary[field] == sum(case[field] for case in cases.values()), field, summary)
    check(summary["timings_s"]["total"] >= sum(case["timings_s"]["iterate"] for case in cases.values()), summary)
    check(summary["factor"]["cached"] is False and cases["heavy"]["factor"]["cached"] is True, summary)
    check(summary["started_from"] == "zero", summary)
    check([link["rel"] for link in job["links"]] == ["self", "result"], job["links"])  # each case has its own history


def test_one_bad_case_is_not_hidden(s):
    job = s.solved(with_cases(solver={"method": "accelerated_restart", "accuracy": {"relative_error": 1e-6},
                                       "max_iterations": 20}))
    cases = {case["name"]: case["summary"] for case in result(s, job["id"])["cases"]}
    check(cases["none"]["outcome"] == "converged" and cases["heavy"]["outcome"] == "iteration_limit", cases)
    summary = job["summary"]
    check(summary["outcome"] == "iteration_limit", summary)
    check(summary["cases"]["converged"] == sum(c["outcome"] == "converged" for c in cases.values()) < 4, summary)
    check(f"{summary['cases']['converged']} of 4 cases converged" in summary["message"], summary)
    check(summary["certificate"]["relative_error"] == max(c["certificate"]["relative_error"] for c in cases.values()))


def test_an_infeasible_case(s):
    request = {**copy.deepcopy(MATRICES), "cases": [{"name": "fine", "h": [0.25, 10]}, {"name": "torn", "h": [-1, -1]}]}
    request["problem"]["N"] = "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 1 -1\n"
    request["problem"]["h"] = [0.5, 10]
    job = s.solved(request)
    check(job["summary"]["outcome"] == "infeasible" and job["summary"]["cases"]["infeasible"] == 1, job)
    check(job["summary"]["certificate"]["relative_error"] is None, job)
    fine, torn = result(s, job["id"])["cases"]
    check(fine["summary"]["outcome"] == "converged" and "ray" not in fine, fine)
    check(torn["summary"]["outcome"] == "infeasible" and len(torn["ray"]) == 2 and torn["reactions"] == [None] * 2, torn)


def test_cases_of_matrices(s):
    request = {**MATRICES, "cases": [{"name": "p", "p": [0, 2]}, {"name": "h", "h": [0.25]}, {"name": "é 1/2", "p": [8, 2], "h": [1]}]}
    job = s.solved(request)
    answers = {case["name"]: case for case in result(s, job["id"], ALL)["cases"]}
    for name, u, r in (("p", [0, 2], 0), ("h", [0.25, 2], -1.5), ("é 1/2", [1, 2], -6)):
        case = answers[name]
        check(max(abs(a - b) for a, b in zip(case["displacements"], u)) < 1e-7, name, case)
        check(abs(case["reactions"][0] - r) < 1e-7, name, case)
    one = result(s, job["id"], "?case=%C3%A9%201%2F2")
    check(one["reactions"] == answers["é 1/2"]["reactions"], one)


# ---------------------------------------------------------------- what is refused

def test_names_that_are_no_case(s):
    job = s.solved(with_cases())["id"]
    for path in (f"/v1/jobs/{job}/result?case=haevy", f"/v1/jobs/{job}/history?case=haevy",
                 f"/v1/jobs/{job}/history.csv?case=haevy"):
        problem = expect(s.get(path), 404, "case_not_found").json
        check('Did you mean "heavy"?' in problem["detail"] and '"light", "heavy"' in problem["detail"], problem)
    plain = s.solved(SCENE)["id"]
    for kind in ("result", "history"):
        problem = expect(s.get(f"/v1/jobs/{plain}/{kind}?case=heavy"), 404, "case_not_found").json
        check("no cases" in problem["detail"], problem)


def test_bad_cases(s):
    twice = with_cases()
    twice["cases"].append({"name": "heavy", "loads": []})
    check(expect(s.post(twice), 422, "not_allowed").json["pointer"] == "/cases/4/name")
    wrong = with_cases()
    wrong["cases"][3]["loads"] = [TOP, {"on": "botom", "traction": [0, 1]}]
    problem = expect(s.post(wrong), 422, "not_allowed").json
    check(problem["pointer"] == "/cases/3/loads/1/on" and '"bottom"' in problem["detail"], problem)
    check(expect(s.post({**MATRICES, "cases": [{"name": "a", "p": [1]}]}), 422).json["pointer"] == "/cases/0/p")


def test_a_fault_that_shows_when_it_runs(s):
    request = {**MATRICES, "cases": [{"name": "a", "h": [1]}, {"name": "b", "p": [1e308, -1e308]}]}
    request = copy.deepcopy(request)
    request["problem"]["K"] = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1e-10\n2 2 1e-10\n"
    job = expect(s.post(request, WAIT), 200).json
    if job["status"] == "failed":
        check(job["error"]["pointer"].startswith("/cases/1"), job)
    else:
        check(job["summary"]["outcome"] != "converged", job)


# ---------------------------------------------------------------- histories

def test_histories(s):
    job = s.solved(with_cases())["id"]
    problem = expect(s.get(f"/v1/jobs/{job}/history"), 400, "case_needed").json
    check("?case=NAME" in problem["detail"] and '"tripled"' in problem["detail"], problem)
    for case in result(s, job)["cases"]:
        history = expect(s.get(f"/v1/jobs/{job}/history?case={case['name']}"), 200).json
        check(history["case"] == case["name"], history["case"])
        check(history["rows"][-1][0] == case["summary"]["iterations"], case["name"])
        tail = expect(s.get(f"/v1/jobs/{job}/history?case={case['name']}&after=5"), 200).json["rows"]
        check(tail == history["rows"][6:], case["name"])
        csv = expect(s.get(f"/v1/jobs/{job}/history.csv?case={case['name']}"), 200).body.decode().splitlines()
        check(csv[0] == ",".join(history["columns"]) and len(csv) == 1 + len(history["rows"]), csv[0])


@options("--workers", "1")
def test_a_job_that_runs(s):
    request = {**ENDLESS, "cases": [{"name": "none", "loads": []}, {"name": "heavy", "loads": LOADS["heavy"]}]}
    job = expect(s.post(request), 202).json["id"]
    s.wait_status(job, "running")
    end = time.monotonic() + PATIENT_S
    while (live := expect(s.get(f"/v1/jobs/{job}/history"), 200).json).get("case") != "heavy" or len(live["rows"]) < 3:
        check(time.monotonic() < end, live)
        time.sleep(0.02)
    check(expect(s.get(f"/v1/jobs/{job}/history?case=heavy"), 200).json["rows"], "no rows of the case that runs")
    check(expect(s.get(f"/v1/jobs/{job}/history?case=none"), 200).json["rows"] == [], "rows of another case")
    expect(s.get(f"/v1/jobs/{job}/history?case=nobody"), 404, "case_not_found")
    check(expect(s.get(f"/v1/jobs/{job}"), 200).json["progress"] >= 52, "one of two cases is done")
    expect(s.request("DELETE", f"/v1/jobs/{job}"), 200)
    ended = s.wait_status(job, "dismissed")
    check(ended["summary"]["outcome"] == "dismissed" and ended["summary"]["cases"]["dismissed"] == 1, ended)
    none, heavy = result(s, job)["cases"]
    check(none["summary"]["outcome"] == "converged" and heavy["summary"]["outcome"] == "dismissed", none, heavy)
    check(len(heavy["reactions"]) == 30, heavy)


def test_too_much_for_one_reply(s):
    d, count = 50000, 81
    diagonal = "".join(f"{i} {i} 2\n" for i in range(1, d + 1))
    request = {"problem": {"kind": "matrices", "p": [1] * d, "h": [1],
                           "K": f"%%MatrixMarket matrix coordinate real symmetric\n{d} {d} {d}\n{diagonal}",
                           "N": f"%%MatrixMarket matrix coordinate real general\n1 {d} 1\n1 1 1\n"},
               "cases": [{"name": f"n{i}", "h": [i / count]} for i in range(count)]}
    job = s.solved(request)["id"]
    check(len(result(s, job)["cases"]) == count, "reactions and gaps fit")
    problem = expect(s.get(f"/v1/jobs/{job}/result?fields=displacements"), 413, "result_too_large").json
    check("?case=NAME" in problem["detail"], problem)
    with urllib.request.urlopen(f"http://{s.host}:{s.port}/v1/jobs/{job}/result?fields=displacements&case=n25") as reply:
        body = json.load(reply)  # long arrays are quick to read and slow to check against a schema
    check(len(body["displacements"]) == d and body["case"] == "n25", body.keys())
    check(abs(body["displacements"][0] - 25 / count) < 1e-7 and abs(body["displacements"][1] - 0.5) < 1e-7, body["displacements"][:2])


# ---------------------------------------------------------------- restarts of the service

@options("--workers", "1")
def test_kill_while_it_runs(s):
    request = with_cases(solver={"method": "uzawa", "operator": "factored", "max_iterations": 3000})
    job = expect(s.post(request), 202).json["id"]
    s.wait_status(job, "running")
    s.restart()
    ended = s.wait_status(job, "successful", "failed")
    check(ended["status"] == "successful" and ended["attempts"] == 2, ended)
    check([case["name"] for case in result(s, job)["cases"]] == list(LOADS), "other cases")
    check(len(s.events("job_ended")) == 1, s.events("job_ended"))
    before = result(s, job, ALL)
    s.restart()
    check(result(s, job, ALL) == before, "the stored result has changed")


# ---------------------------------------------------------------- warm starts

def start(request, **warm):
    return {**request, "solver": {**request.get("solver", {}), "warm_start": warm}}


def test_start_from_a_job(s):
    first = s.solved(SCENE)
    again = s.solved(start(SCENE, job=first["id"]))
    check(again["summary"]["started_from"] == "warm" and again["summary"]["outcome"] == "converged", again)
    check(again["summary"]["iterations"] < first["summary"]["iterations"] / 4, again["summary"]["iterations"])
    check(first["summary"]["started_from"] == "zero", first)


def test_start_from_reactions(s):
    first = s.solved(SCENE)
    reactions = result(s, first["id"])["reactions"]
    again = s.solved(start(SCENE, reactions=reactions))
    check(again["summary"]["started_from"] == "warm", again)
    check(again["summary"]["iterations"] < first["summary"]["iterations"] / 4, again["summary"]["iterations"])
    anything = s.solved(start(SCENE, reactions=[5.0, -100.0] * 15))
    check(anything["summary"]["outcome"] == "converged", anything)
    check(abs(anything["summary"]["energy"]["primal"] / first["summary"]["energy"]["primal"] - 1) < 1e-10, anything)


def test_every_case_starts_there(s):
    many = s.solved(with_cases())
    again = s.solved(start(with_cases(), job=many["id"], case="heavy"))
    cases = result(s, again["id"])["cases"]
    check(all(case["summary"]["started_from"] == "warm" for case in cases), cases)
    check(again["summary"]["started_from"] == "warm", again)
    iterations = {case["name"]: case["summary"]["iterations"] for case in cases}
    check(iterations["heavy"] < 100, iterations)


def test_starts_that_are_refused(s):
    small, scene, many = (s.solved(body)["id"] for body in (MATRICES, SCENE, with_cases()))
    running = expect(s.post(ENDLESS), 202).json["id"]
    failed = expect(s.post({"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("1 1 2", "1 1 -2")}},
                           WAIT), 200).json
    check(failed["status"] == "failed", failed)
    warm = "/solver/warm_start"
    for body, code, pointer in (
            (start(SCENE, job="0" * 32), "not_allowed", f"{warm}/job"),
            (start(SCENE, job=running), "not_allowed", f"{warm}/job"),
            (start(SCENE, job=failed["id"]), "not_allowed", f"{warm}/job"),
            (start(SCENE, job=small), "size_mismatch", f"{warm}/job"),
            (start(MATRICES, job=scene), "size_mismatch", f"{warm}/job"),
            (start(SCENE, job=many), "missing_key", f"{warm}/job"),
            (start(SCENE, job=many, case="haevy"), "not_allowed", f"{warm}/case"),
            (start(SCENE, job=scene, case="heavy"), "not_allowed", f"{warm}/case"),
            (start(SCENE, job=many, **{"continue": True}), "not_allowed", f"{warm}/continue"),
            (start(alone("light"), job=scene, **{"continue": True}), "not_allowed", f"{warm}/continue"),
            (start(with_cases(), job=many, case="heavy", **{"continue": True}), "not_allowed", f"{warm}/case"),
            (start(SCENE, reactions=[0]), "size_mismatch", f"{warm}/reactions"),
            (start(MATRICES, reactions=[0, 0]), "size_mismatch", f"{warm}/reactions")):
        problem = expect(s.post(body), 422, code).json
        check(problem["pointer"] == pointer, body.get("solver"), problem)
    problem = expect(s.post(start(SCENE, job=many)), 422).json
    check('"light"' in problem["detail"], problem)
    problem = expect(s.post(start(SCENE, job=many, case="haevy"), query="?validate=true"), 422).json
    check('Did you mean "heavy"?' in problem["detail"], problem)


@options("--workers", "1")
def test_a_start_that_was_deleted(s):
    first = s.solved(SCENE)
    blocking = expect(s.post(ENDLESS), 202).json["id"]
    waiting = expect(s.post(start(SCENE, job=first["id"])), 202).json["id"]
    expect(s.request("DELETE", f"/v1/jobs/{first['id']}"), 204)
    expect(s.request("DELETE", f"/v1/jobs/{blocking}"), 200)
    ended = s.wait_status(waiting, "successful")
    check(ended["summary"]["started_from"] == "zero", ended)
    check(ended["summary"]["iterations"] == first["summary"]["iterations"], ended)


# ---------------------------------------------------------------- the client

def client(s, *words, stdin=None):
    return subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", *words],
                          input=stdin, capture_output=True, text=True, timeout=60)


def test_client(s):
    done = client(s, "submit", "-", "--wait", stdin=json.dumps(with_cases()))
    check(done.returncode == 0, done)
    job = done.stdout.split()[1]
    lines = done.stdout.splitlines()
    table = lines[next(i for i, line in enumerate(lines) if line.startswith("case  ")):]
    check([line.split()[0] for line in table[1:]] == list(LOADS), table)
    check(all("converged" in line for line in table[1:]), table)
    worst = done.stdout.split("cases       4; what follows is of the worst: ")[1].splitlines()[0]
    check(worst in LOADS and f"outcome     converged, case {worst}: " in done.stdout, done.stdout)
    check("case  " in client(s, "status", job).stdout, "no table")
    one = client(s, "result", job, "--case", "heavy", "--fields", "gaps")
    check(one.returncode == 0 and json.loads(one.stdout)["case"] == "heavy", one)
    check(json.loads(one.stdout).keys() >= {"gaps"} and "reactions" not in json.loads(one.stdout), one.stdout[:200])
    check(client(s, "history", job, "--case", "light", "--csv").stdout.startswith("iteration,"), "no CSV")
    check("iteration" in client(s, "history", job, "-c", "light", "--plot", "--ascii").stdout, "no plot")
    for words in (("history", job), ("result", job, "--case", "havy")):
        done = client(s, *words)
        check(done.returncode == 4 and '"heavy"' in done.stderr, words, done)
    check(client(s, "list", "--case", "x").returncode == 2, "list takes no case")
    done = client(s, "submit", "-", "--wait", stdin=json.dumps(with_cases(solver={"max_iterations": 3, "method": "uzawa"})))
    check(done.returncode == 7 and "iteration_limit" in done.stdout, done)


if __name__ == "__main__":
    service.main(globals())
