"""Several daemons on one database: any of them serves any request; one that is killed, stopped or cut off loses nothing
and writes nothing that is another's."""
# not under ThreadSanitizer: about many processes, of which each has the threads that these see:
# for ThreadSanitizer, any_daemon: workers, listeners and handlers on one database
# for ThreadSanitizer, a_wait_at_another: what is told by the database to who waits here
# for ThreadSanitizer, connections_that: connections to the database, which all threads share, are made anew
import collections
import concurrent.futures
import contextlib
import json
import os
import pathlib
import signal
import time

import databases
import service
from service import ENDLESS, MATRICES, SCENE, Service, check, expect, together, wait_until

LISTENERS = ("SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND application_name = 'uzawad'"
             " AND query ~ 'LISTEN|pg_notify|pg_terminate_backend'")
SERVER = None  # that of all tests, made by the first


@contextlib.contextmanager
def daemons(build, n, *options):
    """n daemons on a new database, and its name."""
    global SERVER
    SERVER = databases.shared()
    name = SERVER.database()
    some = [Service(build, "--workers", "1", *options, db=SERVER.address(name)) for _ in range(n)]
    try:
        together(Service.start, some)
        yield some, name
        live = [one for one in some if one.process.poll() is None]
        for one, status in zip(live, together(Service.end, live)):
            check(status == 0, one.log())
    finally:
        for one in some:
            if one.process and one.process.poll() is None:
                one.process.send_signal(signal.SIGCONT)
            one.stop()


def end_leases(name, daemon):
    """Of the jobs that this daemon runs, also by a claim that it left to PostgreSQL when it ended: as if the time were over."""
    now = SERVER.sql(name, "SELECT clock_timestamp()")[0][0]
    wait_until(lambda: SERVER.sql(name, f"SELECT count(*) FROM pg_stat_activity WHERE datname = '{name}' AND pid <> pg_backend_pid()"
                                        f" AND xact_start <= '{now}'") == [["0"]])
    SERVER.sql(name, f"UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1 AND node IN"
                     f" (SELECT id FROM uzawa.node WHERE pid = {daemon.process.pid})")


def run_by(both, job):
    """The daemon that runs the job, and the other one: once it says so, which is later than the database does."""
    a, b = both
    wait_until(lambda: any(event["job"] == job for one in both for event in one.events("job_started")))
    return (a, b) if any(event["job"] == job for event in a.events("job_started")) else (b, a)


def halt(daemon):
    """Returns once it does nothing more."""
    daemon.process.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, daemon.process.pid, os.WSTOPPED)


def numbered(i):
    """A problem of its own for each number, with a known answer: the force is 1 + i / 1000."""
    problem = json.loads(json.dumps(MATRICES))
    problem["problem"]["p"] = [2 + i / 1000, 2]
    return {**problem, "tags": [f"n{i}"]}


def force_of(daemon, job):
    return daemon.get(f"/v1/jobs/{job}/result").json["summary"]["contact"]["reaction_sum"]


def check_all(daemon, name, posted):
    """Each job that was acknowledged is there, ended well, with the answer of its own problem, once."""
    for job, i in posted.items():
        check(daemon.wait_status(job, "successful", "failed")["status"] == "successful", job)
        check(abs(abs(force_of(daemon, job)) - (1 + i / 1000)) < 1e-6, job, i, force_of(daemon, job))
    counts = dict(SERVER.sql(name, "SELECT status, jobs FROM uzawa.counted"))
    check(counts["0"] == counts["1"] == "0" and int(counts["2"]) >= len(posted), counts)
    twice = SERVER.sql(name, "SELECT job FROM (SELECT job, name, count(DISTINCT token) AS n FROM uzawa.pieces"
                             " GROUP BY 1, 2) AS each WHERE n > 1")
    check(not twice, "two results:", twice)
    check(daemon.request("POST", "/v1/admin/check").json["whole"], "the database is not whole")


