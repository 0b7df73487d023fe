"""Assertions in jobs, and what the client makes of them: summary, exit status, JUnit, baselines.
usage: test_assert.py BUILD_DIR [FILTER]"""
import json
import sys

import service
from service import MATRICES, SCENE, check, expect

PASSING = [{"quantity": "contact.active", "min": 22, "max": 22},
           {"quantity": "contact.max_pressure", "max": 1, "name": "no yielding"},
           {"quantity": "contact.force.1", "near": 10.5137, "relative": 1e-4},
           {"quantity": "energy.primal", "near": -3.9608e-3, "relative": 1e-3},
           {"quantity": "certificate.relative_error", "max": 1e-6},
           {"quantity": "warnings", "max": 0}]
FAILING = {"quantity": "contact.max_pressure", "max": 0.05}
CASES = [{"name": "light", "loads": [{"on": "top", "traction": [0, -0.01]}]},
         {"name": "heavy", "loads": [{"on": "top", "traction": [0, -0.5]}]}]


def results_of(job):
    return [line["result"] for line in job["summary"]["assertions"]]


def test_assertions_are_judged(s):
    job = s.solve({**SCENE, "assert": PASSING})
    check(results_of(job) == ["pass"] * 6 and job["summary"]["assertions_passed"] is True, job["summary"]["assertions"])
    lines = job["summary"]["assertions"]
    check(lines[1]["name"] == "no yielding" and lines[1]["error"] is None, lines[1])
    check(lines[3]["error"] == job["summary"]["certificate"]["gap"], lines[3])  # of the energy a bound is known
    check(lines[4]["error"] == 0 and "reason" not in lines[4], lines[4])
    again = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=summary"), 200).json["summary"]
    check(again["assertions"] == lines, again)


def test_one_that_fails_fails_the_list(s):
    job = s.solve({**SCENE, "assert": [*PASSING, FAILING]})
    check(results_of(job) == ["pass"] * 6 + ["fail"] and job["summary"]["assertions_passed"] is False, job)
    check("above 0.05" in job["summary"]["assertions"][-1]["reason"], job["summary"]["assertions"][-1])
    check(job["status"] == "successful" and job["summary"]["outcome"] == "converged", job)


def test_without_assertions_nothing_is_said(s):
    summary = s.solve(SCENE)["summary"]
    check("assertions" not in summary and "assertions_passed" not in summary, summary)
    summary = s.solve({**SCENE, "assert": []})["summary"]
    check("assertions" not in summary, summary)


def test_every_number_of_a_summary_can_be_asserted(s):
    """Whatever a summary has is taken by its name."""
    def numbers(value, name=""):
        if isinstance(value, dict):
            for key, item in value.items():
                yield from numbers(item, f"{name}.{key}" if name else key)
        elif isinstance(value, list):
            yield name, len(value)
            for i, item in enumerate(value):
                yield from numbers(item, f"{name}.{i}")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield name, value

    first = s.solve(SCENE)
    found = [(name, value) for name, value in numbers(first["summary"]) if not name.startswith("timings_s")]
    check(len(found) > 60, found)
    for start in range(0, len(found), 100):
        asserted = [{"quantity": name, "min": -1e300} for name, _ in found[start:start + 100]]
        job = s.solve({**SCENE, "assert": asserted})
        check(set(results_of(job)) == {"pass"}, [x for x in job["summary"]["assertions"] if x["result"] != "pass"])


def test_a_stopped_job_is_uncertain(s):
    stopped = {**SCENE, "solver": {"method": "uzawa", "max_iterations": 3}, "assert": PASSING}
    job = s.solve(stopped)
    check(job["summary"]["outcome"] == "iteration_limit" and not job["summary"]["assertions_passed"], job)
    check(set(results_of(job)) <= {"uncertain", "fail"} and "uncertain" in results_of(job), results_of(job))
    check("iteration_limit" in job["summary"]["assertions"][0]["reason"], job["summary"]["assertions"])


