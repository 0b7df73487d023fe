"""Who may do what: tokens, rates, connections, TLS, public addresses, users."""
# not under ThreadSanitizer: one client at a time, but for these:
# for ThreadSanitizer, reload: tokens go while others read them
# for ThreadSanitizer, connections_of_one: which all threads count
# for ThreadSanitizer, tls: the certificate is read anew beside those who use it
import http.client
import json
import os
import pathlib
import shutil
import signal
import ssl
import subprocess
import tempfile
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, Skip, check, expect, options, wait_until

READ, SUBMIT, ADMIN = "r" * 20, "s" * 20, "a" * 20
FOLDER = tempfile.TemporaryDirectory(prefix="uzawad-auth-")
TOKENS = os.path.join(FOLDER.name, "tokens")


def write_tokens(text, mode=0o600, path=TOKENS):
    pathlib.Path(path).write_text(text, encoding="utf-8")
    os.chmod(path, mode)
    return path


write_tokens(f"# who may\nreader read {READ} owner=sender\n\nsender submit {SUBMIT}\nboss\tadmin {ADMIN}\n")


def bearer(secret):
    return {"Authorization": f"Bearer {secret}"}


def run(s, *arguments):
    return subprocess.run(s.command("--db", os.path.join(s.folder, "x.db"), *arguments), capture_output=True, text=True,
                          timeout=PATIENT_S, check=False)


@options("--token-file", TOKENS)
def test_scopes(s):
    # (method, path, body) by the scope that it needs
    calls = {"": [("GET", "/healthz", None), ("GET", "/readyz", None), ("GET", "/openapi.json", None),
                  ("GET", "/schemas/job.json", None)],
             "read": [("GET", "/v1/jobs", None), ("GET", "/metrics", None), ("GET", "/v1/factors", None),
                      ("GET", "/v1/limits", None), ("GET", "/v1/jobs/" + "0" * 32, None), ("GET", "/nothing", None),
                      ("GET", "/v1/jobs/" + "0" * 32 + "/events", None), ("GET", "/v1/uploads/" + "0" * 64, None),
                      ("GET", "/v1/jobs/" + "0" * 32 + "/result.vtu", None),
                      ("PATCH", "/v1/jobs", None)],
             "submit": [("POST", "/v1/jobs", MATRICES), ("POST", "/v1/jobs/" + "0" * 32 + "/refine", {}),
                        ("DELETE", "/v1/jobs/" + "0" * 32, None), ("POST", "/v1/verify", {}),
                        ("POST", "/v1/uploads", "text"), ("DELETE", "/v1/uploads/" + "0" * 64, None)],
             "admin": [("POST", "/v1/admin/check", None)]}
    scopes = ["", "read", "submit", "admin"]
    for need, list_of in calls.items():
        for have, secret in zip(scopes, (None, READ, SUBMIT, ADMIN)):
            for method, path, body in list_of:
                reply = s.request(method, path, body, bearer(secret) if secret else {})
                if scopes.index(have) >= scopes.index(need):
                    check(reply.status not in (401, 403), method, path, have, reply)
                elif have:
                    expect(reply, 403, "insufficient_scope")
                    check(f'scope="{need}"' in reply.headers["www-authenticate"], reply)
                else:
                    expect(reply, 401, "unauthorized")
                    check(reply.headers["www-authenticate"] == 'Bearer realm="uzawad"', reply)
                    check("allow" not in reply.headers, reply)


def uzawa(s, *arguments, **environment):
    return subprocess.run([str(s.build / "uzawa"), *arguments], capture_output=True, text=True, timeout=60, check=False,
                          env={**os.environ, **environment})


@options("--token-file", TOKENS)
def test_client_sends_its_token(s):
    got = uzawa(s, "--server", s.url, "list", UZAWA_TOKEN=READ)
    check(got.returncode == 0, got)
    got = uzawa(s, "--server", s.url, "list")
    check(got.returncode == 4 and "401" in got.stderr, got)