def test_a_role_with_the_rights_of_the_documents(s):
    with daemons(s.build, 1) as ((owner,), name):
        check(owner.end() == 0, owner.log())
        SERVER.sql(name, "CREATE ROLE daemon LOGIN; GRANT USAGE ON SCHEMA uzawa TO daemon; GRANT SELECT, INSERT, UPDATE,"
                         " DELETE ON ALL TABLES IN SCHEMA uzawa TO daemon;"
                         " GRANT USAGE ON ALL SEQUENCES IN SCHEMA uzawa TO daemon;"
                         " REVOKE EXECUTE ON FUNCTION pg_terminate_backend FROM PUBLIC;"  # as some do
                         " INSERT INTO uzawa.node(id, host, pid, begun, seen) VALUES ('gone', '', 0, 0, 0)")
        other = Service(s.build, "--workers", "1", db=SERVER.address(name).replace("postgres@", "daemon@"))
        try:
            other.start()
            wait_until(lambda: not SERVER.sql(name, "SELECT 1 FROM uzawa.node WHERE id = 'gone'"))  # by its beat
            posted = {other.post(numbered(i)).json["id"]: i for i in range(5)}
            check_all(other, name, posted)
            job = next(iter(posted))
            expect(other.request("DELETE", f"/v1/jobs/{job}"), 204)
            check(not SERVER.sql(name, f"SELECT 1 FROM uzawa.pieces WHERE job = '{job}'"), "a result is left")
        finally:
            other.stop()


def test_any_daemon_serves_any_request(s):
    with daemons(s.build, 2, "--affinity-s", "0") as ((a, b), name):  # all jobs have one body: it would be one's alone
        posted = {a.post(numbered(i)).json["id"]: i for i in range(40)}
        check_all(b, name, posted)
        by = SERVER.sql(name, "SELECT count(*) FROM uzawa.node")
        check(by == [["2"]], by)
        check(b.events("job_ended") and a.events("job_ended"), "one of them did nothing")
        upload = a.request("POST", "/v1/uploads", MATRICES["problem"]["K"].encode()).json["id"]
        job = b.solve({"problem": {**MATRICES["problem"], "K": {"upload": upload}}})
        check(job["status"] == "successful", job)
        expect(a.request("DELETE", f"/v1/uploads/{upload}"), 409)
        # in chunks, which are followed while they are read: what libpq reads meanwhile is none of them
        for size in (1000, 1 << 20):
            sent = a.request("POST", "/v1/uploads", iter([bytes(size), b"x"]))
            check(expect(sent, 201).json["bytes"] == size + 1, sent)


