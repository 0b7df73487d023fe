"""Sockets that misbehave: ambiguous framing, bodies without end, clients that trickle, stall or leave."""
# not under ThreadSanitizer: one client at a time, but for these:
# for ThreadSanitizer, the_service_ends: while a thread refuses
# for ThreadSanitizer, slow_requests: another thread ends them
# for ThreadSanitizer, half_sent: those that are new take the places of others
# for ThreadSanitizer, room_for_health: and of all
import json
import socket
import time

import service
from service import MATRICES, PATIENT_S, SCENE, check, expect, head_of, options, read_all, wait_until

# ----------------------------------------------------------------- framing

POST = b"POST /v1/jobs?validate=true HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
SMUGGLED = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"


def refused(s, data, statuses=(400,)):
    """One refusal comes back, nothing after it is served, and the connection closes."""
    reply, closed = s.raw(data, timeout=PATIENT_S)
    status, fields, body = head_of(reply)
    check(status in statuses and closed, data[:200], "->", status, closed, reply[:300])
    check(reply.count(b"HTTP/1.1 ") == 1, "a second request was served", data[:200], reply)
    check(json.loads(body)["status"] == status and fields["connection"] == "close", reply)
    check(fields["content-type"] == "application/problem+json", reply)
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
    refused(s, b"GET /healthz HTTP/2.0\r\nHost: x\r\n\r\n", (505,))
    refused(s, b"GET /healthz\r\n\r\n")
    refused(s, b"GET /" + b"y" * 100000 + b" HTTP/1.1\r\nHost: x\r\n\r\n", (414,))
    refused(s, b"GET /healthz HTTP/1.1\r\nHost: x\r\n" + b"X: y\r\n" * 129 + b"\r\n", (431,))
    refused(s, b"GET /healthz HTTP/1.1\r\nHost: x\r\nX: " + b"y" * 100000 + b"\r\n\r\n", (400, 413, 414, 431))
    refused(s, POST + b"Expect: cake\r\nContent-Length: 2\r\n\r\n{}", (417,))
    check(s.get("/healthz").status == 200)


