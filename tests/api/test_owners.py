"""Clients kept apart: jobs, uploads, keys, lists and events belong to the owner of the token that they came with.
usage: test_owners.py BUILD_DIR [FILTER]
"""
# not under ThreadSanitizer: one client at a time; many are in test_concurrency
import hashlib
import json
import os
import pathlib
import tempfile
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options

OLD, NEW, VIEW, BOB, LATE, BOSS = ("alice-old-" + "1" * 16, "alice-new-" + "2" * 16, "alice-view-" + "3" * 16, "bob-" + "4" * 16,
                                   "late-" + "5" * 16, "boss-" + "6" * 16)
FOLDER = tempfile.TemporaryDirectory(prefix="uzawad-owners-")
TOKENS, AUDIT = os.path.join(FOLDER.name, "tokens"), os.path.join(FOLDER.name, "audit")


def write_tokens(text):
    pathlib.Path(TOKENS).write_text(text, encoding="utf-8")
    os.chmod(TOKENS, 0o600)


LINES = f"""# two tokens of one owner, one as its digest; one who only looks; another owner; one that has expired
alice-old submit {OLD} owner=alice
alice-new submit sha256:{hashlib.sha256(NEW.encode()).hexdigest()} owner=alice until=2099-12-31
alice-view read {VIEW} until=2099-01-01T12:00:00Z owner=alice
bob submit {BOB}
late submit {LATE} until=2020-12-31
boss admin {BOSS}
"""
write_tokens(LINES)


def bearer(secret, **more):
    return {"Authorization": f"Bearer {secret}", **{name.replace("_", "-"): value for name, value in more.items()}}


def ask(s, secret, method, path, body=None, **fields):
    return s.request(method, path, body, bearer(secret, **fields))


def solved(s, secret, body=SCENE, **fields):
    return expect(ask(s, secret, "POST", "/v1/jobs", body, Prefer="wait=60", **fields), 200).json["id"]


def listed(s, secret, query=""):
    return [job["id"] for job in ask(s, secret, "GET", "/v1/jobs" + query).json["jobs"]]


@options("--token-file", TOKENS)
def test_jobs(s):
    job = solved(s, OLD, {**SCENE, "tags": ["mine"]})
    others = solved(s, BOB, {**SCENE, "tags": ["mine"]})
    # Whatever there is of a job, for all who are its owner's, and the administrator; for others there is no such job.
    paths = [path.replace("{id}", job) for path in s.get("/openapi.json").json["paths"] if "/jobs/{id}" in path]
    check(len(paths) >= 10, paths)
    for path in paths:
        seen = (422,) if path.endswith("/section") else (200, 204)  # the body is plane
        path += "?from=0,10&to=60,10" if path.endswith(("/path", "/path.csv")) else ""
        path += "?point=0,0,0&normal=0,0,1" if path.endswith("/section") else ""
        if path.endswith("/refine"):
            expect(ask(s, BOB, "POST", path, {}), 404, "not_found")
            expect(ask(s, NEW, "POST", path, {"accuracy": {"relative_error": 1e-9}}), 202)
        else:
            expect(ask(s, BOB, "GET", path), 404, "not_found")
            check(ask(s, VIEW, "GET", path).status in seen, path)
            check(ask(s, BOSS, "GET", path).status in seen, path)
    expect(ask(s, BOB, "DELETE", f"/v1/jobs/{job}"), 404, "not_found")
    expect(ask(s, VIEW, "DELETE", f"/v1/jobs/{job}"), 403, "insufficient_scope")
    # Nor can it be named in a request.
    warm = {**SCENE, "solver": {**SCENE["solver"], "warm_start": {"job": job}}}
    expect(ask(s, BOB, "POST", "/v1/jobs", warm), 422, "not_allowed")
    expect(ask(s, BOB, "GET", f"/v1/jobs/{others}/convergence.svg?with={job}"), 404, "job_not_found")
    expect(ask(s, BOSS, "GET", f"/v1/jobs/{others}/convergence.svg?with={job}"), 200)
    # Lists, by each way that the store goes.
    for query in ("", "?order=asc", "?status=successful", "?tag=mine", "?tag=mine&status=successful", "?limit=1&tag=mine",
                  "?status=successful&order=asc"):
        check(job not in listed(s, BOB, query) and others in listed(s, BOB, query), query)
        check(others not in listed(s, VIEW, query) and listed(s, VIEW, query), query)
        check(others in listed(s, BOSS, query) or "limit" in query, query)
    check({one["id"]: one["owner"] for one in ask(s, BOSS, "GET", "/v1/jobs").json["jobs"]}[job] == "alice")
    # They stay whose they are.
    s.terminate()
    s.start()
    expect(ask(s, BOB, "GET", f"/v1/jobs/{job}"), 404, "not_found")
    expect(ask(s, NEW, "DELETE", f"/v1/jobs/{job}"), 204)
    check(listed(s, BOB) == [others])