@options("--token-file", TOKENS)
def test_wrong_tokens(s):
    for field in (f"Bearer {READ[:-1]}", f"Bearer {READ}x", "Bearer", "Bearer ", f"Basic {READ}", READ, "Bearer " + "x" * 5000,
                  f"Bearer {READ} {ADMIN}", f"Bearer{READ}"):
        reply = expect(s.request("GET", "/v1/jobs", None, {"Authorization": field}), 401, "unauthorized")
        check(READ not in reply.body.decode(), reply)
    check(s.request("GET", "/v1/jobs", None, {"Authorization": f"bEARER   {READ}"}).status == 200)
    # A body that nobody may send is not read.
    reply = expect(s.request("POST", "/v1/jobs", "x" * 1000000, bearer(READ)), 403, "insufficient_scope")
    check(s.end() == 0 and READ not in s.log(), "the log has a secret")
    check(any(event["token"] == "reader" for event in s.events("request")), s.log())


@options("--token-file", TOKENS)
def test_an_upload_is_refused_before_it_comes(s):
    for secret, status in (("", 401), (READ, 403)):
        field = f"Authorization: Bearer {secret}\r\n" if secret else ""
        field += "Content-Type: application/octet-stream\r\n"
        data, _ = s.raw(f"POST /v1/uploads HTTP/1.1\r\nHost: x\r\n{field}Content-Length: 1000000\r\n\r\n".encode())
        check(service.head_of(data)[0] == status, data)
        data, _ = s.raw(f"POST /v1/uploads HTTP/1.1\r\nHost: x\r\n{field}Transfer-Encoding: chunked\r\n\r\n".encode())
        check(service.head_of(data)[0] == status, data)
    check(not os.path.exists(s.db + "-uploads"), "nothing may be written for it")
    reply = expect(s.request("POST", "/v1/uploads", "text", bearer(SUBMIT)), 201)
    expect(s.request("GET", f"/v1/uploads/{reply.json['id']}", None, bearer(READ)), 200)
    expect(s.request("DELETE", f"/v1/uploads/{reply.json['id']}", None, bearer(READ)), 403, "insufficient_scope")
    check(s.end() == 0, s.log())
    seen = [(event["token"], event["status"]) for event in s.events("request") if event["path"] == "/v1/uploads"]
    check(sorted(seen) == [("", 401)] * 2 + [("reader", 403)] * 2 + [("sender", 201)], seen)


@options("--token-file", TOKENS, "--cors", "https://app.example.org")
def test_a_browser_may_ask_before_it_sends_a_token(s):
    asked = {"Origin": "https://app.example.org", "Access-Control-Request-Method": "POST",
             "Access-Control-Request-Headers": "authorization"}
    reply = s.request("OPTIONS", "/v1/jobs", None, asked)
    check(reply.status == 204 and reply.headers["access-control-allow-origin"] == asked["Origin"], reply)
    check("authorization" in reply.headers["access-control-allow-headers"].lower(), reply)
    reply = expect(s.request("POST", "/v1/jobs", MATRICES, {"Origin": asked["Origin"]}), 401, "unauthorized")
    check(reply.headers["access-control-allow-origin"] == asked["Origin"], reply)  # the page may read why
    check("www-authenticate" in reply.headers["access-control-expose-headers"].lower(), reply)
    expect(s.request("POST", "/v1/jobs", MATRICES, {"Origin": asked["Origin"], **bearer(SUBMIT)}), 202)


@options(None)
def test_reload(s):
    path = os.path.join(s.folder, "tokens")
    write_tokens(f"one read {READ}\n", path=path)
    s.options = ("--token-file", path)
    s.start()

    def reload(text, event):
        write_tokens(text, path=path)
        seen = len(s.events(event))
        s.process.send_signal(signal.SIGHUP)
        wait_until(lambda: len(s.events(event)) > seen)

    check(s.request("GET", "/v1/jobs", None, bearer(READ)).status == 200)
    reload(f"two read {SUBMIT}\n", "tokens_reloaded")
    expect(s.request("GET", "/v1/jobs", None, bearer(READ)), 401)
    check(s.request("GET", "/v1/jobs", None, bearer(SUBMIT)).status == 200)
    reload("broken\n", "tokens_kept")
    check(s.request("GET", "/v1/jobs", None, bearer(SUBMIT)).status == 200)
    check(":1:" in s.events("tokens_kept")[0]["cause"], s.log())


