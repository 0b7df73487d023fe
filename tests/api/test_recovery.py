"""Nothing that was acknowledged is lost, whenever the daemon dies, and nothing is done twice.
usage: test_recovery.py BUILD_DIR [FILTER]
"""
# not under ThreadSanitizer: a process that is killed tells of no race, and its file has no threads; but
# for ThreadSanitizer, killed_during_submission: many post while it starts anew
# for ThreadSanitizer, job_that_kills: a process ends beside the one who watches it
# for ThreadSanitizer, drain_leaves: workers, jobs and the drain end together
import collections
import copy
import http.client
import json
import os
import random
import resource
import signal
import subprocess
import tempfile
import threading
import time

import service
from service import ENDLESS, INSTRUMENTED, MATRICES, PATIENT_S, SCENE, check, expect, options, wait_until

ALL_FIELDS = "?fields=summary,reactions,gaps,displacements"


def scene(cells, **solver):
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = list(cells)
    return {**request, "solver": solver}


# Requests and their minimum energies; the third takes some tenths of a second, the fifth has a larger factor. An
# instrumented daemon is slow enough without the plain method, and with smaller bodies.
MIX = [(MATRICES, -2.75), (scene((30, 10)), -3.9608186040e-3)]
MIX += [(scene((30, 10), method="accelerated_restart", operator="factored"), -3.9608186040e-3),
        (scene((30, 10), operator="factored"), -3.9608186040e-3),
        (scene((60, 20)), -3.9620174378e-3)] if INSTRUMENTED else [
            (scene((30, 10), method="uzawa", operator="factored"), -3.9608186040e-3),
            (scene((60, 20), operator="factored"), -3.9620174378e-3), (scene((120, 40)), -3.9624809230e-3)]


# A daemon with a sanitizer is killed in the same ways, with fewer of them.
JOBS, SLOW, KILLS = (10, 12, 3) if INSTRUMENTED else (50, 12, 8)


# ---------------------------------------------------------------- helpers

def submit(s, count, headers=None):
    """Posts `count` jobs of the mix and returns {id: energy}."""
    acknowledged = {}
    for i in range(count):
        request, energy = MIX[i % len(MIX)]
        job = expect(s.post({**request, "tags": [f"number {i}"]}, headers), 202).json
        acknowledged[job["id"]] = energy
    check(len(acknowledged) == count, "two jobs have one id")
    return acknowledged


def fetch(s, path):
    """(status, body) as it came: long arrays are quick to read and slow to check against a schema."""
    connection = http.client.HTTPConnection(s.host, s.port, timeout=60)
    try:
        connection.request("GET", path)
        reply = connection.getresponse()
        return reply.status, reply.read()
    finally:
        connection.close()


def fetch_json(s, path):
    status, body = fetch(s, path)
    check(status == 200, path, status, body)
    return json.loads(body)


def counts(s):
    return expect(s.get("/readyz"), 200).json["jobs"]


def wait_idle(s, seconds=120):
    end = time.monotonic() + seconds
    while (now := counts(s))["accepted"] + now["running"] > 0:
        check(time.monotonic() < end, "still not done:", now, s.log()[-2000:])
        time.sleep(0.05)


def listed(s):
    """Every job there is, by id, over all pages."""
    found, cursor = [], ""
    while cursor is not None:
        page = expect(s.get("/v1/jobs?limit=17" + (f"&cursor={cursor}" if cursor else "")), 200).json
        found += page["jobs"]
        cursor = page["next"]
    jobs = {job["id"]: job for job in found}
    check(len(jobs) == len(found), "a job is listed twice")
    return jobs


