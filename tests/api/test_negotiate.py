"""Conditional requests, ranges, content codings and requests from pages of other origins."""
# not under ThreadSanitizer: about answers, not about threads
import gzip

import service
from service import ENDLESS, MATRICES, SCENE, check, expect, options

UNKNOWN = "0" * 32


def test_etags(s):
    job = s.solve(SCENE)
    base = f"/v1/jobs/{job['id']}"
    upload = s.request("POST", "/v1/uploads", b"text").headers["location"]
    for path in (base, base + "/result", base + "/result?fields=displacements", base + "/history",
                 base + "/history.csv", "/openapi.json", "/schemas/job.json", "/v1/jobs", "/v1/jobs?limit=1",
                 "/v1/limits", "/v1/factors", upload):
        first = expect(s.get(path), 200)
        tag = first.headers["etag"]
        check(tag[0] == tag[-1] == '"' and len(tag) > 10, first.headers)
        check("no-cache" in first.headers["cache-control"], first.headers)
        for wanted in (tag, f"W/{tag}", f'"other", {tag}', "*", tag[:-1] + '-gz"'):
            reply = expect(s.get(path, If_None_Match=wanted), 304)
            check(reply.body == b"" and reply.headers["etag"] == tag, wanted, reply)
            check(reply.headers["vary"] == first.headers["vary"] and "content-type" not in reply.headers, reply)
        for other in ('"other"', tag[1:-1], tag[:-2] + '"', ""):
            check(expect(s.get(path, If_None_Match=other), 200).body == first.body, other)
        check(expect(s.request("HEAD", path, headers={"If-None-Match": tag}), 304).headers["etag"] == tag)
    tags = {s.get(base + "/result" + query).headers["etag"] for query in ("", "?fields=gaps", "?fields=reactions")}
    check(len(tags) == 3, tags)
    check("etag" not in s.get(f"/v1/jobs/{UNKNOWN}").headers and "etag" not in s.get("/healthz").headers)


def test_the_tag_follows_the_job(s):
    job = s.post(ENDLESS).json
    running = s.wait_status(job["id"], "running")
    path = f"/v1/jobs/{job['id']}"
    tag, tag_of_list = s.get(path).headers["etag"], s.get("/v1/jobs").headers["etag"]
    s.request("DELETE", path)
    s.wait_status(running["id"], "dismissed")
    check(expect(s.get(path, If_None_Match=tag), 200).json["status"] == "dismissed")
    check(expect(s.get("/v1/jobs", If_None_Match=tag_of_list), 200).json["jobs"][0]["status"] == "dismissed")


def test_gzip(s):
    job = s.solve(SCENE)
    base = f"/v1/jobs/{job['id']}"
    for path in (base + "/result?fields=displacements,reactions", base + "/history.csv", "/openapi.json",
                 base + "/deformed.svg", base + "/convergence.svg"):
        plain = expect(s.get(path), 200)
        check("content-encoding" not in plain.headers and "accept-encoding" in plain.headers["vary"].lower(), plain)
        for takes in ("gzip", "br, gzip;q=0.5", "*", "x-gzip", "GZIP", "identity;q=0, *;q=0.1"):
            reply = s.request("GET", path, headers={"Accept-Encoding": takes})
            check(reply.status == 200 and reply.headers["content-encoding"] == "gzip", takes, reply.headers)
            check(gzip.decompress(reply.body) == plain.body and len(reply.body) < 0.7 * len(plain.body))
            check(reply.headers["etag"] != plain.headers["etag"], reply.headers)
            again = s.request("GET", path, headers={"Accept-Encoding": takes, "If-None-Match": reply.headers["etag"]})
            check(again.status == 304 and again.body == b"", again)
        for refuses in ("gzip;q=0", "gzip;q=0.000, *", "br", "", "*;q=0", "identity"):
            reply = s.request("GET", path, headers={"Accept-Encoding": refuses})
            check("content-encoding" not in reply.headers and reply.body == plain.body, refuses, reply.headers)
        head = s.request("HEAD", path, headers={"Accept-Encoding": "gzip"})
        full = s.request("GET", path, headers={"Accept-Encoding": "gzip"})
        check(head.headers["content-length"] == full.headers["content-length"], head.headers)
    small = s.request("GET", "/healthz", headers={"Accept-Encoding": "gzip"})
    check("content-encoding" not in small.headers, small)


