"""The HTTP interface of the real daemon, by its contract: every route, every refusal, sockets that misbehave."""
import json
import os
import signal
import socket
import subprocess
import threading
import time

import service
from service import ENDLESS, MATRICES, SCENE, Skip, check, options, read_all

UNKNOWN = "0" * 32


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


# ------------------------------------------------------------------ routes

def test_job_lifecycle(s):
    reply = expect(s.post({**MATRICES, "tags": ["a", "b"]}), 202)
    job = reply.json
    check(reply.headers["location"] == f"/v1/jobs/{job['id']}", reply)
    check(reply.headers["cache-control"] == "no-store", reply)
    check(job["tags"] == ["a", "b"] and job["status"] in ("accepted", "running", "successful"), job)
    ended = expect(s.get(reply.headers["location"], Prefer="wait=30"), 200).json
    check(ended["status"] == "successful" and ended["progress"] == 100, ended)
    check(ended["summary"]["outcome"] == "converged", ended)
    result = expect(s.get(f"/v1/jobs/{job['id']}/result"), 200).json
    check(abs(result["reactions"][0] + 1) < 1e-6 and abs(result["gaps"][0]) < 1e-6, result)
    check("displacements" not in result and result["job"] == job["id"], result)
    result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements"), 200).json
    check(abs(result["displacements"][0] - 0.5) < 1e-6 and abs(result["displacements"][1] - 2) < 1e-6, result)
    check("reactions" not in result and "gaps" not in result, result)
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 204)
    expect(s.get(f"/v1/jobs/{job['id']}"), 404, "not_found")
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 404, "not_found")


def test_scene(s):
    job = s.solve(SCENE)
    check(job["summary"]["outcome"] == "converged", job)
    check(job["summary"]["contact"]["candidates"] == 30 and job["summary"]["contact"]["active"] == 22, job)
    check(abs(job["summary"]["contact"]["reaction_sum"] + 10.51371700) < 1e-3, job)
    result = s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions").json
    check(len(result["displacements"]) == 31 * 11 and len(result["displacements"][0]) == 2, result.keys())
    check(len(result["nodes"]) == 31 * 11 and len(result["contact_nodes"]) == 30, result.keys())
    check(len(s.get("/v1/factors").json["factors"]) == 1, s.get("/v1/factors"))


def test_result_refusals(s):
    job = s.post(ENDLESS).json
    reply = expect(s.get(f"/v1/jobs/{job['id']}/result"), 409, "not_ended")
    check(int(reply.headers["retry-after"]) >= 1, reply)
    expect(s.get(f"/v1/jobs/{job['id']}/result?fields=reactions,nonsense"), 400, "bad_parameter")
    expect(s.get(f"/v1/jobs/{job['id']}/result?fields="), 400, "bad_parameter")
    expect(s.get(f"/v1/jobs/{job['id']}/result?field=gaps"), 400, "unknown_parameter")
    expect(s.get(f"/v1/jobs/{UNKNOWN}/result"), 404, "not_found")


def test_failed_job(s):
    singular = json.loads(json.dumps(MATRICES))
    singular["problem"]["K"] = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 -1\n"
    job = s.solve(singular)
    check(job["status"] == "failed" and job["error"]["code"] == "not_positive_definite", job)
    reply = expect(s.get(f"/v1/jobs/{job['id']}/result"), 409, "job_failed")
    check(job["error"]["detail"] in reply.json["detail"], reply, job)


def test_history(s):
    job = s.solve(SCENE)
    path = f"/v1/jobs/{job['id']}/history"
    history = expect(s.get(path), 200).json
    check(history["columns"][0] == "iteration" and len(history["columns"]) == 12, history["columns"])
    rows = history["rows"]
    check(rows[-1][0] == job["summary"]["iterations"] and len(rows) > 5, rows[-1], job)
    later = expect(s.get(path + "?after=3"), 200).json["rows"]
    check(later == [row for row in rows if row[0] > 3], later)
    for csv in (s.get(path, Accept="text/csv"), s.get(path, Accept="application/x-no, text/csv;q=0.5"),
                s.get(path + ".csv")):
        check(csv.status == 200 and csv.headers["content-type"].startswith("text/csv"), csv)
        lines = csv.body.decode().splitlines()
        check(lines[0] == ",".join(history["columns"]) and len(lines) == len(rows) + 1, lines[:2])
    check(s.get(path, Accept="text/csv;q=0, */*").headers["content-type"] == "application/json")
    for wrong in ("x", "1.5", "", "-2", "99999999999999999999"):
        expect(s.get(f"{path}?after={wrong}"), 400, "bad_parameter")