@options("--token-file", TOKENS)
def test_keys(s):
    """The same key of two owners is two keys, and of two tokens of one owner one."""
    first = solved(s, OLD, Idempotency_Key="k")
    check(solved(s, NEW, Idempotency_Key="k") == first)
    check(solved(s, BOB, MATRICES, Idempotency_Key="k") != first)
    expect(ask(s, NEW, "POST", "/v1/jobs", MATRICES, Idempotency_Key="k"), 422, "idempotency_key_reused")


@options("--token-file", TOKENS)
def test_uploads(s):
    text = MATRICES["problem"]["K"].encode()
    upload = expect(ask(s, OLD, "POST", "/v1/uploads", text), 201).json["id"]
    path, body = f"/v1/uploads/{upload}", {"problem": {**MATRICES["problem"], "K": {"upload": upload}}}
    for fields in ({}, {"Accept": "application/octet-stream"}):
        expect(ask(s, BOB, "GET", path, **fields), 404, "not_found")
        expect(ask(s, VIEW, "GET", path, **fields), 200)
    expect(ask(s, BOB, "DELETE", path), 404, "not_found")
    for query in ("", "?validate=true"):
        expect(ask(s, BOB, "POST", "/v1/jobs" + query, body), 422, "unknown_upload")
    # Both have sent it, once for each: neither learns of the other, and it goes with the last.
    expect(ask(s, BOB, "POST", "/v1/uploads", text), 201)
    expect(ask(s, BOB, "POST", "/v1/uploads", text), 200)
    job = solved(s, BOB, body)
    check(ask(s, BOB, "GET", path).json["used_by"] == 1 and ask(s, OLD, "GET", path).json["used_by"] == 0)
    expect(ask(s, BOB, "DELETE", path), 409, "upload_in_use")
    expect(ask(s, OLD, "DELETE", path), 204)
    expect(ask(s, OLD, "GET", path), 404, "not_found")
    expect(ask(s, BOB, "GET", path), 200)
    expect(ask(s, BOB, "DELETE", f"/v1/jobs/{job}"), 204)
    expect(ask(s, BOB, "DELETE", path), 204)
    expect(ask(s, BOSS, "GET", path), 404, "not_found")
    check(not s.kept_uploads())


def told(c, *wanted, seconds=PATIENT_S):
    """What a stream tells, until all that is wanted was among it."""
    text, end = "", time.monotonic() + seconds
    while not all(one in text for one in wanted):
        check(time.monotonic() < end, wanted, text)
        text += c.recv(65536).decode()
    return text


@options("--token-file", TOKENS)
def test_events(s):
    streams = {}
    for secret in (VIEW, BOB, BOSS):
        streams[secret] = c = s.connect(timeout=PATIENT_S)
        c.sendall(f"GET /v1/events HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {secret}\r\n\r\n".encode())
        check(b"200" in c.recv(20))
    jobs = {secret: solved(s, secret) for secret in (OLD, BOB)}
    of = {VIEW: [jobs[OLD]], BOB: [jobs[BOB]], BOSS: list(jobs.values())}
    seen = {secret: told(c, *of[secret]) for secret, c in streams.items()}
    expect(ask(s, OLD, "DELETE", f"/v1/jobs/{jobs[OLD]}"), 204)
    expect(ask(s, BOB, "DELETE", f"/v1/jobs/{jobs[BOB]}"), 204)
    for secret, c in streams.items():
        seen[secret] += told(c, *(f'{{"id": "{job}"}}' for job in of[secret]))
    check(jobs[BOB] not in seen[VIEW] and jobs[OLD] not in seen[BOB], seen)
    check(jobs[OLD] in seen[BOSS] and '"owner": "alice"' in seen[BOSS].replace('":"', '": "'), seen[BOSS])
    for c in streams.values():
        c.close()


