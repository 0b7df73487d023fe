"""The end of a job told to an address that its request names."""
import hashlib
import hmac
import http.server
import json
import os
import socket
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, check, expect, options, wait_until

SECRET = b"a secret of some length"


class Receiver:
    """An HTTP server that keeps what it is told and answers with the statuses given, the last one for ever."""

    def __init__(self, *statuses, port=0):
        self.told, statuses = [], list(statuses) or [204]
        told = self.told

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                told.append((self.path, dict(self.headers), body))
                self.send_response(statuses.pop(0) if len(statuses) > 1 else statuses[0])
                self.send_header("Location", "/elsewhere")
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.port = self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def url(self, path="/done?x=1"):
        return f"http://127.0.0.1:{self.port}{path}"

    def wait(self, count, seconds=PATIENT_S):
        end = time.monotonic() + seconds
        while len(self.told) < count and time.monotonic() < end:
            time.sleep(0.02)
        check(len(self.told) == count, len(self.told), "wanted", count)
        return self.told

    def close(self):
        self.server.shutdown()
        self.server.server_close()


def start(s, receiver, *more):
    s.options = ("--webhook-allow", f"127.0.0.1:{receiver.port}", *more)
    s.start()


def told_in_store(s, job_id, least=1):
    """(state, attempts, next) once there were so many attempts."""
    end = time.monotonic() + PATIENT_S
    while time.monotonic() < end:
        row, = s.sql("SELECT state, attempts, next FROM webhook WHERE job = ?", (job_id,))
        if row[1] >= least:
            return row
        time.sleep(0.05)
    raise AssertionError(row)


@options(None)
def test_told_and_signed(s):
    secret = os.path.join(s.folder, "secret")
    with open(secret, "wb") as file:
        file.write(SECRET + b"\n")
    receiver = Receiver()
    start(s, receiver, "--webhook-secret-file", secret)
    job = s.solve({**MATRICES, "tags": ["x"], "webhook": {"url": receiver.url()}})
    path, headers, body = receiver.wait(1)[0]
    check(path == "/done?x=1" and headers["Content-Type"] == "application/json", path, headers)
    check(json.loads(body) == s.get(f"/v1/jobs/{job['id']}").json, body)
    check(headers["X-Uzawa-Delivery"] == job["id"] + ".1" and headers["X-Uzawa-Event"] == "job.ended", headers)
    parts = dict(part.split("=") for part in headers["X-Uzawa-Signature"].split(","))
    wanted = hmac.new(SECRET, parts["t"].encode() + b"." + body, hashlib.sha256).hexdigest()
    check(parts["v1"] == wanted and abs(int(parts["t"]) - time.time()) < 60, parts, wanted)
    check(told_in_store(s, job["id"])[:2] == (2, 1))
    time.sleep(0.6)
    receiver.wait(1)  # and not again
    receiver.close()


@options(None)
def test_every_end_is_told(s):
    receiver = Receiver()
    start(s, receiver, "--workers", "1")
    hook = {"webhook": {"url": receiver.url()}}
    running = s.post({**ENDLESS, **hook}).json
    s.wait_status(running["id"], "running")
    waiting = s.post({**MATRICES, **hook}).json
    late = s.post({**MATRICES, **hook, "queue_limit_s": 0.1}).json
    s.get(f"/v1/jobs/{late['id']}", Prefer="wait=20")
    for job in (waiting, running):
        expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 200)
    singular = {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("1 1 2", "1 1 -2")}
    bad = s.solve({"problem": singular, **hook})
    ends = {json.loads(body)["id"]: json.loads(body)["status"] for _, _, body in receiver.wait(4)}
    check(ends == {running["id"]: "dismissed", waiting["id"]: "dismissed", late["id"]: "failed", bad["id"]: "failed"}, ends)
    check(all("X-Uzawa-Signature" not in headers for _, headers, _ in receiver.told))
    receiver.close()


def is_open(connection):
    """Whether who has asked still waits."""
    try:
        return connection.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


