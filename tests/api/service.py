"""Starts the real daemon on a free port with a database in a temporary folder, talks to it, and runs test functions.

A test program is a module with functions test_*; it ends in `service.main(globals())` and is called with
BUILD_DIR [FILTER]. Each test gets a running Service that it may use up: stop() is always called after it. A test that
needs other options is decorated with @options("--workers", "1"). Raise Skip("why") to skip.

Where a module says SHARED = True, the tests that are not decorated have one Service for all of them, for a start costs
as much as many a test: they leave it running, and count on nothing that others may have done to it. @options() gives a
test a Service of its own.
"""
import concurrent.futures
import contextlib
import functools
import gzip
import http.client
import json
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
import traceback

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCHEMAS = ROOT / "schemas"

# A daemon with a sanitizer takes five to twenty times as long: tests give it smaller bodies then.
INSTRUMENTED = len(sys.argv) > 1 and pathlib.Path(sys.argv[1]).name in ("asan", "tsan")

# Whatever is waited for is there at once, or beside much else in a while: only what never comes takes so long.
PATIENT_S = 180


def some(cases, every=3):
    """All of many like cases; with a sanitizer, which looks at the code and not at the answers, each third of them."""
    return list(cases)[::every if INSTRUMENTED else 1]



try:
    import jsonschema
except ImportError:  # then replies are only parsed
    jsonschema = None

# A problem with a known answer: two springs of stiffness 2 and 1, pulled by 2; the first is stopped at 0.5.
MATRICES = {"problem": {"kind": "matrices",
                        "K": "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 1\n",
                        "N": "%%MatrixMarket matrix coordinate real general\n1 2 1\n1 1 1\n",
                        "h": [0.5], "p": [2, 2]}}
