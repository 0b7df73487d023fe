"""Connections that wait without a thread: event streams and long polls after their first second."""
import gzip
import json
import os
import signal
import socket
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, check, expect, head_of, options, read_all, wait_until

LONG = 1.5  # seconds after which a long poll has given up its thread


def threads(s):
    return len(os.listdir(f"/proc/{s.process.pid}/task"))


def ask(s, path, fields="", method="GET", body=b""):
    """A connection that has sent this request."""
    c = s.connect(timeout=PATIENT_S)
    length = f"Content-Length: {len(body)}\r\nContent-Type: application/json\r\n" if body else ""
    c.sendall(f"{method} {path} HTTP/1.1\r\nHost: x\r\n{length}{fields}\r\n".encode() + body)
    return c


def stream_start(c):
    """What a stream says first: its head and the first event."""
    data = b""
    while b"\n\n" not in data.partition(b"\r\n\r\n")[2]:
        more = c.recv(65536)
        check(more, data)
        data += more
    return data


def dechunk(data):
    """The body of a chunked message, and whether it is whole."""
    body = b""
    while data:
        size, _, data = data.partition(b"\r\n")
        if int(size, 16) == 0:
            return body, data == b"\r\n"
        body, data = body + data[:int(size, 16)], data[int(size, 16) + 2:]
    return body, False


def test_no_threads(s):
    job = s.post(ENDLESS).json["id"]
    s.wait_status(job, "running")
    before = threads(s)
    held = [ask(s, f"/v1/jobs/{job}/events") for _ in range(50)] + [ask(s, "/v1/events") for _ in range(50)]
    for c in held:
        stream_start(c)
    # The last of them may come after the end, and is answered at once then.
    polls = [ask(s, f"/v1/jobs/{job}", "Prefer: wait=60\r\nConnection: close\r\n") for _ in range(50)]
    wait_until(lambda: threads(s) <= before + 2)
    metrics = s.get("/metrics").body.decode()
    check("uzawad_http_connections 151" in metrics and "uzawad_http_event_streams 100" in metrics,
          [line for line in metrics.splitlines() if "connections" in line or "streams" in line])
    s.request("DELETE", f"/v1/jobs/{job}")
    for c in polls:
        data, closed = read_all(c)
        check(closed and json.loads(head_of(data)[2])["status"] == "dismissed", data)
    for c in held[:50]:
        data, closed = read_all(c)
        check(closed and b'"status":"dismissed"' in data and data.endswith(b"0\r\n\r\n"), data[-300:])
    for c in held + polls:
        c.close()
    wait_until(lambda: "uzawad_http_connections 1\n" in s.get("/metrics").body.decode())
    ended = [event for event in s.events("request") if event["path"].startswith("/v1/") and event["method"] == "GET"]
    check(len([event for event in ended if event["end"] == "complete" and event["status"] == 200]) >= 100, ended)
    check(len([event for event in ended if event["path"] == "/v1/events" and event["end"] == "aborted"]) == 50, ended)


def test_form_of_a_stream(s):
    job = s.post(ENDLESS).json["id"]
    with ask(s, f"/v1/jobs/{job}/events", "Origin: http://x\r\n") as c:
        start = stream_start(c)
        s.request("DELETE", f"/v1/jobs/{job}")
        data, closed = read_all(c)
        status, fields, body = head_of(start + data)
        check(status == 200 and closed and fields["connection"] == "close", fields)
        check(fields["transfer-encoding"] == "chunked" and "content-length" not in fields, fields)
        check(fields["content-type"] == "text/event-stream" and "date" in fields and "x-request-id" in fields, fields)
        text, whole = dechunk(body)
        check(whole and text.endswith(b"\n\n") and text.count(b"event: status\n") >= 2, text)
    with s.connect(timeout=PATIENT_S) as c:  # which knows no chunks
        c.sendall(f"GET /v1/jobs/{job}/events HTTP/1.0\r\n\r\n".encode())
        status, fields, body = head_of(read_all(c)[0])
        check(status == 200 and "transfer-encoding" not in fields and body.startswith(b"event: status\n"), fields, body)


def test_what_follows_is_not_served(s):
    """The connection ends with the reply: what was sent after the request is not answered, nor in the reply's way."""
    job = s.post(ENDLESS).json["id"]
    more = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"
    streams = [ask(s, f"/v1/jobs/{job}/events"), ask(s, f"/v1/jobs/{job}", "Prefer: wait=60\r\n")]
    for c in streams:
        c.sendall(more)
    time.sleep(LONG)
    for c in streams:
        c.sendall(more * 100)
    s.request("DELETE", f"/v1/jobs/{job}")
    for c in streams:
        data, closed = read_all(c)
        c.close()
        check(closed and data.count(b"HTTP/1.1 ") == 1 and b'"dismissed"' in data, data)


