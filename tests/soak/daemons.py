"""Several daemons on one PostgreSQL database through faults, an upgrade, and many bodies; each a function of its length
that returns its figures as a dictionary (scenarios.py).
"""
import collections
import concurrent.futures
import contextlib
import http.client
import itertools
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

import scenarios
from scenarios import ROOT

import databases  # its folder is one of those that scenarios looks in
import service

LEASE_S = 60


def numbered(i):
    """A problem of its own for each number, with a known answer: the force is 1 + i / 1000."""
    problem = json.loads(json.dumps(service.MATRICES))
    problem["problem"]["p"] = [2 + i / 1000, 2]
    return {**problem, "tags": [f"n{i}"]}


@contextlib.contextmanager
def started(build, n, *options, settings=(), kind=service.Service):
    """n daemons on a new database of a new server, the server, and the database's name."""
    server = databases.Server(*settings)
    some = []
    try:
        name = server.database()
        for _ in range(n):
            some.append(kind(build, "--workers", "1", "--log-level", "info", "--max-client-rate", "0",
                             "--max-attempts", "1000", *options, db=server.address(name)))
            some[-1].start()
        yield some, server, name
    finally:
        for one in some:
            if one.process and one.process.poll() is None:
                one.process.send_signal(signal.SIGCONT)
            one.stop()
        server.end()


class Client(threading.Thread):
    """Posts one problem after another, each with a key, to any daemon, again until it is acknowledged."""

    def __init__(self, daemons, halt, numbers, seed):
        super().__init__()
        self.daemons, self.halt, self.numbers, self.chance = daemons, halt, numbers, random.Random(seed)
        self.posted, self.outcomes, self.refused = {}, collections.Counter(), []

    def run(self):
        while not self.halt.is_set():
            i = next(self.numbers)
            while not self.post(i):
                if self.halt.wait(self.chance.uniform(0.02, 0.2)):
                    return

    def post(self, i):
        try:
            wait = {"Prefer": "wait=2"} if self.chance.random() < 0.3 else {}
            reply = self.chance.choice(self.daemons).request("POST", "/v1/jobs", numbered(i), timeout=10,
                                                             headers={"Idempotency-Key": f"n{i}", **wait})
        except (OSError, service.http.client.HTTPException, ValueError):  # it was ended, or stands still
            self.outcomes["broken"] += 1
            return False
        self.outcomes[reply.status] += 1
        if reply.status in (200, 202):
            self.posted[reply.json["id"]] = i
            return True
        if reply.status != 503:
            self.refused.append(reply)
        return False


class Faults:
    """What befalls three daemons and their database."""

    def __init__(self, daemons, server, name, seed):
        self.daemons, self.server, self.name, self.chance = daemons, server, name, random.Random(seed)
        self.done, self.wrong = collections.Counter(), 0

    def killed(self):
        one = self.chance.choice(self.daemons)
        one.process.kill()
        one.process.wait()
        time.sleep(self.chance.uniform(0, 0.2))
        one.start()

    def stopped_past_its_lease(self):
        one = self.chance.choice(self.daemons)
        one.process.send_signal(signal.SIGSTOP)
        time.sleep(self.chance.uniform(0, 0.1))
        self.server.sql(self.name, "UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1 AND node IN"
                                   f" (SELECT id FROM uzawa.node WHERE pid = {one.process.pid})")
        time.sleep(self.chance.uniform(0.6, 1.2))  # others take them up
        one.process.send_signal(signal.SIGCONT)

    def database_restarted(self):
        self.server.stop(self.chance.choice((signal.SIGQUIT, signal.SIGINT)))
        time.sleep(self.chance.uniform(0, 0.3))
        self.server.start()

    def connections_cut(self):
        self.server.sql("postgres", "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity"
                                    f" WHERE datname = '{self.name}'")

    def one_more(self):
        deed = self.chance.choices((self.killed, self.stopped_past_its_lease, self.database_restarted,
                                    self.connections_cut), (4, 3, 1, 4))[0]
        deed()
        self.done[deed.__name__] += 1


def force_of(daemon, job):
    return daemon.get(f"/v1/jobs/{job}/result").json["summary"]["contact"]["reaction_sum"]