SCENE = {"problem": {"kind": "scene", "model": "plane_stress", "thickness": 5,
                     "mesh": {"box": {"size": [60, 20], "cells": [30, 10], "element": "quad4"}},
                     "materials": [{"on": "all", "young": 200e3, "poisson": 0.3}],
                     "supports": [{"on": "left", "ux": 0, "uy": 0}],
                     "loads": [{"on": "top", "traction": [0, -0.05]}, {"on": "right", "traction": [0.5, 0]}],
                     "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]},
         "solver": {"method": "accelerated_restart", "accuracy": {"relative_error": 1e-6}}}
# What makes SCENE one that is refused by the solver, and not before: loads push the body off its obstacle.
PUSHED_OFF = {"supports": [{"on": "left", "ux": 0}], "loads": [{"on": "top", "traction": [0, 0.05]}]}
# Steps so short that it runs until it is told to stop.
ENDLESS = {**SCENE, "solver": {"method": "uzawa", "alpha": 1e-9, "max_iterations": 1000000000}}


class Skip(Exception):
    """The test cannot run here."""


class Reply:
    """status, headers (last of each name, in lower case), body (bytes as they came), json (None if it is none)."""

    def __init__(self, status, headers, body):
        self.status = status
        self.headers = {name.lower(): value for name, value in headers}
        self.body = body
        self.json = None
        if "json" in self.headers.get("content-type", "") and body and status != 206:
            plain = gzip.decompress(body) if self.headers.get("content-encoding") == "gzip" else body
            self.json = json.loads(plain)
            validate(self)

    def __repr__(self):
        return f"{self.status} {self.headers} {self.body[:600]!r}"


# Who asks for these waits for the end of a job; the service replies that it is under way after a minute.
AS_LONG_AS_IT_TAKES = "wait=60", "wait=120"

# What tells which schema a reply must meet: a member that only this kind of object has.
KINDS = [("valid", "valid.json"), ("factors", "factors.json"), ("used_by", "upload.json"), ("limits", "limits.json"),
         ("whole", "check.json"), ("notes", "translation.json"), ("rows", "history.json"), ("decades", "work-precision.json"), ("code", "problem-details.json"),
         ("workers", "health.json"), ("progress", "job.json"), ("summary", "result.json"), ("nodes", "nodes.json")]  # a result has nodes too


def schema_of(reply):
    if "schema+json" in reply.headers["content-type"] or "openapi" in reply.json:
        return None
    if isinstance(reply.json.get("jobs"), list):
        return "jobs.json"
    return next((name for member, name in KINDS if member in reply.json), None)


@functools.lru_cache
def validator(name):
    """Checks against schemas/NAME; references between the files resolve as if they were served from one host."""
    base = "http://localhost/schemas/"
    store = {base + path.name: {**json.loads(path.read_text()), "$id": base + path.name}
             for path in SCHEMAS.glob("*.json")}
    resolver = jsonschema.RefResolver(base + name, store[base + name], store=store)
    return jsonschema.Draft202012Validator(store[base + name], resolver=resolver)


# jsonschema keeps where it is in a schema in the validator: not for several threads at once.
VALIDATING = threading.Lock()


def telling(numbers):
    """Places of the numbers that may break a schema where none of the others does: least, largest, no integer, null."""
    known = [i for i, x in enumerate(numbers) if x is not None]
    found = {min(known, key=numbers.__getitem__), max(known, key=numbers.__getitem__)} if known else set()
    found |= {next((i for i in known if type(numbers[i]) is float), 0), next((i for i, x in enumerate(numbers) if x is None), 0)}
    return found


FIRST = 13  # are kept besides: no schema of a reply allows a list at most more than 12 items


def shortened(value):
    """The same with long lists of numbers, or of rows of numbers, cut to items that tell what the others could: the
    check of a million numbers one by one takes longer than their solve."""
    def is_numbers(items):
        return all(type(x) in (int, float, type(None)) for x in items)
    if isinstance(value, dict):
        return {key: shortened(one) for key, one in value.items()}
    if not isinstance(value, list) or not value:
        return value
    if len(value) > 40 and is_numbers(value):
        return [value[i] for i in sorted(telling(value).union(range(FIRST)))]
    if len(value) > 40 and all(type(row) is list and len(row) == len(value[0]) and is_numbers(row) for row in value):
        return [value[i] for i in sorted(set(range(FIRST)).union(*map(telling, zip(*value))))]
    return [shortened(one) for one in value]


def validate(reply):
    """Checks a JSON reply against its schema."""
    name = schema_of(reply)
    if name and jsonschema:
        with VALIDATING:
            validator(name).validate(shortened(reply.json))


@contextlib.contextmanager
def masked():
    """A daemon started within finds its signals blocked, and does not start itself once more to block them: with a
    sanitizer each start of the program costs a quarter of a second."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGABRT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def new_database():
    """The address of an empty database of PostgreSQL where UZAWA_STORE asks for one: then the tests run on that engine."""
    if os.environ.get("UZAWA_STORE") != "postgresql":
        return None
    import databases  # which needs this module
    return databases.address_of_new()


class Service:
    """One daemon. Options after --listen and --db; db names another database file. A test that says how many workers
    there are counts on jobs that wait: no others are beside them unless it says so."""

    def __init__(self, build, *options, db=None):
        self.build = pathlib.Path(build)
        self.folder = tempfile.mkdtemp(prefix="uzawad-")
        self.db = db or new_database() or os.path.join(self.folder, "contact.db")
        self.options = options
        self.environment = {}
        self.begins_masked = INSTRUMENTED
        self.process = None

    def command(self, *options):
        return [str(self.build / "uzawad"), *options]

    def spent(self, process=None):
        """Seconds of processor of the daemon and of the processes that it solves in."""
        folder = pathlib.Path(f"/proc/{process or self.process.pid}")
        ended = sum(map(int, (folder / "stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[13:15])) / 100
        own = ended + time.clock_gettime(~int(folder.name) << 3 | 2)  # the clock of another process (clock_getcpuclockid)
        for one in folder.glob("task/*/children"):
            with contextlib.suppress(OSError):  # the thread has ended
                own += sum(map(self.spent, one.read_text(encoding="utf-8").split()))
        return own

    def settle(self):
        """Waits until it does nothing more: its process makes memory ready when it begins. Seconds of processor by then."""
        before = self.spent()
        while time.sleep(0.5) or self.spent() > before + 0.01:  # but for what wakes now and then
            before = self.spent()
        return self.spent()

    def place(self):
        """The option that says where jobs are kept."""
        return "--store" if "://" in self.db else "--db", self.db

    def end_leases(self):
        """Of a daemon that was killed, where the tests run on PostgreSQL: as if their time were over. SQLite's file has no
        other owner, so that the next start knows at once that they are."""
        if os.environ.get("UZAWA_STORE") == "postgresql" and "://" in self.db and self.process and (self.process.poll() or 0) < 0:
            import databases
            databases.rows(self.db, "UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1 AND node IN"
                                    f" (SELECT id FROM uzawa.node WHERE pid = {self.process.pid})")

    def start(self):
        self.end_leases()
        self.close()
        self.log_file = open(os.path.join(self.folder, "log"), "ab")
        suppressions = f"suppressions={ROOT / 'tests' / 'tsan.supp'} {os.environ.get('TSAN_OPTIONS', '')}"
        alone = ("--lanes", "0") if "--workers" in self.options and "--lanes" not in self.options else ()
        with masked() if self.begins_masked else contextlib.nullcontext():
            self.process = subprocess.Popen(self.command("--listen", "127.0.0.1:0", *self.place(), *alone, *self.options),
                                            stdout=subprocess.PIPE, stderr=self.log_file,
                                            env={**os.environ, "TSAN_OPTIONS": suppressions, **self.environment})
        line = self.process.stdout.readline().decode()
        if not line.startswith("listening on http://"):
            self.process.wait(timeout=PATIENT_S)
            raise AssertionError(f"no listening line but {line!r}; the log says:\n{self.log()}")
        self.url = line.split()[-1]
        self.host, port = self.url[len("http://"):].rsplit(":", 1)
        self.port = int(port)
        return self

    def close(self):
        """The pipes of the daemon that ran before, if any."""
        if self.process:
            self.process.stdout.close()
            self.log_file.close()

    def log(self):
        """The log so far, as text."""
        with open(os.path.join(self.folder, "log"), encoding="utf-8") as file:
            return file.read()

    def events(self, event=None):
        """The log so far, as objects."""
        lines = [json.loads(line) for line in self.log().splitlines() if line.startswith("{")]
        return [line for line in lines if event is None or line["event"] == event]

    def terminate(self, timeout=PATIENT_S, number=signal.SIGTERM):
        """Sends a signal and returns the exit status."""
        self.process.send_signal(number)
        return self.process.wait(timeout=timeout)

    def end(self):
        """Ends it gently and returns the exit status: leaks and races show up then."""
        for _ in range(2):  # the second signal cuts the drain short
            if self.process.poll() is None:
                self.process.send_signal(signal.SIGTERM)
            try:
                return self.process.wait(timeout=2)
            except subprocess.TimeoutExpired:
                pass
        return self.process.wait(timeout=PATIENT_S)

    def restart(self, number=signal.SIGKILL, timeout=PATIENT_S):
        """Ends it by a signal and starts it again on the same database; returns the exit status."""
        status = self.terminate(timeout, number)
        self.start()
        return status

    def stop(self):
        """Ends everything and removes the folder. Whatever happened before."""
        if self.process and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def file(self):
        """The name of SQLite's file, for a test that is about that."""
        if "://" in self.db:
            raise Skip("it is about SQLite's file")
        return self.db

    def kept_uploads(self):
        """The digests of uploads that are in the store."""
        if "://" in self.db:
            import databases
            return sorted(row[0] for row in databases.rows(self.db, "SELECT id FROM uzawa.upload"))
        folder = pathlib.Path(self.db + "-uploads")
        return sorted(path.name for path in folder.iterdir()) if folder.exists() else []

    def sql(self, statement, values=()):
        """What SQLite answers past the daemon, on its database; changes are kept."""
        with contextlib.closing(sqlite3.connect(self.file())) as db, db:
            return db.execute(statement, values).fetchall()

    def solvers(self):
        """Process ids of those that solve, and live."""
        found = []
        for task in os.listdir(f"/proc/{self.process.pid}/task"):
            with contextlib.suppress(OSError):  # the thread has ended
                with open(f"/proc/{self.process.pid}/task/{task}/children", encoding="ascii") as file:
                    found += [int(word) for word in file.read().split()]
        return [pid for pid in found if is_alive(pid)]

    # ---- requests

    def request(self, method, path, body=None, headers=None, timeout=PATIENT_S):
        """One request on a connection of its own. A dict or list becomes JSON."""
        headers = dict(headers or {})
        if isinstance(body, (dict, list)):
            body = json.dumps(body).encode()
            headers.setdefault("Content-Type", "application/json")
        elif body and path == "/v1/uploads":
            headers.setdefault("Content-Type", "application/octet-stream")
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            connection.request(method, path, body=body, headers=headers)
            reply = connection.getresponse()
            reply = Reply(reply.status, reply.getheaders(), reply.read())
        finally:
            connection.close()
        if reply.status != 202 or headers.get("Prefer") not in AS_LONG_AS_IT_TAKES:
            return reply
        asked = {name: headers[name] for name in ("Authorization", "Prefer") if name in headers}
        while (told := self.request("GET", f"/v1/jobs/{reply.json['id']}", headers=asked)).json["status"] in ("accepted", "running"):
            pass
        return told

    def get(self, path, **headers):
        return self.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})

    def post(self, body, headers=None, query=""):
        return self.request("POST", "/v1/jobs" + query, body, headers)

    def solve(self, body):
        """Posts a job, waits until it ended, and returns it."""
        return self.post(body, {"Prefer": "wait=60"}).json

    def solved(self, body, outcome=None):
        """As solve; the job has to be successful, with this outcome if one is named."""
        job = expect(self.post(body, {"Prefer": "wait=60"}), 200).json
        check(job["status"] == "successful" and (outcome is None or job["summary"]["outcome"] == outcome), str(job)[:900])
        return job

    def wait_status(self, job_id, *statuses, seconds=PATIENT_S):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            job = self.get(f"/v1/jobs/{job_id}").json
            if job["status"] in statuses:
                return job
            time.sleep(0.02)
        raise AssertionError(f"{job_id} is still {job['status']}, not {statuses}")

    def connect(self, timeout=10):
        return socket.create_connection((self.host, self.port), timeout=timeout)

    def raw(self, data, timeout=10, half_close=False):
        """Sends bytes on a new socket and returns (everything that came back, True if the server closed)."""
        with self.connect(timeout) as connection:
            try:
                connection.sendall(data)
                if half_close:
                    connection.shutdown(socket.SHUT_WR)
            except OSError:
                pass  # the server may have answered and closed already
            return read_all(connection)


