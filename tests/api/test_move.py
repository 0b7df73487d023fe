"""uzawad --move: a file's jobs in every state, results, uploads, keys, webhooks and owners come over into PostgreSQL, and
the interface answers as before, byte for byte."""
# not under ThreadSanitizer: about a program of one thread
import contextlib
import json
import os
import signal
import sqlite3
import subprocess
import time

import databases
import service
from service import ENDLESS, MATRICES, PUSHED_OFF, SCENE, check, expect

SERVER = None
TOKENS = "ann submit ann-secret-is-long\nbob submit bob-secret-is-long\nroot admin root-secret-is-long\n"


def owner(name):
    return {"Authorization": f"Bearer {name}-secret-is-long"}


def move(build, *words, status=0, environment=None):
    run = subprocess.run([os.path.join(build, "uzawad"), "--move", *words], capture_output=True, text=True, timeout=120,
                         check=False, env={**os.environ, **(environment or {})})
    check(run.returncode == status, run)
    return run.stdout + run.stderr


@contextlib.contextmanager
def database():
    global SERVER
    SERVER = databases.shared()
    name = SERVER.database()
    yield SERVER.address(name), name


def fill(s):
    """Jobs in every state, of two owners; the daemon is killed while one runs. What was posted, by what it is."""
    with open(os.path.join(s.folder, "tokens"), "w", encoding="ascii") as file:
        file.write(TOKENS)
    os.chmod(os.path.join(s.folder, "tokens"), 0o600)
    s.options = ("--workers", "1", "--token-file", os.path.join(s.folder, "tokens"), "--webhook-allow", "127.0.0.1:9")
    s.db = os.path.join(s.folder, "contact.db")
    s.start()
    upload = s.request("POST", "/v1/uploads", MATRICES["problem"]["K"].encode(), owner("ann")).json["id"]
    s.request("POST", "/v1/uploads", MATRICES["problem"]["K"].encode(), owner("bob"))
    unused = s.request("POST", "/v1/uploads", os.urandom(2 << 20), owner("bob")).json["id"]
    empty = s.request("POST", "/v1/uploads", b"", owner("bob")).json.get("id")

    def post(body, who="ann", **headers):
        return expect(s.request("POST", "/v1/jobs", body, {**owner(who), **headers}), 202).json["id"]

    def ended(job, who="ann"):
        while (now := s.request("GET", f"/v1/jobs/{job}", headers={**owner(who), "Prefer": "wait=60"}).json)["status"] in (
                "accepted", "running"):
            pass
        return now["status"]
    jobs = {"keyed": post(MATRICES, **{"Idempotency-Key": "the key"}),
            "cases": post({**SCENE, "tags": ["a", "b\u00e4"], "cases": [
                {"name": n, "loads": SCENE["problem"]["loads"]} for n in ("x", "y")]}, "bob"),
            "large": post({**SCENE, "solver": {"method": "uzawa", "max_iterations": 12000,
                                               "accuracy": {"relative_error": 1e-15}}}, "bob"),
            "uploaded": post({"problem": {**MATRICES["problem"], "K": {"upload": upload}}}),
            "hooked": post({**MATRICES, "webhook": {"url": "http://127.0.0.1:9/told"}})}
    check([ended(job, "root") for job in jobs.values()] == ["successful"] * 5, "they did not all end well")
    failing = json.loads(json.dumps(SCENE))
    failing["problem"].update(PUSHED_OFF)
    jobs["failed"] = post(failing)
    check(ended(jobs["failed"]) == "failed")
    jobs["refined"] = expect(s.request("POST", f"/v1/jobs/{jobs['keyed']}/refine", {"accuracy": {"relative_error": 1e-12}},
                                       owner("ann")), 202).json["id"]
    ended(jobs["refined"])
    jobs["dismissed"] = post(ENDLESS)
    s.request("DELETE", f"/v1/jobs/{jobs['dismissed']}", headers=owner("ann"))
    check(ended(jobs["dismissed"]) == "dismissed")
    jobs["running"] = post(ENDLESS)
    while s.request("GET", f"/v1/jobs/{jobs['running']}", headers=owner("ann")).json["status"] != "running":
        time.sleep(0.02)
    jobs["waiting"] = post({**MATRICES, "priority": 3, "tags": ["later"]}, "bob")
    return jobs, [one for one in (upload, unused, empty) if one]