def test_live_history(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    path = f"/v1/jobs/{job['id']}/history"
    end = time.monotonic() + 20
    while not (rows := s.get(path).json["rows"]) and time.monotonic() < end:
        time.sleep(0.02)
    check(rows, "no row of a running job")
    time.sleep(0.1)
    later = s.get(f"{path}?after={int(rows[-1][0])}").json["rows"]
    check(later and later[0][0] > rows[-1][0], rows[-1], later[:1])
    check(s.get(f"/v1/jobs/{job['id']}").json["status"] == "running")


def test_dismiss(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    reply = expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 200)
    check(reply.json["id"] == job["id"], reply)
    ended = s.wait_status(job["id"], "dismissed")
    check(ended["status"] == "dismissed", ended)
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 204)


@options("--workers", "1")
def test_dismiss_waiting(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    second = s.post(MATRICES).json
    reply = expect(s.request("DELETE", f"/v1/jobs/{second['id']}"), 200)
    check(reply.json["status"] == "dismissed", reply)
    expect(s.get(f"/v1/jobs/{second['id']}/result"), 409, "no_result")


def test_list(s):
    ids = [s.solve({**MATRICES, "tags": ["even" if i % 2 == 0 else "odd"]})["id"] for i in range(5)]
    page = expect(s.get("/v1/jobs?limit=2"), 200).json
    check([job["id"] for job in page["jobs"]] == ids[:2:-1], page)
    seen = [job["id"] for job in page["jobs"]]
    while page["next"]:
        page = s.get(f"/v1/jobs?limit=2&cursor={page['next']}").json
        seen += [job["id"] for job in page["jobs"]]
    check(seen == ids[::-1], seen, ids)
    check([job["id"] for job in s.get("/v1/jobs?tag=odd").json["jobs"]] == [ids[3], ids[1]])
    check(len(s.get("/v1/jobs?status=successful").json["jobs"]) == 5)
    check(s.get("/v1/jobs?status=failed").json["jobs"] == [])
    for query, code in (("limit=0", "bad_parameter"), ("limit=1001", "bad_parameter"), ("limit=two", "bad_parameter"),
                        ("status=done", "bad_parameter"), ("cursor=xyz", "bad_parameter"),
                        ("page=2", "unknown_parameter"), ("limit=1&limit=2", "repeated_parameter"),
                        ("tag=%zz", "bad_target"), ("tag=%00", "bad_target")):
        expect(s.get("/v1/jobs?" + query), 400, code)


def test_service_routes(s):
    check(expect(s.get("/healthz"), 200).json["status"] == "ok")
    check(expect(s.get("/readyz"), 200).json["jobs"]["failed"] == 0)
    check(expect(s.get("/v1/factors"), 200).json["factors"] == [])
    openapi = expect(s.get("/openapi.json"), 200)
    check("/v1/jobs" in openapi.json["paths"], openapi.json["paths"].keys())
    for path in service.SCHEMAS.glob("*.json"):
        reply = expect(s.get(f"/schemas/{path.name}"), 200)
        check(reply.body == path.read_bytes(), path)
    expect(s.get("/schemas/none.json"), 404, "not_found")
    expect(s.get("/schemas/..%2FMakefile"), 404, "not_found")


def test_not_found(s):
    for path in ("/", "/v1", "/v1/jobs/", "/v1/jobs/xyz", f"/v1/jobs/{UNKNOWN.upper()}x", "/v1/jobsx", "/healthz/",
                 f"/v1/jobs/{UNKNOWN}/nothing", "//v1/jobs", "/v1/../v1/jobs"):
        expect(s.get(path), 404, "not_found")
    expect(s.get(f"/v1/jobs/{UNKNOWN}"), 404, "not_found")
    expect(s.get("/%ff%01"), 404, "not_found")


def test_method_not_allowed(s):
    for method, path, allow in (("PUT", "/v1/jobs", "POST, GET, HEAD"), ("POST", "/healthz", "GET, HEAD"),
                                ("PATCH", f"/v1/jobs/{UNKNOWN}", "GET, HEAD, DELETE"),
                                ("BREW", "/v1/factors", "GET, HEAD"), ("OPTIONS", "/v1/jobs", "POST, GET, HEAD")):
        reply = expect(s.request(method, path), 405, "method_not_allowed")
        check(reply.headers["allow"] == allow, reply)


def test_head(s):
    for path, status in (("/v1/jobs", 200), ("/healthz", 200), ("/openapi.json", 200), ("/nothing", 404)):
        head, get = s.request("HEAD", path), s.get(path)
        check(head.status == get.status == status and head.body == b"", head)
        check(head.headers["content-length"] == str(len(get.body)), head, get)


def test_keep_alive(s):
    with s.connect() as c:
        for path in (b"/healthz", b"/nothing", b"/v1/jobs?bad=1", b"/healthz"):
            c.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: x\r\n\r\n")
            data = c.recv(65536)
            status, fields, body = head_of(data)
            while len(body) < int(fields["content-length"]):
                body += c.recv(65536)
            check("connection" not in fields, data)
        check(status == 200)


def test_absolute_target(s):
    data, _ = s.raw(b"GET http://example.org/healthz HTTP/1.1\r\nHost: example.org\r\nConnection: close\r\n\r\n")
    check(head_of(data)[0] == 200, data)


# ------------------------------------------------------------------ submit

def test_validate(s):
    reply = expect(s.post(SCENE, query="?validate=true"), 200)
    check(reply.json == {"valid": True}, reply)
    expect(s.post({"problem": {}}, query="?validate=true"), 422)
    expect(s.post(SCENE, query="?validate=maybe"), 400, "bad_parameter")
    expect(s.post(SCENE, query="?wait=1"), 400, "unknown_parameter")
    check(s.get("/v1/jobs").json["jobs"] == [], "validation made a job")


def test_bad_bodies(s):
    json_type = {"Content-Type": "application/json"}
    for body in (b"", b"{", b'{"problem": 1,}', b"\xff\xfe", b"[1\0]", b'{"a": "\0"}', json.dumps(SCENE).encode() + b"\0",
                 b"\0"):
        expect(s.request("POST", "/v1/jobs", body, json_type), 400, "json_syntax")
    reply = expect(s.post({**SCENE, "solvr": {}}), 422, "unknown_key")
    check(reply.json["pointer"] == "/solvr", reply)
    wrong = json.loads(json.dumps(MATRICES))
    wrong["problem"]["K"] = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 x 1\n"
    reply = expect(s.post(wrong), 422)
    check(reply.json["pointer"] == "/problem/K" and reply.json["line"] == 4, reply)
    check(s.get("/v1/jobs").json["jobs"] == [], "a bad body made a job")


def test_content_type(s):
    body = json.dumps(MATRICES).encode()
    for good in ("application/json", "Application/JSON; charset=utf-8", "application/vnd.x+json"):
        expect(s.request("POST", "/v1/jobs?validate=true", body, {"Content-Type": good}), 200)
    expect(s.request("POST", "/v1/jobs?validate=true", body), 200)  # none at all
    for bad in ("application/x-www-form-urlencoded", "text/plain", "application/json-seq", "+json", ""):
        expect(s.request("POST", "/v1/jobs?validate=true", body, {"Content-Type": bad}), 415, "content_type")
    expect(s.request("POST", "/v1/jobs", body, {"Content-Type": "application/json", "Content-Encoding": "gzip"}), 415,
           "content_encoding")
    expect(s.post(MATRICES, {"Sec-Fetch-Site": "cross-site"}), 403, "cross_site")


def test_prefer_wait(s):
    reply = expect(s.post(MATRICES, {"Prefer": "respond-async, wait=30"}), 200)
    check(reply.json["status"] == "successful" and reply.headers["preference-applied"] == "wait=30", reply)
    check(reply.headers["location"] == f"/v1/jobs/{reply.json['id']}", reply)
    for prefer in ("wait=", "wait=x", "wait=-1", "wait", 'foo="wait=5', "wait=99999999999"):
        reply = expect(s.post(ENDLESS, {"Prefer": prefer}), 202)
        check("preference-applied" not in reply.headers, prefer, reply)
        s.request("DELETE", f"/v1/jobs/{reply.json['id']}")


def test_long_poll(s):
    job = s.post(ENDLESS).json
    started = time.monotonic()
    reply = expect(s.get(f"/v1/jobs/{job['id']}", Prefer="wait=1"), 200)
    check(reply.json["status"] in ("accepted", "running") and 0.9 < time.monotonic() - started < 5, reply)
    timer = threading.Timer(0.7, lambda: s.request("DELETE", f"/v1/jobs/{job['id']}"))
    timer.start()
    started = time.monotonic()
    reply = expect(s.get(f"/v1/jobs/{job['id']}", Prefer="wait=600"), 200)
    took = time.monotonic() - started
    timer.join()
    check(reply.json["status"] == "dismissed" and 0.5 < took < 20, took, reply)
    check(reply.headers["preference-applied"] == "wait=60", reply)


@options("--request-deadline-s", "1")
def test_long_poll_outlives_the_deadline(s):
    job = s.post(ENDLESS).json
    started = time.monotonic()
    reply = expect(s.get(f"/v1/jobs/{job['id']}", Prefer="wait=3"), 200)
    check(time.monotonic() - started > 2.5 and reply.json["status"] == "running", reply)


def test_long_poll_ends_with_its_client(s):
    job = s.post(ENDLESS).json
    with s.connect() as c:
        c.sendall(f"GET /v1/jobs/{job['id']} HTTP/1.1\r\nHost: x\r\nPrefer: wait=60\r\n\r\n".encode())
        time.sleep(0.3)
    end = time.monotonic() + 10
    while not (ended := [e for e in s.events("request") if e["method"] == "GET"]) and time.monotonic() < end:
        time.sleep(0.1)
    check(ended and ended[0]["seconds"] < 5, ended)


def test_idempotency(s):
    key = {"Idempotency-Key": "a key, with spaces"}
    first = expect(s.post(ENDLESS, key), 202).json
    again = expect(s.post(ENDLESS, key), 202)
    check(again.json["id"] == first["id"] and again.headers["location"].endswith(first["id"]), again)
    expect(s.post(SCENE, key), 422, "idempotency_key_reused")
    s.request("DELETE", f"/v1/jobs/{first['id']}")
    s.wait_status(first["id"], "dismissed")
    check(expect(s.post(ENDLESS, key), 200).json["id"] == first["id"])
    check(len(s.get("/v1/jobs").json["jobs"]) == 1)
    for wrong in ("", "x" * 256, "caf\u00e9"):
        expect(s.post(MATRICES, {"Idempotency-Key": wrong.encode("utf-8")}), 400, "bad_idempotency_key")


def test_idempotency_race(s):
    ids = []

    def submit():
        ids.append(s.post(MATRICES, {"Idempotency-Key": "one"}).json["id"])
    threads = [threading.Thread(target=submit) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    check(len(ids) == 8 and len(set(ids)) == 1, ids)


# ----------------------------------------------------------------- framing

POST = b"POST /v1/jobs?validate=true HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
SMUGGLED = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"


def refused(s, data, statuses=(400,), framed=True):
    """One refusal comes back, nothing after it is served, and the connection closes. framed: the request has a line
    that libmicrohttpd reads; otherwise it answers by itself, not in JSON."""
    reply, closed = s.raw(data, timeout=5)
    status, fields, body = head_of(reply)
    check(status in statuses and closed, data[:200], "->", status, closed, reply[:300])
    check(reply.count(b"HTTP/1.1 ") == 1, "a second request was served", data[:200], reply)
    if framed:
        check(json.loads(body)["status"] == status and fields["connection"] == "close", reply)
    return fields, body


def test_smuggling(s):
    for lines in (b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n",
                  b"Transfer-Encoding: chunked\r\nContent-Length: 2\r\n",
                  b"Content-Length: 2\r\nContent-Length: 40\r\n",
                  b"Content-Length: 2\r\nContent-Length: 2\r\n",
                  b"Content-Length : 2\r\n",
                  b"Content-Length\t: 2\r\n",
                  b"Content-Length: +2\r\n", b"Content-Length: -2\r\n", b"Content-Length: 2,2\r\n",
                  b"Content-Length: 0x2\r\n", b"Content-Length: 2 2\r\n", b"Content-Length:\r\n",
                  b"Content-Length: 99999999999999999999999\r\n",
                  b"Transfer-Encoding: gzip\r\n", b"Transfer-Encoding: gzip, chunked\r\n",
                  b"Transfer-Encoding: chunked, identity\r\n", b"Transfer-Encoding: xchunked\r\n",
                  b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
                  b"Transfer-Encoding : chunked\r\n", b"Transfer-Encoding:\x0bchunked\r\n",
                  b"Host: y\r\nContent-Length: 2\r\n",
                  b"X: a\0b\r\nContent-Length: 2\r\n",
                  b"X: a\0\0b: c\r\nContent-Length: 2\r\n",
                  b"X\0Y: a\r\nContent-Length: 2\r\n",
                  b"X: a\rb\r\nContent-Length: 2\r\n",
                  b"X: a\r\n folded\r\nContent-Length: 2\r\n",
                  b"X: a\nContent-Length: 2\r\n",
                  b": a\r\nContent-Length: 2\r\n",
                  b"X[]: a\r\nContent-Length: 2\r\n",
                  b"no colon\r\nContent-Length: 2\r\n"):
        refused(s, POST + lines + b"\r\n{}" + SMUGGLED, (400, 413))
    check(s.get("/healthz").status == 200)


def test_malformed_requests(s):
    for data in (b"GET /healthz HTTP/1.1\r\n\r\n",  # no Host
                 b"GET /healthz HTTP/1.1\r\nHost: x\r\nHost: x\r\n\r\n",
                 b"GET /healthz HTTP/1.1\nHost: x\n\n",
                 b"GET  /healthz HTTP/1.1\r\nHost: x\r\n\r\n",
                 b"GET /healthz\0 HTTP/1.1\r\nHost: x\r\n\r\n",
                 b"GET /healthz HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
                 b"GET /healthz HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello"):
        refused(s, data)
    for target in (b"/health\xffz", b"healthz", b"/healthz#x", b"*", b"http://x"):  # well framed: it stays open
        data = b"GET " + target + b" HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
        check(head_of(s.raw(data)[0])[0] == 400, data)
    refused(s, b"GET /healthz HTTP/2.0\r\nHost: x\r\n\r\n", (400, 505), framed=False)
    refused(s, b"GET /healthz\r\n\r\n", framed=False)
    refused(s, b"GET /" + b"y" * 100000 + b" HTTP/1.1\r\nHost: x\r\n\r\n", (414,), framed=False)
    refused(s, b"GET /healthz HTTP/1.1\r\nHost: x\r\n" + b"X: y\r\n" * 129 + b"\r\n", (431,))
    refused(s, b"GET /healthz HTTP/1.1\r\nHost: x\r\nX: " + b"y" * 100000 + b"\r\n\r\n", (400, 413, 414, 431))
    refused(s, POST + b"Expect: cake\r\nContent-Length: 2\r\n\r\n{}", (417,))
    check(s.get("/healthz").status == 200)


def test_pipelining(s):
    body = json.dumps(MATRICES).encode()
    one = POST + b"Content-Length: %d\r\n\r\n" % len(body) + body
    data, _ = s.raw(one + SMUGGLED + one + b"GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
    check(data.count(b"HTTP/1.1 200 OK") == 4, data)


def chunked(*pieces):
    return b"".join(b"%x\r\n%s\r\n" % (len(piece), piece) for piece in pieces) + b"0\r\n\r\n"


def test_chunked(s):
    body = json.dumps(SCENE).encode()
    data, _ = s.raw(POST + b"Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n" +
                    chunked(*(body[i:i + 7] for i in range(0, len(body), 7))))
    status, _, answer = head_of(data)
    check(status == 200 and json.loads(answer) == {"valid": True}, data)
    for broken in (b"2\r\n{}X0\r\n\r\n", b"zz\r\n{}\r\n0\r\n\r\n", b"-2\r\n{}\r\n0\r\n\r\n",
                   b"fffffffffffffffff\r\n{}\r\n0\r\n\r\n"):
        refused(s, POST + b"Transfer-Encoding: chunked\r\n\r\n" + broken + SMUGGLED, (400, 413))


def test_connection_ends_early(s):
    for data in (b"", b"GET", b"GET / HTTP/1.1\r\nHost", POST + b"Content-Length: 100\r\n\r\n{",
                 POST + b"Transfer-Encoding: chunked\r\n\r\n5\r\nab"):
        for half_close in (True, False):
            with s.connect() as c:
                c.sendall(data)
                if half_close:
                    c.shutdown(socket.SHUT_WR)
                    read_all(c)
    check(s.get("/healthz").status == 200)
    check(s.get("/v1/jobs").json["jobs"] == [])


# ------------------------------------------------------------ size and time

@options("--max-body", "10K")
def test_body_too_large(s):
    big = b" " * 10241
    for expect_field in (b"", b"Expect: 100-continue\r\n"):
        # Only the head is sent: the refusal must not wait for the body.
        with s.connect(timeout=5) as c:
            c.sendall(POST + expect_field + b"Content-Length: 10241\r\n\r\n")
            data = c.recv(65536)
            status, fields, body = head_of(data)
            check(status == 413 and b"100 Continue" not in data and fields["connection"] == "close", data)
            check("10240" in json.loads(body)["detail"] and json.loads(body)["code"] == "body_too_large", body)
    fields, body = refused(s, POST + b"Content-Length: 10241\r\n\r\n" + big, (413,))
    check(json.loads(body)["code"] == "body_too_large", body)
    fields, body = refused(s, POST + b"Content-Length: 3000000\r\n\r\n" + b" " * 3000000, (413,))
    fields, body = refused(s, POST + b"Transfer-Encoding: chunked\r\n\r\n" + chunked(*[b" " * 1000] * 11), (413,))
    check(json.loads(body)["code"] == "body_too_large" and "10240" in json.loads(body)["detail"], body)
    refused(s, POST + b"Transfer-Encoding: chunked\r\n\r\n" + b"ffffffff\r\n" + b" " * 3000000, (413,))
    expect(s.request("POST", "/v1/jobs", b" " * 10240, {"Content-Type": "application/json"}), 400, "json_syntax")


def test_expect_continue(s):
    body = json.dumps(MATRICES).encode()
    with s.connect(timeout=5) as c:
        c.sendall(POST + b"Expect: 100-continue\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(body))
        check(c.recv(100).startswith(b"HTTP/1.1 100 Continue\r\n\r\n"))
        c.sendall(body)
        data, _ = read_all(c)
        check(head_of(data)[0] == 200, data)


def test_large_body(s):
    numbers = [0.1] * 400000
    body = {"problem": {"kind": "matrices", "K": MATRICES["problem"]["K"], "N": MATRICES["problem"]["N"],
                        "h": numbers, "p": numbers}}
    reply = s.post(body, query="?validate=true")
    check(reply.status == 422, reply)


def trickle(c, data, pause):
    """Sends byte by byte until the server closes; what came back."""
    try:
        for i in range(len(data)):
            c.sendall(data[i:i + 1])
            time.sleep(pause)
    except OSError:
        pass
    return read_all(c)


@options("--request-deadline-s", "1")
def test_slow_requests(s):
    for data, answered in ((b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Slow: " + b"y" * 1000 + b"\r\n\r\n", True),
                           (b"GET /" + b"y" * 1000 + b" HTTP/1.1\r\n\r\n", False),
                           (POST + b"Content-Length: 900\r\n\r\n" + b" " * 900, True),
                           (POST + b"Transfer-Encoding: chunked\r\n\r\n" + b"1\r\n \r\n" * 900, True)):
        with s.connect(timeout=10) as c:
            started = time.monotonic()
            c.sendall(data[:-800])
            reply, closed = trickle(c, data[-800:], 0.05)
            took = time.monotonic() - started
            check(closed and 0.8 < took < 5, data[:60], closed, took, reply)
            if reply:
                status, _, body = head_of(reply)
                check(status == 408 and json.loads(body)["code"] == "request_timeout", reply)
            check(reply or not answered, data[:60], "ended without a word")
    check(any(event["end"] == "deadline" for event in s.events("request")), s.log())


@options("--request-deadline-s", "1")
def test_idle_connections_close(s):
    with s.connect(timeout=10) as c, s.connect(timeout=10) as silent:
        c.sendall(SMUGGLED)
        started = time.monotonic()
        data, closed = read_all(c)
        check(closed and data.startswith(b"HTTP/1.1 200") and 0.5 < time.monotonic() - started < 5, data)
        check(read_all(silent) == (b"", True), "a silent connection")


@options("--max-connections", "8")
def test_connection_limit(s):
    held = [s.connect() for _ in range(8)]
    time.sleep(0.2)
    with s.connect(timeout=3) as c:
        c.sendall(SMUGGLED)
        data, _ = read_all(c)
        check(not data.startswith(b"HTTP/1.1 200"), data)
    for c in held:
        c.close()
    time.sleep(0.3)
    check(s.get("/healthz").status == 200)


# ------------------------------------------------------------------ process

def test_terminates(s):
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if s.process.poll() is not None:
            s.process.stdout.close()
            s.log_file.close()
            s.start()
        s.get("/healthz")
        started = time.monotonic()
        check(s.terminate(number=number) == 0, s.log())
        check(time.monotonic() - started < 5, "an idle daemon drained for", time.monotonic() - started)


@options("--drain-s", "2", "--workers", "1")
def test_drain(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    poll = {}

    def long_poll():
        poll["reply"] = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=60")
    thread = threading.Thread(target=long_poll)
    thread.start()
    time.sleep(0.3)
    started = time.monotonic()
    s.process.send_signal(signal.SIGTERM)
    time.sleep(0.5)
    reply = expect(s.post(MATRICES), 503, "draining")
    check(int(reply.headers["retry-after"]) >= 1, reply)
    expect(s.get("/readyz"), 503, "draining")
    check(s.get("/healthz").status == 200 and s.get(f"/v1/jobs/{job['id']}").status == 200)
    thread.join(timeout=10)
    check(poll["reply"].status == 200 and time.monotonic() - started < 2, poll)
    check(s.process.wait(timeout=30) == 0 and 1.5 < time.monotonic() - started < 10, time.monotonic() - started)
    s.process.stdout.close()
    s.log_file.close()
    s.start()  # the job was put back and runs again
    again = s.wait_status(job["id"], "running")
    check(again["attempts"] == 1, again)


@options("--drain-s", "60")
def test_second_signal_ends_the_drain(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    started = time.monotonic()
    s.process.send_signal(signal.SIGTERM)
    time.sleep(0.5)
    check(s.process.poll() is None, "it did not drain")
    check(s.terminate(timeout=20) == 0 and time.monotonic() - started < 15, s.log())


def test_killed_daemon_keeps_jobs(s):
    done = s.solve(MATRICES)
    running = s.post(ENDLESS).json
    s.wait_status(running["id"], "running")
    s.process.kill()
    s.process.wait()
    s.process.stdout.close()
    s.log_file.close()
    s.start()
    check(s.get(f"/v1/jobs/{done['id']}").json["summary"] == done["summary"])
    check(s.wait_status(running["id"], "running")["attempts"] == 2)


def test_signals_are_blocked_in_every_thread(s):
    s.solve(SCENE)
    # The first thread takes the signals: while it waits for them they are open there, and only there.
    for task in set(os.listdir(f"/proc/{s.process.pid}/task")) - {str(s.process.pid)}:
        try:
            with open(f"/proc/{s.process.pid}/task/{task}/status", encoding="ascii") as file:
                blocked = next(int(line.split()[1], 16) for line in file if line.startswith("SigBlk"))
        except OSError:  # a connection's thread that ended meanwhile
            continue
        for number in (signal.SIGTERM, signal.SIGABRT, signal.SIGINT):
            check(blocked >> (number - 1) & 1, "signal", number, "is open in thread", task)


def run(s, *arguments):
    return subprocess.run(s.command(*arguments), capture_output=True, text=True, timeout=30, check=False)


def test_port_in_use(s):
    got = run(s, "--listen", f"127.0.0.1:{s.port}", "--db", s.db + "2")
    check(got.returncode == 1 and got.stdout == "" and "cannot listen" in got.stderr and "in use" in got.stderr, got)


def test_database_in_use(s):
    got = run(s, "--listen", "127.0.0.1:0", "--db", s.db)
    check(got.returncode == 1 and got.stdout == "" and s.db in got.stderr, got)
    check(s.solve(MATRICES)["status"] == "successful")


@options(None)
def test_command_line(s):
    got = run(s, "--help")
    check(got.returncode == 0 and got.stdout.startswith("usage:") and got.stderr == "", got)
    got = run(s, "--version")
    check(got.returncode == 0 and got.stdout.startswith("uzawad "), got)
    for wrong in (["--nonsense"], ["--workers", "0"], ["--workers", "two"], ["--max-body", "10X"], ["--max-body"],
                  ["--drain-s", "nan"], ["--drain-s", "-1"], ["--cache", "-1"], ["--log-level", "loud"], ["here"],
                  ["--request-deadline-s", "0"]):
        got = run(s, *wrong)
        check(got.returncode == 2 and got.stdout == "" and "usage:" in got.stderr, wrong, got)
    for wrong in ("127.0.0.1", "127.0.0.1:x", "127.0.0.1:70000", "::1:80", ":80", "[::1]", "300.1.1.1:80"):
        got = run(s, "--listen", wrong, "--db", os.path.join(s.folder, "x.db"))
        check(got.returncode == 1 and got.stderr.startswith("uzawad: "), wrong, got)
    got = run(s, "--listen", "127.0.0.1:0", "--db", "/nonexistent/x.db")
    check(got.returncode == 1 and "/nonexistent/x.db" in got.stderr, got)


@options(None)
def test_ipv6(s):
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError as why:
        raise Skip("no IPv6 loopback here") from why
    with subprocess.Popen(s.command("--listen", "[::1]:0", "--db", s.db), stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL) as process:
        line = process.stdout.readline().decode()
        process.send_signal(signal.SIGTERM)
        check(line.startswith("listening on http://[::1]:") and process.wait(timeout=20) == 0, line)


def test_descriptors_do_not_leak(s):
    def count():
        return len(os.listdir(f"/proc/{s.process.pid}/fd"))
    s.solve(MATRICES)
    for _ in range(8):
        s.get("/v1/jobs")
    time.sleep(0.3)
    before = count()
    for i in range(200):
        if i % 4 == 0:
            s.post(MATRICES, query="?validate=true")
        elif i % 4 == 1:
            s.raw(b"GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n")
        else:
            s.get("/v1/jobs" if i % 4 == 2 else "/nothing")
    time.sleep(0.5)
    check(count() <= before + 2, "descriptors grew from", before, "to", count())


def test_access_log(s):
    job = s.solve(MATRICES)
    s.get(f"/v1/jobs/{job['id']}/result?fields=gaps")
    s.get("/no%22thing\\")
    time.sleep(0.2)
    events = s.events("request")
    result = next(event for event in events if event["path"].endswith("/result"))
    check(result["method"] == "GET" and result["status"] == 200 and result["job"] == job["id"], result)
    check(result["bytes"] > 10 and 0 <= result["seconds"] < 10 and result["end"] == "complete", result)
    check(events[-1]["status"] == 404 and events[-1]["path"] == '/no%22thing\\', events[-1])


if __name__ == "__main__":
    service.main(globals())