def check_all_successful(s, acknowledged):
    """Every acknowledged job, and no other, ended with the right answer and exactly one result."""
    wait_idle(s)
    jobs = listed(s)
    check(set(jobs) == set(acknowledged), "lost:", set(acknowledged) - set(jobs), "new:", set(jobs) - set(acknowledged))
    for job_id, energy in acknowledged.items():
        job = jobs[job_id]
        check(job["status"] == "successful" and job["progress"] == 100, job)
        check(job["summary"]["outcome"] == "converged", job)
        check(abs(job["summary"]["energy"]["primal"] - energy) <= 1e-8 * abs(energy), energy, job)
        check(job["created"] <= job["started"] <= job["finished"] and job["attempts"] >= 1, job)
        result = fetch_json(s, f"/v1/jobs/{job_id}/result{ALL_FIELDS}")
        check(result["job"] == job_id and result["summary"] == job["summary"], job_id)
        check(len(result["reactions"]) == job["summary"]["problem"]["m"] == len(result["gaps"]), job_id)
        check(len(result["displacements"]) > 0, job_id)
        iterations = job["summary"]["iterations"]
        check(fetch_json(s, f"/v1/jobs/{job_id}/history?after={iterations - 2}")["rows"][-1][0] == iterations, job)
    ended = collections.Counter(event["job"] for event in s.events("job_ended"))
    check(not ended or max(ended.values()) == 1, "ended twice:", ended.most_common(3))
    return jobs


def check_file(s):
    """The database after the daemon has ended: sound, and without rows of nobody's."""
    s.end()
    check(s.sql("PRAGMA integrity_check") == [("ok",)], "the file is damaged")
    check(s.sql("PRAGMA foreign_key_check") == [], "rows that belong to no job")
    check(s.sql("SELECT count(*) FROM job WHERE owner IS NOT NULL AND status = 1") == [(0,)])


# ---------------------------------------------------------------- kill -9

@options("--workers", "2")
def test_killed_with_many_jobs(s):
    acknowledged = submit(s, JOBS)
    done = {job_id: job for job_id, job in listed(s).items() if job["status"] == "successful"}
    # Posted last, so that the kill meets running jobs even where all others were done meanwhile.
    slow, energy = MIX[2]
    acknowledged |= {expect(s.post(slow), 202).json["id"]: energy for _ in range(SLOW)}
    before = counts(s)
    check(before["running"] > 0 and before["accepted"] >= 1, "too few were left to be killed:", before)
    check(s.restart() == -signal.SIGKILL)
    jobs = check_all_successful(s, acknowledged)
    check(all(job["attempts"] <= 2 for job in jobs.values()), jobs)
    check(any(job["attempts"] == 2 for job in jobs.values()), "none was running when it was killed")
    for job_id, job in done.items():
        check(jobs[job_id] == job, "an ended job changed:", job, jobs[job_id])
    check(len(s.events("recovered")) == 1, s.events("recovered"))
    check_file(s)


@options("--workers", "2", "--max-attempts", "100")
def test_killed_again_and_again(s):
    acknowledged = submit(s, JOBS)
    randomly = random.Random(7)
    for kill in range(KILLS):
        if kill == 0:  # meets a job surely, others as it happens
            wait_until(lambda: counts(s)["running"] > 0)
        else:
            time.sleep(randomly.uniform(0, 0.2))
        check(s.restart() == -signal.SIGKILL)
        check(set(listed(s)) == set(acknowledged), "jobs were lost or made")
    jobs = check_all_successful(s, acknowledged)
    check(max(job["attempts"] for job in jobs.values()) >= 2, "no kill met a running job")
    check_file(s)


class Submitters:
    """Threads that post with a key each until they are told to stop or the daemon is gone."""

    def __init__(self, s, threads):
        self.s, self.lock, self.stopped = s, threading.Lock(), False
        self.acknowledged, self.unsure = {}, {}
        self.threads = [threading.Thread(target=self.run, args=(i,)) for i in range(threads)]
        for thread in self.threads:
            thread.start()

    def run(self, number):
        for i in range(100000):
            key = f"{number}-{i}"
            request, energy = MIX[(number + i) % 2]
            if self.stopped:
                return
            try:
                reply = self.s.post(request, {"Idempotency-Key": key})
            except (OSError, http.client.HTTPException):
                with self.lock:
                    self.unsure[key] = (request, energy)
                return
            check(reply.status == 202, reply)
            with self.lock:
                self.acknowledged[key] = (reply.json["id"], request, energy)

    def join(self):
        self.stopped = True
        for thread in self.threads:
            thread.join(timeout=60)