@options(None)
def test_token_files_that_are_refused(s):
    path = os.path.join(s.folder, "tokens")
    for text, mode, words in (("a read\n", 0o600, ":1:"), (f"a write {READ}\n", 0o600, "read, submit or admin"),
                              ("\na read short\n", 0o600, ":2:"), (f"a read {READ}\na read {SUBMIT}\n", 0o600, ":2:"),
                              ("# nothing\n", 0o600, "no token"), (f"a read {READ} x\n", 0o600, ":1:"),
                              (f"a read {READ}\n", 0o604, "chmod"), (f"a read {'x' * 600}\n", 0o600, ":1:")):
        got = run(s, "--listen", "127.0.0.1:0", "--token-file", write_tokens(text, mode, path))
        check(got.returncode == 1 and words in got.stderr and READ not in got.stderr, text, got)
    got = run(s, "--listen", "127.0.0.1:0", "--token-file", path + "x")
    check(got.returncode == 1 and path in got.stderr, got)


@options(None)
def test_public_address(s):
    got = run(s, "--listen", "0.0.0.0:0")
    check(got.returncode == 1 and "--token-file" in got.stderr and "--insecure-public" in got.stderr, got)
    check(not os.path.exists(os.path.join(s.folder, "x.db")), "it made a database")
    for more in (["--insecure-public"], ["--token-file", TOKENS]):
        with subprocess.Popen(s.command("--listen", "0.0.0.0:0", "--db", s.db, *more), stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL) as process:
            line = process.stdout.readline().decode()
            process.send_signal(signal.SIGTERM)
            check(line.startswith("listening on http://0.0.0.0:") and process.wait(timeout=PATIENT_S) == 0, line)


@options("--max-client-rate", "5")
def test_rate(s):
    replies = [s.get("/v1/jobs") for _ in range(30)]
    limited = [reply for reply in replies if reply.status == 429]
    check(10 <= len(replies) - len(limited) <= 25 and limited, [reply.status for reply in replies])
    expect(limited[0], 429, "too_many_requests")
    check(int(limited[0].headers["retry-after"]) >= 1, limited[0])
    check(s.get("/healthz").status == 200, "a supervisor must get through")
    end = time.monotonic() + PATIENT_S
    while s.get("/v1/jobs").status == 429 and time.monotonic() < end:
        time.sleep(0.1)
    check(time.monotonic() < end, "it never lets go")
    reply = s.get("/metrics")
    while reply.status == 429:
        time.sleep(0.2)
        reply = s.get("/metrics")
    check(int(reply.body.decode().split("uzawad_http_rate_limited_total ")[-1].split()[0]) >= len(limited), reply)


@options("--max-client-rate", "5", "--token-file", TOKENS)
def test_rate_is_each_token_s_own(s):
    while s.request("GET", "/v1/jobs", None, bearer(READ)).status == 200:
        pass
    check(s.request("GET", "/v1/jobs", None, bearer(SUBMIT)).status == 200)
    while s.request("GET", "/v1/jobs", None, bearer("guess" * 4)).status == 401:
        pass  # guessing ends
    check(s.request("GET", "/v1/jobs", None, bearer(SUBMIT)).status == 200)


