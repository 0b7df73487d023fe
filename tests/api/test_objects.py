"""Large results and uploads in an object store: several daemons with one bucket, what fails there, and what a crash leaves.
"""
# not under ThreadSanitizer: about what is kept where, but for these, in which threads meet:
# for ThreadSanitizer, results_and_uploads: many put and get at once
# for ThreadSanitizer, the_object_store_is_away: all wait for one store
import concurrent.futures
import contextlib
import json
import os
import subprocess
import time

import databases
import object_store
import service
from service import MATRICES, PATIENT_S, SCENE, Service, check, expect, together, wait_until

SERVER = None
LARGE = {**SCENE, "tags": ["large"]}
KEYS = {"AWS_ACCESS_KEY_ID": object_store.KEY, "AWS_SECRET_ACCESS_KEY": object_store.SECRET}


@contextlib.contextmanager
def daemons(build, n, *options, least="2K", start=True):
    """n daemons, a database and a bucket."""
    global SERVER
    SERVER = databases.shared()
    name, place = SERVER.database(), object_store.ObjectStore()
    some = [Service(build, "--workers", "1", "--objects", place.url(), "--object-region", object_store.REGION,
                    "--object-least", least, *options, db=SERVER.address(name)) for _ in range(n)]
    try:
        for one in some:
            one.environment = dict(KEYS)
        if start:
            together(Service.start, some)
        yield some, name, place
        live = [one for one in some if one.process and one.process.poll() is None]
        for one, status in zip(live, together(Service.end, live)):
            check(status == 0, one.log())
    finally:
        place.released.set()
        for one in some:
            one.stop()
        place.stop()


def result_of(daemon, job):
    return expect(daemon.get(f"/v1/jobs/{job}/result?fields=displacements,reactions,gaps"), 200).body


def solve(daemon, body=LARGE):
    job = daemon.solve(body)
    check(job["status"] == "successful", job)
    return job["id"]


def until_back(ask):
    """After a failure nobody asks the object store for a moment."""
    replies = []
    wait_until(lambda: replies.append(ask()) or replies[-1].status != 503)
    return replies[-1]


def names_in(database):
    return {row[0] for row in SERVER.sql(database, "SELECT name FROM uzawa.object")}


def collect(database, place, until):
    """As if the time had come for what is nobody's."""
    SERVER.sql(database, "UPDATE uzawa.object SET due = 0 WHERE due < 'Infinity'")
    wait_until(lambda: SERVER.sql(database, "UPDATE uzawa.object SET due = 0 WHERE due < 'Infinity'") is not None and
               until(), seconds=40)
    check(set(place.objects) == names_in(database), "objects without a row", set(place.objects) - names_in(database))


def test_results_and_uploads_of_two_daemons(s):
    with daemons(s.build, 2) as ((a, b), name, place):
        job = solve(a)
        check(place.count("PUT") >= 1 and not [one for one in place.seen if one[3]], place.seen)
        check(SERVER.sql(name, f"SELECT count(*) FROM uzawa.pieces WHERE job = '{job}'") == [["0"]])
        check(result_of(a, job) == result_of(b, job))
        cases = solve(a, {**LARGE, "cases": [{"name": n, "loads": SCENE["problem"]["loads"]} for n in "xy"]})
        check(expect(b.get(f"/v1/jobs/{cases}/result?case=y&fields=displacements"), 200).body)
        small = solve(b, MATRICES)
        check(SERVER.sql(name, f"SELECT count(*) > 0 FROM uzawa.pieces WHERE job = '{small}'") == [["t"]])
        check(SERVER.sql(name, f"SELECT count(*) FROM uzawa.placed WHERE job = '{small}'") == [["0"]])
        # uploads: one that is small, one of several objects and an end that stays in the database
        for sent in (b"x" * 100, os.urandom(4096), os.urandom((9 << 20) + 100)):
            upload = expect(a.request("POST", "/v1/uploads", sent), 201).json
            for one in (a, b):
                check(expect(one.get(f"/v1/uploads/{upload['id']}", Accept="application/octet-stream"), 200).body == sent)
            check(b.request("POST", "/v1/uploads", sent).json["id"] == upload["id"])
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.blob_piece WHERE object IS NOT NULL") == [["4"]])
        matrix = MATRICES["problem"]["K"].replace("symmetric\n", "symmetric\n" + ("%" + " " * 900 + "\n") * 5).encode()
        upload = a.request("POST", "/v1/uploads", matrix).json["id"]
        solve(b, {"problem": {**MATRICES["problem"], "K": {"upload": upload}}})
        check(a.request("POST", "/v1/admin/check").json["whole"])
        check(set(place.objects) == names_in(name), "they differ")
        metrics = a.get("/metrics").body.decode()
        check("\nuzawad_object_written_bytes_total 0\n" not in metrics and "uzawad_object_request_seconds_count" in metrics)


