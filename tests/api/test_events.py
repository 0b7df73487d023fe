"""Server-Sent Events of a job: /v1/jobs/{id}/events."""
import http.client
import json
import signal
import threading
import time

import service
from service import ENDLESS, MATRICES, SCENE, check, expect, options


class Stream:
    """An open event stream. Iterating gives (event, id, data) until it ends; comments are counted."""

    def __init__(self, s, job_id, last=None):
        self.comments = 0
        self.connection = http.client.HTTPConnection(s.host, s.port, timeout=30)
        self.connection.request("GET", f"/v1/jobs/{job_id}/events", headers={"Last-Event-ID": last} if last else {})
        self.reply = self.connection.getresponse()
        if self.reply.status != 200:
            self.close()
        check(self.reply.status == 200, self.reply.status, self.reply.getheaders())
        check(self.reply.getheader("content-type") == "text/event-stream", self.reply.getheaders())

    def __iter__(self):
        fields = {}
        while line := self.reply.readline():
            line = line.decode().rstrip("\n")
            if line.startswith(":"):
                self.comments += 1
            elif line:
                name, _, value = line.partition(": ")
                fields[name] = value
            elif fields:
                yield fields["event"], fields["id"], json.loads(fields["data"])
                fields = {}

    def close(self):
        self.reply.close()
        self.connection.close()


def check_job(data):
    if service.jsonschema:
        service.validator("job.json").validate(data)


def test_from_start_to_end(s):
    job = s.post(ENDLESS).json
    seen = []
    stream = Stream(s, job["id"])
    for event, event_id, data in stream:
        seen.append((event, event_id, data))
        if event == "status":
            check_job(data)
        else:
            check(0 <= data["progress"] <= 100, data)
        if len([one for one in seen if one[0] == "progress" and "iteration" in one[2]]) == 2:
            s.request("DELETE", f"/v1/jobs/{job['id']}")
    statuses = [data["status"] for event, _, data in seen if event == "status"]
    check(statuses[-1] == "dismissed" and statuses[:-1] in (["running"], ["accepted", "running"]), statuses)
    iterations = [data["iteration"] for event, _, data in seen if event == "progress" and "iteration" in data]
    check(iterations == sorted(set(iterations)) and len(iterations) >= 2, iterations)
    ids = [event_id for _, event_id, _ in seen]
    check(len(set(ids)) == len(ids), ids)


def test_ended_job(s):
    job = s.solve(MATRICES)
    events = list(Stream(s, job["id"]))
    check(len(events) == 1 and events[0][0] == "status", events)
    check(events[0][2] == s.get(f"/v1/jobs/{job['id']}").json, events)
    path = f"/v1/jobs/{job['id']}/events"
    reply = expect(s.get(path, Last_Event_ID=events[0][1]), 204)
    check(reply.body == b"", reply)
    check(len(list(Stream(s, job["id"], "0.accepted"))) == 1)
    expect(s.request("HEAD", path), 200)


def test_links(s):
    job = s.post(ENDLESS).json
    links = {link["rel"]: link["href"] for link in job["links"]}
    check(links["events"] == f"/v1/jobs/{job['id']}/events", links)
    s.request("DELETE", f"/v1/jobs/{job['id']}")
    ended = s.wait_status(job["id"], "dismissed")
    check("events" not in [link["rel"] for link in ended["links"]], ended)


@options("--workers", "1")
def test_waiting_job(s):
    first, second = s.post(ENDLESS).json, s.post(MATRICES).json
    s.wait_status(first["id"], "running")
    events = iter(Stream(s, second["id"]))
    event, event_id, data = next(events)
    check(event == "status" and data["status"] == "accepted", data)
    again = iter(Stream(s, second["id"], event_id))  # who has seen this is told of the next
    s.request("DELETE", f"/v1/jobs/{first['id']}")
    for stream in (events, again):
        last = [data["status"] for event, _, data in stream if event == "status"]
        check(last[-1] == "successful" and "accepted" not in last, last)


def test_many_streams(s):
    job = s.post(ENDLESS).json
    ends = []

    def follow():
        ends.append([data["status"] for event, _, data in Stream(s, job["id"]) if event == "status"][-1])
    threads = [threading.Thread(target=follow) for _ in range(40)]
    for thread in threads:
        thread.start()
    time.sleep(0.5)
    expect(s.get("/healthz"), 200)
    s.request("DELETE", f"/v1/jobs/{job['id']}")
    for thread in threads:
        thread.join()
    check(ends == ["dismissed"] * 40, ends)


@options("--max-connections", "8")
def test_streams_leave_connections(s):
    job = s.post(ENDLESS).json
    streams = [Stream(s, job["id"]) for _ in range(6)]
    reply = expect(s.get(f"/v1/jobs/{job['id']}/events"), 503, "too_many_streams")
    check(int(reply.headers["retry-after"]) > 0, reply)
    streams[0].close()
    end = time.monotonic() + 10
    while time.monotonic() < end:
        try:
            streams[0] = Stream(s, job["id"])
            break
        except (AssertionError, OSError, http.client.HTTPException):
            time.sleep(0.1)
    check(next(iter(streams[0]))[0] == "status")
    for stream in streams:
        stream.close()
    time.sleep(0.5)
    s.request("DELETE", f"/v1/jobs/{job['id']}")


@options("--request-deadline-s", "0.3")
def test_a_stream_outlives_the_deadline(s):
    job = s.post(ENDLESS).json
    started = time.monotonic()
    for event, _, data in Stream(s, job["id"]):
        if time.monotonic() - started > 1:
            s.request("DELETE", f"/v1/jobs/{job['id']}")
    check(data["status"] == "dismissed" and time.monotonic() - started > 0.9, data)


def test_the_end_of_the_service_ends_streams(s):
    job = s.post(ENDLESS).json
    events = iter(Stream(s, job["id"]))
    next(events)
    s.process.send_signal(signal.SIGTERM)
    list(events)  # ends, although the job still runs
    check(s.process.poll() is None and s.terminate() == 0, s.log())


def test_deleted_meanwhile(s):
    job = s.solve(SCENE)
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 204)
    expect(s.get(f"/v1/jobs/{job['id']}/events"), 404, "not_found")
    expect(s.get(f"/v1/jobs/{job['id']}/events?x=1"), 400, "unknown_parameter")


if __name__ == "__main__":
    service.main(globals())