@options("--workers", "2", "--max-attempts", "100")
def test_killed_during_submission(s):
    """Each 202 that somebody has read is a promise; a request without an answer may be there or not, once."""
    promised, energies = {}, {}
    for count in (1, 8, 25):
        submitters = Submitters(s, 4)
        end = time.monotonic() + PATIENT_S
        while len(submitters.acknowledged) < count and time.monotonic() < end:
            time.sleep(0.002)
        s.process.kill()
        submitters.join()
        s.restart()
        jobs = listed(s)
        for key, (job_id, request, energy) in submitters.acknowledged.items():
            check(job_id in jobs, key, "was acknowledged and is lost")
            again = s.post(request, {"Idempotency-Key": key})
            check(again.status in (200, 202) and again.json["id"] == job_id, "the key makes another job:", again)
            promised[job_id] = energy
        for key, (request, energy) in submitters.unsure.items():
            job_id = s.post(request, {"Idempotency-Key": key}).json["id"]
            energies[job_id] = energy
        wait_idle(s)
        s.sql("UPDATE job SET idempotency_key = NULL")  # so that the next round's keys are new ones
    check(len(promised) > 20, "hardly anything was submitted:", len(promised))
    check_all_successful(s, {**promised, **energies})
    check_file(s)


def iterates(s, job_id):
    return s.get(f"/v1/jobs/{job_id}").json["progress"] > 5 and len(s.get(f"/v1/jobs/{job_id}/history").json["rows"]) > 0


@options("--workers", "1", "--max-attempts", "1")
def test_the_end_of_the_daemon_fails_no_job(s):
    job_id = s.post(ENDLESS).json["id"]
    for attempt in (1, 2, 3):
        wait_until(lambda: s.get(f"/v1/jobs/{job_id}").json["attempts"] == attempt)
        s.restart()
    check(s.get(f"/v1/jobs/{job_id}").json["status"] in ("accepted", "running"))


@options("--workers", "2", "--max-attempts", "2")
def test_job_that_kills_is_given_up(s):
    """A job whose process dies is tried again, so often and no more; the daemon's own end counts ten times less."""
    deadly = [s.post(ENDLESS).json["id"] for _ in range(2)]
    waiting = s.post(MATRICES).json["id"]
    for attempt in (1, 2):
        for job_id in deadly:
            wait_until(lambda: s.get(f"/v1/jobs/{job_id}").json["attempts"] == attempt and iterates(s, job_id))
        check(s.get(f"/v1/jobs/{waiting}").json["status"] == "accepted")
        for pid in s.solvers():
            os.kill(pid, signal.SIGKILL)
    for job_id in deadly:
        job = s.wait_status(job_id, "failed")
        check(job["attempts"] == 2 and job["error"]["code"] == "process_died", job)
        check("signal 9" in job["error"]["detail"] and job["finished"], job)
        expect(s.get(f"/v1/jobs/{job_id}/result"), 409, "job_failed")
    job = s.wait_status(waiting, "successful")  # nobody else suffers
    check(job["attempts"] == 1, job)
    check(s.get("/v1/jobs?status=failed").json["jobs"][0]["id"] in deadly)
    s.restart()
    check([s.get(f"/v1/jobs/{job_id}").json["status"] for job_id in deadly] == ["failed"] * 2, "they came back")


@options("--workers", "1")
def test_dismissed_stays_dismissed(s):
    first, second = s.post(ENDLESS).json["id"], s.post(ENDLESS).json["id"]
    s.wait_status(first, "running")
    expect(s.request("DELETE", f"/v1/jobs/{second}"), 200)
    expect(s.request("DELETE", f"/v1/jobs/{first}"), 200)
    before = s.wait_status(first, "dismissed")
    s.restart()
    check(s.get(f"/v1/jobs/{first}").json == before)
    check(s.get(f"/v1/jobs/{second}").json["status"] == "dismissed" and counts(s)["running"] == 0, counts(s))
    expect(s.request("DELETE", f"/v1/jobs/{first}"), 204)
    s.restart()
    expect(s.get(f"/v1/jobs/{first}"), 404, "not_found")