@options("--max-client-connections", "3")
def test_connections_of_one_client(s):
    held = [s.connect() for _ in range(3)]
    for one in held:
        one.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
        check(one.recv(100).startswith(b"HTTP/1.1 200"))
    _, closed = s.raw(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", timeout=PATIENT_S)
    check(closed, "a fourth connection was served")
    for one in held:
        one.close()
    end = time.monotonic() + PATIENT_S
    while time.monotonic() < end:
        try:
            if s.get("/healthz").status == 200:
                return
        except (OSError, http.client.HTTPException):
            time.sleep(0.05)
    raise AssertionError("it never takes another")


def make_certificate(folder, kind=("ec", "-pkeyopt", "ec_paramgen_curve:P-256")):
    if not shutil.which("openssl"):
        raise Skip("openssl is not installed")
    os.makedirs(folder, exist_ok=True)
    cert, key = os.path.join(folder, "cert.pem"), os.path.join(folder, "key.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", *kind, "-nodes",
                    "-keyout", key, "-out", cert, "-days", "2", "-subj", "/CN=localhost", "-addext",
                    "subjectAltName=IP:127.0.0.1"], check=True, capture_output=True)
    return cert, key


@options(None)
def test_tls(s):
    cert, key = make_certificate(s.folder)
    with subprocess.Popen(s.command("--listen", "127.0.0.1:0", "--db", s.db, "--tls-cert", cert, "--tls-key", key,
                                    "--max-body", "10K", "--request-deadline-s", "30"),
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        line = process.stdout.readline().decode()
        try:
            check(line.startswith("listening on https://127.0.0.1:"), line)
            port = int(line.rsplit(":", 1)[1])
            context = ssl.create_default_context(cafile=cert)

            def ask(method, path, body=None, headers=None):
                connection = http.client.HTTPSConnection("127.0.0.1", port, context=context, timeout=PATIENT_S)
                try:
                    connection.request(method, path, body, {"Content-Type": "application/json", **(headers or {})} if body else headers or {})
                    reply = connection.getresponse()
                    kept.update({name.lower(): value for name, value in reply.getheaders()})
                    return reply.status, reply.read()
                finally:
                    connection.close()
            kept = {}
            status, body = ask("POST", "/v1/jobs", json.dumps(MATRICES), {"Prefer": "wait=30"})
            check(status == 200 and json.loads(body)["summary"]["outcome"] == "converged", status, body)
            check(ask("GET", "/v1/jobs")[0] == 200 and ask("GET", "/nothing")[0] == 404)
            check(kept["strict-transport-security"].startswith("max-age="), kept)
            check(ask("POST", "/v1/jobs", "x" * 20000)[0] == 413)
            # What waits keeps its thread, as nobody else can write to its connection.
            told = ask("GET", f"/v1/jobs/{json.loads(body)['id']}/events")
            check(told[0] == 200 and told[1].startswith(b"event: status\n") and told[1].endswith(b"\n\n"), told)
            endless = json.loads(ask("POST", "/v1/jobs", json.dumps(ENDLESS))[1])["id"]
            status, body = ask("GET", f"/v1/jobs/{endless}", None, {"Prefer": "wait=2"})
            check(status == 200 and json.loads(body)["status"] == "running", status, body)
            check(ask("DELETE", f"/v1/jobs/{endless}")[0] == 200)
            got = uzawa(s, "--server", line.split()[-1], "list", UZAWA_CA=cert)
            check(got.returncode == 0, got)
            check(uzawa(s, "--server", line.split()[-1], "--retry", "0", "list").returncode == 12, "it trusts anybody")
            # A slow client is cut off, long before a request's deadline, without plain text in the encrypted stream.
            started = time.monotonic()
            with socket_to(port) as raw, context.wrap_socket(raw, server_hostname="127.0.0.1") as slow:
                slow.sendall(b"GET /healthz HT")
                slow.settimeout(20)
                try:
                    check(slow.recv(100) == b"", "something was said")
                except (ssl.SSLEOFError, ConnectionResetError):
                    pass
            check(3 < time.monotonic() - started < 40)
            with socket_to(port) as plain:
                plain.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
                check(b"200" not in plain.recv(1000))
            check(ask("GET", "/healthz")[0] == 200)
            # Another certificate, without a moment in which there is none; one that is no good changes nothing.
            check(handshake(port, "-tls1_2", "-cipher", "ECDHE-ECDSA-AES128-GCM-SHA256"))
            renew(process, port, cert, key, make_certificate(os.path.join(s.folder, "new"), ("rsa:2048",)))
            context = ssl.create_default_context(cafile=cert)
            check(ask("GET", "/healthz")[0] == 200)
            os.chmod(key, 0o644)
            process.send_signal(signal.SIGHUP)
            time.sleep(0.3)
            check(ask("GET", "/healthz")[0] == 200)
            # Forward secrecy, and nothing old: RSA key exchange, CBC, TLS 1.1.
            check(handshake(port, "-tls1_3") and handshake(port, "-tls1_2", "-cipher", "ECDHE-RSA-AES256-GCM-SHA384"))
            for old in (("-tls1_2", "-cipher", "AES128-GCM-SHA256"), ("-tls1_2", "-cipher", "ECDHE-RSA-AES128-SHA"),
                        ("-tls1_2", "-cipher", "DHE-RSA-AES128-SHA"), ("-tls1_1", "-cipher", "ALL:@SECLEVEL=0")):
                check(not handshake(port, *old), old)
        finally:
            process.send_signal(signal.SIGTERM)
            _, log = process.communicate(timeout=PATIENT_S)
        check(process.returncode == 0, log)
        check(b"certificate_reloaded" in log and b"certificate_kept" in log and b"open to every user" in log, log)
    got = run(s, "--listen", "127.0.0.1:0", "--tls-cert", cert, "--tls-key", key)
    check(got.returncode == 1 and "open to every user" in got.stderr and "chmod" in got.stderr, got)
    other = os.path.join(s.folder, "other")
    for wrong in ((key, cert), (cert, make_certificate(other)[1]), (cert, "/nonexistent/key"), (cert, os.devnull)):
        got = run(s, "--listen", "127.0.0.1:0", "--tls-cert", wrong[0], "--tls-key", wrong[1])
        check(got.returncode == 1 and "key" in got.stderr or "null" in got.stderr, wrong, got)


def handshake(port, *options):
    done = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{port}", "-brief", *options], input=b"", capture_output=True,
                          timeout=PATIENT_S, check=False)
    return done.returncode == 0 and b"CONNECTION ESTABLISHED" in done.stdout + done.stderr


