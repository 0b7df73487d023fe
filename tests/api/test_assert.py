"""Assertions in jobs, and what the client makes of them: summary, exit status, JUnit, baselines.
usage: test_assert.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import json
import os
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import service
from service import MATRICES, PUSHED_OFF, SCENE, check, expect

SHARED = True  # one service for all tests

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


# ---- the client

def run(s, *words, body=None, code=0):
    """The client, with a dict as its standard input."""
    done = subprocess.run([os.path.join(sys.argv[1], "uzawa"), "--server", s.url, *words], capture_output=True,
                          input=json.dumps(body) if body else "", text=True, timeout=90)
    check(done.returncode == code, words, "exit", done.returncode, "wanted", code, done.stdout, done.stderr)
    return done


def read_report(path):
    """The root of a JUnit report that has the common shape: testsuites > testsuite > properties? testcase*, counts that
    agree with what is there, a failure or error with a message, names and times everywhere."""
    root = xml.etree.ElementTree.parse(path).getroot()
    check(root.tag == "testsuites" and len(root) >= 1, root.tag)
    for suite in root:
        check(suite.tag == "testsuite" and suite.get("name"), suite.attrib)
        check(re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", suite.get("timestamp")), suite.attrib)
        cases = suite.findall("testcase")
        check([child.tag for child in suite] == ["properties"] + ["testcase"] * len(cases), [x.tag for x in suite])
        check(all(one.get("name") and one.get("value") is not None for one in suite.find("properties")), suite)
        for case in cases:
            check(set(case.attrib) == {"classname", "name", "time"} and float(case.get("time")) >= 0, case.attrib)
            check([child.tag for child in case] in (["failure"], ["error"], ["system-out"]), case)
            check(case[0].tag == "system-out" or (case[0].get("message") and case[0].get("type")), case[0].attrib)
        for count, tag in (("tests", "testcase"), ("failures", "testcase/failure"), ("errors", "testcase/error"),
                           ("skipped", "testcase/skipped")):
            check(int(suite.get(count)) == len(suite.findall(tag)), count, suite.attrib)
    for count in ("tests", "failures", "errors", "skipped"):
        check(int(root.get(count)) == sum(int(suite.get(count)) for suite in root), root.attrib)
    return root


def report_of(s, body, *words, code):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.xml")
        done = run(s, "submit", "-", "--wait", "--junit", path, *words, body=body, code=code)
        return read_report(path), done


def names_of(report, tag=""):
    """Names of the test cases with such a child."""
    return [case.get("name") for case in report.iter("testcase") if not tag or case.find(tag) is not None]


def test_client_passes(s):
    report, done = report_of(s, {**SCENE, "assert": PASSING}, code=0)
    check("assertions  6 of 6 pass" in done.stdout and "no yielding" in done.stdout, done.stdout)
    check(names_of(report)[:3] == ["converged", "contact.active at least 22 at most 22", "no yielding"], names_of(report))
    check(len(names_of(report)) == 7 and report[0].find("properties/property[@name='job']").get("value"), report)


def test_client_fails_with_3(s):
    report, done = report_of(s, {**SCENE, "assert": [*PASSING, FAILING]}, code=3)
    check("assertions  6 of 7 pass" in done.stdout and "FAIL       contact.max_pressure at most 0.05" in done.stdout, done)
    check(names_of(report, "failure") == ["contact.max_pressure at most 0.05"], names_of(report, "failure"))
    job = run(s, "submit", "-", "--wait", "--quiet", body={**SCENE, "assert": [FAILING]}, code=3).stdout.strip()
    run(s, "wait", job, "--quiet", code=3)
    shown = run(s, "status", job).stdout
    check("assertions  0 of 1 pass" in shown, shown)
    run(s, "refine", job, "--accuracy", "1e-9", "--wait", code=3)


def test_client_tells_other_ends_first(s):
    stopped = {**SCENE, "solver": {"method": "uzawa", "max_iterations": 3}, "assert": [PASSING[0]]}
    report, done = report_of(s, stopped, code=7)
    check("uncertain" in done.stdout, done.stdout)
    check(len(names_of(report, "failure")) == 2, names_of(report, "failure"))
    report, _ = report_of(s, {"problem": {**SCENE["problem"], **PUSHED_OFF}}, code=6)
    check(names_of(report, "error") == ["converged"], names_of(report))


def test_report_of_cases(s):
    asserted = [{"quantity": "contact.max_pressure", "max": 0.1, "name": "a < b & \"c\""},
                {"quantity": "cases.converged", "min": 2}, {"quantity": "cases.time_limit", "max": 0}]
    report, done = report_of(s, {**SCENE, "cases": CASES, "assert": asserted}, code=3)
    check("(case heavy)" in done.stdout, done.stdout)
    found = [(case.get("classname").partition(".")[2], case.get("name"), case[0].tag) for case in report.iter("testcase")]
    name = 'a < b & "c"'
    check(found == [("", "converged", "system-out"), ("", "cases.converged at least 2", "system-out"),
                    ("", "cases.time_limit at most 0", "system-out"),
                    ("light", "converged", "system-out"), ("light", name, "system-out"),
                    ("heavy", "converged", "system-out"), ("heavy", name, "failure")], found)


def test_report_of_several_jobs(s):
    """A suite for each value."""
    body = {**SCENE, "assert": [{"quantity": "energy.strain", "max": 0.004}]}
    report, done = report_of(s, body, "--vary", "materials.0.young=1e5,2e5", code=3)
    suites = [(suite.get("name").split()[-1], suite.get("tests"), suite.get("failures")) for suite in report]
    check(len(suites) == 2 and [one[1:] for one in suites] == [("2", "1"), ("2", "0")], suites)
    check([one[0] for one in suites] == ["100000", "200000"], suites)


def test_report_of_a_job_that_goes_on(s):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.xml")
        job = run(s, "submit", "-", body=service.ENDLESS).stdout.strip()
        run(s, "wait", job, "--timeout", "1", "--junit", path, code=10)
        check(names_of(read_report(path), "error") == ["converged"], names_of(read_report(path)))
        run(s, "cancel", job)


def test_options_that_do_nothing_are_refused(s):
    for words in (["--junit", "x.xml"], ["--baseline", "x"], ["--wait", "--tolerance", "1e-3"],
                  ["--wait", "--baseline", "x", "--tolerance", "-1"]):
        run(s, "submit", "-", *words, body=SCENE, code=2)
    run(s, "submit", "-", "--wait", "--junit", "no/such/folder/x.xml", body=MATRICES, code=11)


# ---- baselines

def submitted(s, body):
    return run(s, "submit", "-", "--wait", "--quiet", body=body).stdout.strip()


def with_load(traction, cells=(30, 10)):
    problem = {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": list(cells)}},
               "loads": [{"on": "top", "traction": [0, traction]}, {"on": "right", "traction": [0.5, 0]}]}
    return {"problem": problem}


def test_no_drift_from_itself(s):
    baseline = submitted(s, with_load(-0.05))
    report, done = report_of(s, SCENE, "--baseline", baseline, code=0)
    check("baseline    5 of 5 pass" in done.stdout, done.stdout)
    check("baseline: displacements" in names_of(report), names_of(report))
    done = run(s, "submit", "-", "--wait", "--json", "--baseline", baseline, body=SCENE)
    check(json.loads(done.stdout)["status"] == "successful" and "5 of 5 pass" in done.stderr, done)


def test_drift_is_told(s):
    """One more node touches, and the pressure has risen; within a tenth that is nothing."""
    baseline = submitted(s, with_load(-0.05))
    report, done = report_of(s, with_load(-0.051), "--baseline", baseline, "--tolerance", "1e-3", code=3)
    check("closed at node 8" in done.stdout and "more than 0.001" in done.stdout, done.stdout)
    check("baseline: contact.active set" in names_of(report, "failure"), names_of(report, "failure"))
    report_of(s, with_load(-0.051), "--baseline", baseline, "--tolerance", "0.1", code=0)


def test_another_mesh_is_told(s):
    baseline = submitted(s, with_load(-0.05))
    report, done = report_of(s, with_load(-0.05, (60, 20)), "--baseline", baseline, "--tolerance", "0.1", code=3)
    check("the meshes differ in their number of nodes" in done.stdout, done.stdout)
    check(names_of(report, "failure") == ["baseline: mesh"], names_of(report, "failure"))


def test_cases_against_a_baseline(s):
    body = {**SCENE, "cases": CASES}
    baseline = submitted(s, body)
    run(s, "submit", "-", "--wait", "--baseline", baseline, body=body)
    more = {**SCENE, "cases": [*CASES, {"name": "new", "loads": []}]}
    done = run(s, "submit", "-", "--wait", "--baseline", baseline, body=more, code=3)
    check("new: baseline: it has no load case of this name" in done.stdout, done.stdout)
    done = run(s, "submit", "-", "--wait", "--baseline", baseline, body={**SCENE, "cases": CASES[:1]}, code=3)
    check("baseline: this job has no load case of this name" in done.stdout, done.stdout)
    done = run(s, "submit", "-", "--wait", "--baseline", baseline, body=SCENE, code=3)
    check("it has some load cases" in done.stdout, done.stdout)
    matrices = submitted(s, MATRICES)
    run(s, "submit", "-", "--wait", "--baseline", matrices, body=MATRICES)


def test_a_baseline_that_is_not_there(s):
    run(s, "submit", "-", "--wait", "--baseline", "0" * 32, body=MATRICES, code=4)


if __name__ == "__main__":
    service.main(globals())