# ---------------------------------------------------------------- SIGTERM

@options("--workers", "2", "--drain-s", "0.3")
def test_drain_leaves_the_rest_for_the_next_start(s):
    endless = [s.post(ENDLESS).json["id"] for _ in range(2)]
    for job_id in endless:
        s.wait_status(job_id, "running")
    acknowledged = submit(s, JOBS // 2)
    started = time.monotonic()
    check(s.restart(signal.SIGTERM) == 0, s.log()[-2000:])
    check(time.monotonic() - started < 40, "the drain took", time.monotonic() - started)
    check(len(s.events("stopped")) == 1, s.log()[-2000:])
    for job_id in endless:
        check(s.wait_status(job_id, "running")["attempts"] == 1, "a release is no attempt")
        expect(s.request("DELETE", f"/v1/jobs/{job_id}"), 200)
        s.wait_status(job_id, "dismissed")
        expect(s.request("DELETE", f"/v1/jobs/{job_id}"), 204)
    jobs = check_all_successful(s, acknowledged)
    check(all(job["attempts"] == 1 for job in jobs.values()), jobs)
    check_file(s)


@options("--workers", "2", "--drain-s", "60")
def test_drain_finishes_what_runs(s):
    acknowledged = submit(s, JOBS // 2)
    before = counts(s)
    check(before["running"] > 0 and before["accepted"] > 0, before)
    check(s.restart(signal.SIGTERM) == 0, s.log()[-2000:])
    check(s.events("job_released") == [], "a job that could have ended was put back")
    jobs = check_all_successful(s, acknowledged)
    check(all(job["attempts"] == 1 for job in jobs.values()), jobs)
    check_file(s)


@options("--workers", "2", "--drain-s", "0.1")
def test_terminated_while_metis_orders(s):
    """METIS takes SIGTERM for itself while it runs. The daemon must end in order all the same, each time."""
    ids, delays = [], (0.0, 0.02, 0.04, 0.06, 0.1, 0.14, 0.18, 0.25)[::3 if INSTRUMENTED else 1]
    for round_, delay in enumerate(delays):
        # Other meshes each time, so that nothing is cached and both workers order.
        ids += [s.post(scene(((120 if INSTRUMENTED else 240) + 2 * round_ + i, 80), ordering="metis", operator="condensed")).json["id"] for i in range(2)]
        time.sleep(delay)
        status = s.restart(signal.SIGTERM)
        check(status == 0, "exit status", status, "after", delay, s.log()[-3000:])
    wait_idle(s)
    for job_id in ids:
        job = s.get(f"/v1/jobs/{job_id}").json
        check(job["status"] == "successful" and job["summary"]["factor"]["ordering"] == "metis", job)
    check(len(s.events("stopped")) == len(delays), len(s.events("stopped")))


# ---------------------------------------------------------------- what is kept

@options("--workers", "2")
def test_everything_survives_byte_for_byte(s):
    ids = [s.solve({**request, "tags": ["a", "\u00e9\u4e16\"\\"]})["id"] for request, _ in MIX]
    failed = copy.deepcopy(MATRICES)
    failed["problem"]["K"] = failed["problem"]["K"].replace("2 2 1\n", "2 2 -1\n")
    ids.append(s.solve(failed)["id"])
    endless = s.post(ENDLESS).json["id"]
    s.wait_status(endless, "running")
    time.sleep(0.2)
    expect(s.request("DELETE", f"/v1/jobs/{endless}"), 200)
    s.wait_status(endless, "dismissed")
    ids.append(endless)
    paths = ["/v1/jobs", "/v1/jobs?tag=a", "/v1/jobs?status=failed"] + [
        f"/v1/jobs/{job_id}{rest}" for job_id in ids
        for rest in ("", "/result", f"/result{ALL_FIELDS}", "/history", "/history.csv", "/history?after=3")]
    before = {path: fetch(s, path) for path in paths}
    check(sum(status == 200 for status, _ in before.values()) > 30, [(path, got[0]) for path, got in before.items()])
    for number in (signal.SIGKILL, signal.SIGTERM):
        s.restart(number)
        for path in paths:
            check(fetch(s, path) == before[path], path, "changed:", before[path][1][:500], fetch(s, path)[1][:500])
    check_file(s)


def test_long_history_survives(s):
    job = s.solve({**scene((60, 20), method="uzawa", stopping="paper", epsilon=1e-9, max_iterations=5000), "tags": []})
    before = fetch_json(s, f"/v1/jobs/{job['id']}/history")
    check(len(before["rows"]) > 1000, len(before["rows"]))
    s.restart()
    check(fetch_json(s, f"/v1/jobs/{job['id']}/history") == before, "the history changed")


def test_database_copied_while_it_ran_is_usable(s):
    """What a kill leaves is a file and its journal: both belong together and nothing else is needed."""
    job = s.solve(MATRICES)
    s.process.kill()
    s.process.wait()
    target = os.path.join(s.folder, "moved.db")
    for suffix in ("", "-wal"):
        if os.path.exists(s.file() + suffix):
            os.rename(s.file() + suffix, target + suffix)
    s.db = target
    s.restart()
    check(s.get(f"/v1/jobs/{job['id']}").json == job, json.dumps(job))


@options("--workers", "1", "--max-solve-s", "0.5")
def test_a_result_waits_for_room_on_the_disk(s):
    """A disk that is full when a job ends: once there is room the result is kept, without a restart and another run."""
    s.file()
    job = s.post(ENDLESS).json["id"]
    s.wait_status(job, "running")
    no_limit = resource.RLIM_INFINITY
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (1, no_limit))
    time.sleep(6)  # longer than a failure of the store that is none of room is put up with
    check(s.get(f"/v1/jobs/{job}").json["status"] == "running")
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (no_limit, no_limit))
    job = s.wait_status(job, "successful", "failed")
    check(job["attempts"] == 1 and job["summary"]["outcome"] == "time_limit", job)
    check(s.solve(MATRICES)["status"] == "successful")


