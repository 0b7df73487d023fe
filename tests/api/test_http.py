"""The HTTP interface of the real daemon, by its contract: every route and every refusal."""
# not under ThreadSanitizer: one client at a time, but for these:
# for ThreadSanitizer, idempotency_race: one key in eight threads
# for ThreadSanitizer, long_poll: who waits is woken by the one who ends the job
import gzip
import json
import re
import signal
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, head_of, options

UNKNOWN = "0" * 32


# ------------------------------------------------------------------ routes

def test_job_lifecycle(s):
    reply = expect(s.post({**MATRICES, "tags": ["a", "b"]}), 202)
    job = reply.json
    check(reply.headers["location"] == f"/v1/jobs/{job['id']}", reply)
    check(reply.headers["cache-control"] == "no-store" and "allow" not in reply.headers, reply)
    check("allow" not in s.get("/v1/jobs").headers)
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
    reply = expect(s.get(f"/v1/jobs/{job['id']}/result?field=gaps"), 400, "unknown_parameter")
    check("it takes fields, case, from, count" in reply.json["detail"], reply)
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
    end = time.monotonic() + PATIENT_S
    while not (rows := s.get(path).json["rows"]) and time.monotonic() < end:
        time.sleep(0.02)
    check(rows, "no row of a running job")
    while not (later := s.get(f"{path}?after={int(rows[-1][0])}").json["rows"]) and time.monotonic() < end:
        time.sleep(0.02)
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
    check(expect(s.get("/v1/factors"), 200).json["factors"] == [])
    check(expect(s.get("/readyz"), 200).json["jobs"]["failed"] == 0)  # solves a problem of its own
    openapi = expect(s.get("/openapi.json"), 200)
    check("/v1/jobs" in openapi.json["paths"], openapi.json["paths"].keys())
    for path in service.SCHEMAS.glob("*.json"):
        reply = expect(s.get(f"/schemas/{path.name}"), 200)
        check(reply.body == (openapi.body if path.name == "openapi.json" else path.read_bytes()), path)
    # generators of clients follow references within one document
    check(set(re.findall(r'"\$ref": ?"([^/"]+)', openapi.body.decode())) == {"#"})
    expect(s.get("/schemas/none.json"), 404, "not_found")
    expect(s.get("/schemas/..%2FMakefile"), 404, "not_found")


def test_page(s):
    index = expect(s.get("/"), 200)
    check(index.headers["content-type"] == "text/html; charset=utf-8" and index.headers["cache-control"] == "no-cache", index)
    check("script-src 'self'" in index.headers["content-security-policy"], index.headers)
    script = re.search(rb'src="(/page/main-\w+\.js)"', index.body).group(1).decode()
    plain, packed = expect(s.get(script), 200), expect(s.get(script, Accept_Encoding="gzip"), 200)
    check(packed.headers["content-encoding"] == "gzip" and gzip.decompress(packed.body) == plain.body, packed.headers)
    check("immutable" in plain.headers["cache-control"] and plain.headers["etag"] != packed.headers["etag"], plain.headers)
    for tag in (plain.headers["etag"], packed.headers["etag"]):
        expect(s.get(script, If_None_Match=tag), 304)
    check(s.request("HEAD", script).headers["content-length"] == str(len(plain.body)), script)


def test_not_found(s):
    for path in ("/page", "/page/none.js", "/v1", "/v1/jobs/", "/v1/jobs/xyz", f"/v1/jobs/{UNKNOWN.upper()}x", "/v1/jobsx", "/healthz/",
                 f"/v1/jobs/{UNKNOWN}/nothing", "//v1/jobs", "/v1/../v1/jobs"):
        expect(s.get(path), 404, "not_found")
    expect(s.get(f"/v1/jobs/{UNKNOWN}"), 404, "not_found")
    expect(s.get("/%ff%01"), 404, "not_found")
    for path, words in (("/v1/jobs/xyz", '"xyz" is not the id of a job: those have 32 digits'),
                        ("/v1/jobs/xyz/result", "is not the id of a job"), ("/v1/uploads/12", "of an upload: those have 64 digits"),
                        ("/v1/nothing", "/openapi.json lists what is")):
        reply = expect(s.get(path), 404, "not_found")
        check(words in reply.json["detail"], reply)


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
    predicted = reply.json["predicted"]
    check(reply.json["valid"] is True and predicted["m"] == 30 and predicted["d"] == 660 and predicted["fits"], reply)
    solved = s.solve(SCENE)["summary"]
    s.request("DELETE", f"/v1/jobs/{s.get('/v1/jobs').json['jobs'][0]['id']}")
    check(predicted["operator"] == solved["operator"] and predicted["factor_nnz"] == solved["factor"]["nnz"], solved)
    check(predicted["bytes"] > 1e5 and 0 < predicted["seconds"] < 10, predicted)
    free = json.loads(json.dumps(SCENE))
    free["problem"]["supports"] = []
    problem = expect(s.post(free, query="?validate=true"), 422, "free_body").json
    check(problem["pointer"] == "/problem/supports" and "translation along x" in problem["detail"], problem)
    free["problem"]["supports"] = [{"on": "left", "ux": 0}]  # the obstacle holds the rest
    check(expect(s.post(free, query="?validate=true"), 200).json == {"valid": True, "predicted": None})
    check(expect(s.post(MATRICES, query="?validate=true"), 200).json["predicted"]["d"] == 2)
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
    reply = expect(s.request("POST", "/v1/jobs?validate=true", body), 415, "content_type")  # none at all
    check("Content-Type: application/json" in reply.json["detail"], reply)
    for bad in ("application/x-www-form-urlencoded", "text/plain", "text/plain+json", "application/json-seq", "+json", ""):
        expect(s.request("POST", "/v1/jobs?validate=true", body, {"Content-Type": bad}), 415, "content_type")
    expect(s.request("POST", "/v1/jobs", body, {"Content-Type": "application/json", "Content-Encoding": "gzip"}), 415,
           "content_encoding")
    for bad in ("text/plain", "multipart/form-data; boundary=x", "Application/x-www-form-urlencoded", ""):
        expect(s.request("POST", "/v1/uploads", b"text", {"Content-Type": bad}), 415, "content_type")
    for good in ("application/octet-stream", "text/x-matrix-market", "application/json"):
        check(s.request("POST", "/v1/uploads", b"text", {"Content-Type": good}).status in (200, 201), good)