def test_a_quick_answer_does_not_pass_what_its_bound_leaves_open(s):
    """The exact energy is known to within the gap only, and the limit is put into it."""
    quick = {**SCENE, "solver": {"method": "accelerated_restart", "accuracy": "quick"}}
    energy = s.solve(quick)["summary"]["energy"]
    middle = (energy["primal"] + energy["dual"]) / 2
    check(energy["dual"] < middle < energy["primal"], energy)
    job = s.solve({**quick, "assert": [{"quantity": "energy.primal", "max": middle},
                                       {"quantity": "energy.dual", "max": middle}]})
    check(results_of(job) == ["uncertain", "uncertain"], job["summary"]["assertions"])
    check("exact value is between" in job["summary"]["assertions"][0]["reason"], job["summary"]["assertions"])


def test_refining_keeps_the_assertions(s):
    quick = {**SCENE, "solver": {"method": "accelerated_restart", "accuracy": "quick"}, "assert": PASSING}
    job = s.solve(quick)
    check(results_of(job)[4] == "fail", job["summary"]["assertions"])
    finer = expect(s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": {"relative_error": 1e-8}},
                             {"Prefer": "wait=60"}), 200).json
    check(results_of(finer) == ["pass"] * 6, finer["summary"]["assertions"])


def test_cases_are_judged_each(s):
    asserted = [{"quantity": "contact.max_pressure", "max": 0.1},
                {"quantity": "contact.max_pressure", "max": 1e3},
                {"quantity": "contact.active", "min": 1, "case": "heavy"},
                {"quantity": "cases.converged", "min": 2}]
    job = s.solve({**SCENE, "cases": CASES, "assert": asserted})
    lines = job["summary"]["assertions"]
    check([line["result"] for line in lines] == ["fail", "pass", "pass", "pass"], lines)
    check([line.get("case") for line in lines] == ["heavy", "heavy", "heavy", None], lines)
    check(lines[0]["cases"] == {"pass": 1, "uncertain": 0, "fail": 1} and "cases" not in lines[3], lines)
    cases = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=summary"), 200).json["cases"]
    check([results_of(case) for case in cases] == [["pass", "pass"], ["fail", "pass", "pass"]], cases)
    check([case["summary"]["assertions_passed"] for case in cases] == [True, False], cases)
    heavy = expect(s.get(f"/v1/jobs/{job['id']}/result?case=heavy"), 200).json["summary"]
    check(heavy["assertions"] == cases[1]["summary"]["assertions"], heavy)


def test_a_misspelt_quantity_is_refused(s):
    for query in ("", "?validate=true"):
        reply = expect(s.post({**SCENE, "assert": [FAILING, {"quantity": "contact.max_presure", "max": 1}]}, query=query),
                       422, "not_allowed")
        check(reply.json["pointer"] == "/assert/1/quantity", reply)
        check('Did you mean "contact.max_pressure"?' in reply.json["detail"], reply)
    expect(s.post({**SCENE, "assert": PASSING}, query="?validate=true"), 200)


def test_too_many_lines_are_refused(s):
    cases = [{"name": str(i), "p": [i, 1]} for i in range(2000)]
    reply = expect(s.post({**MATRICES, "cases": cases, "assert": [{"quantity": "iterations", "max": 9}] * 51}), 422)
    check(reply.json["pointer"] == "/assert", reply)


def test_what_matrices_have_not_fails(s):
    job = s.solve({**MATRICES, "assert": [{"quantity": "contact.max_pressure", "max": 1}]})
    check(results_of(job) == ["fail"] and "no such number" in job["summary"]["assertions"][0]["reason"], job)


def test_a_given_answer_is_judged_too(s):
    answer = {"displacements": [0.5, 2], "reactions": [-1]}
    body = {**MATRICES, "answer": answer, "assert": [{"quantity": "contact.active", "min": 1},
                                                     {"quantity": "contact.reaction_sum", "max": -2}]}
    summary = expect(s.request("POST", "/v1/verify", body), 200).json["summary"]
    check(summary["outcome"] == "verified" and [x["result"] for x in summary["assertions"]] == ["pass", "fail"], summary)


if __name__ == "__main__":
    service.main(globals())