@options(None)
def test_a_start_on_a_full_disk(s):
    """What is kept for deletions lets the service start, too, and delete; without it the refusal says what is lacking."""
    script = '''mount -t tmpfs -o size=8m tmpfs "$1" && cd "$1" || exit 77
        begin() {
            : >"$3/out"
            "$2" --listen 127.0.0.1:0 --db a.db --workers 1 >"$3/out" 2>"$3/log" & one=$!
            while kill -0 $one 2>/dev/null && [ ! -s "$3/out" ]; do sleep 0.1; done
            kill $one 2>/dev/null; wait $one; cat "$3/out"
        }
        begin "$@"; cat /dev/zero >fill 2>/dev/null; stat -c %s a.db-spare
        begin "$@"; stat -c %s a.db-spare
        begin "$@"; rm a.db-spare; cat /dev/zero >more 2>/dev/null
        begin "$@"; cat "$3/log" >&2'''
    with tempfile.TemporaryDirectory() as beside:
        got = subprocess.run(["unshare", "-rm", "sh", "-c", script, "sh", s.folder, os.path.abspath(s.command()[0]), beside], capture_output=True, text=True,
                             timeout=service.PATIENT_S, check=False)
    if got.returncode == 77 or "unshare" in got.stderr:
        raise service.Skip("no file system can be mounted here")
    lines = got.stdout.splitlines()
    check([line.startswith("listening on ") for line in lines] == [True, False, True, False, True], got)
    check(int(lines[1]) == 4 << 20 and int(lines[3]) > 3 << 20, lines)
    check("no room" in got.stderr.splitlines()[-1], got.stderr)


if __name__ == "__main__":
    service.main(globals())
