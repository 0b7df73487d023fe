"""A daemon whose n-th allocation fails, for each n on the way of a job: submitted, solved, stored, read. The heap that
fails is tests/preload/failing_malloc.c, before the libraries' own."""
import http.client
import json
import mmap
import os
import pathlib
import struct
import threading
import time

import service

WATCHING, ALLOWED, LASTING, SEEN, FAILED, HELD = range(6)
FOLLOW_UP = ("", "/result?fields=displacements,reactions,gaps", "/history", "/deformed.svg")
LASTS_S = 0.05  # a heap that fails from then on is well again so long after the job was sent


class Heap:
    """The control file of a daemon with a failing heap."""

    def __init__(self, path):
        with open(path, "w+b") as file:
            file.write(bytes(4096))
            file.flush()
            self.memory = mmap.mmap(file.fileno(), 4096)

    def __getitem__(self, name):
        return struct.unpack_from("q", self.memory, 8 * name)[0]

    def __setitem__(self, name, value):
        struct.pack_into("q", self.memory, 8 * name, value)

    def watch(self, allowed, lasting):
        for name, value in ((ALLOWED, allowed), (LASTING, lasting), (SEEN, 0), (FAILED, 0), (WATCHING, 1)):
            self[name] = value

    def unwatch(self):
        self[WATCHING] = 0
        return self[SEEN], self[FAILED]


def possible(build):
    """Why a daemon of this build can't have a failing heap, or None."""
    program = pathlib.Path(build, "uzawad").read_bytes()
    if b"__asan_init" in program or b"__tsan_init" in program:
        return "the sanitizer has a heap of its own"
    return None if pathlib.Path(build, "failing_malloc.so").exists() else "failing_malloc.so was not built"


def environment(build, s):
    """Of a service whose heap is counted in the file "heap" of its folder."""
    return {"FAILING_MALLOC": os.path.join(s.folder, "heap"), "LD_PRELOAD": str(pathlib.Path(build, "failing_malloc.so").resolve())}


def _ask(s, method, path, body=None, headers=None):
    """(status, JSON or None); (0, None) where the connection broke: a daemon without memory may drop it."""
    connection = http.client.HTTPConnection(s.host, s.port, timeout=20)
    try:
        connection.request(method, path, body, headers or {})
        reply = connection.getresponse()
        text = reply.read()
        return reply.status, json.loads(text) if "json" in (reply.getheader("Content-Type") or "") and text else None
    except (OSError, http.client.HTTPException, ValueError):
        return 0, None
    finally:
        connection.close()


def _way(s, text):
    """One job from its body to its result; its id where it was acknowledged."""
    status, job = _ask(s, "POST", "/v1/jobs", text, {"Content-Type": "application/json", "Prefer": "wait=1"})
    if status not in (200, 202) or not job:
        return None
    for path in FOLLOW_UP:
        _ask(s, "GET", f"/v1/jobs/{job['id']}{path}")
    return job["id"]


def _ended(s, job, seconds=60):
    """The status that an acknowledged job ends with, None if it does not end."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        status, got = _ask(s, "GET", f"/v1/jobs/{job}", headers={"Prefer": "wait=5"})
        if status == 200 and got and got["status"] not in ("accepted", "running"):
            return got["status"]
    return None


def failing(build, every=1, again=8, rounds=2):
    """Lets each `every`-th allocation fail, once and from then on; then each `again`-th of these, `rounds` times. stuck: jobs
    acknowledged that did not end; errors: jobs after it that were not solved; leaked: 1 if the last of the rounds left a block
    for every ten failures, and 200."""
    text = json.dumps(service.SCENE).encode()
    s = service.Service(build, "--log-level", "error", "--max-client-rate", "0", "--workers", "1", "--keep-jobs", "4", "--cache", "1",
                        "--access-log", "no")
    heap = Heap(os.path.join(s.folder, "heap"))
    # One thread for each job: which allocation is the n-th is then nearly the same every time.
    s.environment = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", **environment(build, s)}
    figures = {"allocations": 0, "failed": 0, "stuck": 0, "errors": 0, "ended_failed": 0}
    try:
        s.start()
        for _ in range(8):
            _way(s, text)
        heap.watch(10**9, 0)
        _way(s, text)
        figures["allocations"] = heap.unwatch()[0]
        held = []
        for step in (every,) + (every * again,) * rounds:
            before = figures["failed"]
            for lasting in (0, 1):
                for n in range(0, figures["allocations"], step):
                    _fail_at(s, heap, n, lasting, text, figures)
            for _ in range(8):  # what may be kept is as it was
                _way(s, text)
            time.sleep(0.1)
            held.append(heap[HELD])
        figures["blocks_grown"] = held[-1] - held[-2] if rounds else 0
        figures["leaked"] = int(figures["blocks_grown"] > 200 + (figures["failed"] - before) // 10)
        figures["wrong_exit"] = s.end()
        return figures
    finally:
        s.stop()


def _fail_at(s, heap, n, lasting, text, figures):
    heap.watch(n, lasting)
    well_again = threading.Timer(LASTS_S, heap.unwatch)
    if lasting:
        well_again.start()
    job = _way(s, text)
    well_again.cancel()
    figures["failed"] += heap.unwatch()[1] > 0
    if s.process.poll() is not None:
        raise AssertionError(f"the daemon died of allocation {n}{' and those after it' if lasting else ''}: {s.log()[-3000:]}")
    if job:
        end = _ended(s, job)
        figures["stuck"] += end is None
        figures["ended_failed"] += end == "failed"
    after = _way(s, text)
    figures["errors"] += after is None or _ended(s, after) not in ("successful",)