def test_one_key_is_one_job_wherever_it_comes(s):
    with daemons(s.build, 2) as (both, name), concurrent.futures.ThreadPoolExecutor(8) as pool:
        def post(i):
            return both[i % 2].post(numbered(i // 8), {"Idempotency-Key": f"k{i // 8}"})
        replies = list(pool.map(post, range(80)))
        check(all(reply.status in (200, 201, 202) for reply in replies), replies)
        check(len({reply.json["id"] for reply in replies}) == 10, "keys made more than one job")
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.job") == [["10"]])


def test_a_wait_at_another_daemon_ends_with_the_job(s):
    with daemons(s.build, 2) as ((a, b), _):
        long = a.post(ENDLESS).json["id"]
        here, other = run_by((a, b), long)
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            waits = pool.submit(other.get, f"/v1/jobs/{long}", Prefer="wait=60")
            time.sleep(0.5)
            begun = time.monotonic()
            # told to end at the one that does not run it
            check(other.request("DELETE", f"/v1/jobs/{long}").status in (200, 202))
            job = waits.result().json
        check(job["status"] == "dismissed" and time.monotonic() - begun < 40, job, time.monotonic() - begun)
        check(here.get(f"/v1/jobs/{long}").json["status"] == "dismissed")


def node_named(daemon, name):
    return next(one for one in daemon.get("/v1/nodes").json["nodes"] if one["name"] == name)


def metric(daemon, name):
    return float(daemon.get("/metrics").body.decode().split(f"\n{name} ")[1].split()[0])


def test_nodes_and_the_drain_of_one(s):
    with daemons(s.build, 2) as ((a, b), _):
        for one, name in ((a, "left"), (b, "right")):
            one.terminate()
            one.options += ("--node", name)
            one.start()
        wait_until(lambda: {one["name"] for one in b.get("/v1/nodes").json["nodes"]} == {"left", "right"})
        check(metric(a, "uzawad_nodes") == 2)
        expect(a.request("POST", "/v1/nodes/middle/drain"), 404, "not_found")
        long = a.post(ENDLESS).json["id"]
        runs, other = run_by((a, b), long)
        name = "left" if runs is a else "right"
        wait_until(lambda: node_named(other, name)["running"] == 1)
        check(expect(other.request("POST", f"/v1/nodes/{name}/drain"), 200).json["nodes"])
        wait_until(lambda: runs.get("/readyz").status == 503)
        expect(runs.get("/readyz"), 503, "draining")
        check(node_named(other, name)["state"] == "draining" and metric(runs, "uzawad_draining") == 1)
        started = len(runs.events("job_started"))
        for i in range(6):  # also those that come to it are run by the other
            check(runs.solve(numbered(i))["status"] == "successful")
        check(len(runs.events("job_started")) == started, "a node that is drained claimed a job")
        check(runs.get(f"/v1/jobs/{long}").json["status"] == "running", "what it runs goes on")
        runs.request("DELETE", f"/v1/jobs/{long}")
        runs.wait_status(long, "dismissed")
        expect(other.request("DELETE", f"/v1/nodes/{name}/drain"), 200)
        wait_until(lambda: runs.get("/readyz").status == 200)
        expect(other.request("POST", f"/v1/nodes/{'right' if runs is a else 'left'}/drain"), 200)
        check(other.solve(numbered(7))["status"] == "successful")
        check(len(runs.events("job_started")) == started + 1)


def body_of(young):
    """A scene whose factor is its own, and worth to be kept."""
    problem = json.loads(json.dumps(SCENE))
    problem["problem"]["mesh"]["box"]["cells"] = [90, 30]
    problem["problem"]["materials"][0]["young"] = young
    return problem


def test_jobs_go_where_the_factor_of_their_body_is(s):
    with daemons(s.build, 2) as (both, _):
        for i in range(48):  # each body eight times, posted to either of them
            check(both[i % 2].solve(body_of(1e5 + i % 6))["status"] == "successful")
        missed = sum(metric(one, "uzawad_cache_misses_total") for one in both)
        held = sum(metric(one, "uzawad_claims_body_held_total") for one in both)
        check(missed <= 9, missed, "factorizations of 6 bodies; by chance there would be 12")
        check(held >= 36, held)
        wait_until(lambda: len({body for one in both[0].get("/v1/nodes").json["nodes"] for body in one["bodies"]}) == 6)


def test_a_job_does_not_wait_for_long_for_who_has_its_body(s):
    with daemons(s.build, 2) as ((a, b), _):
        first = a.solve(body_of(1e5))
        check(first["status"] == "successful")
        holder, other = run_by((a, b), first["id"])
        # it has something else to do
        other_name = next(one["name"] for one in a.get("/v1/nodes").json["nodes"] if one["pid"] == other.process.pid)
        expect(a.request("POST", f"/v1/nodes/{other_name}/drain"), 200)
        long = a.post(ENDLESS).json["id"]
        holder.wait_status(long, "running")
        expect(a.request("DELETE", f"/v1/nodes/{other_name}/drain"), 200)
        check(a.solve(body_of(1e5))["status"] == "successful")
        check(metric(other, "uzawad_claims_body_others_total") == 1)
        a.request("DELETE", f"/v1/jobs/{long}")


def test_a_token_asks_as_often_of_all_as_of_one(s):
    token = {"Authorization": "Bearer 0123456789abcdef0123456789abcdef"}
    with daemons(s.build, 0) as (_, name):
        some = [Service(s.build, "--workers", "1", "--max-client-rate", "2", db=SERVER.address(name)) for _ in range(2)]
        try:
            for one in some:
                tokens = pathlib.Path(one.folder, "tokens")
                tokens.write_text(f"all admin {token['Authorization'].split()[1]}\n", encoding="ascii")
                tokens.chmod(0o600)
                one.options += ("--token-file", str(tokens))
                one.start()
            begun, taken, asked = time.monotonic(), 0, 0
            while time.monotonic() < begun + 4 or asked < 60:
                asked += 2
                taken += sum(one.request("GET", "/v1/limits", headers=token).status == 200 for one in some)
                time.sleep(0.02)
            seconds = time.monotonic() - begun
            # each begins with 4 of its own, and goes on with 2 a second where it is alone
            check(4 < taken < 8 + 3 * seconds, taken, asked, seconds)
        finally:
            for one in some:
                one.stop()


def test_one_is_killed(s):
    with daemons(s.build, 2) as ((a, b), name):
        posted = {}
        for i in range(60):
            posted[a.post(numbered(i)).json["id"]] = i
        a.process.kill()
        a.process.wait()
        end_leases(name, a)
        check_all(b, name, posted)


def test_one_that_begins_anew_takes_up_its_jobs(s):
    with daemons(s.build, 1) as ((a,), _):
        job = a.post(ENDLESS).json["id"]
        a.wait_status(job, "running")
        a.process.kill()
        a.process.wait()
        a.start()  # the lease is good for most of a minute
        wait_until(lambda: a.get(f"/v1/jobs/{job}").json["attempts"] == 2, seconds=40)
        check([event["requeued"] for event in a.events("recovered")] == [1], a.events("recovered"))
        check(len(a.get("/v1/nodes").json["nodes"]) == 1, "its former self is a node")
        a.request("DELETE", f"/v1/jobs/{job}")


def test_one_is_stopped_past_its_lease(s):
    with daemons(s.build, 2) as ((a, b), name):
        for cells in (300, 420, 600):  # one that ends before its daemon is stopped is followed by a larger one
            job = a.post({**SCENE, "problem": {**SCENE["problem"], "mesh": {"box": {
                "size": [60, 20], "cells": [cells, 100], "element": "quad4"}}}}).json["id"]
            stopped, other = run_by((a, b), job)
            halt(stopped)
            end_leases(name, stopped)
            found = other.wait_status(job, "successful", "failed")
            if found["attempts"] > 1:
                break
            stopped.process.send_signal(signal.SIGCONT)
        check(found["status"] == "successful" and found["attempts"] == 2, found)
        before = other.get(f"/v1/jobs/{job}/result").body
        stopped.process.send_signal(signal.SIGCONT)
        wait_until(lambda: stopped.events("result_not_wanted") or stopped.events("job_taken_over"))
        check(other.get(f"/v1/jobs/{job}/result").body == before, "an owner whose lease was over wrote")
        check(not any(event["job"] == job for event in stopped.events("job_ended")), stopped.events("job_ended"))
        check(SERVER.sql(name, f"SELECT count(DISTINCT token) FROM uzawa.pieces WHERE job = '{job}'") == [["1"]])
        check(stopped.solve(numbered(1))["status"] == "successful", "it serves on")


def test_one_is_stopped_in_the_midst_of_a_transaction(s):
    """What it has locked is free again, though its connection stands: its job is run by another. Where nothing is locked
    it may send a large request on a slow way."""
    with daemons(s.build, 2) as ((a, b), name):
        job = a.post(ENDLESS).json["id"]
        stopped, other = run_by((a, b), job)
        halt(stopped)
        with (SERVER.silent(name, "SELECT 42"), SERVER.silent(name, "SELECT 43, uzawa.take_queue(true)"),
              SERVER.silent(name, f"SELECT 1 FROM uzawa.job WHERE id = '{job}' FOR UPDATE")):
            wait_until(lambda: SERVER.sql(name, "SELECT 1 FROM pg_stat_activity WHERE query LIKE '%FOR UPDATE' AND"
                                                " wait_event = 'ClientRead' AND state = 'active'"))
            SERVER.sql(name, f"DELETE FROM uzawa.node WHERE pid = {stopped.process.pid}")  # its jobs are nobody's from here on
            wait_until(lambda: any(event["job"] == job for event in other.events("job_started")), seconds=60)
            wait_until(lambda: not SERVER.sql(name, "SELECT 1 FROM pg_stat_activity WHERE query LIKE 'SELECT 43%'"))
            check(SERVER.sql(name, "SELECT 1 FROM pg_stat_activity WHERE query = 'SELECT 42'"), "it was cut off")
        stopped.process.send_signal(signal.SIGCONT)
        other.request("DELETE", f"/v1/jobs/{job}")


def test_the_database_is_away_for_a_while(s):
    with daemons(s.build, 1) as ((a,), name):
        posted = {a.post(numbered(i)).json["id"]: i for i in range(5)}
        slow = {**SCENE, "problem": {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": [300, 100],
                                                                         "element": "quad4"}}}}
        job = a.post(slow).json["id"]
        a.wait_status(job, "running")
        SERVER.stop()
        refused = expect(a.get(f"/v1/jobs/{job}"), 503, "store_unavailable")
        check(int(refused.headers["retry-after"]) > 0)
        expect(a.post(numbered(9), {"Idempotency-Key": "later"}), 503, "store_unavailable")
        expect(a.get("/readyz"), 503, "store_unavailable")
        wait_until(lambda: a.events("store_failed"))  # it has its answer, and nowhere to put it
        SERVER.start()
        wait_until(lambda: a.get(f"/v1/jobs/{job}").status == 200)
        found = a.wait_status(job, "successful", "failed")
        check(found["status"] == "successful" and found["attempts"] == 1, found)
        last = a.post(numbered(9), {"Idempotency-Key": "later"}).json["id"]
        check_all(a, name, {**posted, last: 9})


