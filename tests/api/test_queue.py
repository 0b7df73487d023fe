"""Which jobs run first, which wait too long, which are listed, and which are kept."""
import contextlib
import datetime
import http.client
import json
import os
import pathlib
import signal
import sqlite3
import tempfile
import threading
import time
import urllib.parse

import service
from service import ENDLESS, MATRICES, SCENE, check, expect, options, wait_until


def ids(reply):
    return [job["id"] for job in expect(reply, 200).json["jobs"]]


def listed(s, **query):
    return ids(s.get("/v1/jobs?" + urllib.parse.urlencode(query, doseq=True)))


# -------------------------------------------------------------------- list

def test_list_by_time_and_order(s):
    jobs = []
    for i in range(5):
        jobs.append(s.solve(MATRICES))
        time.sleep(0.005)
    all_ids, times = [job["id"] for job in jobs], [job["created"] for job in jobs]
    check(len(set(times)) == 5, times)
    check(listed(s, order="asc") == all_ids and listed(s, order="desc") == listed(s) == all_ids[::-1])
    page = s.get("/v1/jobs?order=asc&limit=2").json
    seen = [job["id"] for job in page["jobs"]]
    while page["next"]:
        page = s.get(f"/v1/jobs?order=asc&limit=2&cursor={page['next']}").json
        seen += [job["id"] for job in page["jobs"]]
    check(seen == all_ids, seen)
    check(listed(s, until=times[3])[-1] == all_ids[0] and all_ids[4] not in listed(s, until=times[3]))
    later = datetime.datetime.fromisoformat(times[2].replace("Z", "+00:00")) + datetime.timedelta(milliseconds=1)
    zone = datetime.timezone(datetime.timedelta(hours=5, minutes=30))
    for text in (later.isoformat().replace("+00:00", "Z"), later.astimezone(zone).isoformat(),
                 later.isoformat().replace("+00:00", "z").replace("T", "t")):
        check(listed(s, since=text) == all_ids[:2:-1], text, listed(s, since=text))
        check(listed(s, since=text, status="successful", order="asc") == all_ids[3:], text)
    check(ids(s.get(f"/v1/jobs?since={later.astimezone(zone).isoformat()}")) == all_ids[:2:-1])  # '+' not escaped
    check(listed(s, since="2099-01-01T00:00:00Z") == [] and listed(s, until="1999-01-01T00:00:00-11:00") == [])
    for first in ("1970-01-01T00:00:00Z", "1969-12-31T23:59:59Z", "0001-01-01T00:00:00Z"):
        check(listed(s, until=first) == [] and listed(s, since=first) == all_ids[::-1], first)
    for key in ("since", "until"):
        for wrong in ("", "yesterday", "2026-01-31", "2026-02-30T00:00:00Z", "2026-01-31T24:00:00Z", "1769860800",
                      "2026-01-31T12:00:00", "2026-01-31T12:00:00.Z", "2026-01-31T12:00:00+1:00", "2026-13-01T00:00:00Z"):
            expect(s.get(f"/v1/jobs?{urllib.parse.urlencode({key: wrong})}"), 400, "bad_parameter")
    expect(s.get("/v1/jobs?order=up"), 400, "bad_parameter")


def test_list_by_tags(s):
    tags = [["a"], ["a", "b"], ["b", "c"], ["a", "b", "c", "d"], []]
    jobs = [s.solve({**MATRICES, "tags": one})["id"] for one in tags]
    for wanted in (["a"], ["a", "b"], ["b", "a"], ["c", "b"], ["a", "b", "c", "d"], ["a", "x"], ["d", "d"]):
        have = [jobs[i] for i in range(5) if set(wanted) <= set(tags[i])]
        check(listed(s, tag=wanted, order="asc") == have, wanted)
        check(listed(s, tag=wanted, status="successful") == have[::-1], wanted)
        check(listed(s, tag=wanted, status="failed") == [], wanted)
    expect(s.get("/v1/jobs?tag=a&tag=b&tag=c&tag=d&tag=e"), 400, "bad_parameter")
    expect(s.get("/v1/jobs?status=failed&status=failed"), 400, "repeated_parameter")


# ------------------------------------------------------------------- queue

