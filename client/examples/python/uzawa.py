"""A small client of the contact solver service, of nothing but Python's standard library (3.8 or later).

    service = Uzawa()                                # $UZAWA_SERVER and $UZAWA_TOKEN, or http://127.0.0.1:8080
    job = service.wait(service.submit(request)["id"])
    result = service.result(job["id"], "reactions", "displacements")
"""
import json
import os
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid

ENDED = ("successful", "failed", "dismissed")


class Refused(Exception):
    """The service's reason (RFC 9457): .problem has status, code, detail and a JSON pointer into the request."""

    def __init__(self, problem):
        super().__init__(f"{problem.get('pointer', '')} {problem.get('detail', problem)}".strip())
        self.problem = problem


class Uzawa:
    def __init__(self, server=None, token=None, patience_s=30):
        self.server = (server or os.environ.get("UZAWA_SERVER") or "http://127.0.0.1:8080").rstrip("/")
        self.token = token or os.environ.get("UZAWA_TOKEN")
        self.patience_s = patience_s

    def open(self, method, path, body=None, timeout=90, **headers):
        """One request, sent again while the service cannot be reached or asks for patience. The reply is to be closed."""
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        data = None if body is None else json.dumps(body).encode()
        if data is not None:
            headers["Content-Type"] = "application/json"
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

    def call(self, method, path, body=None, **headers):
        with self.open(method, path, body, **headers) as reply:
            return json.load(reply)

    def submit(self, request, wait_s=0):
        """Posts a job. The key makes a repeat after a lost connection the same job."""
        wait = {"Prefer": f"wait={wait_s}"} if wait_s else {}
        return self.call("POST", "/v1/jobs", request, Idempotency_Key=uuid.uuid4().hex, **wait)

    def wait(self, job_id):
        """Long polls until the job has ended."""
        job = self.call("GET", f"/v1/jobs/{job_id}")
        while job["status"] not in ENDED:
            job = self.call("GET", f"/v1/jobs/{job_id}", Prefer="wait=30")
        if job["status"] == "failed":
            raise Refused(job["error"])
        return job

    def result(self, job_id, *fields, case=None):
        query = {"fields": ",".join(fields or ("summary",)), **({"case": case} if case else {})}
        return self.call("GET", f"/v1/jobs/{job_id}/result?{urllib.parse.urlencode(query)}")

    def verify(self, request):
        """Certifies an answer from elsewhere; the result, whose summary has the certificate."""
        return self.call("POST", "/v1/verify", request, Idempotency_Key=uuid.uuid4().hex, Prefer="wait=60")

    def events(self, job_id):
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