def test_messages_that_stay_away_keep_no_job_waiting(s):
    """Connections that listen answer no more, and are not closed: the others find what waits, before 45 s show that."""
    with daemons(s.build, 2) as (both, name):
        busy = both[0].post(ENDLESS).json["id"]
        runs, idle = run_by(both, busy)
        wait_until(lambda: int(SERVER.sql(name, LISTENERS)[0][0]) == 2)
        pids = [int(row[0]) for row in SERVER.sql(name, LISTENERS.replace("count(*)", "pid"))]
        try:
            for pid in pids:
                os.kill(pid, signal.SIGSTOP)
            job = runs.post(numbered(1)).json["id"]
            wait_until(lambda: idle.get(f"/v1/jobs/{job}").json["status"] == "successful", seconds=30)
        finally:
            for pid in pids:
                os.kill(pid, signal.SIGCONT)
        runs.request("DELETE", f"/v1/jobs/{busy}")


def test_a_database_that_stands_still_is_no_end_of_the_daemon(s):
    """Who supervises it asks /healthz, and would restart what does not answer; other questions wait for 45 s."""
    with daemons(s.build, 1) as ((a,), name), concurrent.futures.ThreadPoolExecutor(12) as pool:
        def connections():
            list(pool.map(lambda _: a.get("/v1/jobs"), range(24)))
            return [int(row[0]) for row in SERVER.sql(name, "SELECT pid FROM pg_stat_activity WHERE application_name = 'uzawad'"
                                                            " AND datname = current_database()")]
        wait_until(lambda: len(connections()) >= 6)
        stopped = [SERVER.process.pid, *connections()]  # nor is there a new one
        try:
            for pid in stopped:
                os.kill(pid, signal.SIGSTOP)
            check(a.request("GET", "/healthz", timeout=30).json["status"] == "store_unavailable")
            expect(a.request("GET", "/metrics", timeout=60), 200)
        finally:
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
        wait_until(lambda: a.get("/healthz").json["status"] == "ok")