def test_long_polls(s):
    job = s.post(ENDLESS).json["id"]
    s.wait_status(job, "running")
    path = f"/v1/jobs/{job}"
    tag = s.get(path).headers.get("etag")
    body = json.dumps(ENDLESS).encode()
    started = time.monotonic()
    asked = {"plain": ask(s, path, "Prefer: wait=60\r\nX-Request-Id: mine\r\n"),
             "gzip": ask(s, path, "Prefer: wait=60\r\nAccept-Encoding: gzip\r\n"),
             "short": ask(s, path, "Prefer: wait=3\r\n"),
             "same": ask(s, path, f"Prefer: wait=2\r\nIf-None-Match: {tag}\r\n"),
             "submit": ask(s, "/v1/jobs", "Prefer: wait=2\r\n", "POST", body),
             "late": ask(s, path, "Prefer: wait=60\r\nIf-None-Match: *\r\n")}
    got = {name: head_of(read_all(asked[name])[0]) for name in ("same", "submit", "short")}
    check(2.9 < time.monotonic() - started < 20)
    status, fields, answer = got["submit"]
    check(status == 202 and json.loads(answer)["status"] in ("accepted", "running"), got["submit"])
    check(fields["location"] == f"/v1/jobs/{json.loads(answer)['id']}", fields)
    check(got["short"][0] == 200 and json.loads(got["short"][2])["status"] == "running", got["short"])
    check(got["same"][0] in (200, 304), got["same"])  # a job that runs has another tag when it got on
    s.request("DELETE", f"/v1/jobs/{json.loads(answer)['id']}")
    wait_until(lambda: s.get(f"{path}/history").json["rows"])  # with an answer it is long enough to be packed
    s.request("DELETE", path)
    got |= {name: head_of(read_all(asked[name])[0]) for name in ("plain", "gzip", "late")}
    status, fields, answer = got["plain"]
    check(status == 200 and json.loads(answer)["status"] == "dismissed" and fields["x-request-id"] == "mine", got)
    check(fields["preference-applied"] == "wait=60" and int(fields["content-length"]) == len(answer), fields)
    status, fields, packed = got["gzip"]
    check(fields["content-encoding"] == "gzip" and gzip.decompress(packed) == answer, fields)
    check(got["late"][0] == 304 and got["late"][2] == b"" and "content-length" not in got["late"][1], got["late"])
    for name, (_, fields, _) in got.items():
        check(fields["connection"] == "close", name, fields)
    for c in asked.values():
        c.close()


@options("--workers", "1")
def test_a_job_is_deleted_while_it_is_waited_for(s):
    first, second = s.post(ENDLESS).json["id"], s.post(MATRICES).json["id"]
    s.wait_status(first, "running")
    with ask(s, f"/v1/jobs/{second}", "Prefer: wait=60\r\n") as c:
        time.sleep(LONG)
        s.request("DELETE", f"/v1/jobs/{second}")  # dismissed
        status, _, answer = head_of(read_all(c)[0])
        check(status == 200 and json.loads(answer)["status"] == "dismissed", answer)
    expect(s.request("DELETE", f"/v1/jobs/{first}"), 200)


def test_clients_leave(s):
    job = s.post(ENDLESS).json["id"]
    asked = [ask(s, f"/v1/jobs/{job}", "Prefer: wait=60\r\n"), ask(s, f"/v1/jobs/{job}/events"),
             ask(s, "/v1/events"), ask(s, f"/v1/jobs/{job}", "Prefer: wait=60\r\n")]
    time.sleep(LONG)
    asked[0].close()
    asked[1].close()
    asked[2].shutdown(socket.SHUT_WR)
    asked[3].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    asked[3].close()  # by a reset
    wait_until(lambda: len([e for e in s.events("request") if e["method"] == "GET" and e["end"] == "aborted"]) == 4)
    check(read_all(asked[2])[1])
    asked[2].close()
    check(s.get("/healthz").json["status"] == "ok")


def test_the_end_of_the_service(s):
    job = s.post(ENDLESS).json["id"]
    asked = [ask(s, f"/v1/jobs/{job}", "Prefer: wait=60\r\n"), ask(s, f"/v1/jobs/{job}/events"),
             ask(s, "/v1/events")]
    time.sleep(LONG)
    s.process.send_signal(signal.SIGTERM)
    data = [read_all(c)[0] for c in asked]
    check(head_of(data[0])[0] == 200 and data[0].endswith(b"}"), data[0])
    check(data[1].endswith(b"0\r\n\r\n") and data[2].endswith(b"0\r\n\r\n"), data[1:])
    for c in asked:
        c.close()
    check(s.terminate() == 0, s.log())


@options("--max-connections", "8", "--max-streams", "8")
def test_they_count_as_connections(s):
    held = [ask(s, "/v1/events") for _ in range(8)]
    for c in held:
        stream_start(c)
    _, closed = s.raw(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", timeout=PATIENT_S)
    check(closed, "a ninth connection was served")
    held.pop().close()
    wait_until(lambda: s.raw(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", timeout=1)[0].startswith(b"HTTP/1.1 200"))
    for c in held:
        c.close()


@options("--max-client-connections", "3")
def test_they_count_for_their_client(s):
    held = [ask(s, "/v1/events") for _ in range(3)]
    for c in held:
        stream_start(c)
    data, closed = s.raw(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", timeout=PATIENT_S)
    check(closed and not data, "a fourth connection was served", data)
    for c in held:
        c.close()
    wait_until(lambda: s.raw(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", timeout=1)[0].startswith(b"HTTP/1.1 200"))


def test_many_come_and_go(s):
    """Streams and long polls that begin, are told and are left in any order, beside jobs that end."""
    stop = time.monotonic() + 4  # seconds of coming and going

    def follow(number):
        while time.monotonic() < stop:
            job = s.post(MATRICES).json["id"]
            path = ("/v1/events", f"/v1/jobs/{job}/events", f"/v1/jobs/{job}")[number % 3]
            with ask(s, path, "Prefer: wait=9\r\n") as c:
                if number % 2:
                    check(c.recv(100).startswith(b"HTTP/1.1 "))
    everyone = [threading.Thread(target=follow, args=(number,)) for number in range(12)]
    for one in everyone:
        one.start()
    for one in everyone:
        one.join()
    wait_until(lambda: "uzawad_http_connections 1\n" in s.get("/metrics").body.decode())
    check("uzawad_http_event_streams 0\n" in s.get("/metrics").body.decode())


if __name__ == "__main__":
    service.main(globals())