def padded(kilobytes):
    """A problem whose request is that long."""
    lines = ("%" + " " * 1022 + "\n") * kilobytes
    return {"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("symmetric\n", "symmetric\n" + lines)}}


def test_requests_of_two_daemons(s):
    with daemons(s.build, 2) as ((a, b), name, place):
        job = a.post(padded(4100), {"Idempotency-Key": "long"}).json["id"]
        check(a.wait_status(job, "successful", "failed")["status"] == "successful")
        check(SERVER.sql(name, "SELECT cardinality(objects), size > 4 << 20 FROM uzawa.request_placed") == [["2", "t"]])
        check(SERVER.sql(name, "SELECT 1 FROM uzawa.request") == [])
        refine = lambda: b.request("POST", f"/v1/jobs/{job}/refine", {"accuracy": {"relative_error": 1e-12}})
        again = expect(refine(), 202).json["id"]
        check(a.wait_status(again, "successful", "failed")["status"] == "successful")
        check(b.post(padded(4100), {"Idempotency-Key": "long"}).json["id"] == job)
        expect(b.post(padded(3), {"Idempotency-Key": "long"}), 422)
        check(a.request("POST", "/v1/admin/check").json["whole"])
        with place.failing("500", "GET"):
            expect(refine(), 503, "store_unavailable")
        objects = dict(place.objects)
        place.objects.update({one: bytes(len(data)) for one, data in objects.items()})
        expect(until_back(refine), 500, "stored_data_damaged")
        place.objects.update(objects)
        with place.failing("500", "PUT"):  # it is acknowledged all the same
            other = a.post(padded(3)).json["id"]
        check(b.wait_status(other, "successful", "failed")["status"] == "successful")
        check(SERVER.sql(name, "SELECT job FROM uzawa.request") == [[other]])
        for one in job, again:
            expect(b.request("DELETE", f"/v1/jobs/{one}"), 204)
        collect(name, place, lambda: not place.objects)


def test_what_is_deleted_is_collected(s):
    with daemons(s.build, 2) as ((a, b), name, place):
        job = solve(a)
        upload = a.request("POST", "/v1/uploads", os.urandom(5000)).json["id"]
        keep = solve(b)
        before = result_of(a, keep)
        expect(b.request("DELETE", f"/v1/jobs/{job}"), 204)
        expect(b.request("DELETE", f"/v1/uploads/{upload}"), 204)
        check(len(place.objects) >= 3, "it went before its time")
        with place.failing("500", "DELETE"):
            SERVER.sql(name, "UPDATE uzawa.object SET due = 0 WHERE due < 'Infinity'")
            wait_until(lambda: SERVER.sql(name, "SELECT 1 FROM uzawa.object WHERE doomed"))
        collect(name, place, lambda: not SERVER.sql(name, "SELECT 1 FROM uzawa.object WHERE job IS NULL"))
        check(result_of(a, keep) == before)


def test_a_daemon_is_killed_between_object_and_row(s):
    with daemons(s.build, 2) as ((a, b), name, place):
        with place.failing("hang", "PUT"):
            job = a.post(LARGE).json["id"]
            upload = concurrent.futures.ThreadPoolExecutor(1).submit(
                lambda: a.request("POST", "/v1/uploads", os.urandom(5000), timeout=PATIENT_S))
            wait_until(lambda: place.count("PUT") >= 2)
            runs_at_a = bool(a.events("job_started"))
            killed, other = (a, b) if runs_at_a else (b, a)
            for one in {killed, a}:
                one.process.kill()
                one.process.wait()
        check(upload.exception(), "an upload was acknowledged")
        left = set(place.objects)
        check(left, "nothing was put")
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.object WHERE job IS NOT NULL") == [["0"]], "half of it shows")
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.placed") == [["0"]], "half of it shows")
        if other is a:
            other.start()
        check(other.get(f"/v1/jobs/{job}").json["status"] in ("accepted", "running"))
        SERVER.sql(name, "UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1")
        check(other.wait_status(job, "successful", "failed")["status"] == "successful")
        result_of(other, job)
        kept = {row[0] for row in SERVER.sql(name, "SELECT DISTINCT object FROM uzawa.placed")}
        collect(name, place, lambda: set(place.objects) == kept)
        check(not left & kept, "a name was used twice")


def test_faults(s):
    with daemons(s.build, 1) as ((a,), name, place):
        job = solve(a)
        before = result_of(a, job)
        for fault, status, code in (("500", 503, "store_unavailable"), ("cut", 503, "store_unavailable"),
                                    ("truncated", 503, "store_unavailable"), ("wrong", 500, "stored_data_damaged")):
            with place.failing(fault, "GET"):
                refused = expect(a.get(f"/v1/jobs/{job}/result?fields=displacements"), status, code)
                check(status == 500 or int(refused.headers["retry-after"]) > 0, fault)
            until_back(lambda: a.get(f"/v1/jobs/{job}/result?fields=displacements"))
            check(result_of(a, job) == before, fault)
        with place.failing("slow", "GET"):
            check(result_of(a, job) == before)
        # what was put is damaged, cut short, gone
        objects = dict(place.objects)
        for harm in (lambda x: bytes(one ^ 1 for one in x), lambda x: x[:8], lambda x: None):
            for one, data in objects.items():
                harmed = harm(data)
                place.objects[one] = harmed
                if harmed is None:
                    del place.objects[one]
            expect(a.get(f"/v1/jobs/{job}/result?fields=displacements,reactions,nodes"), 500, "stored_data_damaged")
        place.objects.update(objects)
        check(result_of(a, job) == before)
        # an upload that can't be kept is not taken, and one that can't be read is no other
        with place.failing("500", "PUT"):
            refused = a.request("POST", "/v1/uploads", os.urandom(5000))
            expect(refused, 503, "store_unavailable")
            check(int(refused.headers["retry-after"]) > 0)
        check(SERVER.sql(name, "SELECT count(*) FROM uzawa.upload") == [["0"]])


def test_the_object_store_is_away_for_a_while(s):
    with daemons(s.build, 1) as ((a,), name, place):
        place.stop()
        job = a.post(LARGE).json["id"]
        small = a.post(MATRICES).json["id"]
        wait_until(lambda: a.events("store_failed"))
        check(a.get(f"/v1/jobs/{job}").json["status"] == "running")
        check(expect(a.get("/healthz"), 200))
        matrix = MATRICES["problem"]["K"].replace("symmetric\n", "symmetric\n" + ("%" + " " * 900 + "\n") * 5).encode()
        expect(a.request("POST", "/v1/uploads", matrix), 503, "store_unavailable")
        place.start()
        found = a.wait_status(job, "successful", "failed")
        check(found["status"] == "successful" and found["attempts"] == 1, found)
        result_of(a, job)
        check(a.wait_status(small, "successful")["attempts"] == 1)
        # what a job needs from there it waits for, and may be told to end meanwhile
        upload = expect(until_back(lambda: a.request("POST", "/v1/uploads", matrix)), 201).json["id"]
        place.stop()
        body = {"problem": {**MATRICES["problem"], "K": {"upload": upload}}}
        refused = expect(a.post(body), 503, "store_unavailable")
        check(int(refused.headers["retry-after"]) > 0)
        place.start()
        long = a.post(service.ENDLESS).json["id"]
        a.wait_status(long, "running")
        first, second = (until_back(lambda: a.post(body)).json["id"] for _ in range(2))
        with place.failing("500", "GET"):
            a.request("DELETE", f"/v1/jobs/{long}")
            a.wait_status(first, "running")
            expect(a.get(f"/v1/uploads/{upload}", Accept="application/octet-stream"), 503, "store_unavailable")
            a.request("DELETE", f"/v1/jobs/{first}")
            check(a.wait_status(first, "dismissed", "successful", "failed")["status"] == "dismissed")
            a.wait_status(second, "running")
            time.sleep(1)
            check(a.get(f"/v1/jobs/{second}").json["status"] == "running")
        found = a.wait_status(second, "successful", "failed")
        check(found["status"] == "successful" and found["attempts"] == 1, found)


def test_a_history_tail_reads_its_end_only(s):
    body = {**SCENE, "solver": {"method": "uzawa", "max_iterations": 12000, "accuracy": {"relative_error": 1e-15}}}
    with daemons(s.build, 1) as ((a,), name, place):
        job = a.solve(body)["id"]
        rows = SERVER.sql(name, f"SELECT part, last, size, at, object FROM uzawa.placed WHERE job = '{job}' AND name = '/'"
                                " ORDER BY part")
        check(len(rows) > 1, "the history has one piece:", rows)
        whole = expect(a.get(f"/v1/jobs/{job}/history"), 200).json["rows"]
        place.seen.clear()
        after = int(float(rows[0][1]))
        tail = expect(a.get(f"/v1/jobs/{job}/history?after={after}"), 200).json["rows"]
        check(tail == whole[-len(tail):] and 0 < len(tail) < len(whole), len(tail), len(whole))
        ranges = [one[2] for one in place.seen if one[0] == "GET"]
        wanted = [f"bytes={at}-{int(at) + int(size) - 1}" for _, last, size, at, _ in rows[1:] if float(last) > after]
        check(ranges == wanted, ranges, wanted)


def test_a_start_says_what_is_wrong(s):
    with daemons(s.build, 1, start=False) as ((a,), _, place):
        def told(*options, **environment):
            run = subprocess.run(a.command("--listen", "127.0.0.1:0", "--db", a.db, "--objects", place.url(),
                                           "--object-region", object_store.REGION, *options), capture_output=True,
                                 text=True, timeout=PATIENT_S, check=False, env={**os.environ, **KEYS, **environment})
            check(run.returncode == 1, run)
            return run.stderr
        key_file = os.path.join(a.folder, "keys")
        check("SignatureDoesNotMatch" in told(AWS_SECRET_ACCESS_KEY="other"))
        check("InvalidAccessKeyId" in told(AWS_ACCESS_KEY_ID="other"))
        check("--object-key-file" in told(AWS_SECRET_ACCESS_KEY=""))
        check("NoSuchBucket" in told("--objects", place.url("other")))
        check("--object-region" in told("--object-region", "elsewhere"))
        check("cannot put" in told("--objects", "http://127.0.0.1:1/bucket"))
        check("BUCKET" in told("--objects", "ftp://127.0.0.1/bucket"))
        check("--store postgresql" in told("--db", os.path.join(a.folder, "file.db")))
        check("No such file" in told("--object-key-file", key_file))
        with open(key_file, "w", encoding="ascii") as file:
            file.write(f"{object_store.KEY} {object_store.SECRET}\n")
        os.chmod(key_file, 0o644)
        check("chmod 600" in told("--object-key-file", key_file))
        os.chmod(key_file, 0o600)
        a.options += ("--object-key-file", key_file)
        a.environment = {name: "" for name in KEYS}
        a.start()
        check(json.loads(result_of(a, solve(a)))["job"])


if __name__ == "__main__":
    service.main(globals())