class Slow:
    """A server that keeps who tells it something: it says nothing, or goes on with its answer for ever."""

    def __init__(self, answer):
        self.socket, self.answer, self.halt, self.held = socket.create_server(("127.0.0.1", 0)), answer, threading.Event(), []
        self.port, self.most = self.socket.getsockname()[1], 0  # connections at once, at most
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while not self.halt.is_set():
            try:
                connection = self.socket.accept()[0]
            except OSError:
                return
            self.most = max(self.most, 1 + sum(map(is_open, self.held)))
            self.held.append(connection)
            threading.Thread(target=self.hold, args=(connection,), daemon=True).start()

    def hold(self, connection):
        try:
            connection.recv(65536)
            connection.sendall(self.answer)
            while self.answer and not self.halt.wait(0.1):
                connection.sendall(b"x")
            self.halt.wait(60)
        except OSError:
            pass

    def close(self):
        self.halt.set()
        self.socket.close()
        for one in self.held:
            one.close()


@options(None)
def test_a_slow_receiver_holds_up_its_own_alone(s):
    silent, endless, quick = [Slow(b"") for _ in range(3)], Slow(b"HTTP/1.1 200 OK\r\n\r\n"), Receiver()
    ports = [one.port for one in silent] + [endless.port]
    start(s, quick, *[word for port in ports for word in ("--webhook-allow", f"127.0.0.1:{port}")])
    for port in ports:
        for i in range(3):
            s.solve({**MATRICES, "webhook": {"url": f"http://127.0.0.1:{port}/{i}"}})
    began = time.monotonic()
    for _ in range(5):
        s.solve({**MATRICES, "webhook": {"url": quick.url()}})
    quick.wait(5)
    check(time.monotonic() - began < 14)  # before the first of the others is given up
    end = time.monotonic() + 20  # an answer's status counts, not its end
    while len(s.events("webhook_told")) < 8:
        check(time.monotonic() < end, s.events("webhook_told"))
        time.sleep(0.05)
    check([one.most for one in silent] == [1, 1, 1], [one.most for one in silent])
    for one in (*silent, endless, quick):
        one.close()


@options(None)
def test_a_receiver_by_many_names_holds_up_its_own_alone(s):
    """A name in other letters is no other host; other ways to write one are refused."""
    silent, quick = Slow(b""), Receiver()
    start(s, quick, "--webhook-allow", f"localhost:{silent.port}")
    names = ["localhost"] + ["localhost"[:i] + "localhost"[i].upper() + "localhost"[i + 1:] for i in range(9)]
    for name in names:
        s.solve({**MATRICES, "webhook": {"url": f"http://{name}:{silent.port}/"}})
    s.solve({**MATRICES, "webhook": {"url": quick.url()}})
    quick.wait(1, seconds=14)
    wait_until(lambda: silent.held)  # it is told of no earlier than the other
    check(silent.most == 1, silent.most)
    host, port = "127.0.0.1", quick.port
    for odd in (f"http:///{host}:{port}/", f"http:/{host}:{port}/", f"http://127.1:{port}/", f"http://{host}:0{port}/",
                f"http://0x7f.0.0.1:{port}", f"http://2130706433:{port}/?x", f"http://%3127.0.0.1:{port}/"):
        expect(s.post({**MATRICES, "webhook": {"url": odd}}), 422, "webhook_not_allowed")
    for plain in (f"HTTP://{host}:{port}", f"http://{host}:{port}?x", f"http://{host}:{port}/%31"):
        s.solve({**MATRICES, "webhook": {"url": plain}})
    quick.wait(4)
    silent.close()
    quick.close()


