"""Solves in processes of their own: they obey in any phase, a death is one job's alone, and they can do nothing but solve.
usage: test_processes.py BUILD_DIR [FILTER]"""
# not under sanitizers: about times, and about a filter that a sanitizer does not get through
import concurrent.futures
import copy
import json
import os
import pathlib
import resource
import signal
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options, wait_until


def cube(n, **solver):
    """Some ten seconds of one factorization for n = 38."""
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"origin": [0, 0, -1], "size": [1, 1, 1], "cells": [n, n, n], "element": "hex8"}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": 0}],
                        "contacts": [{"on": "front", "obstacle": {"sphere": {"center": [0.5, 0.5, 1.98], "radius": 2}}}]},
            "solver": {"operator": "condensed", **solver}}


LONG = cube(38)


def busy(s, request):
    """The id of a job that factors by now."""
    job = s.post(request).json["id"]
    s.wait_status(job, "running")
    time.sleep(2)
    return job


@options("--workers", "2", "--threads", "2")
def test_idle_processors_help(s):
    processors = len(os.sched_getaffinity(0))
    if processors < 2:
        raise service.Skip("one processor")
    box = cube(30, operator="matrix_free")
    alone = s.solve(box)["summary"]
    check(alone["cost"]["actual"]["threads"] == 2, alone["cost"])
    other = s.post(ENDLESS).json["id"]
    s.wait_status(other, "running")
    beside = s.solve({**box, "tags": ["beside"]})["summary"]
    check(beside["cost"]["actual"]["threads"] == min(2, processors // 2), beside["cost"])
    check(beside["energy"] == alone["energy"] and beside["certificate"] == alone["certificate"], beside, alone)
    expect(s.request("DELETE", f"/v1/jobs/{other}"), 200)
    s.wait_status(other, "dismissed")


@options("--workers", "2", "--threads", "1")
def test_threads_can_be_bounded(s):
    check(s.solve(cube(30, operator="matrix_free"))["summary"]["cost"]["actual"]["threads"] == 1)


@options("--workers", "1")
def test_dismissed_while_it_factors(s):
    job = busy(s, LONG)
    before = s.spent()
    reply = expect(s.request("DELETE", f"/v1/jobs/{job}"), 200)
    s.wait_status(job, "dismissed")
    check(s.spent() - before < 4, s.spent() - before, reply)  # seconds of processor; all of it takes ten
    check(s.solve(MATRICES)["status"] == "successful")


@options("--workers", "1")
def test_time_is_over_while_it_factors(s):
    before = s.spent()
    job = s.solve(copy.deepcopy({**LONG, "solver": {**LONG["solver"], "time_limit_s": 1}}))
    check(job["status"] == "failed" and job["error"]["code"] == "time_limit" and "factored" in job["error"]["detail"], job)
    check(s.spent() - before < 6, s.spent() - before)  # seconds of processor; all of it takes ten
    check(s.solve(MATRICES)["status"] == "successful")


@options("--workers", "1", "--drain-s", "0.2")
def test_the_service_ends_while_it_factors(s):
    job = busy(s, LONG)
    began = time.monotonic()
    s.process.send_signal(signal.SIGTERM)
    check(s.process.wait(timeout=PATIENT_S) == 0)
    took = time.monotonic() - began
    check(took < 7, took)
    s.start()
    check(s.get(f"/v1/jobs/{job}").json["status"] in ("accepted", "running"))
    check(s.events("job_released"), s.log()[-2000:])
    s.request("DELETE", f"/v1/jobs/{job}")


def busy_solver(s):
    """The one process that solves. Another may be there and make memory ready, or rest: it takes a fifth of a second of
    processor while the others take none."""
    before = {}
    while True:
        now = {pid: seconds_of(pid) for pid in s.solvers()}
        grown = {pid: seconds - before.get(pid, 0) for pid, seconds in now.items()}
        busy = [pid for pid, seconds in grown.items() if seconds > 0.01]
        if len(busy) == 1 and grown[busy[0]] >= 0.2 and before.keys() == now.keys():
            return busy[0]
        if len(busy) > 1 or before.keys() != now.keys():
            before = now
        time.sleep(0.05)


@options("--workers", "2")
def test_a_death_is_one_jobs_alone(s):
    """The other job goes on, with its attempt; the one whose process died runs again, and ends right."""
    other = s.post(ENDLESS).json["id"]
    while s.get(f"/v1/jobs/{other}").json["progress"] < 10:
        time.sleep(0.02)
    others = [busy_solver(s)]  # another one may be there and idle: the service has one ready from its start
    slow = copy.deepcopy(SCENE)
    slow["problem"]["mesh"]["box"]["cells"] = [400, 130]
    job = s.post(slow).json["id"]
    while s.get(f"/v1/jobs/{job}").json["progress"] < 5:  # read: a process that dies before is no fault of its job
        time.sleep(0.01)
    os.kill((set(s.solvers()) - set(others)).pop(), signal.SIGSEGV)
    ended = s.wait_status(job, "successful")
    check(ended["attempts"] == 2, ended)
    check(s.get(f"/v1/jobs/{other}").json["attempts"] == 1)
    check([event["cause"] for event in s.events("process_died")] == ["signal 11"], s.events("process_died"))
    s.request("DELETE", f"/v1/jobs/{other}")
    s.wait_status(other, "dismissed")


def stopped_while_it_iterates(s, body):
    """A job whose process stands still after some rows of its history."""
    job = s.post(body).json["id"]
    while len(s.get(f"/v1/jobs/{job}/history").json.get("rows", ())) < 5:
        time.sleep(0.02)
    os.kill(s.solvers()[0], signal.SIGSTOP)
    return job


@options("--workers", "1", "--max-attempts", "1")
def test_a_job_that_is_ended_keeps_what_it_had(s):
    """By its limit, by a dismissal, by its process's death: rows of its history, and where the last one stands in words."""
    limited = {**ENDLESS, "solver": {**ENDLESS["solver"], "time_limit_s": 4}}
    job = stopped_while_it_iterates(s, limited)
    ended = s.wait_status(job, "failed")
    check(ended["error"]["code"] == "time_limit" and "come to iteration" in ended["error"]["detail"], ended)
    check("energy norm" in ended["error"]["detail"] or "iteration" in ended["error"]["detail"], ended)
    check(len(s.get(f"/v1/jobs/{job}/history").json["rows"]) >= 5)
    job = stopped_while_it_iterates(s, ENDLESS)
    expect(s.request("DELETE", f"/v1/jobs/{job}"), 200)
    check(s.wait_status(job, "dismissed")["summary"] is None)
    check(len(s.get(f"/v1/jobs/{job}/history").json["rows"]) >= 5)
    job = stopped_while_it_iterates(s, ENDLESS)
    os.kill(s.solvers()[0], signal.SIGKILL)
    ended = s.wait_status(job, "failed")
    check(ended["error"]["code"] == "process_died" and "come to iteration" in ended["error"]["detail"], ended)
    check(len(s.get(f"/v1/jobs/{job}/history").json["rows"]) >= 5)
    check(s.solve(MATRICES)["status"] == "successful")


@options("--workers", "1")
def test_ready_is_asked_of_a_process(s):
    """Not of the daemon, nor of one that works."""
    check(s.get("/readyz").status == 200 and len(s.solvers()) == 1)
    job = s.post(ENDLESS).json["id"]
    s.wait_status(job, "running")
    time.sleep(1.1)
    check(s.get("/readyz").status == 200 and s.get(f"/v1/jobs/{job}").json["status"] == "running")
    s.request("DELETE", f"/v1/jobs/{job}")
    s.wait_status(job, "dismissed")
    check(len(s.get("/v1/jobs").json["jobs"]) == 1)
    time.sleep(1.1)
    check(s.get("/readyz").status == 200, "that a job was to end is no word to the next question")


def seconds_of(pid):
    """Of a processor, so far."""
    return sum(map(int, pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13])) / 100


@options("--workers", "2")
def test_memory_ends_in_a_factorization(s):
    """The job fails with memory_limit, at once; its process lives, and the job beside it does not notice."""
    other = s.post(ENDLESS).json["id"]
    s.wait_status(other, "running")
    check(s.solve(MATRICES)["status"] == "successful")
    idle = set(s.solvers()) - {busy_solver(s)}
    for pid in idle:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
        room = 1024 * int(status.split("VmSize:")[1].split()[0]) + (200 << 20)  # analysis and threads take 130 MB, the factor 327
        resource.prlimit(pid, resource.RLIMIT_AS, (room, room))
    job = s.solve(cube(24))
    check(job["status"] == "failed" and job["error"]["code"] == "memory_limit" and "factor" in job["error"]["detail"], job)
    check(s.solve(MATRICES)["status"] == "successful" and idle and idle <= set(s.solvers()) and not s.events("process_died"))
    now = s.get(f"/v1/jobs/{other}").json
    check(now["status"] == "running" and now["attempts"] == 1, now)
    s.request("DELETE", f"/v1/jobs/{other}")
    s.wait_status(other, "dismissed")


@options("--workers", "1", "--log-level", "warn")
def test_memory_ends_anywhere(s):
    """Also where a library does not look at what it was given, as METIS while it orders: one attempt, memory_limit."""
    for megabytes in (20, 50, 80, *range(104, 153, 4), 160):
        s.restart()
        check(s.solve(MATRICES)["status"] == "successful")
        pid = s.solvers()[0]
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
        room = 1024 * int(status.split("VmSize:")[1].split()[0]) + (megabytes << 20)
        resource.prlimit(pid, resource.RLIMIT_AS, (room, room))
        job = s.solve(cube(24))
        check(job["status"] == "failed" and job["error"]["code"] == "memory_limit" and job["attempts"] == 1, megabytes, job)


@options("--workers", "1")
def test_an_idle_process_may_go(s):
    for _ in range(3):
        check(s.solve(MATRICES)["attempts"] == 1)
        os.kill(s.solvers()[0], signal.SIGKILL)
    body = json.dumps(MATRICES).encode()[:-1] + b" " * (2 << 20) + b"}"  # more than what stays in memory between jobs
    job = expect(s.request("POST", "/v1/jobs", body, {"Content-Type": "application/json", "Prefer": "wait=30"}), 200).json
    check(job["status"] == "successful" and job["attempts"] == 1, job)
    check(s.events("process_died") == [])


@options("--workers", "1")
def test_a_prediction_is_nobodys_danger(s):
    """It has a process of its own: one that dies leaves an answer, one that nobody waits for ends, and so does the next."""
    s.solve(MATRICES)
    own = s.solvers()

    def predictor():
        end = time.monotonic() + PATIENT_S
        while not (found := [pid for pid in s.solvers() if pid not in own]):
            check(time.monotonic() < end, "no process predicts")
            time.sleep(0.005)
        return found[0]

    with concurrent.futures.ThreadPoolExecutor(1) as aside:
        reply = aside.submit(s.post, LONG, query="?validate=true")
        time.sleep(0.1)
        os.kill(predictor(), signal.SIGKILL)
        check(expect(reply.result(), 200).json == {"valid": True, "predicted": None}, reply.result())
    check(len(s.events("prediction_died")) == 1)
    body = json.dumps(LONG).encode()
    for leaves in (False, True):  # another one waits for its turn meanwhile, and leaves too
        callers = [s.connect(timeout=PATIENT_S) for _ in range(1 + leaves)]
        for caller in callers:
            caller.sendall(b"POST /v1/jobs?validate=true HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                           b"Content-Length: %d\r\n\r\n" % len(body) + body)
        predictor()
        before = s.spent()
        for caller in reversed(callers):
            caller.close()
        wait_until(lambda: s.solvers() == own)
        check(s.spent() - before < 0.5, s.spent() - before)  # seconds of processor; all of it takes 0.9, or 1.2
    check(len(s.events("prediction_died")) == 1)
    check(expect(s.post(SCENE, query="?validate=true"), 200).json["predicted"]["d"] == 660 and s.solvers() == own)


@options("--workers", "1")
def test_processes_go_with_the_daemon(s):
    s.solve(MATRICES)
    pid = s.solvers()[0]
    s.terminate(number=signal.SIGKILL)
    end = time.monotonic() + PATIENT_S
    while os.path.exists(f"/proc/{pid}") and "Z" not in pathlib.Path(f"/proc/{pid}/stat").read_text().split()[2]:
        check(time.monotonic() < end, "it lives on")
        time.sleep(0.02)
    s.restart()


@options("--workers", "1")
def test_a_process_is_confined(s):
    """In all its threads; what the filter refuses is tried in tests/unit/server/work/test_confine.c."""
    s.solve(MATRICES)
    pid = s.solvers()[0]
    for task in os.listdir(f"/proc/{pid}/task"):
        status = dict(line.split(":\t", 1) for line in pathlib.Path(f"/proc/{pid}/task/{task}/status").read_text().splitlines())
        check(status["Seccomp"] == "2" and status["NoNewPrivs"] == "1", status)
    names = sorted(os.readlink(f"/proc/{pid}/fd/{fd}").split(":")[0] for fd in os.listdir(f"/proc/{pid}/fd"))
    check(names[:2] == ["/dev/null"] * 2 and names.count("/memfd") == 3 and names.count("socket") == 1 and len(names) == 7, names)
    check(s.events("process_not_confined") == [])
    # It may start no thread any more: those that touch pages and that compute aside are there already.
    threads = [pathlib.Path(f"/proc/{pid}/task/{task}/comm").read_text().strip() for task in os.listdir(f"/proc/{pid}/task")]
    check({"uzawad-pages", "uzawad-aside"} <= set(threads), threads)


@options(None)
def test_nobody_starts_one_by_hand(s):
    import subprocess
    done = subprocess.run(s.command("--solver-process", "1", "1000", "0"), capture_output=True, text=True, timeout=PATIENT_S)
    check(done.returncode == 2 and "how uzawad starts itself" in done.stderr, done)


if __name__ == "__main__":
    service.main(globals())