def account(daemons, server, name, posted, seconds, short=False):
    """(lost, twice, stuck, damaged) once nothing waits or runs any more, or after so many seconds. short: nobody waits for
    leases of claims that nobody knows of, but makes them end."""
    end = time.monotonic() + seconds
    if short:
        time.sleep(2)
        server.sql(name, "UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1")
    while time.monotonic() < end and server.sql(name, "SELECT 1 FROM uzawa.job WHERE status < 2 LIMIT 1"):
        time.sleep(0.5)
    status = dict(server.sql(name, "SELECT id, status FROM uzawa.job"))
    lost = sum(status.get(job) != "2" for job in posted)
    chance = random.Random(1)
    for job in chance.sample(sorted(posted), min(300, len(posted))):
        lost += status.get(job) == "2" and abs(abs(force_of(daemons[0], job)) - (1 + posted[job] / 1000)) > 1e-6
    twice = len(server.sql(name, "SELECT job FROM (SELECT job, name, count(DISTINCT token) AS n FROM uzawa.pieces"
                                 " GROUP BY 1, 2) AS each WHERE n > 1"))
    keys = len(server.sql(name, "SELECT tags FROM uzawa.job GROUP BY tags HAVING count(*) > 1"))
    ended = collections.Counter(event["job"] for one in daemons for event in one.events("job_ended"))
    twice += keys + sum(n > 1 for n in ended.values())
    stuck = sum(one in ("0", "1") for one in status.values())
    whole = daemons[0].request("POST", "/v1/admin/check").json
    if not whole["whole"]:
        print("#", whole["findings"])
    return lost, twice, stuck, int(not whole["whole"])


def faults(build, count, clients=16, seed=1):
    """Three daemons and PostgreSQL: each acknowledged job gets one answer, its own, whatever happens."""
    with started(build, 3) as (daemons, server, name):
        halt, numbers = threading.Event(), itertools.count()
        some = [Client(daemons, halt, numbers, seed + i) for i in range(clients)]
        for one in some:
            one.start()
        happens = Faults(daemons, server, name, seed)
        try:
            for _ in range(count):
                time.sleep(happens.chance.uniform(0.05, 0.4))
                happens.one_more()
        finally:
            halt.set()
            for one in some:
                one.join()
        posted = {job: i for one in some for job, i in one.posted.items()}
        refused = [reply for one in some for reply in one.refused]
        for reply in refused[:5]:
            print("#", reply)
        lost, twice, stuck, damaged = account(daemons, server, name, posted, LEASE_S + 60, count < 20)
        return {"faults": count, "acknowledged": len(posted), "lost": lost, "twice": twice, "stuck": stuck,
                "damaged": damaged, "refused": len(refused), **happens.done,
                "repeated": sum(one.outcomes[503] + one.outcomes["broken"] for one in some),
                "not_wanted": sum(len(one.events("result_not_wanted")) for one in daemons)}


# ---------------------------------------------------------------- a node dies

def node_dies(build):
    """From the end of a daemon to the moment when another one has begun its job anew: a lease, and what it takes to see."""
    with started(build, 2) as (daemons, _, _):
        job = daemons[0].post(service.ENDLESS).json["id"]
        daemons[0].wait_status(job, "running")
        dies, other = sorted(daemons, key=lambda one: not one.events("job_started"))
        dies.process.kill()
        begun = time.monotonic()
        while not other.events("job_started") and time.monotonic() < begun + 3 * LEASE_S:
            time.sleep(0.05)
        waited = time.monotonic() - begun
        other.request("DELETE", f"/v1/jobs/{job}")
        return {"lease_s": LEASE_S, "waited_s": round(waited, 1), "stuck": int(waited > LEASE_S + 5)}


# ---------------------------------------------------------------- an upgrade

