"""The client against a server that fails in every way it can. usage: test_client_faults.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import email.utils
import json
import os
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import PATIENT_S
from fake_server import Cutter, Fake

SHARED = True  # one service for all tests

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
BODY = "tests/data/small_matrices.json"
ID = "0" * 31 + "1"


def run(server, *words, stdin=None, seconds=90, stdout=subprocess.PIPE):
    command = [CLIENT, "--server", server, *words]
    return subprocess.run(command, input=stdin, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=seconds)


def job(status="accepted", outcome=None, **more):
    value = {"id": ID, "status": status, "progress": 0, "tags": []}
    if outcome:
        value["summary"] = {"outcome": outcome, "iterations": 3}
    return {**value, **more}


def expect(done, code):
    assert done.returncode == code, f"exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}"
    return done


def test_each_outcome_has_its_exit_code(_):
    cases = [("successful", "converged", 0), ("successful", "iteration_limit", 7), ("successful", "time_limit", 7),
             ("successful", "precision_limit", 7), ("successful", "paper_rule", 7), ("successful", "infeasible", 8),
             ("dismissed", "dismissed", 9), ("dismissed", None, 9), ("failed", None, 6)]
    for status, outcome, code in cases:
        with Fake((200, job(status, outcome))) as fake:
            expect(run(fake.url, "wait", ID), code)
            expect(run(fake.url, "submit", BODY, "--wait", "--json"), code)
            expect(run(fake.url, "status", ID), 0)


def test_failed_job_says_why(_):
    error = {"title": "Not solvable", "detail": "K is not positive definite", "pointer": "/problem/K", "line": 4,
             "code": "not_positive_definite", "status": 422}
    with Fake((200, job("failed", error=error))) as fake:
        done = expect(run(fake.url, "submit", BODY, "--wait"), 6)
    for part in ("K is not positive definite", "/problem/K, line 4", "not_positive_definite"):
        assert part in done.stderr, done.stderr


def test_server_errors(_):
    for step in [(500, {"title": "t", "detail": "the disk is gone"}), (500, ""), (507, "<html>"), (200, "<html>"),
                 (200, ""), (200, "[1]"), (200, {}), (302, "", {"Location": "http://127.0.0.1:1/"})]:
        with Fake(step) as fake:
            expect(run(fake.url, "submit", BODY, "--retry", "0"), 5)
    with Fake((500, {"detail": "the disk is gone"})) as fake:
        assert "the disk is gone" in run(fake.url, "list").stderr
        assert len(fake.requests) == 1, "a 500 must not be repeated"


def test_refusal_is_explained(_):
    problem = {"title": "T", "detail": "no number\u001b[2J", "pointer": "/problem/K", "line": 3, "code": "format"}
    with Fake((422, problem)) as fake:
        done = expect(run(fake.url, "submit", BODY), 4)
    assert done.stdout == "" and "\033" not in done.stderr
    assert "no number?[2J" in done.stderr and "/problem/K, line 3" in done.stderr


def test_nobody_listens(_):
    with socket.socket() as placeholder:
        placeholder.bind(("127.0.0.1", 0))
        url = "http://127.0.0.1:%d" % placeholder.getsockname()[1]
        for _ in range(3):  # where the machine is slow one of them is quick enough
            start = time.monotonic()
            done = expect(run(url, "list", "--retry", "0"), 12)
            assert "Is uzawad running there?" in done.stderr, done.stderr
            seconds = time.monotonic() - start
            if seconds < 2.9:
                break
        assert seconds < 2.9, seconds  # without it 3 s
        expect(run(url, "list", "--retry", "1"), 12)
        assert time.monotonic() - start > 0.5
        expect(run(url, "cancel", ID, "--retry", "0"), 12)
        expect(run(url, "wait", ID, "--retry", "0"), 12)
        start = time.monotonic()
        expect(run(url, "list", "--timeout", "0.5", "--retry", "20"), 12)
        assert time.monotonic() - start < 15


def test_a_connection_that_ends_in_its_handshake_is_made_again(_):
    if not shutil.which("openssl"):
        raise service.Skip("openssl is not installed")
    with tempfile.TemporaryDirectory() as folder, socket.create_server(("127.0.0.1", 0)) as listening:
        key, cert = os.path.join(folder, "key.pem"), os.path.join(folder, "cert.pem")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days",
                        "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out",
                        cert], check=True, capture_output=True)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(cert, key)
        listening.settimeout(30)
        body = json.dumps({"id": ID, "status": "dismissed"}).encode()
        met = []

        def serve(cut_off, answered):
            """Cuts off so many connections within their handshakes, then answers requests."""
            for n in range(cut_off + answered):
                connection, _ = listening.accept()
                with connection:
                    if n < cut_off:
                        met.append(connection.recv(1 << 16)[:1])
                        continue
                    with context.wrap_socket(connection, server_side=True) as tls:
                        met.append(tls.recv(1 << 16)[:6])
                        tls.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(body) + body)

        url, environment = "https://127.0.0.1:%d" % listening.getsockname()[1], {**os.environ, "UZAWA_CA": cert}
        for retry, cut_off, answered, code in (("30", 2, 1, 0), ("0", 1, 0, 12)):
            met.clear()
            server = threading.Thread(target=serve, args=(cut_off, answered))
            server.start()
            words = [CLIENT, "--server", url, "--retry", retry, "status", ID]
            done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=PATIENT_S)
            server.join()
            expect(done, code)
            assert met == cut_off * [b"\x16"] + answered * [b"GET /v"], met


def test_lost_reply_is_repeated_with_the_same_key(_):
    for fault in ("drop", "cut", (503, {"detail": "draining"}), (429, ""), (502, "")):
        with Fake(fault, (202, job())) as fake:
            done = expect(run(fake.url, "submit", BODY), 0)
            assert done.stdout.strip() == ID
            keys = [request.headers["Idempotency-Key"] for request in fake.requests]
            assert len(keys) == 2 and keys[0] == keys[1] and len(keys[0]) == 32, keys
            assert fake.requests[0].body == fake.requests[1].body == open(BODY, "rb").read()


def test_keys_are_random_unless_given(_):
    with Fake((202, job())) as fake:
        run(fake.url, "submit", BODY)
        run(fake.url, "submit", BODY)
        run(fake.url, "submit", BODY, "--key", "mine")
        keys = [request.headers["Idempotency-Key"] for request in fake.requests]
    assert keys[0] != keys[1] and keys[2] == "mine", keys


def test_retry_after_is_obeyed(_):
    with Fake((503, {"detail": "draining"}, {"Retry-After": "1"}), (202, job())) as fake:
        expect(run(fake.url, "submit", BODY), 0)
        pause = fake.requests[1].time - fake.requests[0].time
    assert 0.95 < pause < 2.5, pause
    date = email.utils.formatdate(time.time() + 3, usegmt=True)
    with Fake((503, {"detail": "draining"}, {"Retry-After": date}), (202, job())) as fake:
        expect(run(fake.url, "submit", BODY, "--retry", "10"), 0)
        pause = fake.requests[1].time - fake.requests[0].time
    assert 1.5 < pause < 6, pause
    with Fake((503, {"detail": "draining"}, {"Retry-After": "3600"})) as fake:
        done = expect(run(fake.url, "submit", BODY), 5)
        assert "draining" in done.stderr and len(fake.requests) == 1


def test_gives_up_when_patience_ends(_):
    with Fake("drop") as fake:
        start = time.monotonic()
        expect(run(fake.url, "list", "--retry", "1"), 12)
        assert time.monotonic() - start < 20
        assert 2 <= len(fake.requests) <= 8, len(fake.requests)


def test_cancel_is_never_sent_twice(_):
    for fault in ("drop", (503, ""), "cut"):
        with Fake((200, job()), fault, (204, "")) as fake:
            assert run(fake.url, "cancel", ID).returncode in (12, 5)
            assert [request.method for request in fake.requests] == ["GET", "DELETE"]


def test_silent_server(_):
    with Fake(20) as fake:
        start = time.monotonic()
        done = expect(run(fake.url, "list", "--timeout", "0.6"), 12)
        assert time.monotonic() - start < 15 and "no answer" in done.stderr


def test_wait_times_out(_):
    with Fake((200, job("running"))) as fake:
        start = time.monotonic()
        done = expect(run(fake.url, "wait", ID, "--timeout", "1.2"), 10)
        seconds = time.monotonic() - start
        assert 1.0 < seconds < 30, seconds
        assert f"uzawa wait {ID}" in done.stderr
        assert len(fake.requests) < 12, "a server that does not hold requests must not be flooded"
        expect(run(fake.url, "submit", BODY, "--wait", "--timeout", "0.5"), 10)
        expect(run(fake.url, "wait", ID, "--timeout", "0"), 10)
    with Fake((200, job("successful", "converged"))) as fake:
        expect(run(fake.url, "wait", ID, "--timeout", "0"), 0)


def test_wait_asks_the_server_to_hold(_):
    with Fake((202, job()), (200, job("running")), (200, job("successful", "converged"))) as fake:
        expect(run(fake.url, "submit", BODY, "--wait"), 0)
        asked = [(request.method, request.headers["Prefer"]) for request in fake.requests]
    assert asked == [("POST", "wait=30"), ("GET", "wait=30"), ("GET", "wait=30")], asked


def test_wait_survives_a_restart_of_the_server(_):
    ended = (200, job("successful", "converged"))
    with Fake((200, job("running")), "drop", (503, {"detail": "draining"}), ended) as fake:
        expect(run(fake.url, "wait", ID), 0)
        assert len(fake.requests) == 4


def test_progress_lines(_):
    with Fake((202, job()), (200, job("running", progress=40)), (200, job("running", progress=40)),
              (200, job("successful", "converged", progress=100))) as fake:
        done = expect(run(fake.url, "submit", BODY, "--wait", "--progress"), 0)
        quiet = expect(run(fake.url, "wait", ID), 0)
    lines = [line.split("%")[0].split() for line in done.stderr.splitlines()]
    assert lines == [["accepted", "0"], ["running", "40"], ["successful", "100"]], done.stderr
    assert quiet.stderr == ""


def test_tags_are_sent(_):
    with Fake((202, job())) as fake:
        expect(run(fake.url, "submit", BODY, "--tag", "a", "--tag", "springs", "--tag", "\u00e4"), 0)
        sent = json.loads(fake.requests[0].body)
    assert sent["tags"] == ["springs", "a", "\u00e4"] and sent["problem"] == json.load(open(BODY))["problem"]


def test_large_body_arrives_whole(_):
    body = json.dumps({"problem": list(range(2_000_000))})
    with Fake((202, job())) as fake:
        expect(run(fake.url, "submit", "-", stdin=body), 0)
        assert fake.requests[0].body == body.encode()
        assert fake.requests[0].headers["Content-Type"] == "application/json"
        assert fake.requests[0].headers["Expect"] is None


def test_ids_cannot_change_the_path(_):
    with Fake((404, {"detail": "no such job"})) as fake:
        for odd in ("..", "a/b", "x?status=1", "a b", "#", "%2e"):
            expect(run(fake.url, "status", odd), 4)
        paths = [request.path for request in fake.requests]
    wanted = ["..", "a%2Fb", "x%3Fstatus%3D1", "a%20b", "%23", "%252e"]
    assert paths == ["/v1/jobs/" + path for path in wanted], paths


def test_list_follows_pages(_):
    page = [{"id": "%032d" % i, "status": "successful", "tags": ["t\u0007"]} for i in range(100)]
    with Fake((200, {"jobs": page, "next": "c&1"}), (200, {"jobs": page[:50], "next": None})) as fake:
        done = expect(run(fake.url, "list", "--limit", "170", "--status", "successful", "--tag", "a&b"), 0)
        paths = [request.path for request in fake.requests]
    assert paths == ["/v1/jobs?limit=100&status=successful&tag=a%26b",
                     "/v1/jobs?limit=70&status=successful&tag=a%26b&cursor=c%261"], paths
    assert len(done.stdout.splitlines()) == 151 and "\a" not in done.stdout


def test_result_file_is_whole_or_not_there(_):
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "r.json")
        with Fake("cut") as fake:
            expect(run(fake.url, "result", ID, "-o", target, "--retry", "0"), 12)
        assert os.listdir(folder) == []
        with Fake((200, {"reactions": [1]})) as fake:
            expect(run(fake.url, "result", ID, "-o", target, "--fields", "reactions,gaps"), 0)
            assert fake.requests[0].path == f"/v1/jobs/{ID}/result?fields=reactions%2Cgaps"
            expect(run(fake.url, "result", ID, "-o", os.path.join(folder, "no", "r.json")), 11)
        assert json.load(open(target)) == {"reactions": [1]} and os.listdir(folder) == ["r.json"]


def test_local_faults(_):
    with Fake((200, {"reactions": [1]})) as fake:
        expect(run(fake.url, "submit", "/nonexistent/file"), 11)
        expect(run(fake.url, "submit", "tests"), 11)
        assert len(fake.requests) == 0, "nothing is sent when the file cannot be read"
        if os.path.exists("/dev/full"):
            with open("/dev/full", "w") as full:
                for words in ((), ("--format", "table")):
                    done = expect(run(fake.url, "result", ID, *words, stdout=full), 11)
                    assert done.stderr.count("cannot write") == 1, done.stderr
                help_page = subprocess.run([CLIENT, "help"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENT_S)
                expect(help_page, 11)


def test_history_that_is_none(_):
    with Fake((200, "<html>")) as fake:
        expect(run(fake.url, "history", ID, "--plot"), 5)
    with Fake((200, "iteration,residual_total,error_bound,restart\n")) as fake:
        done = expect(run(fake.url, "history", ID, "--plot"), 0)
        assert "no iteration" in done.stderr


def test_proxy_is_not_used_for_this_machine(_):
    with Fake((200, {"jobs": [], "next": None})) as fake:
        environment = {**os.environ, "http_proxy": "http://127.0.0.1:9", "UZAWA_SERVER": fake.url + "/"}
        done = subprocess.run([CLIENT, "list"], capture_output=True, text=True, env=environment, timeout=PATIENT_S)
        expect(done, 0)
        assert fake.requests[0].path.startswith("/v1/jobs?")


def test_many_clients_at_once(_):
    with Fake("drop", "drop", "drop", (202, job())) as fake:
        codes = []
        threads = [threading.Thread(target=lambda: codes.append(run(fake.url, "submit", BODY).returncode))
                   for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert codes == [0] * 8, codes


def test_a_reply_cut_at_any_byte_makes_no_second_job(server):
    server.start()
    whole = server.raw(b"POST /v1/jobs HTTP/1.1\r\nHost: h\r\nContent-Type: application/json\r\nConnection: close\r\n"
                       b"Accept-Encoding: gzip\r\nContent-Length: %d\r\n\r\n%s"
                       % (os.path.getsize(BODY), open(BODY, "rb").read()))[0]
    cuts = range(os.getpid() % 6, len(whole) - 1, 6)  # all of them in six runs

    def submit(count):
        with Cutter((server.host, server.port), count) as cutter:
            done = run(cutter.url, "submit", BODY, "--retry", "20")
            return done.returncode, done.stdout.strip(), cutter.connections

    with ThreadPoolExecutor(8) as pool:
        ends = list(pool.map(submit, cuts))
    assert all(code == 0 for code, _, _ in ends), ends
    assert sum(connections == 2 for _, _, connections in ends) > 0.9 * len(ends), ends
    jobs = json.loads(run(server.url, "list", "--json", "--limit", "100000").stdout)
    assert sorted(job["id"] for job in jobs)[1:] == sorted(found for _, found, _ in ends), (len(jobs), len(ends))


if __name__ == "__main__":
    for test in [value for name, value in globals().items() if name.startswith("test_")]:
        service.options(None)(test)  # no daemon is needed here, or the test starts it
    service.main(globals())