def is_alive(pid):
    """Neither gone nor waiting for its parent to be told."""
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False


def read_all(connection):
    """Reads until the server closes or nothing comes for the socket's timeout."""
    data = b""
    try:
        while piece := connection.recv(65536):
            data += piece
        return data, True
    except socket.timeout:
        return data, False
    except ConnectionResetError:
        return data, True


def check(condition, *what):
    """assert that stays with python -O, and says what it saw."""
    if not condition:
        raise AssertionError(" ".join(str(one) for one in what))


def wait_until(holds, seconds=PATIENT_S):
    end = time.monotonic() + seconds
    while not holds():
        check(time.monotonic() < end, "not true after", seconds, "s")
        time.sleep(0.02)


def together(what, some):
    """What it returns for each; what takes its time for one takes it for all at once."""
    with concurrent.futures.ThreadPoolExecutor(len(some) or 1) as pool:
        return list(pool.map(what, some))


def expect(reply, status, code=None):
    check(reply.status == status, "wanted", status, code, "got", reply)
    if code:
        check(reply.headers["content-type"] == "application/problem+json", reply)
        check(reply.json["code"] == code and reply.json["status"] == status, "wanted", code, "got", reply)
        check(reply.json["title"] and reply.json["detail"], reply)
    check(reply.headers["x-content-type-options"] == "nosniff" and "date" in reply.headers, reply)
    return reply


