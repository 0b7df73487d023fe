"""What a service meets in a long life, each as a function of its length that returns its figures as a dictionary.

The short forms are tests (tests/api/test_soak.py), the long ones `make soak`. A figure whose name is in ZERO must be 0.
"""
import http.client
import json
import os
import pathlib
import random
import signal
import socket
import sqlite3
import statistics
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests/api"))

import service  # noqa: E402  the path is set above

ZERO = ("lost", "twice", "stuck", "damaged", "wrong_exit", "refused", "broken", "errors", "put_back_missing", "leaked")
BODY = json.dumps(service.MATRICES).encode()
# Nearly all of its time goes into the order of elimination and the factorization.
LARGE = {**service.SCENE, "problem": {**service.SCENE["problem"],
                                      "mesh": {"box": {"size": [60, 20], "cells": [400, 133], "element": "quad4"}}}}
PAPER = ROOT / "tests/data/paper_body.json"


def default_body(folder):
    """The paper's body with the default solver, as a file."""
    body = json.loads(PAPER.read_text())
    del body["solver"]
    path = os.path.join(folder, "default.json")
    pathlib.Path(path).write_text(json.dumps(body))
    return path


def quantile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("nan")


# ---------------------------------------------------------------- daemons that end

class Poster(threading.Thread):
    """Posts on a kept connection until it breaks or `halt` is set; `ids` is what was acknowledged."""

    def __init__(self, port, halt, ids):
        super().__init__()
        self.port, self.halt, self.ids, self.refusals = port, halt, ids, 0

    def run(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            while not self.halt.is_set():
                connection.request("POST", "/v1/jobs", BODY, {"Content-Type": "application/json"})
                reply = connection.getresponse()
                body = reply.read()
                if reply.status == 202:
                    self.ids.append(json.loads(body)["id"])
                elif reply.status != 503:  # 503: it drains
                    self.refusals += 1
                else:
                    return
        except (OSError, http.client.HTTPException, ValueError):
            pass  # it was ended; what was not acknowledged may be gone
        finally:
            connection.close()


def resident(s):
    """Megabytes that the daemon holds."""
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def rows(path, sql):
    connection = sqlite3.connect(path)
    try:
        return connection.execute(sql).fetchall()
    finally:
        connection.close()


def endings(build, cycles, number, clients=16, seed=1):
    """Ends the daemon by a signal again and again under load, and counts what that cost."""
    chance = random.Random(seed)
    s = service.Service(build, "--max-attempts", "1000", "--log-level", "warn", "--max-client-rate", "0",
                        "--drain-s", "0.05")
    acknowledged, figures, drains = [], {"wrong_exit": 0, "refused": 0, "put_back_missing": 0}, []
    try:
        s.start()
        for _ in range(cycles):
            halt = threading.Event()
            posters = [Poster(s.port, halt, []) for _ in range(clients)]
            for one in posters:
                one.start()
            time.sleep(chance.uniform(0.01, 0.25))
            begun = time.monotonic()
            s.process.send_signal(number)
            figures["wrong_exit"] += s.process.wait(timeout=60) != (0 if number == signal.SIGTERM else -number)
            drains.append(time.monotonic() - begun)
            halt.set()
            for one in posters:
                one.join()
                acknowledged += one.ids
                figures["refused"] += one.refusals
            if number == signal.SIGTERM:  # nothing is left running
                figures["put_back_missing"] += rows(s.db, "SELECT count(*) FROM job WHERE status = 1")[0][0]
            s.start()
        figures["lost"], figures["stuck"], figures["twice"] = settle(s, acknowledged)
        check = subprocess.run(s.command("--check-db", "--db", s.db), capture_output=True, text=True, check=False)
        figures["damaged"] = int(check.returncode != 0)
        figures |= {"cycles": cycles, "acknowledged": len(acknowledged), "drain_p99_s": round(quantile(drains, 0.99), 3)}
        return figures
    finally:
        s.stop()


def kill_worker(s, chance):
    """One of the processes that solve, whatever it does; False: there was none."""
    try:
        os.kill(chance.choice(s.solvers()), signal.SIGKILL)
        return True
    except (IndexError, OSError):  # it has just gone
        return False


def killed_workers(build, kills, clients=16, seed=3):
    """Kills processes that solve again and again under load: each job gets one answer all the same."""
    chance = random.Random(seed)
    s = service.Service(build, "--max-attempts", "1000", "--log-level", "warn", "--max-client-rate", "0")
    acknowledged, halt, killed = [], threading.Event(), 0
    try:
        s.start()
        posters = [Poster(s.port, halt, []) for _ in range(clients)]
        for one in posters:
            one.start()
        while killed < kills:
            time.sleep(chance.uniform(0.01, 0.1))
            killed += kill_worker(s, chance)
        halt.set()
        for one in posters:
            one.join()
            acknowledged += one.ids
        lost, stuck, twice = settle(s, acknowledged)
        return {"kills": killed, "acknowledged": len(acknowledged), "died_at_work": len(s.events("process_died")), "lost": lost,
                "stuck": stuck, "twice": twice, "refused": sum(one.refusals for one in posters),
                "failed_to_start": len(s.events("process_not_started")), "wrong_exit": s.end()}
    finally:
        s.stop()


def settle(s, acknowledged, seconds=300):
    """Waits until all jobs ended: (acknowledged and not successful, not ended, results stored twice)."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        counts = s.get("/healthz").json["jobs"]
        if counts["accepted"] == counts["running"] == 0:
            break
        time.sleep(0.1)
    status = dict(rows(s.db, "SELECT id, status FROM job"))
    lost = sum(status.get(job) != 2 for job in acknowledged) + len(acknowledged) - len(set(acknowledged))
    stuck = sum(one in (0, 1) for one in status.values())
    twice = rows(s.db, "SELECT count(*) FROM (SELECT job FROM vector WHERE name = 'gaps' AND part = 0"
                       " GROUP BY job HAVING count(*) <> 1)")[0][0]
    return lost, stuck, twice


class Chaos(threading.Thread):
    """What befalls a service: processes die, jobs of all sizes come and are dismissed at any moment, the tokens are read
    again, people look."""

    def __init__(self, s, halt, seed, token):
        super().__init__()
        self.s, self.halt, self.chance, self.token, self.done, self.errors = s, halt, random.Random(seed), token, {}, []

    def run(self):
        deeds = [(self.killed, 3), (self.dismissed, 4), (self.reloaded, 1), (self.looked, 2)]  # and how often each comes
        while not self.halt.wait(self.chance.uniform(0.02, 0.3)):
            deed = self.chance.choices([one for one, _ in deeds], [weight for _, weight in deeds])[0]
            try:
                deed()
                self.done[deed.__name__] = self.done.get(deed.__name__, 0) + 1
            except Exception as why:  # whatever it was, it is told at the end
                self.errors.append(f"{deed.__name__}: {why!r}")

    def killed(self):
        kill_worker(self.s, self.chance)

    def dismissed(self):
        body = self.chance.choice((service.ENDLESS, service.SCENE, LARGE, LARGE))
        job = self.s.post(body, self.token).json["id"]
        self.halt.wait(self.chance.uniform(0, 1.5))
        reply = self.s.request("DELETE", f"/v1/jobs/{job}", headers=self.token)
        service.check(reply.status in (200, 204), reply)

    def reloaded(self):
        self.s.process.send_signal(signal.SIGHUP)

    def looked(self):
        for path in ("/metrics", "/healthz", "/v1/jobs?limit=20", "/v1/factors"):
            service.expect(self.s.get(path, **self.token), 200)


def week(build, seconds, clients=8):
    """A mixed load while all that happens in a week happens: jobs that are waited for get answers, and memory does not grow."""
    s = service.Service(build, "--max-attempts", "1000", "--log-level", "warn", "--max-client-rate", "0", "--keep-jobs", "3000",
                        "--cache", "64M")
    halt, memory, figures = threading.Event(), [], {"jobs": 0, "refused": 0, "broken": 0}
    token = {"Authorization": "Bearer 0123456789abcdef0123456789abcdef"}
    try:
        tokens, small = os.path.join(s.folder, "tokens"), os.path.join(s.folder, "small.json")
        pathlib.Path(tokens).write_text(f"all admin {token['Authorization'].split()[1]}\n", encoding="ascii")
        os.chmod(tokens, 0o600)
        pathlib.Path(small).write_bytes(BODY)
        s.options += ("--token-file", tokens)
        s.start()
        chaos = [Chaos(s, halt, seed, token) for seed in range(3)]
        for one in chaos:
            one.start()
        for _ in range(4):
            got = load(build, s.port, clients, seconds / 4, small, f"wait=30\r\nAuthorization: {token['Authorization']}")
            for key, of in (("jobs", "requests"), ("refused", "refused"), ("broken", "broken")):
                figures[key] += got[of]
            memory.append(resident(s))
        halt.set()
        for one in chaos:
            one.join()
            for name, count in one.done.items():
                figures[name] = figures.get(name, 0) + count
            for why in one.errors:
                print("#", why)
        _, figures["stuck"], figures["twice"] = settle(s, [])
        failed = rows(s.db, "SELECT count(*) FROM job WHERE status = 3")[0][0]
        figures["errors"] = failed + sum(len(one.errors) for one in chaos)
        figures["memory_mb"] = "/".join(f"{one:.0f}" for one in memory)
        figures["died_at_work"] = len(s.events("process_died"))
        figures["wrong_exit"] = s.end()
        return figures
    finally:
        halt.set()
        s.stop()


# ---------------------------------------------------------------- clients that are slow, jobs that are cancelled

def slow_clients(build, clients, seconds):
    """Many connections send a byte a second; others ask /healthz meanwhile."""
    s = service.Service(build, "--max-connections", str(clients + 50), "--log-level", "warn", "--max-client-rate", "0")
    held, waits, errors = [], [], 0
    try:
        s.start()
        for _ in range(clients):
            one = socket.create_connection((s.host, s.port), timeout=20)
            one.setblocking(False)
            held.append(one)
        message = b"POST /v1/jobs HTTP/1.1\r\nHost: slow\r\nContent-Type: application/json\r\nContent-Length: 1000\r\n\r\n" + b"x" * 1000
        begun, at = time.monotonic(), 0
        while time.monotonic() < begun + seconds:
            due = time.monotonic() + 1
            for one in held:
                try:
                    one.send(message[at:at + 1])
                except OSError:
                    pass  # it was cut off: a request has a deadline
            at += 1
            while time.monotonic() < due:
                start = time.monotonic()
                errors += s.request("GET", "/healthz").status != 200
                waits.append(time.monotonic() - start)
                time.sleep(0.005)
        return {"clients": clients, "asked": len(waits), "errors": errors,
                "p50_ms": round(1e3 * quantile(waits, 0.5), 2), "p99_ms": round(1e3 * quantile(waits, 0.99), 2)}
    finally:
        for one in held:
            one.close()
        s.stop()


def cancels(build, count, body=None):
    """From DELETE to the job's end, for jobs that iterate, or for those of a body at any moment of its solve."""
    chance = random.Random(2)
    s = service.Service(build, "--workers", "1", "--log-level", "warn", "--cache", "1")
    waits, errors, too_late = [], 0, 0
    try:
        s.start()
        begun = time.monotonic()
        whole = (s.solve(body) and time.monotonic() - begun) if body else 0.1
        while len(waits) < count and too_late < 10 * count:
            job = s.post(body or service.ENDLESS).json["id"]
            s.wait_status(job, "running")
            time.sleep(chance.uniform(0.2, 0.8) * whole)
            start = time.monotonic()
            deleted = s.request("DELETE", f"/v1/jobs/{job}").status
            end = s.get(f"/v1/jobs/{job}", Prefer="wait=30")
            if deleted == 204 and body:  # it had ended: what was deleted is its result
                too_late += 1
                continue
            errors += deleted != 200 or end.status != 200 or end.json["status"] not in ("dismissed", "successful")[:1 + bool(body)]
            waits.append(time.monotonic() - start)
        return {"cancelled": len(waits), "errors": errors, "p50_ms": round(1e3 * statistics.median(waits), 2),
                "p99_ms": round(1e3 * quantile(waits, 0.99), 2), "max_ms": round(1e3 * max(waits), 2)}
    finally:
        s.stop()


# ---------------------------------------------------------------- many jobs

def load(build, port, clients, seconds, body, prefer=None):
    command = [os.path.join(build, "load"), str(port), str(clients), str(seconds), str(body)]
    done = subprocess.run(command + ([prefer] if prefer else []), capture_output=True, text=True, check=False)
    service.check(done.stdout, done.stderr)
    return json.loads(done.stdout)


def throughput(build, seconds, body=None, clients=64, prefer="wait=30"):
    """Keep-alive clients that post a body and wait for its answer; every job is on disk before it is acknowledged."""
    s = service.Service(build, "--log-level", "warn", "--max-client-rate", "0")
    try:
        s.start()
        path = body or default_body(s.folder)
        load(build, s.port, 4, 0.3, path, prefer)
        got = load(build, s.port, clients, seconds, path, prefer)
        metrics = s.get("/metrics").body.decode()
        cpu = float(metrics.split("\nprocess_cpu_seconds_total ")[1].split()[0])
        syncs = int(metrics.split("\nuzawad_store_commit_seconds_count ")[1].split()[0])
        jobs = int(metrics.split("\nuzawad_jobs_submitted_total ")[1].split()[0])
        return {"clients": clients, "jobs_per_s": got["per_s"], "p50_ms": got["p50_ms"], "p99_ms": got["p99_ms"],
                "cpu_ms_per_job": round(1e3 * cpu / jobs, 3), "jobs_per_sync": round(jobs / syncs, 2),
                "refused": got["refused"], "broken": got["broken"]}
    finally:
        s.stop()


def fill(path, jobs):
    """Adds so many ended jobs, older than any other, to a database that a daemon made and left."""
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA synchronous = OFF")
    name = "%012x%04x%016x"
    with connection:
        connection.executemany("INSERT INTO job(id, status, progress, attempts, created, started, finished, tags, summary)"
                               " VALUES(?, 2, 100, 1, 1e9, 1e9, 1e9, '[\"old\"]', '{}')",
                               ((name % (i, 0, i),) for i in range(jobs)))
        connection.executemany("INSERT INTO request(job, body) VALUES(?, ?)",
                               ((name % (i, 0, i), BODY) for i in range(jobs)))
    connection.close()


def timed(action, count):
    waits = []
    for _ in range(count):
        start = time.perf_counter()
        action()
        waits.append(time.perf_counter() - start)
    return 1e3 * statistics.median(waits)


def full_database(build, jobs, count=100):
    """List, get, submit and health with many jobs in the database, in units of the same without."""
    figures = {"jobs": jobs, "errors": 0}
    times = {}
    for kind, size in (("empty", 0), ("full", jobs)):
        s = service.Service(build, "--log-level", "warn", "--max-client-rate", "0")
        try:
            s.start()
            first = s.solve(service.MATRICES)["id"]
            for _ in range(60):
                s.post(service.MATRICES)
            if size:
                s.terminate()
                fill(s.db, size)
                s.start()
            held = http.client.HTTPConnection(s.host, s.port, timeout=60)

            def ask(method, path, body=None):
                held.request(method, path, body, {"Content-Type": "application/json"} if body else {})
                reply = held.getresponse()
                reply.read()
                figures["errors"] += reply.status not in (200, 202)
            times[kind] = {"list": timed(lambda: ask("GET", "/v1/jobs?limit=50"), count),
                           "get": timed(lambda: ask("GET", f"/v1/jobs/{first}"), count),
                           "health": timed(lambda: ask("GET", "/healthz"), count),
                           "submit": timed(lambda: ask("POST", "/v1/jobs", BODY), count)}
            held.close()
        finally:
            s.stop()
    for name, full in times["full"].items():
        figures[name + "_ratio"] = round(full / times["empty"][name], 2)
        figures[name + "_ms"] = round(full, 3)
    return figures


def leaks(build, jobs):
    """Descriptors and memory after many jobs, against those after a tenth of them."""
    s = service.Service(build, "--log-level", "warn", "--max-client-rate", "0", "--cache", "64M")

    def run(count):
        done = 0
        while done < count:
            done += load(build, s.port, 16, min(5, max(0.2, (count - done) / 1500)), small, "wait=30")["requests"]
        time.sleep(0.5)
        return done, len(os.listdir(f"/proc/{s.process.pid}/fd")), resident(s)
    try:
        s.start()
        small = os.path.join(s.folder, "small.json")
        pathlib.Path(small).write_bytes(BODY)
        first, descriptors, memory = run(max(200, jobs // 10))
        then, descriptors_after, memory_after = run(jobs)
        return {"jobs": first + then, "descriptors": descriptors_after - descriptors,
                "memory_mb": round(memory_after, 1), "memory_grown_mb": round(memory_after - memory, 1)}
    finally:
        s.stop()