@options("--token-file", TOKENS)
def test_tokens(s):
    expect(ask(s, NEW, "GET", "/v1/jobs"), 200)  # whose digest is in the file
    digest = hashlib.sha256(NEW.encode()).hexdigest()
    for wrong in (digest, "sha256:" + digest):
        expect(ask(s, wrong, "GET", "/v1/jobs"), 401, "unauthorized")
    late = expect(ask(s, LATE, "GET", "/v1/jobs"), 401, "unauthorized")
    check("expired" in late.json["detail"] and "invalid_token" in late.headers["www-authenticate"], late)
    # It ends while the daemon runs.
    soon = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 2))
    write_tokens(LINES + f"soon read {'s' * 20} until={soon}\n")
    try:
        s.process.send_signal(service.signal.SIGHUP)
        end = time.monotonic() + PATIENT_S
        while ask(s, "s" * 20, "GET", "/v1/jobs").status != 200:
            check(time.monotonic() < end, s.log())
            time.sleep(0.02)
        while ask(s, "s" * 20, "GET", "/v1/jobs").status != 401:
            check(time.monotonic() < end, s.log())
            time.sleep(0.1)
    finally:
        write_tokens(LINES)
    for line, why in ((f"x submit {'x' * 20} until=soon", "until="), (f"x submit {'x' * 20} for=ever", "owner=NAME"),
                      ("x submit sha256:12", "sha256:"), (f"x submit {OLD}", "another token"), (f"x submit {'x' * 20} owner=", "owner"),
                      (f"x submit sha256:{digest}", "another token")):
        write_tokens(LINES + line + "\n")
        try:
            done = service.subprocess.run(s.command("--check-config", "--token-file", TOKENS), capture_output=True, text=True,
                                          timeout=PATIENT_S, check=False)
        finally:
            write_tokens(LINES)
        check(done.returncode == 1 and ":8:" in done.stderr and why in done.stderr and "x" * 20 not in done.stderr, line, done.stderr)


@options("--token-file", TOKENS, "--workers", "1", "--client-queue", "2", "--client-seconds", "1")
def test_quotas(s):
    """What one owner has counts for that one alone."""
    running = expect(ask(s, BOSS, "POST", "/v1/jobs", ENDLESS), 202).json["id"]
    end = time.monotonic() + PATIENT_S
    while ask(s, BOSS, "GET", f"/v1/jobs/{running}").json["status"] != "running":
        check(time.monotonic() < end)
        time.sleep(0.02)
    waiting = [expect(ask(s, secret, "POST", "/v1/jobs", MATRICES), 202).json["id"] for secret in (OLD, NEW)]
    reply = expect(ask(s, OLD, "POST", "/v1/jobs", MATRICES), 429, "quota_exceeded")
    check("--client-queue" in reply.json["detail"] and "alice" in reply.json["detail"] and "retry-after" in reply.headers, reply)
    expect(ask(s, BOB, "POST", "/v1/jobs", MATRICES), 202)
    expect(ask(s, OLD, "DELETE", f"/v1/jobs/{waiting[0]}"), 200)
    waiting[0] = expect(ask(s, OLD, "POST", "/v1/jobs", MATRICES), 202).json["id"]
    # Time: the boss's endless job took more than a second.
    time.sleep(1.0)
    expect(ask(s, BOSS, "DELETE", f"/v1/jobs/{running}"), 200)
    while ask(s, BOSS, "GET", f"/v1/jobs/{running}").json["status"] != "dismissed":
        check(time.monotonic() < end)
        time.sleep(0.02)
    for job in waiting:  # none waits from here on: that would be another quota
        while ask(s, NEW, "GET", f"/v1/jobs/{job}").json["status"] != "successful":
            check(time.monotonic() < end + 30)
            time.sleep(0.02)
    reply = expect(ask(s, BOSS, "POST", "/v1/jobs", MATRICES), 429, "quota_exceeded")
    check("--client-seconds" in reply.json["detail"], reply)
    check(s.end() == 0)
    s.sql("UPDATE client SET day = day - 1")
    s.start()
    expect(ask(s, BOSS, "POST", "/v1/jobs", MATRICES), 202)
    check(expect(ask(s, BOSS, "POST", "/v1/admin/check"), 200).json["whole"])


