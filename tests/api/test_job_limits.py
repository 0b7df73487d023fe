"""What becomes of a job that needs more time or memory than it may have, before its first iteration.
usage: test_job_limits.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import math
import os
import re
import signal
import time

import service
from service import MATRICES, SCENE, check, expect, options

FIELDS = "?fields=displacements,reactions,gaps"


def plate(cells=(48, 16), **solver):
    """By default what is factored and certified before its process would be ended, on a busy machine too."""
    body = copy.deepcopy(SCENE)
    body["problem"]["mesh"]["box"]["cells"] = list(cells)
    body["solver"] = {"accuracy": {"relative_error": 1e-6}, **solver}
    return body


def check_out_of_time(s, body):
    """Factored, then out of time: the answer says so, bounds its own error, and can be gone on with. A process that the
    machine lets wait is ended before it has factored, and says that instead."""
    for _ in range(15):
        job = s.solve(body)
        if job["status"] == "successful":
            break
        check(job["error"]["code"] == "time_limit" and "still being" in job["error"]["detail"], job)
    check(job["status"] == "successful", job)
    summary = job["summary"]
    check(summary["outcome"] == "time_limit" and summary["iterations"] == 0 and "time_limit_s" in summary["message"], summary)
    certificate = summary["certificate"]
    check(certificate["absolute_error"] is None or 0 < certificate["absolute_error"] < math.inf, certificate)
    check("inf" not in summary["message"].replace("infeasible", "") and "nan" not in summary["message"], summary["message"])
    result = expect(s.get(f"/v1/jobs/{job['id']}/result{FIELDS}"), 200).json
    check(max(result["reactions"]) <= 0 and all(math.isfinite(r) for r in result["reactions"]), result["reactions"])
    return job, certificate, result


def test_time_while_factoring(s):
    job, certificate, _ = check_out_of_time(s, plate(time_limit_s=1e-6))
    exact = s.solve(plate())["summary"]["energy"]
    below = exact["primal"] - job["summary"]["energy"]["dual"]  # psi(r) is a lower bound of the optimum
    check(-1e-9 <= below <= 0.5 * certificate["absolute_error"] ** 2 * (1 + 1e-9), below, certificate, exact)
    on = s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": {"relative_error": 1e-6}, "time_limit_s": 60},
                   {"Prefer": "wait=60"})
    check(expect(on, 200).json["summary"]["outcome"] == "converged", on)


def test_time_without_a_factor(s):
    check_out_of_time(s, plate(time_limit_s=1e-6, operator="matrix_free"))


@options("--max-solve-s", "0.000001")
def test_time_of_the_daemon(s):
    """The daemon's own limit holds where the request asks for more, or for nothing."""
    check_out_of_time(s, plate())
    check_out_of_time(s, plate(time_limit_s=1000))


def stopped_amid_grids(s, cases):
    """A job that refines its mesh, whose process stands still from its fourth grid on, as one in a factorization that takes too long."""
    body = plate((6, 2), accuracy={"relative_error": 1e-3})
    body["problem"]["mesh"]["refine"] = "auto"
    if cases:
        body["cases"] = [{"name": name, "loads": SCENE["problem"]["loads"]} for name in cases]
    for limit in 2, 10, 40:  # a busy machine takes longer to come so far
        body["solver"]["time_limit_s"] = limit
        job = expect(s.post(body), 202).json
        while job["status"] in ("accepted", "running") and job.get("grid", {}).get("number", 0) < 4:
            time.sleep(0.005)
            job = s.get(f"/v1/jobs/{job['id']}").json
        if job["status"] == "running":
            break
    check(job["status"] == "running", job)
    for pid in s.solvers():
        os.kill(pid, signal.SIGSTOP)
    job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=60").json
    for pid in s.solvers():  # those that had no part in it, one of which may be given the next job
        os.kill(pid, signal.SIGCONT)
    return job


def test_time_while_a_finer_grid_is_factored(s):
    """The process is ended, and what is told is the answer of the last grid that it had finished."""
    for cases in ((), ("a", "b")):
        job = stopped_amid_grids(s, cases)
        check(job["status"] == "successful", job.get("error"), job["status"])
        summary = job["summary"]
        check(summary["outcome"] == "time_limit", summary["outcome"], summary)
        check(len(summary["mesh"]["ladder"]) >= 3 if not cases else summary["cases"]["count"] == 2, summary)
        result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions,nodes,von_mises{'&case=b' if cases else ''}"), 200).json
        check(len(result["displacements"]) == len(result["nodes"]) == len(result["von_mises"]) > 21, len(result["nodes"]))
        check(min(result["reactions"]) < 0 and 1e-3 < result["summary"]["error"]["total"] < 1, result["summary"])
        check("time_limit_s" in result["summary"]["message"], result["summary"]["message"])
        check(s.solve(plate())["summary"]["outcome"] == "converged", "the next job has another process")


@options("--memory", "4M")
def test_memory(s):
    """Refused before it is taken, with the bytes; what fits is solved beside it."""
    refused, small = s.post(plate((120, 40))).json, s.solve(MATRICES)
    job = s.get(f"/v1/jobs/{refused['id']}", Prefer="wait=60").json
    check(small["status"] == "successful" and job["status"] == "failed", small, job)
    check(job["error"]["code"] == "memory_limit", job)
    bytes_ = [float(number) for number in re.findall(r"([\d.e+]+) bytes", job["error"]["detail"])]
    check(bytes_ and max(bytes_) > 4 << 20, job["error"]["detail"])


if __name__ == "__main__":
    service.main(globals())
