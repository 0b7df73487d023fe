"""What people call things: names of jobs, units of scenes. usage: test_labels.py BUILD_DIR [FILTER]
not under ThreadSanitizer: nothing here is about threads
"""
import copy
import json
import os
import subprocess
import sys
import time

from service import ENDLESS, MATRICES, SCENE, check, expect, main

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")

MM = {**SCENE["problem"], "units": {"length": "mm", "force": "N"}}

OTHER = {"problem": {**SCENE["problem"], "thickness": 7}}


def names_of(s, query):
    return [job.get("name") for job in expect(s.get(f"/v1/jobs?{query}"), 200).json["jobs"]]


def test_jobs_have_names(s):
    odd = 'Träger "A" \\ 3 kN'
    job = s.solve({**SCENE, "name": odd, "tags": ["demo"]})
    check(job["name"] == odd and job["tags"] == ["demo"], job)
    other = s.solve({**SCENE, "name": "bare", "tags": ["bare"]})
    check(other["name"] == "bare" and other["tags"] == ["bare"], other)
    alone = s.solve({**MATRICES, "name": "alone"})
    check(alone["name"] == "alone" and alone["tags"] == [], alone)
    check("name" not in s.solve(SCENE), "a job without a name has none")
    check(names_of(s, "name=bare") == ["bare"], names_of(s, "name=bare"))
    check(names_of(s, "name=bare&tag=bare") == ["bare"] and names_of(s, "name=bare&tag=demo") == [], "all must be true")
    check(names_of(s, "tag=demo") == [odd], "tags go on as they did")
    check(names_of(s, "name=nobody") == [], "no job is called so")
    check(s.get("/v1/jobs?name=" + "x" * 64).status == 400, "longer than any name")
    refined = expect(s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": "exact"}), 202).json
    check(refined["name"] == odd and refined["tags"] == ["demo"], refined)
    for wrong in ("", "x" * 64, "a\x1fb", "a\u202eb", 7):
        reply = s.post({**SCENE, "name": wrong})
        check(reply.status == 422 and reply.json["pointer"] == "/name", wrong, reply.json)


def test_units_are_said_and_change_nothing(s):
    s.solve(SCENE)
    plain = s.solve(SCENE)  # on the factor of the first, as all that follow
    said = s.solve({**SCENE, "problem": MM})
    check("units" not in plain["summary"]["problem"], plain)
    check(said["summary"]["problem"]["units"] == {"length": "mm", "force": "N", "stress": "MPa"}, said["summary"]["problem"])
    check(said["summary"]["factor"]["cached"], "the same body, whatever its units are called")
    answers = [s.get(f"/v1/jobs/{job['id']}/result?fields=reactions,gaps,displacements").json for job in (plain, said)]
    check(all(answers[0][key] == answers[1][key] for key in ("reactions", "gaps", "displacements")), "another answer")
    other = copy.deepcopy(MM)
    other["units"] = {"length": "ell", "force": "<stone>"}
    cases = [{"name": "one", "loads": SCENE["problem"]["loads"]}]
    job = s.solve({"problem": other, "cases": cases})
    check(job["summary"]["problem"]["units"]["stress"] == "<stone>/ell²", job["summary"]["problem"])
    for colour, unit in (("von_mises", "&lt;stone&gt;/ell²"), ("displacements", "displacement, ell")):
        svg = s.get(f"/v1/jobs/{job['id']}/deformed.svg?case=one&colour={colour}").body.decode()
        check(unit in svg and "<stone>" not in svg, colour, svg[-900:])
    for wrong, at in (({"length": "mm"}, "/problem/units"), ({"length": "", "force": "N"}, "/problem/units/length"),
                      ({"length": "mm", "force": "é" * 16}, "/problem/units/force"), ({"length": "m\x07", "force": "N"}, "/problem/units/length"),
                      ({"length": "mm", "force": "N", "stress": "Pa"}, "/problem/units/stress")):
        reply = s.post({"problem": {**MM, "units": wrong}})
        check(reply.status == 422 and reply.json["pointer"] == at, wrong, reply.json)


def test_a_body_is_known_whatever_its_units_are_called(s):
    """By the text alone, before anything of it is read: it goes to the process that has its factor, not to the first that is free."""
    blocker = expect(s.post(ENDLESS), 202).json["id"]  # takes the first process
    s.wait_status(blocker, "running")
    s.solve(OTHER)
    expect(s.request("DELETE", f"/v1/jobs/{blocker}"), 200)
    s.wait_status(blocker, "dismissed")
    time.sleep(0.5)  # its process is let go
    check(s.solve({"problem": {**OTHER["problem"], "units": MM["units"]}})["summary"]["factor"]["cached"], "names of units made it another body")


def test_the_client_says_both(s):
    def run(*words, **more):
        return subprocess.run([CLIENT, *words, "--server", s.url], capture_output=True, text=True, timeout=60, check=True, **more).stdout
    out = run("submit", "-", "--name", "First try", "--wait", input=json.dumps({"problem": MM}))
    check("First try" in out, out)
    for words in ("MPa at (", ", force (", " N\n", " mm at most", "mm^2"):
        check(words in out, "not said:", words, out)
    s.solve(SCENE)
    check(len(run("list", "--name", "First try", "-q").split()) == 1, "one is called so")
    listed = run("list")
    check("First try" in listed and "name" in listed.splitlines()[0], listed)
    report = run("report", run("list", "--name", "First try", "-q").strip())
    check("Mean pressure, MPa" in report and "Area, mm²" in report, report[-3000:])


main(globals())
