"""The service over HTTP, of nothing but Python's standard library."""
from __future__ import annotations

import json
import os
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from typing import Any, Callable, Iterator, Optional, Union

from .arrays import from_npz, to_json
from .job import ENDED, Job

Progress = Union[bool, Callable[[dict], None]]


class Refused(Exception):
    """The service's reason (RFC 9457): .problem has status, code, detail and a JSON pointer into the request."""

    def __init__(self, problem: dict) -> None:
        pointer, detail = problem.get("pointer", ""), str(problem.get("detail", problem))
        super().__init__(detail if detail.startswith(pointer) else f"{pointer} {detail}")  # details begin with the place where they can
        self.problem = problem


def print_progress(data: dict) -> None:
    """One line that is written over and over, on stderr."""
    bound = data.get("error_bound")
    words = f"{data.get('progress', 0):3d} %" + (f", error at most {bound:.2g}" if bound is not None else "")
    sys.stderr.write(f"\r{words:<60}")
    sys.stderr.flush()


class Uzawa:
    """A service. server, token: default $UZAWA_SERVER and $UZAWA_TOKEN; patience_s: for how long a request is sent again
    while the service cannot be reached, or asks for patience."""

    def __init__(self, server: Optional[str] = None, token: Optional[str] = None, patience_s: float = 30) -> None:
        self.server = (server or os.environ.get("UZAWA_SERVER") or "http://127.0.0.1:8080").rstrip("/")
        self.token = token or os.environ.get("UZAWA_TOKEN")
        self.patience_s = patience_s

    # ---- jobs

    def solve(self, request: dict, progress: Progress = False) -> Job:
        """Submits a request and waits for its answer. progress: True prints how far it is; or what is called with each
        event's data. Raises Refused where the request is refused or the job fails."""
        return self.submit(request, wait_s=0 if progress else 10).wait(progress)

    def submit(self, request: dict, wait_s: float = 0) -> Job:
        """Posts a job. The key makes a repeat after a lost connection the same job."""
        wait = {"Prefer": f"wait={wait_s:g}"} if wait_s else {}
        return Job(self, self.call("POST", "/v1/jobs", request, Idempotency_Key=uuid.uuid4().hex, **wait))

    def validate(self, request: dict) -> dict:
        """Checks a request without solving it, and predicts what it costs."""
        return self.call("POST", "/v1/jobs?validate=true", request)

    def job(self, job_id: str) -> Job:
        return Job(self, self.call("GET", f"/v1/jobs/{job_id}"))

    def jobs(self, **query: Any) -> list[Job]:
        """The newest first: status, tag, since, until, order, limit."""
        listed = self.call("GET", f"/v1/jobs?{urllib.parse.urlencode(query, doseq=True)}")
        return [Job(self, document) for document in listed["jobs"]]

    def wait(self, job_id: str, progress: Progress = False) -> Job:
        """Long polls until the job has ended."""
        job = self.job(job_id)
        if progress and not job.ended:
            tell = print_progress if progress is True else progress
            for event, data in self.events(job_id):
                if event == "progress":
                    tell(data)
            if progress is True:
                sys.stderr.write("\n")
            job = self.job(job_id)
        while not job.ended:
            job = Job(self, self.call("GET", f"/v1/jobs/{job_id}", Prefer="wait=30"))
        if job["status"] == "failed":
            raise Refused(job["error"])
        return job

    def result(self, job_id: str, *fields: str, case: Optional[str] = None) -> dict:
        """Fields of the answer: "displacements", "pressure", ... as arrays, NaN where a number is not known; "summary"
        and "components", the names of those of stress, as they are. Of a job with load cases: of the one that is named, or
        of each, in the list "cases"."""
        query = urllib.parse.urlencode({"fields": ",".join(fields or ("summary",)), **({"case": case} if case else {})})
        if all(name == "summary" for name in fields):
            return self.call("GET", f"/v1/jobs/{job_id}/result?{query}")
        try:
            with self.open("GET", f"/v1/jobs/{job_id}/result.npz?{query}") as reply:
                return from_npz(reply.read())
        except Refused as refused:
            if refused.problem.get("code") != "case_needed":
                raise
        listed = self.result(job_id)
        return {**listed, "cases": [{**one, **self.result(job_id, *fields, case=one["name"])} for one in listed["cases"]]}

    def verify(self, request: dict) -> dict:
        """Certifies an answer from elsewhere; the result, whose summary has the certificate."""
        return self.call("POST", "/v1/verify", request, Idempotency_Key=uuid.uuid4().hex, Prefer="wait=60")

    def upload(self, data: Union[bytes, str]) -> dict:
        """Sends a mesh or a matrix once: {"upload": ID}, which stands for its text in a request."""
        sent = data.encode() if isinstance(data, str) else data
        with self.open("POST", "/v1/uploads", raw=sent) as reply:
            return {"upload": json.load(reply)["id"]}

    def events(self, job_id: str) -> Iterator[tuple]:
        """Server-Sent Events: pairs of a name ("status", "progress") and its data, until the job has ended. After a lost
        connection it goes on behind the last event that was seen."""
        last, status = "", ""
        while status not in ENDED:
            with self.open("GET", f"/v1/jobs/{job_id}/events", Last_Event_ID=last) as stream:
                fields = {}
                for line in (raw.decode().rstrip("\n") for raw in stream):
                    name, _, value = line.partition(": ")
                    if line and name:
                        fields[name] = value
                    elif not line and fields:
                        last, data = fields.get("id", last), json.loads(fields["data"])
                        status = data.get("status", status)
                        yield fields["event"], data
                        fields = {}

    # ---- requests

    def open(self, method: str, path: str, body: Optional[dict] = None, raw: Optional[bytes] = None, timeout: float = 90,
             **headers: str) -> Any:
        """One request, sent again while the service cannot be reached or asks for patience. The reply is to be closed."""
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        data = raw if body is None else to_json(body)
        if data is not None:
            headers["Content-Type"] = "application/octet-stream" if body is None else "application/json"
        request = urllib.request.Request(self.server + path, data, headers, method=method)
        if self.token:  # not to where a redirection points
            request.add_unredirected_header("Authorization", f"Bearer {self.token}")
        deadline = time.monotonic() + self.patience_s
        while True:
            try:
                return urllib.request.urlopen(request, timeout=timeout)
            except urllib.error.HTTPError as error:
                text, pause = error.read(), float(error.headers.get("Retry-After") or 0.5)
                if error.code not in (429, 502, 503, 504) or time.monotonic() + pause > deadline:
                    try:
                        raise Refused(json.loads(text)) from None
                    except ValueError:
                        raise Refused({"status": error.code, "detail": text.decode(errors="replace")}) from None
                time.sleep(pause)
            except (urllib.error.URLError, ConnectionError) as error:
                if method == "DELETE" or time.monotonic() > deadline:  # the first dismisses, a second would delete
                    why = getattr(error, "reason", error)
                    raise ConnectionError(f"no answer from {self.server}: {why}; is uzawad running there?") from None
                time.sleep(0.5)

    def call(self, method: str, path: str, body: Optional[dict] = None, **headers: str) -> Any:
        with self.open(method, path, body, **headers) as reply:
            return json.load(reply)
