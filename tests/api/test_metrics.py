"""What the daemon tells its operators: metrics, health, request ids."""
import re
import resource
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, check, expect, options

LINE = re.compile(r'([a-zA-Z_:][a-zA-Z0-9_:]*)(?:\{(.*)\})? (-?[0-9.e+-]+|\+Inf|NaN)$')


def scrape(s):
    """{(name, labels): value}; every line is checked against the format."""
    reply = expect(s.get("/metrics"), 200)
    check(reply.headers["content-type"].startswith("text/plain; version=0.0.4"), reply.headers)
    values, kinds = {}, {}
    for line in reply.body.decode().splitlines():
        if line.startswith("# TYPE "):
            _, _, name, kind = line.split(" ")
            check(name not in kinds, line)
            kinds[name] = kind
        elif not line.startswith("# HELP "):
            found = LINE.match(line)
            check(found, line)
            name, labels = found[1], found[2] or ""
            check((name, labels) not in values, "twice", line)
            base = re.sub("_(bucket|sum|count)$", "", name)
            check(name in kinds or kinds.get(base) == "histogram", "no type", line)
            values[name, labels] = float(found[3])
    return values


def scrape_after(s, solved, failed=0):
    """The values once so many jobs were counted: a job is counted just after its end can be read, its phases last."""
    end = time.monotonic() + PATIENT_S
    while True:
        values = scrape(s)
        if (values["uzawad_job_phase_seconds_count", 'phase="certify"'] == solved and
                values["uzawad_job_phase_seconds_count", 'phase="total"'] == solved + failed):
            return values
        check(time.monotonic() < end, values)
        time.sleep(0.05)


def test_counts_follow_what_happens(s):
    before = scrape(s)
    check(before["uzawad_jobs", 'status="successful"'] == 0 and before["uzawad_queue_depth", ""] == 0, before)
    s.solve(SCENE)
    again = {**SCENE, "problem": {**SCENE["problem"], "loads": [{"on": "top", "traction": [0, -0.06]}]}}
    s.solve(again)
    failing = {**MATRICES, "problem": {**MATRICES["problem"], "K":
               "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 -1\n"}}
    check(s.solve(failing)["status"] == "failed")
    expect(s.get("/nothing"), 404)
    now = scrape_after(s, 2, 1)
    check(now["uzawad_jobs", 'status="successful"'] == 2 and now["uzawad_jobs", 'status="failed"'] == 1, now)
    check(now["uzawad_jobs_ended_total", 'status="successful",outcome="converged"'] == 2, now)
    check(now["uzawad_jobs_ended_total", 'status="failed",outcome="none"'] == 1, now)
    check(now["uzawad_jobs_submitted_total", ""] == 3 and now["uzawad_iterations_total", ""] > 2, now)
    check(now["uzawad_cache_hits_total", ""] == 1 and now["uzawad_cache_misses_total", ""] == 1, now)
    check(now["uzawad_cache_entries", ""] >= 1 and now["uzawad_cache_bytes", ""] > 1000, now)
    check(now["uzawad_http_requests_total", 'code="404"'] == 1, now)
    check(now["uzawad_http_request_seconds_count", 'method="POST",route="/v1/jobs"'] == 3, now)
    check(now["uzawad_store_commit_seconds_count", ""] > before["uzawad_store_commit_seconds_count", ""], now)
    check(now["uzawad_job_phase_seconds_count", 'phase="total"'] == 3, now)
    check(now["uzawad_job_phase_seconds_count", 'phase="factor"'] == 2, now)
    check("://" in s.db or now["uzawad_store_free_bytes", ""] > 1e6, now)  # a database has its disk elsewhere
    check(any(name == "uzawad_build_info" and value == 1 for (name, _), value in now.items()), now)
    check(now["process_resident_memory_bytes", ""] > 1e6 and now["uzawad_http_connections", ""] >= 1, now)


def test_histograms_are_cumulative(s):
    for _ in range(3):
        s.solve(MATRICES)
    values = scrape_after(s, 3)
    series = {}
    for (name, labels), value in values.items():
        if name.endswith("_bucket"):
            rest, _, end = labels.rpartition("le=")
            series.setdefault((name[:-7], rest.rstrip(",")), []).append((float(end.strip('"')), value))
    check(len(series) > 8, series.keys())
    for (name, labels), buckets in series.items():
        check(buckets == sorted(buckets) and buckets[-1][0] == float("inf"), name, buckets)
        counts = [count for _, count in buckets]
        check(counts == sorted(counts) and counts[-1] == values[name + "_count", labels], name, labels, counts)