def test_connections_that_are_cut_lose_nothing(s):
    with daemons(s.build, 2) as ((a, b), name), concurrent.futures.ThreadPoolExecutor(4) as pool:
        outcomes = collections.Counter()

        def post(i):
            for attempt in range(40):
                reply = (a, b)[i % 2].post(numbered(i), {"Idempotency-Key": f"cut{i}"})
                outcomes[reply.status] += 1
                if reply.status < 300:
                    return reply.json["id"], i
                check(reply.status == 503, reply)
                time.sleep(0.05 * (attempt + 1))
            raise AssertionError(f"{i} was never taken")
        ends = pool.submit(lambda: SERVER.sql("postgres", f"""DO $$ BEGIN FOR i IN 1..20 LOOP
            PERFORM pg_sleep(0.2), pg_stat_clear_snapshot();
            PERFORM pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}';
            END LOOP; END $$"""))
        posted = dict(pool.map(post, range(60)))
        ends.result()
        check(len(posted) == 60, len(posted), outcomes)
        # one whose claim was cut off waits for the end of a lease that nobody knows of
        for one in (a, b):
            if SERVER.sql(name, "SELECT 1 FROM uzawa.job WHERE status = 1"):
                time.sleep(2)
                end_leases(name, one)
        check_all(a, name, posted)
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.job") == [["60"]], "a submission was carried out twice")


if __name__ == "__main__":
    service.main(globals())
