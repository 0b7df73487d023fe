"""What the way through HTTP, JSON and the disk adds to the library's own time, nothing cached, turn by turn in one run."""
import copy
import http.client
import json
import os
import pathlib
import statistics
import subprocess
import time

import service

PARTS = ("K", "N", "h", "p")
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # of both: how many there are is not the question


class Library:
    """The library's seconds for one solve of the scene, or of its matrices."""

    def __init__(self, build, folder, body):
        path = os.path.join(folder, "scene.json")
        pathlib.Path(path).write_text(json.dumps(body))
        self.process = subprocess.Popen([os.path.join(build, "library"), path, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        env={**os.environ, **ONE_THREAD})

    def seconds(self, what):
        self.process.stdin.write(what.encode() + b"\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def end(self):
        self.process.stdin.close()
        self.process.stdout.close()
        return self.process.wait(timeout=60)


class Way:
    """One kept connection; status, JSON of small replies."""

    def __init__(self, s):
        self.connection = http.client.HTTPConnection(s.host, s.port, timeout=120)

    def ask(self, method, path, body=None, fields=None):
        self.connection.request(method, path, body, fields or {})
        reply = self.connection.getresponse()
        return reply.status, reply.read()

    def solve(self, body):
        """Submits, waits, reads the result with the displacements: (seconds, those of reading, job, bytes of the
        result)."""
        text = json.dumps(body).encode()
        start = time.perf_counter()
        status, got = self.ask("POST", "/v1/jobs", text, {"Content-Type": "application/json", "Prefer": "wait=60"})
        job = json.loads(got)
        service.check(status == 200 and job["status"] == "successful" and job["summary"]["outcome"] == "converged", status, got[:500])
        waited = time.perf_counter() - start
        status, result = self.ask("GET", f"/v1/jobs/{job['id']}/result?fields=summary,displacements,reactions,gaps")
        seconds = time.perf_counter() - start
        service.check(status == 200, result[:500])
        return seconds, seconds - waited, job, len(result)

    def upload(self, texts):
        """(seconds, body that names the uploads)."""
        start = time.perf_counter()
        ids = {}
        for name, text in texts.items():
            status, got = self.ask("POST", "/v1/uploads", text, {"Content-Type": "application/octet-stream"})
            service.check(status == 201, status, got[:500])
            ids[name] = {"upload": json.loads(got)["id"]}
        return time.perf_counter() - start, ids

    def forget(self, job, ids=None):
        self.ask("DELETE", f"/v1/jobs/{job['id']}")
        for one in (ids or {}).values():
            service.check(self.ask("DELETE", f"/v1/uploads/{one['upload']}")[0] == 204)


def overhead(build, cells=(600, 200), turns=7):
    """Ratios of medians to the library's: the scene; the matrices from uploads, with and without the time to send them."""
    body = copy.deepcopy(service.SCENE)
    body["problem"]["mesh"]["box"]["cells"] = list(cells)
    body["solver"] = {"accuracy": {"relative_error": 1e-6}}
    s = service.Service(build, "--log-level", "warn", "--cache", "1", "--workers", "1")
    s.environment = ONE_THREAD
    times = {name: [] for name in ("scene_library", "scene", "matrices_library", "matrices", "sent", "read", "solve")}
    figures = {}
    library = Library(build, s.folder, body)
    try:
        s.start()
        way = Way(s)
        for turn in range(turns + 1):  # the first does not count
            seconds = {f"{kind}_library": library.seconds(kind) for kind in ("scene", "matrices")}
            service.check(min(seconds.values()) > 0, seconds)
            seconds["scene"], seconds["read"], job, figures["result_bytes"] = way.solve(body)
            seconds["solve"] = job["summary"]["timings_s"]["total"]
            way.forget(job)
            texts = {name: pathlib.Path(s.folder, name + ".mtx").read_bytes() for name in PARTS}
            seconds["sent"], ids = way.upload(texts)
            seconds["matrices"], _, job, _ = way.solve({"problem": {"kind": "matrices", **ids}, "solver": body["solver"]})
            way.forget(job, ids)
            for name, value in seconds.items() if turn else ():
                times[name].append(value)
        figures["uploaded_bytes"] = sum(map(len, texts.values()))
        middle = {name: statistics.median(values) for name, values in times.items() if values}
        figures |= {f"{name}_s": round(value, 3) for name, value in middle.items()}
        figures["scene_ratio"] = round(middle["scene"] / middle["scene_library"], 2)
        figures["matrices_ratio"] = round(middle["matrices"] / middle["matrices_library"], 2)
        figures["with_upload_ratio"] = round((middle["matrices"] + middle["sent"]) / middle["matrices_library"], 2)
        figures["errors"] = int(library.end() != 0)
        return figures
    finally:
        if library.process.poll() is None:
            library.process.kill()
            library.process.wait()
        s.stop()
