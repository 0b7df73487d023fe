"""Server-Sent Events of a job, /v1/jobs/{id}/events, and of all jobs, /v1/events."""
import http.client
import json
import signal
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options


class Stream:
    """An open event stream. Iterating gives (event, id, data) until it ends; comments are counted. They keep it alive
    for ever: what has not come after two minutes does not come."""

    def __init__(self, s, job_id, last=None):
        self.comments = 0
        self.connection = http.client.HTTPConnection(s.host, s.port, timeout=PATIENT_S)
        path = f"/v1/jobs/{job_id}/events" if job_id else "/v1/events"
        self.connection.request("GET", path, headers={"Last-Event-ID": last} if last else {})
        self.reply = self.connection.getresponse()
        if self.reply.status != 200:
            self.close()
        check(self.reply.status == 200, self.reply.status, self.reply.getheaders())
        check(self.reply.getheader("content-type") == "text/event-stream", self.reply.getheaders())

    def __iter__(self):
        fields, end = {}, time.monotonic() + PATIENT_S
        while line := self.reply.readline():
            check(time.monotonic() < end, "nothing but", self.comments, "comments for long")
            line = line.decode().rstrip("\n")
            if line.startswith(":"):
                self.comments += 1
            elif line:
                name, _, value = line.partition(": ")
                fields[name] = value
            elif fields:
                yield fields["event"], fields["id"], json.loads(fields["data"])
                fields, end = {}, time.monotonic() + PATIENT_S

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
    end = time.monotonic() + PATIENT_S
    while True:
        check(time.monotonic() < end, "there is no room for another")
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


# ---- all jobs

def until(events, wanted):
    """The events up to the first one that `wanted` holds for, with it."""
    seen = []
    for one in events:
        seen.append(one)
        if wanted(*one):
            return seen
    raise AssertionError(seen)


def ended(job_id, status="successful"):
    return lambda event, _, data: event == "job" and data["id"] == job_id and data["status"] == status


def test_all_jobs(s):
    stream = Stream(s, None)
    events = iter(stream)
    event, _, data = next(events)  # what was before is for the list
    check(event == "reset" and data == {}, event)
    first, second = s.post(MATRICES).json["id"], s.post(SCENE).json["id"]
    seen = until(events, ended(second))
    if not any(ended(first)(*one) for one in seen):
        seen += until(events, ended(first))
    for _, _, data in seen:
        check_job(data)
    ids = [event_id for _, event_id, _ in seen]
    check(len(set(ids)) == len(ids), ids)
    listed = {job["id"]: job for job in s.get("/v1/jobs").json["jobs"]}
    check({data["id"]: data for _, _, data in seen} == listed, (seen, listed))
    expect(s.request("DELETE", f"/v1/jobs/{first}"), 204)
    *late, (_, last, data) = until(events, lambda event, *_: event == "deleted")
    check(data == {"id": first} and all(one == listed[one["id"]] for _, _, one in late), (late, data))  # may be told twice
    stream.close()
    third = s.solve(MATRICES)["id"]
    stream = Stream(s, None, last)  # goes on after what was seen
    seen = until(iter(stream), ended(third))
    check({data["id"] for _, _, data in seen} == {third}, seen)
    stream.close()


def test_all_jobs_progress(s):
    stream = Stream(s, None)
    events = iter(stream)
    next(events)
    job = s.post({**ENDLESS, "solver": {"method": "uzawa", "alpha": 1e-9, "max_iterations": 3000000}}).json["id"]
    started, percents, times = time.monotonic(), [], []
    for event, _, data in events:
        check(event == "job" and data["id"] == job, data)
        if data["status"] == "running":
            percents.append(data["progress"])
            times.append(time.monotonic())
        if len(set(percents)) >= 4:
            s.request("DELETE", f"/v1/jobs/{job}")
        if data["status"] not in ("accepted", "running"):
            break
    check(percents == sorted(percents) and len(set(percents)) >= 4, percents)
    check(len(times) <= 3 + 10 * (times[-1] - started), times)  # no more than one in a tenth of a second
    stream.close()


@options("--workers", "2")
def test_all_jobs_expired_and_dismissed(s):
    """What others than a job's owner do to it is told as well."""
    stream = Stream(s, None)
    events = iter(stream)
    next(events)
    running = [s.post(ENDLESS).json["id"] for _ in range(2)]
    for job in running:
        s.wait_status(job, "running")
    late, waiting = s.post({**MATRICES, "queue_limit_s": 0.1}).json["id"], s.post(MATRICES).json["id"]
    until(events, ended(late, "failed"))
    s.request("DELETE", f"/v1/jobs/{waiting}")
    until(events, ended(waiting, "dismissed"))
    for job in running:
        s.request("DELETE", f"/v1/jobs/{job}")
    stream.close()


@options("--keep-jobs", "1")
def test_all_jobs_retention(s):
    stream = Stream(s, None)
    first = s.solve(MATRICES)["id"]
    s.solve(MATRICES)
    until(stream, lambda event, _, data: event == "deleted" and data["id"] == first)
    stream.close()


def test_all_jobs_begin_again(s):
    """Another run of the daemon, a number that is not there (yet), nonsense: load the list."""
    stream = Stream(s, None)
    _, last, _ = next(iter(stream))
    stream.close()
    run = last.partition(".")[0]
    for unknown in ("0" * 16 + ".0", run + ".999", run + ".", run + ".1x", run, "x" * 100, ".", run + "." + "9" * 20):
        stream = Stream(s, None, unknown)
        event, event_id, _ = next(iter(stream))
        check(event == "reset" and event_id == last, (unknown, event, event_id))
        stream.close()
    stream = Stream(s, None, last)
    job = s.solve(MATRICES)["id"]
    check(next(iter(stream))[2]["id"] == job)
    stream.close()
    expect(s.request("HEAD", "/v1/events"), 200)
    expect(s.request("POST", "/v1/events", MATRICES), 405)
    expect(s.get("/v1/events?x=1"), 400, "unknown_parameter")


def test_all_jobs_more_than_are_kept(s):
    """Who was away for longer than the changes are kept loads the list."""
    stream = Stream(s, None)
    _, last, _ = next(iter(stream))
    stream.close()

    def post():
        for _ in range(360):
            s.post(MATRICES)
    threads = [threading.Thread(target=post) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    while s.get("/healthz").json["jobs"]["successful"] < 1440:  # each has three changes, and 4096 are kept
        time.sleep(0.05)
    stream = Stream(s, None, last)
    check(next(iter(stream))[0] == "reset")
    stream.close()


@options("--max-streams", "2")
def test_the_limit_of_streams_has_a_name(s):
    limits = s.get("/v1/limits").json["limits"]
    check(limits["max_streams"]["value"] == 2, limits)
    streams = [Stream(s, None), Stream(s, None)]
    expect(s.get("/v1/events"), 503, "too_many_streams")
    for stream in streams:
        stream.close()


def test_the_end_of_the_service_ends_streams_of_all(s):
    stream = Stream(s, None)
    s.process.send_signal(signal.SIGTERM)
    check([event for event, _, _ in stream] in (["reset"], []))
    check(s.terminate() == 0, s.log())


if __name__ == "__main__":
    service.main(globals())