def build_before(folder):
    """The build of the commit before the newest version of the schema."""
    newest = sorted(pathlib.Path(ROOT / "server/store/postgresql").glob("schema_*.sql"),
                    key=lambda path: int(path.stem.split("_")[1]))[-1]
    git = ["git", "-C", str(ROOT)]
    commit = subprocess.run([*git, "log", "--diff-filter=A", "--format=%H", "--", str(newest)], capture_output=True,
                            text=True, check=True).stdout.split()[-1]
    archive = subprocess.run([*git, "archive", commit + "^"], capture_output=True, check=True).stdout
    subprocess.run(["tar", "x", "-C", folder], input=archive, check=True)
    subprocess.run(["make", "-s", "-j2", "all"], cwd=folder, check=True)
    return os.path.join(folder, "build")


class Before(service.Service):
    """A daemon of the version before while its build is that."""
    before = None

    def place(self):  # it knew --db only
        return ("--db", self.db) if self.build == self.before else super().place()


def upgrade(build, seconds=5, clients=8):
    """Three daemons of the version before are replaced one by one under load, behind a balancer that asks /readyz and leaves
    out one that drains: no request fails."""
    folder = tempfile.mkdtemp(prefix="uzawa-before-")
    try:
        before = os.environ.get("BUILD_BEFORE") or build_before(folder)
        Before.before = pathlib.Path(before)
        with started(before, 3, kind=Before) as (daemons, server, name):
            halt, numbers, open_for = threading.Event(), itertools.count(), list(daemons)
            some = [Client(open_for, halt, numbers, i) for i in range(clients)]
            versions = [server.sql(name, "SELECT version FROM uzawa.format")[0][0]]
            for one in some:
                one.start()
            for one in daemons:
                time.sleep(seconds)
                open_for.remove(one)  # as a balancer does whose check fails, before the daemon ends
                time.sleep(3)  # requests that are on their way end
                status = one.terminate()
                service.check(status == 0, "the daemon ended with", status)
                one.build = pathlib.Path(build)
                one.start()
                open_for.append(one)
                versions.append(server.sql(name, "SELECT version FROM uzawa.format")[0][0])
            time.sleep(seconds)
            halt.set()
            for one in some:
                one.join()
            posted = {job: i for one in some for job, i in one.posted.items()}
            failed = sum(n for one in some for outcome, n in one.outcomes.items() if outcome not in (200, 202))
            for one in some:
                for reply in one.refused[:3]:
                    print("#", reply)
            lost, twice, stuck, damaged = account(daemons, server, name, posted, 60)
            return {"versions": "/".join(versions), "acknowledged": len(posted), "errors": failed, "lost": lost,
                    "twice": twice, "stuck": stuck, "damaged": damaged}
    finally:
        shutil.rmtree(folder, ignore_errors=True)


# ---------------------------------------------------------------- many bodies

def body_of(k, cells):
    """A solid part that is pressed onto a plane, by the default solver; k: its material."""
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"size": [4, 4, 2.5], "cells": cells, "element": "hex8"}},
                        "materials": [{"on": "all", "young": 1e5 + k, "poisson": 0.3}],
                        "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}],
                        "loads": [{"on": "top", "traction": [0, 0, -5]}],
                        "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, -1e-4],
                                                                             "normal": [0, 0, 1]}}}]}}


def metric(daemon, name):
    return float(daemon.get("/metrics").body.decode().split(f"\n{name} ")[1].split()[0])


def processor(pids):
    """Seconds of these processes and all below them."""
    parent, used = {}, {}
    for entry in os.listdir("/proc"):
        try:
            if entry.isdigit():
                fields = pathlib.Path(f"/proc/{entry}/stat").read_text().rsplit(")", 1)[1].split()
                parent[int(entry)] = int(fields[1])
                used[int(entry)] = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
        except OSError:  # it has ended
            pass

    def is_below(pid):
        return pid in pids or (pid in parent and is_below(parent[pid]))
    return sum(seconds for pid, seconds in used.items() if is_below(pid))


class Asker:
    """One client of several daemons, on connections that it keeps: a new one for each request would take the daemons more
    time than many a job."""

    def __init__(self, daemons):
        self.connections = [http.client.HTTPConnection(one.host, one.port, timeout=60) for one in daemons]

    def __call__(self, daemon, method, path, body=None, key=None):
        headers = {"Content-Type": "application/json", "Prefer": "wait=20", **({"Idempotency-Key": key} if key else {})}
        connection = self.connections[daemon]
        for again in (True, False):
            try:
                connection.request(method, path, json.dumps(body) if body else None, headers)
                return json.loads(connection.getresponse().read())
            except (OSError, http.client.HTTPException):
                connection.close()  # the daemon may have closed it, as nobody used it
                if not again:
                    raise

    def solve(self, daemon, body, key):
        job = self(daemon, "POST", "/v1/jobs", body, key)
        while job.get("status") in ("accepted", "running"):
            job = self(daemon, "GET", f"/v1/jobs/{job['id']}")
        return job