def test_ranges(s):
    job = s.solve(SCENE)
    text = b"%%MatrixMarket matrix array real general\n1 1\n1\n" * 100
    upload = s.request("POST", "/v1/uploads", text).headers["location"]
    base = f"/v1/jobs/{job['id']}"
    for path, headers in ((base + "/result", {}), (base + "/history", {}), (base + "/history.csv", {}), (upload, {"Accept": "application/octet-stream"})):
        def part(wanted, **more):
            return s.request("GET", path, headers={**headers, "Range": wanted,
                                                   **{k.replace("_", "-"): v for k, v in more.items()}})
        full = expect(s.request("GET", path, headers=headers), 200)
        size, tag = len(full.body), full.headers["etag"]
        check(full.headers["accept-ranges"] == "bytes", full.headers)
        for wanted, first, last in (("bytes=0-0", 0, 0), ("bytes=10-19", 10, 19), ("bytes=5-", 5, size - 1),
                                    ("bytes=-7", size - 7, size - 1), (f"bytes=0-{size + 5}", 0, size - 1),
                                    (f"Bytes=-{size + 5}", 0, size - 1), (f"bytes={size - 1}-", size - 1, size - 1)):
            reply = part(wanted, Accept_Encoding="gzip")
            check(reply.status == 206 and reply.body == full.body[first:last + 1], wanted, reply.status, reply.headers)
            check(reply.headers["content-range"] == f"bytes {first}-{last}/{size}", wanted, reply.headers)
            check("content-encoding" not in reply.headers and reply.headers["etag"] == tag, reply.headers)
        for beyond in (f"bytes={size}-", f"bytes={size + 10}-{size + 20}", "bytes=-0"):
            reply = expect(part(beyond), 416, "range_not_satisfiable")
            check(reply.headers["content-range"] == f"bytes */{size}", reply)
        for strange in ("bytes=5-2", "bytes=0-1,3-4", "lines=0-1", "bytes=", "bytes=-", "bytes=x-1", "bytes=1-x", "1-2",
                        "bytes=99999999999999999999-"):
            check(expect(part(strange), 200).body == full.body, strange)
        check(part("bytes=0-3", If_Range=tag).status == 206)
        for other in ('"other"', f"W/{tag}", "Sat, 01 Jan 2000 00:00:00 GMT"):
            check(part("bytes=0-3", If_Range=other).status == 200, other)
        check(part("bytes=0-3", If_None_Match=tag).status == 304)
    live = s.post(ENDLESS).json["id"]
    s.wait_status(live, "running")
    check("accept-ranges" not in expect(s.get(f"/v1/jobs/{live}/history"), 200).headers)  # it is another one each time
    check(expect(s.get("/healthz", Range="bytes=0-1"), 200).json["status"] == "ok")


def test_part_of_a_result(s):
    job = s.solve(SCENE)
    path = f"/v1/jobs/{job['id']}/result?fields=reactions,gaps,pressure,displacements"
    full = s.get(path).json
    for start, count in ((0, 5), (28, 100), (3, 1), (30, 4), (5, 0), (341, 1), (10**18, 10**18)):
        part = expect(s.get(f"{path}&from={start}&count={count}"), 200).json
        check(part["from"] == start, part["from"])
        for name in ("reactions", "gaps", "pressure", "contact_nodes", "displacements", "nodes"):
            check(part[name] == full[name][start:start + count], name, start, count)
    check(s.get(f"{path}&from=20").json["reactions"] == full["reactions"][20:])
    check("from" not in full)
    for wrong in ("from=-1", "count=x", "count=", "from=1.5"):
        expect(s.get(f"{path}&{wrong}"), 400, "bad_parameter")
    cases = s.solve({**MATRICES, "cases": [{"name": "a", "p": [2, 2]}, {"name": "b", "p": [3, 4]}]})
    path = f"/v1/jobs/{cases['id']}/result?fields=displacements"
    full, part = s.get(path).json, s.get(path + "&from=1&count=1").json
    check([one["displacements"] for one in part["cases"]] == [one["displacements"][1:] for one in full["cases"]], part)


def test_only_what_was_read_is_deleted(s):
    """A job that has gone on since, and one that has not."""
    waits = s.post(ENDLESS)
    tag = s.get(f"/v1/jobs/{waits.json['id']}").headers["etag"]
    path = f"/v1/jobs/{waits.json['id']}"
    s.wait_status(waits.json["id"], "running")
    for fields in ({"If-Match": '"0"'}, {"If-Match": f"W/{s.get(path).headers['etag']}"}, {"If-Match": ""},
                   {"If-Unmodified-Since": "Sat, 01 Jan 2022 00:00:00 GMT"}):
        expect(s.request("DELETE", path, headers=fields), 412, "precondition_failed")
    check(s.get(path).json["status"] == "running", tag)
    expect(s.request("DELETE", path), 200)
    s.wait_status(waits.json["id"], "dismissed")
    expect(s.request("DELETE", path, headers={"If-Match": tag}), 412, "precondition_failed")
    now = s.get(path).headers["etag"]
    expect(s.request("DELETE", path, headers={"If-Match": f'"x", {now}', "If-Unmodified-Since": "Sat, 01 Jan 2022 00:00:00 GMT"}), 204)
    expect(s.request("DELETE", path, headers={"If-Match": now}), 404)
    job = s.solve(MATRICES)["id"]
    expect(s.request("DELETE", f"/v1/jobs/{job}", headers={"If-Unmodified-Since": "Sat, 01 Jan 2050 00:00:00 GMT"}), 204)
    upload = s.request("POST", "/v1/uploads", b"text").headers["location"]
    expect(s.request("DELETE", upload, headers={"If-Match": '"1"'}), 412, "precondition_failed")
    expect(s.request("DELETE", upload, headers={"If-Match": s.get(upload).headers["etag"]}), 204)