def answers(s, jobs, uploads):
    """What the interface says of everything that does not change by itself."""
    found = {}

    def ask(path, who="root", **headers):
        reply = s.request("GET", path, headers={**owner(who), **headers})
        found[path, who, str(headers)] = reply.status, reply.body.replace(s.url.encode(), b"URL")
    for name, job in jobs.items():
        if name in ("running", "waiting"):
            continue
        for who in ("root", "ann", "bob"):
            ask(f"/v1/jobs/{job}", who)
        for what in ("result", "result?fields=displacements,reactions,gaps,pressure,stress", "history", "history.csv",
                     "history?after=9000", "result.vtu", "convergence.svg", "result?case=y", "history?case=y"):
            ask(f"/v1/jobs/{job}/{what}")
    for upload in uploads:
        for who in ("root", "ann", "bob"):
            ask(f"/v1/uploads/{upload}", who)
            ask(f"/v1/uploads/{upload}", who, Accept="application/octet-stream")
    for which in ("tag=b%C3%A4", "status=failed", "status=dismissed"):
        for who in ("root", "ann", "bob"):
            ask(f"/v1/jobs?{which}", who)
    return found


def test_jobs_in_every_state(s):
    jobs, uploads = fill(s)
    with database() as (address, name):
        check("another daemon" in move(s.build, s.db, address, status=1), "a file in use was moved")
        before = answers(s, jobs, uploads)
        s.terminate(number=signal.SIGKILL)
        # cut off in the middle: it goes on
        told = move(s.build, s.db, address)
        check(f"{len(jobs)} jobs and {len(uploads)} uploads" in told and "; 0 and 0 of them" in told, told)
        SERVER.sql(name, f"DELETE FROM uzawa.job WHERE id IN ('{jobs['large']}', '{jobs['waiting']}')")
        told = move(s.build, s.db, address)
        check(f"; {len(jobs) - 2} and {len(uploads)} of them" in told, told)
        told = move(s.build, s.db, "--store", address)
        check(f"; {len(jobs)} and {len(uploads)} of them" in told, told)
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.job") == [[str(len(jobs))]], "a job is there twice")
        # what is other there is told
        other = "set_byte(data, 0, (get_byte(data, 0) + 1) % 256)"
        SERVER.sql(name, f"UPDATE uzawa.bundle SET data = {other}, sum = uzawa.bundle_sum(job, n, list, {other})"
                         f" WHERE job = '{jobs['cases']}'")
        check(f"job {jobs['cases']} is not there as it was" in move(s.build, s.db, address, status=1))
        SERVER.sql(name, f"DELETE FROM uzawa.job WHERE id = '{jobs['cases']}'")
        move(s.build, s.db, address)
        seconds = s.sql("SELECT name, round(seconds, 3) FROM client ORDER BY name")
        there = SERVER.sql(name, "SELECT name, round(seconds::numeric, 3) FROM uzawa.client ORDER BY name COLLATE \"C\"")
        check([[n, f"{x:.3f}"] for n, x in seconds] == there, seconds, there)
        hook = s.sql("SELECT state, attempts FROM webhook")
        check([list(map(str, row)) for row in hook] == SERVER.sql(name, "SELECT state, attempts FROM uzawa.webhook"), hook)
        s.db = address
        s.start()
        after = answers(s, jobs, uploads)
        for asked, reply in before.items():
            check(after[asked] == reply, asked, reply, after[asked])
        # a job that ran when its daemon was killed runs again, one that waited is solved, a key is known
        again = s.request("POST", "/v1/jobs", MATRICES, {**owner("ann"), "Idempotency-Key": "the key"})
        check(again.json["id"] == jobs["keyed"], again)
        while s.request("GET", f"/v1/jobs/{jobs['running']}", headers=owner("ann")).json["status"] != "running":
            time.sleep(0.02)
        check(s.request("GET", f"/v1/jobs/{jobs['running']}", headers=owner("ann")).json["attempts"] == 2)
        s.request("DELETE", f"/v1/jobs/{jobs['running']}", headers=owner("ann"))
        waiting = s.request("GET", f"/v1/jobs/{jobs['waiting']}", headers={**owner("bob"), "Prefer": "wait=60"}).json
        check(waiting["status"] == "successful" and waiting["priority"] == 3, waiting)
        check(s.request("POST", "/v1/admin/check", headers=owner("root")).json["whole"])


test_jobs_in_every_state.options = (None,)


def test_what_is_refused(s):
    with database() as (address, _):
        check("No such file" in move(s.build, os.path.join(s.folder, "none.db"), address, status=1))
        check("postgresql://" in move(s.build, os.path.join(s.folder, "none.db"), status=1))
        check("takes a file" in move(s.build, address, address, status=1))
        check("unexpected argument" in move(s.build, "a.db", address, "more", status=2))
        s.db = os.path.join(s.folder, "contact.db")
        s.start()
        job = s.solve(MATRICES)["id"]
        s.end()
        with contextlib.closing(sqlite3.connect(s.db)) as db, db:
            db.execute("UPDATE request SET body = CAST(body || ' ' AS BLOB) WHERE job = ?", (job,))
        told = move(s.build, s.db, address, status=1)
        check("is damaged" in told and job in told, told)


test_what_is_refused.options = (None,)


if __name__ == "__main__":
    service.main(globals())