def header_block(size, fields):
    """A request of so many bytes with so many header fields."""
    start = b"GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n"
    room = size - len(start) - 2
    lines = [b"X-%03d: " % i + b"y" * (room // (fields - 2) - 9) + b"\r\n" for i in range(fields - 2)]
    lines[-1] = lines[-1][:-2] + b"y" * (room - sum(map(len, lines))) + b"\r\n"
    return start + b"".join(lines) + b"\r\n"


def test_header_too_large(s):
    """The limit is what /v1/limits says, to the byte, and what is beyond it is told so."""
    limits = s.get("/v1/limits").json["limits"]
    most = limits["max_header"]["value"]
    for fields in (3, 20, limits["max_header_fields"]["value"]):
        check(head_of(s.raw(header_block(most, fields))[0])[0] == 200, fields)
        for size in (most + 1, 60000, *range(65000, 65537, 67)):
            body = refused(s, header_block(size, fields), (431, 413))[1]
            problem = json.loads(body)
            check(problem["code"] == "header_too_large" and str(most) in problem["detail"], size, fields, problem)


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
    check(status == 200 and json.loads(answer)["valid"] is True, data)
    for broken in (b"2\r\n{}X0\r\n\r\n", b"zz\r\n{}\r\n0\r\n\r\n", b"-2\r\n{}\r\n0\r\n\r\n",
                   b"fffffffffffffffff\r\n{}\r\n0\r\n\r\n"):
        refused(s, POST + b"Transfer-Encoding: chunked\r\n\r\n" + broken + SMUGGLED, (400, 413))
    for broken, status, code in ((b"fffffffffffffffff\r\n", 400, "bad_request_framing"),
                                 (b"2;" + b"x" * 100000 + b"\r\n", 400, "bad_request_framing")):
        _, body = refused(s, POST + b"Transfer-Encoding: chunked\r\n\r\n" + broken, (status,))
        check(json.loads(body)["code"] == code and "header" not in json.loads(body)["detail"], body)


def test_chunks_end_in_cr_lf(s):
    """In one piece, and byte by byte, when nothing but the size line has come; also behind another request."""
    head = POST + b"Transfer-Encoding: chunked\r\n\r\n"
    good = b"1\r\n{\r\n1;x=y\r\n}\r\n0\r\nX-Sum: 1\r\n\r\n"
    for i in range(good.count(b"\r\n")):
        parts = good.split(b"\r\n")
        bad = b"\r\n".join(parts[:i + 1]) + b"\n" + b"\r\n".join(parts[i + 1:])
        refused(s, head + bad + SMUGGLED)
        data, _ = s.raw(SMUGGLED + head + bad + SMUGGLED)
        check(data.count(b"HTTP/1.1 200") == 1 and data.count(b"HTTP/1.1 400") == 1, bad, data)
        with s.connect(timeout=PATIENT_S) as c:
            c.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            c.sendall(head)
            reply, closed = trickle(c, bad + SMUGGLED, 0.002)
            check(closed and reply.count(b"HTTP/1.1 ") == 1 and head_of(reply)[0] == 400, bad, reply)
    for bad in (b"1 \r\n{", b"+1\r\n{", b"0x1\r\n{", b"\r\n", b";x\r\n", b"10000000000000000\r\n{", b"1;\0\r\n{",
                b"0\r\n X: y\r\n\r\n", b"0\r\nX: \0\r\n\r\n", b"1\r\n{}\r\n"):
        refused(s, head + bad + SMUGGLED)
    # what is right is taken, also twice on a connection and with what is beyond it
    data, _ = s.raw(SMUGGLED + head + good + head + good + SMUGGLED.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
    check(data.count(b"HTTP/1.1 200") == 2 and data.count(b"HTTP/1.1 422") == 2, data)
    with s.connect(timeout=PATIENT_S) as c:
        for _ in range(3):
            c.sendall(head)
            for i in range(len(good)):
                c.sendall(good[i:i + 1])
            check(c.recv(65536).startswith(b"HTTP/1.1 422"))


def test_two_authorizations(s):
    two = b"Authorization: Bearer a\r\nauthorization: Bearer b\r\n"
    refused(s, b"GET /healthz HTTP/1.1\r\nHost: x\r\n" + two + b"\r\n" + SMUGGLED)


def test_the_service_ends_while_it_refuses(s):
    """What libmicrohttpd refuses by itself must not be in the making when it is stopped."""
    malformed = (POST + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n{}\r\n",
                 b"GET /healthz HTTP/1.1\r\nContent-Length: x\r\n\r\n",
                 POST + b"Transfer-Encoding: chunked\r\n\r\n2;" + b"x" * 100000)
    asked = [s.connect() for _ in range(6)]
    for i, c in enumerate(asked):
        c.sendall(malformed[i % 3])
    for c in asked:
        check(c.recv(65536).startswith(b"HTTP/1.1 4"))
    check(s.end() == 0, s.log())
    for c in asked:
        c.close()


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
        with s.connect(timeout=PATIENT_S) as c:
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
    with s.connect(timeout=PATIENT_S) as c:
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
        with s.connect(timeout=PATIENT_S) as c:
            started = time.monotonic()
            c.sendall(data[:-800])
            reply, closed = trickle(c, data[-800:], 0.05)
            took = time.monotonic() - started
            check(closed and 0.8 < took < 20, data[:60], closed, took, reply)
            if reply:
                status, _, body = head_of(reply)
                check(status == 408 and json.loads(body)["code"] == "request_timeout", reply)
            check(reply or not answered, data[:60], "ended without a word")
    check(any(event["end"] == "deadline" for event in s.events("request")), s.log())


@options("--request-deadline-s", "1")
def test_idle_connections_close(s):
    with s.connect(timeout=PATIENT_S) as c, s.connect(timeout=PATIENT_S) as silent:
        c.sendall(SMUGGLED)
        started = time.monotonic()
        data, closed = read_all(c)
        check(closed and data.startswith(b"HTTP/1.1 200") and 0.5 < time.monotonic() - started < 30, data)
        check(read_all(silent) == (b"", True), "a silent connection")


@options("--max-connections", "40", "--max-streams", "40")
def test_half_sent_requests_go_first(s):
    """However many there are, whoever asks is served; streams and idle connections stay."""
    job = s.post(SCENE, {"Prefer": "wait=20"}).json["id"]
    with s.connect(timeout=PATIENT_S) as stream, s.connect(timeout=PATIENT_S) as idle:
        stream.sendall(b"GET /v1/events HTTP/1.1\r\nHost: x\r\n\r\n")
        check(stream.recv(4096).startswith(b"HTTP/1.1 200"))
        began = time.monotonic()
        idle.sendall(SMUGGLED)
        check(idle.recv(4096).startswith(b"HTTP/1.1 200"))
        half = []
        for _ in range(100):
            half.append(s.connect())
            half[-1].sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n")
        # So old are half-sent ones, once read, before the idle one counts as much, of whose time it is a tenth.
        time.sleep((3 if service.INSTRUMENTED else 0.3) + 0.3 * (time.monotonic() - began))
        for _ in range(30):
            started = time.monotonic()
            check(s.get(f"/v1/jobs/{job}").status == 200 and time.monotonic() - started < 40)
        idle.sendall(SMUGGLED)
        check(idle.recv(4096).startswith(b"HTTP/1.1 200"), "one that was idle for a moment went before half-sent ones")
        s.solve(MATRICES)
        check(b"event: " in stream.recv(65536), "the stream was cut")
        for c in half:
            c.close()
    warned = s.events("too_many_connections")
    check(len(warned) == 1 and warned[0]["level"] == "warn" and warned[0]["address"] == "127.0.0.1", warned)
    check(warned[0]["max_connections"] == 40 and warned[0]["of_this_address"] >= 40 and warned[0]["cut"] == 1, warned)


@options("--max-connections", "8", "--max-streams", "8")
def test_room_for_health_checks(s):
    """Where all connections are busy, so that none can go."""
    busy = [s.connect() for _ in range(8)]
    for c in busy:
        c.sendall(b"GET /v1/events HTTP/1.1\r\nHost: x\r\n\r\n")
        check(c.recv(4096).startswith(b"HTTP/1.1 200"))
    for _ in range(40):
        for path in ("/healthz", "/readyz"):
            check(s.get(path).status == 200, path)
    reply = expect(s.get("/v1/jobs"), 503, "too_many_connections")
    check(reply.headers["connection"] == "close" and int(reply.headers["retry-after"]) > 0, reply)
    half = [s.connect() for _ in range(40)]  # these must not take the room
    check(s.get("/healthz").status == 200)
    for c in busy + half:
        c.close()
    wait_until(lambda: s.get("/v1/jobs").status == 200)


@options("--max-client-connections", "5")
def test_connections_of_one_address(s):
    held = [s.connect() for _ in range(5)]
    time.sleep(0.2)
    with s.connect(timeout=3) as c:
        c.sendall(SMUGGLED)
        data, _ = read_all(c)
        check(data == b"", data)
    for c in held:
        c.close()
    wait_until(lambda: answers(s))
    check(s.events("too_many_connections")[0]["refused"] == 1, s.log())


def answers(s):
    try:
        return s.get("/healthz").status == 200
    except OSError:
        return False


if __name__ == "__main__":
    service.main(globals())