def renew(process, port, cert, key, fresh):
    before = ssl.get_server_certificate(("127.0.0.1", port))
    os.replace(fresh[0], cert)
    os.replace(fresh[1], key)
    process.send_signal(signal.SIGHUP)
    end = time.monotonic() + PATIENT_S
    while ssl.get_server_certificate(("127.0.0.1", port)) == before:
        check(time.monotonic() < end, "the certificate is never the new one")
        time.sleep(0.02)


def socket_to(port):
    import socket
    return socket.create_connection(("127.0.0.1", port), timeout=PATIENT_S)


@options(None)
def test_user(s):
    got = run(s, "--listen", "127.0.0.1:0", "--user", "no-such-user-here")
    check(got.returncode == 1 and "no-such-user-here" in got.stderr, got)
    if os.geteuid() != 0:
        got = run(s, "--listen", "127.0.0.1:0", "--user", "root")
        check(got.returncode == 1 and "root" in got.stderr, got)
        raise Skip("only root can become somebody else")
    os.chmod(s.folder, 0o777)
    s.options = ("--user", "nobody")
    s.start()
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        status = dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)
    check(set(status["Uid"].split()) == {str(os.stat(s.file()).st_uid)} != {"0"} and "0" not in status["Gid"].split(), status)
    check(s.solve(MATRICES)["status"] == "successful")
    check(s.end() == 0 and not s.events("tokens_not_readable_again"), s.log())
    tokens = os.path.join(s.folder, "tokens")  # root's, which nobody cannot read again
    write_tokens("boss admin " + "b" * 20, path=tokens)
    s.options = ("--user", "nobody", "--token-file", tokens)
    s.start()
    warned = s.events("tokens_not_readable_again")
    check(len(warned) == 1 and warned[0]["file"] == tokens, s.log())
    expect(s.get("/v1/jobs", Authorization="Bearer " + "b" * 20), 200)


if __name__ == "__main__":
    service.main(globals())