def test_pages_of_other_origins(s):
    """Whatever a page can have its visitor's browser send. Another port is another origin, though the same site."""
    job = s.solve(MATRICES)["id"]
    own = {"Origin": f"http://127.0.0.1:{s.port}"}
    foreign = [{"Origin": f"http://127.0.0.1:{s.port + 1}"}, {"Origin": "http://127.0.0.1"}, {"Origin": "null"}, {"Origin": ""},
               {"Origin": f"ftp://127.0.0.1:{s.port}"}, {"Origin": f"http://127.0.0.1:{s.port}.x"}, {"Origin": "http://desk"},
               {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"}, {**own, "Sec-Fetch-Site": "same-site"}]
    changes = (("POST", "/v1/jobs", MATRICES), ("POST", "/v1/verify", MATRICES), ("POST", f"/v1/jobs/{job}/refine", {}),
               ("POST", "/v1/uploads", b"text"), ("POST", "/v1/admin/check", None), ("DELETE", f"/v1/jobs/{job}", None))
    for fields in foreign:
        for method, path, body in changes:
            expect(s.request(method, path, body, fields), 403, "cross_site")
        expect(s.request("GET", "/v1/jobs", headers=fields), 200)  # which the page can't read
    check(len(s.get("/v1/jobs").json["jobs"]) == 1)
    for fields in ({}, own, {**own, "Sec-Fetch-Site": "same-origin"}, {"Sec-Fetch-Site": "none"},
                   {"Origin": f"https://LOCALHOST:{s.port}", "Host": f"localhost:{s.port}"},  # behind a proxy with TLS
                   {"Origin": "https://solver.example", "Sec-Fetch-Site": "same-origin"}):  # that puts its own Host
        expect(s.post(MATRICES, fields), 202)


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
    check(reply.json["status"] in ("accepted", "running") and 0.9 < time.monotonic() - started < 40, reply)
    timer = threading.Timer(0.7, lambda: s.request("DELETE", f"/v1/jobs/{job['id']}"))
    timer.start()
    started = time.monotonic()
    reply = expect(s.get(f"/v1/jobs/{job['id']}", Prefer="wait=600"), 200)
    took = time.monotonic() - started
    timer.join()
    check(reply.json["status"] == "dismissed" and 0.5 < took < 100, took, reply)
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
    end = time.monotonic() + PATIENT_S
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


def test_a_repeat_is_answered_though_it_would_be_refused_now(s):
    key = {"Idempotency-Key": "again"}
    start = s.solve(SCENE)["id"]
    warm = {**SCENE, "solver": {"warm_start": {"job": start}}}
    first = s.post(warm, {**key, "Prefer": "wait=60"}).json
    check(first["status"] == "successful", first)
    check_id = s.request("POST", "/v1/verify", json.loads((service.ROOT / "tests/data/verify.json").read_text()),
                         {"Idempotency-Key": "certify"}).json["job"]
    expect(s.request("DELETE", f"/v1/jobs/{start}"), 204)
    expect(s.post(warm), 422, "not_allowed")
    again = expect(s.post(warm, key), 200)
    check(again.json["id"] == first["id"] and again.headers["location"].endswith(first["id"]), again)
    expect(s.post({**warm, "tags": ["other"]}, key), 422, "not_allowed")
    expect(s.post(warm, key, "?validate=true"), 422, "not_allowed")
    s.options = ("--max-dofs", "1")
    s.restart(signal.SIGTERM)
    expect(s.post(SCENE), 413)
    check(expect(s.post(warm, key), 200).json["id"] == first["id"])
    verified = s.request("POST", "/v1/verify", json.loads((service.ROOT / "tests/data/verify.json").read_text()),
                         {"Idempotency-Key": "certify"})
    check(expect(verified, 200).json["job"] == check_id, verified)


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


if __name__ == "__main__":
    service.main(globals())