def mixture(build, affinity_s, jobs, bodies, cells, cache, clients=16, seed=7):
    """Jobs of many bodies, few of which are asked for often (Zipf): seconds and processor seconds of all, factorizations."""
    chance = random.Random(seed)
    asked = chance.choices(range(bodies), [1 / (k + 1) for k in range(bodies)], k=jobs)
    with started(build, 3, "--affinity-s", str(affinity_s), "--cache", cache, "--lanes", "0") as (daemons, server, _):
        pids = {one.process.pid for one in daemons} | {server.process.pid}
        turn = iter(list(enumerate(asked)))
        lock, errors = threading.Lock(), []

        def client():
            asker = Asker(daemons)
            while True:
                with lock:
                    i, k = next(turn, (None, None))
                if i is None:
                    return
                job = asker.solve(i % 3, body_of(k, cells), f"mixture{i}")
                if job.get("status") != "successful":
                    errors.append(job)

        begun, before = time.monotonic(), processor(pids)
        with concurrent.futures.ThreadPoolExecutor(clients) as pool:
            for one in [pool.submit(client) for _ in range(clients)]:
                one.result()
        return {"seconds": time.monotonic() - begun, "processor": processor(pids) - before, "errors": len(errors),
                "missed": sum(metric(one, "uzawad_cache_misses_total") for one in daemons), "asked": len(set(asked))}


def zipf(build, jobs, bodies=200, cells=(20, 20, 12), cache="6000M"):
    """The same jobs where the factor of their body is, and wherever it happens. A cache has room for a third of the bodies
    (of 93 MB each), so that the three together have all of them once; few jobs of many bodies are mostly their first."""
    near = mixture(build, 5, jobs, bodies, list(cells), cache)
    far = mixture(build, 0, jobs, bodies, list(cells), cache)
    could = jobs - near["asked"]

    def hits(run):
        return round(100 * (jobs - run["missed"]) / could, 1)
    return {"jobs": jobs, "bodies": near["asked"], "hits_percent": hits(near), "hits_by_chance_percent": hits(far),
            "seconds": round(near["seconds"], 1), "by_chance_s": round(far["seconds"], 1),
            "time_ratio": round(near["seconds"] / far["seconds"], 3),
            "processor_ratio": round(near["processor"] / far["processor"], 3), "errors": near["errors"] + far["errors"]}


# ---------------------------------------------------------------- how many

def throughput(build, seconds, shared, clients=64, workers=None):
    """Jobs that are posted, solved and waited for, each on disk before it is acknowledged; processor time of daemon,
    solvers and database for each."""
    server = databases.Server("fsync=on") if shared else None
    options = ("--log-level", "warn", "--max-client-rate", "0") + (("--workers", str(workers)) if workers else ())
    s = service.Service(build, *options, db=server.address(server.database()) if server else None)
    try:
        s.start()
        path = scenarios.default_body(s.folder)
        scenarios.load(build, s.port, 4, 0.5, path, "wait=30")
        pids = {s.process.pid} | ({server.process.pid} if server else set())
        before = processor(pids)
        got = scenarios.load(build, s.port, clients, seconds, path, "wait=30")
        return {"store": "postgresql" if shared else "sqlite", "clients": clients, "jobs_per_s": got["per_s"],
                "p50_ms": got["p50_ms"], "p99_ms": got["p99_ms"],
                "cpu_ms_per_job": round(1e3 * (processor(pids) - before) / max(1, got["requests"]), 3),
                "refused": got["refused"], "broken": got["broken"]}
    finally:
        s.stop()
        if server:
            server.end()


if __name__ == "__main__":
    print(globals()[sys.argv[2]](sys.argv[1], *map(json.loads, sys.argv[3:])))