@options("--token-file", TOKENS, "--client-bytes", "100K")
def test_quota_of_bytes(s):
    """Of uploads and jobs together."""
    expect(ask(s, BOB, "POST", "/v1/uploads", b"x" * 95000), 201)
    reply = expect(ask(s, BOB, "POST", "/v1/uploads", b"y" * 9000), 429, "quota_exceeded")
    check("--client-bytes" in reply.json["detail"], reply)
    check(len(s.kept_uploads()) == 1, "the bytes of a refused upload stayed")
    large = {"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"] + "\n" * 5000}}
    expect(ask(s, BOB, "POST", "/v1/jobs", large), 429, "quota_exceeded")
    solved(s, BOB, MATRICES)
    expect(ask(s, OLD, "POST", "/v1/uploads", b"y" * 9000), 201)
    job = solved(s, OLD, large)
    expect(ask(s, OLD, "POST", "/v1/uploads", b"z" * 90000), 429, "quota_exceeded")
    expect(ask(s, OLD, "DELETE", f"/v1/jobs/{job}"), 204)
    expect(ask(s, OLD, "POST", "/v1/uploads", b"z" * 90000), 201)
    check(expect(ask(s, BOSS, "POST", "/v1/admin/check"), 200).json["whole"])


@options("--token-file", TOKENS, "--audit-log", AUDIT, "--access-log", "no")
def test_audit(s):
    job = solved(s, OLD)
    expect(ask(s, BOB, "DELETE", f"/v1/jobs/{job}"), 404)
    expect(ask(s, NEW, "DELETE", f"/v1/jobs/{job}", X_Request_Id="mine"), 204)
    expect(ask(s, VIEW, "POST", "/v1/jobs", SCENE), 403)
    expect(s.get("/v1/jobs"), 401)
    upload = expect(ask(s, BOB, "POST", "/v1/uploads", b"text"), 201).json["id"]
    expect(ask(s, BOB, "GET", "/v1/jobs"), 200)
    check(s.end() == 0 and os.stat(AUDIT).st_mode & 0o077 == 0)
    lines = [json.loads(line) for line in pathlib.Path(AUDIT).read_text(encoding="utf-8").splitlines()]
    by = {one["token"]: one for one in lines}  # those of two connections come in any order
    check(by["alice-old"].pop("status") in (200, 202), lines)  # as it ended before the reply, or not
    check(len(lines) == 5 and {name: (one["owner"], one["method"], one.get("status")) for name, one in by.items()} == {
        "alice-old": ("alice", "POST", None), "alice-new": ("alice", "DELETE", 204), "alice-view": ("alice", "POST", 403),
        "": ("", "GET", 401), "bob": ("bob", "POST", 201)}, lines)
    check(by["alice-old"]["job"] == by["alice-new"]["job"] == job and by["alice-new"]["request"] == "mine" and
          by["bob"]["upload"] == upload, lines)
    check(all(one["address"] == "127.0.0.1" for one in lines), lines)


def test_without_tokens_all_belongs_to_one(s):
    job = s.solve(SCENE)
    check("owner" not in job and [one["id"] for one in s.get("/v1/jobs").json["jobs"]] == [job["id"]], job)
    check(s.sql("SELECT count(*) FROM client") == [(0,)])


if __name__ == "__main__":
    service.main(globals())