ORIGIN = "https://app.example.org:8443"


@options("--cors", ORIGIN, "--cors", "http://localhost:5173")
def test_cors(s):
    for origin in (ORIGIN, "http://localhost:5173"):
        reply = s.request("OPTIONS", "/v1/jobs", headers={"Origin": origin, "Access-Control-Request-Method": "POST"})
        check(reply.status == 204 and reply.headers["access-control-allow-origin"] == origin, reply)
        check("POST" in reply.headers["access-control-allow-methods"], reply)
        for name in ("Content-Type", "Prefer", "Idempotency-Key", "If-None-Match", "Range", "Last-Event-ID"):
            check(name.lower() in reply.headers["access-control-allow-headers"].lower(), name, reply)
        check("origin" in reply.headers["vary"].lower() and int(reply.headers["access-control-max-age"]) > 0, reply)
        reply = expect(s.post(MATRICES, {"Origin": origin, "Sec-Fetch-Site": "cross-site"}), 202)
        check(reply.headers["access-control-allow-origin"] == origin, reply)
        check("Location" in reply.headers["access-control-expose-headers"], reply)
        refused = expect(s.post({}, {"Origin": origin}), 422)  # a page may read why
        check(refused.headers["access-control-allow-origin"] == origin, refused)
    for other in ("https://evil.example", ORIGIN + "0", ORIGIN[:-1], "null", "https://app.example.org"):
        reply = expect(s.get("/healthz", Origin=other), 200)
        check("access-control-allow-origin" not in reply.headers and "origin" in reply.headers["vary"].lower(), reply)
        expect(s.post(MATRICES, {"Origin": other, "Sec-Fetch-Site": "cross-site"}), 403, "cross_site")
        reply = s.request("OPTIONS", "/v1/jobs", headers={"Origin": other})
        check(reply.status == 204 and "access-control-allow-origin" not in reply.headers, reply)
    reply = s.request("OPTIONS", f"/v1/jobs/{UNKNOWN}")
    check(reply.status == 204 and reply.headers["allow"] == "GET, HEAD, DELETE, OPTIONS", reply)
    expect(s.request("OPTIONS", "/nothing"), 404, "not_found")


@options("--cors", "*")
def test_cors_for_all(s):
    check(s.get("/healthz", Origin="https://any.example").headers["access-control-allow-origin"] == "*")


BROWSER = {"User-Agent": "Mozilla/5.0", "Accept-Language": "en"}


def test_a_name_that_a_page_made_point_here(s):
    """DNS rebinding: to its visitor's browser the service is then the page's own server."""
    for fields in (BROWSER, {"Accept-Language": "en"}, {"Origin": "http://evil.example"}, {"User-Agent": "Mozilla/5.0 x"}):
        for method, path in (("GET", "/"), ("GET", "/v1/jobs"), ("POST", "/v1/jobs"), ("GET", "/nothing")):
            reply = s.request(method, path, MATRICES if method == "POST" else None, {"Host": f"evil.example:{s.port}", **fields})
            expect(reply, 421, "unknown_host")
            check("--cors" in reply.json["detail"] and "evil.example" in reply.json["detail"], reply)
    check(s.get("/v1/jobs").json["jobs"] == [])
    for host in (f"127.0.0.1:{s.port}", "localhost", f"LOCALHOST:{s.port}", "[::1]:80", "app.localhost:5173", "desk", ""):
        expect(s.request("GET", "/v1/jobs", headers={"Host": host, **BROWSER}), 200)
    for host in ("localhost.evil.example", "127.0.0.1.evil.example", "evillocalhost.example", "1.2.3.4.x"):
        expect(s.request("GET", "/v1/jobs", headers={"Host": host, **BROWSER}), 421, "unknown_host")
    expect(s.request("GET", "/v1/jobs", headers={"Host": "solver.example"}), 200)  # a program behind a proxy, say


@options("--cors", "https://solver.example:8443")
def test_a_name_that_is_known(s):
    for host in ("solver.example", "Solver.Example:8443", "solver.example:80"):
        expect(s.request("GET", "/v1/jobs", headers={"Host": host, **BROWSER}), 200)
    expect(s.request("GET", "/v1/jobs", headers={"Host": "solver.example.org", **BROWSER}), 421, "unknown_host")


def test_no_cors_by_default(s):
    reply = expect(s.get("/healthz", Origin=ORIGIN), 200)
    check(not any(name.startswith("access-control") for name in reply.headers) and "vary" not in reply.headers, reply)
    expect(s.request("OPTIONS", "/v1/jobs"), 405, "method_not_allowed")


if __name__ == "__main__":
    service.main(globals())