def head_of(data):
    """Status and header fields (lower case) of the first reply in bytes, and its body."""
    head, _, body = data.partition(b"\r\n\r\n")
    lines = head.decode("latin-1").split("\r\n")
    fields = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines[1:])}
    return int(lines[0].split()[1]) if lines[0] else 0, fields, body


def options(*given):
    """Decorates a test whose service needs options; options(None): the test starts its services itself."""
    def mark(test):
        test.options = given
        return test
    return mark


def settle(service):
    """Ends a service; leaks, races and mistakes show up then."""
    try:
        if service.process:
            check(service.end() == 0, "the daemon ended with status", service.process.returncode, service.log())
            log = service.log()
            check("Sanitizer" not in log and "runtime error" not in log, log)
    finally:
        service.stop()


def run_one(test, build):
    given = getattr(test, "options", ())
    service = Service(build, *(option for option in given if option is not None))
    try:
        if None not in given:
            service.start()
        test(service)
        settle(service)
    finally:
        service.stop()


def run_shared(test, service):
    if not service.process:
        service.start()
    test(service)
    check(service.process.poll() is None, "it has ended the service of all tests: @options() gives it one of its own")


def attempt(title, run, *what):
    """Runs it and prints how it went; True unless it failed: a failing test must not end the others."""
    try:
        run(*what)
        print(f"ok {title}", flush=True)
    except Skip as why:
        print(f"skip {title}: {why}", flush=True)
    except Exception:
        print("# " + "# ".join(traceback.format_exc().splitlines(True)).rstrip())
        print(f"not ok {title}", flush=True)
        return False
    return True


def main(names):
    """Runs every test_* in names; prints a line for each and exits with 1 if one failed."""
    if len(sys.argv) < 2:
        sys.exit("usage: PROGRAM BUILD_DIR [FILTER]")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a shell's background job, and so in its children
    program, build = pathlib.Path(sys.argv[0]).stem, sys.argv[1]
    wanted = sys.argv[2] if len(sys.argv) > 2 else ""
    failed, shared = False, None
    for name, test in list(names.items()):
        if not name.startswith("test_") or wanted not in name[5:]:
            continue
        title = f"{program}.{name[5:]}"
        if not names.get("SHARED") or hasattr(test, "options"):
            failed |= not attempt(title, run_one, test, build)
            continue
        shared = shared or Service(build)
        if not attempt(title, run_shared, test, shared):
            failed, shared = True, shared.stop()
    if shared:
        failed |= not attempt(f"{program}.service", settle, shared)
    sys.exit(1 if failed else 0)