@options(None)
def test_a_restart_forgets_none(s):
    receiver = Receiver(500)
    start(s, receiver)
    before = time.time()
    job = s.solve({**MATRICES, "webhook": {"url": receiver.url()}})
    state, attempts, due = told_in_store(s, job["id"])
    check(state == 1 and attempts == 1 and before + 3 < due < time.time() + 6, state, attempts, before, due, time.time())
    s.terminate(number=9)
    receiver.close()
    for again in range(2):  # later each time; nobody listens now
        s.sql("UPDATE webhook SET next = 0, attempts = ?", (1 + again * 3,))
        if again:
            receiver = Receiver(port=receiver.port)
        before = time.time()
        s.start()
        if again:
            receiver.wait(1)
            check(receiver.told[0][1]["X-Uzawa-Delivery"] == job["id"] + ".5", receiver.told)
        else:
            state, attempts, due = told_in_store(s, job["id"], 2)
            check(attempts == 2 and before + 8 < due < time.time() + 11, attempts, before, due, time.time())
            s.terminate(number=9)
    receiver.close()


@options(None)
def test_what_ends_the_telling(s):
    receiver = Receiver(410, 302)
    start(s, receiver)
    gone = s.solve({**MATRICES, "webhook": {"url": receiver.url()}})
    check(told_in_store(s, gone["id"])[0] == 3)
    moved = s.solve({**MATRICES, "webhook": {"url": receiver.url()}})
    check(told_in_store(s, moved["id"])[0] == 1)  # a redirection is not followed, and is no success
    receiver.wait(2)
    s.options = ("--webhook-allow", "example.org")
    s.terminate()
    s.sql("UPDATE webhook SET next = 0")
    s.start()
    check(told_in_store(s, moved["id"], 2)[0] == 3)
    receiver.wait(2)  # it was not called any more
    s.terminate()
    s.sql("UPDATE webhook SET state = 1, next = 0, attempts = 1 WHERE job = ?", (gone["id"],))
    s.options = ("--keep-jobs", "1")
    s.start()
    end = time.monotonic() + PATIENT_S
    while s.get(f"/v1/jobs/{gone['id']}").status != 404:  # without webhooks too a job does not stay for ever for one
        check(time.monotonic() < end, s.log())
        time.sleep(0.05)
    receiver.close()


@options("--webhook-allow", "example.org", "--webhook-allow", "Hooks.example.org:8443", "--webhook-allow", "[::1]:99")
def test_allow_list(s):
    for good in ("http://example.org/x", "https://example.org", "https://example.org:443/", "HTTP://EXAMPLE.org:80",
                 "https://hooks.example.org:8443/a?b=c", "http://[::1]:99/"):
        expect(s.post({**MATRICES, "webhook": {"url": good}}, query="?validate=true"), 200)
    for bad in ("http://example.org:8080/", "https://example.org:80/", "https://hooks.example.org/", "ftp://example.org/",
                "http://example.org.evil.net/", "http://evil.net/example.org", "http://user@example.org/", "http://[::1]/",
                "http://example.org@evil.net/", "example.org/path", "file:///etc/passwd", "http://127.0.0.1/", "http:///"):
        for query in ("", "?validate=true"):
            reply = expect(s.post({**MATRICES, "webhook": {"url": bad}}, query=query), 422, "webhook_not_allowed")
            check(reply.json["pointer"] == "/webhook/url", reply)
    for wrong, code in (({}, "missing_key"), ({"url": 5}, "wrong_type"), ({"url": "x"}, "out_of_range"),
                        ({"url": "http://example.org", "x": 1}, "unknown_key"), ("http://example.org", "wrong_type")):
        expect(s.post({**MATRICES, "webhook": wrong}), 422, code)
    check(s.get("/v1/jobs").json["jobs"] == [])


def test_off_by_default(s):
    reply = expect(s.post({**MATRICES, "webhook": {"url": "http://example.org/"}}), 422, "webhook_not_allowed")
    check("--webhook-allow" in reply.json["detail"], reply)


@options(None)
def test_bad_secret(s):
    for text in (None, b"\n", b"x" * 5000):
        path = os.path.join(s.folder, "secret")
        if text:
            with open(path, "wb") as file:
                file.write(text)
        s.options = ("--webhook-allow", "example.org", "--webhook-secret-file", path)
        try:
            s.start()
        except AssertionError as why:
            check("webhook secret" in str(why), why)
        else:
            raise AssertionError("it started")
    s.process = None


if __name__ == "__main__":
    service.main(globals())