@options("--workers", "1")
def test_queue_and_workers(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    waiting = [s.post(MATRICES).json["id"] for _ in range(3)]
    now = scrape(s)
    check(now["uzawad_queue_depth", ""] == 3 and now["uzawad_workers_busy", ""] == now["uzawad_workers", ""] == 1, now)
    s.request("DELETE", f"/v1/jobs/{job['id']}")
    for one in waiting:
        s.wait_status(one, "successful")
    s.wait_status(job["id"], "dismissed")
    end = time.monotonic() + PATIENT_S
    dismissed = {}
    while not dismissed and time.monotonic() < end:  # stopped before its first iteration it has no outcome
        now = scrape(s)
        dismissed = {labels: value for (name, labels), value in now.items() if 'status="dismissed",' in labels}
    check(list(dismissed.values()) == [1] and now["uzawad_queue_depth", ""] == 0, now)


def test_ready_solves_a_problem(s):
    commits, begun = scrape(s)["uzawad_store_changes_total", ""], time.monotonic()
    for _ in range(50):
        check(expect(s.get("/readyz"), 200).json["status"] == "ready")
    seconds, now = time.monotonic() - begun, scrape(s)
    made = now["uzawad_store_changes_total", ""] - commits
    check(("://" in s.db or 1 <= made) and made <= 1 + seconds, made, seconds)  # it is tried once a second at most
    check(now["uzawad_jobs", 'status="successful"'] == 0)


def test_ready_finds_a_full_disk(s):
    """No file of the daemon may grow or be written: as on a full disk, and then there is room again."""
    s.file()
    check(s.solve(MATRICES)["status"] == "successful")
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
    time.sleep(1.1)  # what was found out before is good for a second
    reply = expect(s.get("/readyz"), 503, "storage_full")
    check("retry-after" in reply.headers, reply)
    expect(s.post(MATRICES), 507, "storage_full")
    expect(s.get("/healthz"), 200)
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    time.sleep(1.1)
    expect(s.get("/readyz"), 200)
    check(s.solve(MATRICES)["status"] == "successful")


def counted(s, name, labels, value):
    """A job is counted just after its end is told."""
    end = time.monotonic() + PATIENT_S
    while (now := scrape(s)).get((name, labels)) != value:
        check(time.monotonic() < end, name, labels, now)
        time.sleep(0.02)


@options("--workers", "1")
def test_uploads_streams_and_what_ends_without_a_run(s):
    for _ in range(2):
        s.request("POST", "/v1/uploads", "some text")
    running = s.post(ENDLESS).json["id"]
    s.wait_status(running, "running")
    waiting = [s.post(ENDLESS).json["id"] for _ in range(2)]
    expect(s.request("DELETE", f"/v1/jobs/{waiting[-1]}"), 200)
    late = s.post({**ENDLESS, "queue_limit_s": 0.01}).json["id"]
    s.wait_status(late, "failed")
    with s.connect() as stream:
        stream.sendall(f"GET /v1/jobs/{running}/events HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        check(b"200 OK" in stream.recv(4096))
        now = scrape(s)
        check(now["uzawad_http_event_streams", ""] == 1, now)
    check(now["uzawad_uploads_total", ""] == 2, now)
    for status in ("dismissed", "failed"):
        counted(s, "uzawad_jobs_ended_total", f'status="{status}",outcome="none"', 1)
    for one in [running] + waiting[:-1]:
        s.request("DELETE", f"/v1/jobs/{one}")


def test_request_ids(s):
    own = s.get("/healthz", X_Request_Id="trace-42/a").headers["x-request-id"]
    check(own == "trace-42/a", own)
    made = [s.get("/healthz").headers["x-request-id"] for _ in range(2)]
    made += [s.get("/nothing").headers["x-request-id"], s.post({}).headers["x-request-id"]]
    made += [s.get("/healthz", X_Request_Id=bad).headers["x-request-id"] for bad in ("a b", "x" * 65, '"quoted"')]
    check(len(set(made)) == len(made) and all(re.fullmatch("[0-9a-f]{24,}", one) for one in made), made)
    check(s.end() == 0)
    logged = [event["request"] for event in s.events("request")]
    check(set(made) | {own} <= set(logged), made, logged)


if __name__ == "__main__":
    service.main(globals())