@options("--workers", "1")
def test_priorities(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    wanted = [(0, 2), (-10, 5), (10, 0), (0, 3), (5, 1), (-1, 4)]
    jobs = [s.post({**MATRICES, "priority": priority}).json for priority, _ in wanted]
    check([job["priority"] for job in jobs] == [priority for priority, _ in wanted], jobs)
    s.request("DELETE", f"/v1/jobs/{first['id']}")
    ended = [s.get(f"/v1/jobs/{job['id']}", Prefer="wait=30").json for job in jobs]
    ran = [event["job"] for event in s.events("job_started")]  # in the order of their lines: times may be equal
    order = sorted(range(6), key=lambda i: ran.index(jobs[i]["id"]))
    check(all(job["status"] == "successful" for job in ended), ended)
    check([wanted[i][1] for i in order] == list(range(6)), order)
    check("priority" in s.get(f"/v1/jobs/{first['id']}").json)


# ------------------------------------------------------------------ shares

TOKENS = {"many": "many-" + "1" * 16, "one": "one-" + "2" * 16, "boss": "boss-" + "3" * 16}
FOLDER = tempfile.TemporaryDirectory(prefix="uzawad-queue-")
TOKEN_FILE = pathlib.Path(FOLDER.name, "tokens")
TOKEN_FILE.write_text("".join(f"{name} {'admin' if name == 'boss' else 'submit'} {secret}\n" for name, secret in TOKENS.items()))
TOKEN_FILE.chmod(0o600)


def queue_of(s, share, client, count, body):
    """So many jobs of one client wait in the database of a daemon that is not running."""
    s.start()
    check(s.end() == 0)
    s.process.stdout.close()
    s.log_file.close()
    with contextlib.closing(sqlite3.connect(s.file())) as db, db:
        names = [f"{i:012x}{0:04x}{i:016x}" for i in range(1, count + 1)]
        db.executemany("INSERT INTO job(id, status, created, tags, client, share, small) VALUES(?, 0, 1e9, '[]', ?, ?, 1)",
                       [(name, client, share) for name in names])
        db.executemany("INSERT INTO request(job, body) VALUES(?, ?)", [(name, json.dumps(body).encode()) for name in names])
    s.start()


def ask_from(s, address, method, path, body=None):
    connection = http.client.HTTPConnection(s.host, s.port, timeout=60, source_address=(address, 0))
    with contextlib.closing(connection):
        connection.request(method, path, json.dumps(body) if body else None, {"Content-Type": "application/json"} if body else {})
        return json.loads(connection.getresponse().read())


def check_turn(s, job, seconds=40):
    """Hardly anybody had a turn while it waited: those that workers had taken by then, and that in time."""
    times = [datetime.datetime.fromisoformat(job[name].replace("Z", "+00:00")).timestamp() for name in ("created", "started")]
    check(job["status"] == "successful" and times[1] - times[0] < seconds, job)  # 0.01 s, or 1 s in a lane that is taken, ten times as long with a sanitizer
    between = s.sql("SELECT count(*) FROM job WHERE started > ? AND started < ?", times)[0][0]
    check(between <= 2 * (os.cpu_count() + 1), between)


@options(None)
def test_one_job_beside_ten_thousand_by_token(s):
    s.options = ("--token-file", str(TOKEN_FILE))
    queue_of(s, "many", "many", 10000, SCENE)
    for _ in range(3):
        reply = s.post(MATRICES, {"Authorization": "Bearer " + TOKENS["one"], "Prefer": "wait=30"})
        check_turn(s, expect(reply, 200).json)
    left = s.request("GET", "/healthz").json["jobs"]["accepted"]
    check(left > 1000, "nobody else was waiting any more", left)


@options(None)
def test_one_job_beside_ten_thousand_by_address(s):
    queue_of(s, "7f000001", "", 10000, SCENE)
    mine = s.post(MATRICES).json
    for _ in range(3):
        job = ask_from(s, "127.0.0.2", "POST", "/v1/jobs", MATRICES)
        while job["status"] in ("accepted", "running"):
            job = ask_from(s, "127.0.0.2", "GET", f"/v1/jobs/{job['id']}")
        check_turn(s, job)
    check(s.get(f"/v1/jobs/{mine['id']}").json["status"] == "accepted")  # behind the others of its address
    check("\nuzawad_queue_clients 1\n" in s.get("/metrics").body.decode(), [x for x in s.get("/metrics").body.decode().splitlines() if "queue" in x])


@options("--token-file", str(TOKEN_FILE), "--workers", "1")
def test_who_may_go_before_others(s):
    for query in ("", "?validate=true"):
        for name, status in (("one", 403), ("boss", 202 if not query else 200)):
            reply = s.request("POST", "/v1/jobs" + query, {**MATRICES, "priority": 6}, {"Authorization": "Bearer " + TOKENS[name]})
            check(reply.status == status, name, reply)
            if status == 403:
                check(reply.json["code"] == "insufficient_scope" and reply.json["pointer"] == "/priority", reply)
    expect(s.post({**MATRICES, "priority": 5}, {"Authorization": "Bearer " + TOKENS["one"]}), 202)


# Too large to be taken for a small one.
LARGE = {**ENDLESS, "problem": {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": [150, 50], "element": "quad4"}}}}


@options("--workers", "1", "--lanes", "1")
def test_small_jobs_have_a_lane(s):
    """They go past a large one that runs; what only seemed small is put back, and does not hold up the others."""
    large = s.post(LARGE).json["id"]
    s.wait_status(large, "running")
    check(s.solve(MATRICES)["status"] == "successful")
    seemed = s.post(ENDLESS).json["id"]
    s.wait_status(seemed, "running")
    after = s.post(MATRICES).json["id"]
    ended = s.get(f"/v1/jobs/{after}", Prefer="wait=30").json
    check_turn(s, ended)
    job = s.get(f"/v1/jobs/{seemed}").json
    check(job["status"] == "accepted" and job["attempts"] == 0, job)
    s.request("DELETE", f"/v1/jobs/{large}")
    s.wait_status(seemed, "running")
    s.request("DELETE", f"/v1/jobs/{seemed}")
    s.wait_status(seemed, "dismissed")
    check(s.get(f"/v1/jobs/{seemed}").json["attempts"] == 1)
    told = s.get("/metrics").body.decode()
    check("\nuzawad_lane_jobs_total 3\n" in told and "\nuzawad_lane_jobs_returned_total 1\n" in told, told)


def test_bad_values(s):
    for key, wrong, code in (("priority", 11, "out_of_range"), ("priority", -11, "out_of_range"),
                             ("priority", 0.5, "wrong_type"), ("priority", "high", "wrong_type"),
                             ("queue_limit_s", 0, "out_of_range"), ("queue_limit_s", -1, "out_of_range"),
                             ("queue_limit_s", None, "wrong_type")):
        check(expect(s.post({**MATRICES, key: wrong}), 422, code).json["pointer"] == "/" + key, key, wrong)


@options("--workers", "1")
def test_queue_limit(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    short = s.post({**MATRICES, "queue_limit_s": 0.2}).json
    long = s.post({**MATRICES, "queue_limit_s": 60}).json
    started = time.monotonic()
    ended = s.get(f"/v1/jobs/{short['id']}", Prefer="wait=30").json  # whoever waits is told
    check(ended["status"] == "failed" and ended["error"]["code"] == "queue_time_limit", ended)
    check(time.monotonic() - started < 25 and ended["started"] is None and ended["finished"], ended)
    expect(s.get(f"/v1/jobs/{short['id']}/result"), 409, "job_failed")
    s.request("DELETE", f"/v1/jobs/{first['id']}")
    check(s.get(f"/v1/jobs/{long['id']}", Prefer="wait=30").json["status"] == "successful")


@options("--workers", "1")
def test_a_limit_that_passed_while_the_service_was_down(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    job = s.post({**MATRICES, "queue_limit_s": 0.3}).json
    s.terminate(number=9)
    time.sleep(0.4)
    s.start()
    check(s.get(f"/v1/jobs/{job['id']}", Prefer="wait=30").json["error"]["code"] == "queue_time_limit")
    s.request("DELETE", f"/v1/jobs/{first['id']}")


@options("--workers", "1", "--max-queue", "2")
def test_full_queue(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    key = {"Idempotency-Key": "x"}
    waiting = [expect(s.post(MATRICES, key), 202).json, expect(s.post(MATRICES), 202).json]
    reply = expect(s.post(MATRICES), 503, "queue_full")
    check(int(reply.headers["retry-after"]) > 0, reply)
    check(expect(s.post(MATRICES, key), 202).json["id"] == waiting[0]["id"])  # a repeat is no new job
    expect(s.request("DELETE", f"/v1/jobs/{waiting[1]['id']}"), 200)
    expect(s.post(MATRICES), 202)
    expect(s.post(MATRICES), 503, "queue_full")
    s.request("DELETE", f"/v1/jobs/{first['id']}")


@options("--workers", "1", "--max-queue", "5")
def test_full_queue_race(s):
    first = s.post(ENDLESS).json
    s.wait_status(first["id"], "running")
    statuses = []
    threads = [threading.Thread(target=lambda: statuses.append(s.post(MATRICES).status)) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    check(sorted(statuses) == [202] * 5 + [503] * 11, statuses)
    s.request("DELETE", f"/v1/jobs/{first['id']}")


# --------------------------------------------------------------- retention

@options("--keep-jobs", "3")
def test_keep_jobs(s):
    jobs = [s.solve(MATRICES)["id"] for _ in range(6)]
    endless = s.post(ENDLESS).json["id"]
    wait_until(lambda: listed(s, status="successful") == jobs[:2:-1])
    check(s.get(f"/v1/jobs/{endless}").json["status"] in ("accepted", "running"))
    expect(s.get(f"/v1/jobs/{jobs[0]}/result"), 404, "not_found")
    expect(s.get(f"/v1/jobs/{jobs[5]}/result"), 200)
    s.request("DELETE", f"/v1/jobs/{endless}")


@options(None)
def test_keep_days(s):
    s.start()
    jobs = [s.solve(MATRICES)["id"] for _ in range(2)]
    s.terminate()
    s.sql("UPDATE job SET finished = finished - 86400 WHERE id = ?", (jobs[0],))
    s.options = ("--keep-days", "0.5")
    s.start()
    wait_until(lambda: listed(s) == [jobs[1]])


@options(None)
def test_keep_bytes(s):
    s.start()
    jobs = [s.solve(MATRICES)["id"] for _ in range(4)]
    s.terminate()
    sizes = [s.sql("SELECT bytes FROM job WHERE id = ?", (one,))[0][0] for one in jobs]
    (body, data), = s.sql("SELECT length(body), (SELECT sum(length(data)) FROM vector WHERE job = ?1)"
                          " + (SELECT sum(length(data)) FROM history WHERE job = ?1) FROM request WHERE job = ?1", (jobs[0],))
    check(sizes[0] == body + data and body > 0 and data > 0, sizes, body, data)
    s.options = ("--keep-bytes", str(sum(sizes[2:]) + 1))
    s.start()
    wait_until(lambda: listed(s) == [jobs[3], jobs[2]])


@options(None)
def test_an_upload_goes_after_its_job(s):
    s.start()
    text = MATRICES["problem"]["K"].encode()
    one = s.request("POST", "/v1/uploads", text).json["id"]
    s.solve({"problem": {**MATRICES["problem"], "K": {"upload": one}}})
    s.options = ("--keep-jobs", "1", "--upload-days", "0.000001")  # from here on: before, it could go before its job came
    s.restart(signal.SIGTERM)
    check(s.get(f"/v1/uploads/{one}").json["used_by"] == 1)
    s.solve(MATRICES)
    wait_until(lambda: s.get(f"/v1/uploads/{one}").status == 404)


def test_a_result_is_whole_or_gone(s):
    """A job may be deleted while its result is read: never is a part of it passed off as all."""
    wrong, whole = [], []

    def read(job_id, stop):
        while not stop.is_set():
            reply = s.get(f"/v1/jobs/{job_id}/result?fields=reactions,gaps,displacements")
            if reply.status == 404:
                return
            complete = all(name in reply.json for name in ("reactions", "gaps", "displacements"))
            (whole if complete else wrong).append(reply)
    for _ in range(25):
        job_id, stop = s.solve(MATRICES)["id"], threading.Event()
        threads = [threading.Thread(target=read, args=(job_id, stop)) for _ in range(4)]
        for thread in threads:
            thread.start()
        time.sleep(0.01)
        expect(s.request("DELETE", f"/v1/jobs/{job_id}"), 204)
        for thread in threads:
            thread.join(10)
        stop.set()
    check(not wrong and whole, len(wrong), len(whole), wrong[:1])


if __name__ == "__main__":
    service.main(globals())
