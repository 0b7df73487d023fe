"""Many clients at once. usage: test_concurrency.py BUILD_DIR [FILTER]"""
import copy
import http.client
import json
import os
import sqlite3
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, PUSHED_OFF, SCENE, check, expect, options, wait_until

ENERGY, REACTION_SUM = -3.9608186040e-3, -10.51371700  # of the scene
CLIENTS = 8


# ---------------------------------------------------------------- helpers

def together(count, work):
    """Runs work(i) in `count` threads that start at one moment; returns the results or raises the first failure."""
    barrier, results, failures = threading.Barrier(count), [None] * count, []

    def run(i):
        try:
            barrier.wait(timeout=PATIENT_S)
            results[i] = work(i)
        except Exception as why:  # noqa: raised again below
            failures.append(why)
    threads = [threading.Thread(target=run, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=120)
        check(not thread.is_alive(), "a client never came back")
    if failures:
        raise failures[0]
    return results


def scaled_scene(factor, cells=(30, 10), **solver):
    """All loads times `factor`: with no gap at the start u and r grow by it, and the energy by its square."""
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = list(cells)
    for load in request["problem"]["loads"]:
        load["traction"] = [factor * traction for traction in load["traction"]]
    return {**request, "solver": solver}


def near(got, want, relative=1e-8):
    return abs(got - want) <= relative * abs(want)


def delete(s, job_id):
    return s.request("DELETE", f"/v1/jobs/{job_id}")


# ---------------------------------------------------------------- one body, many loads

WORKERS = 4


def check_shared_factor(s, solver):
    """Every client gets its own answer from one factorization."""
    factors = [[1 + i + CLIENTS * round_ for round_ in range(4)] for i in range(CLIENTS)]
    summaries = together(CLIENTS, lambda i: [(factor, s.solve(scaled_scene(factor, **solver))["summary"])
                                             for factor in factors[i]])
    everything = [pair for pairs in summaries for pair in pairs]
    for factor, summary in everything:
        check(summary["outcome"] == "converged" and summary["contact"]["active"] == 22, factor, summary)
        check(near(summary["energy"]["primal"], factor ** 2 * ENERGY), factor, summary)
        check(near(summary["contact"]["reaction_sum"], factor * REACTION_SUM, 1e-7), factor, summary)
    fresh = [factor for factor, summary in everything if not summary["factor"]["cached"]]
    check(1 <= len(fresh) <= WORKERS, "factored for the loads", fresh)  # each process at most once

    def held_now():
        return expect(s.get("/v1/factors"), 200).json

    def is_all(held):  # a process that is at work for long is asked again
        return len(held["factors"]) == 1 and held["factors"][0]["hits"] == len(everything) - len(fresh)

    wait_until(lambda: is_all(held_now()))
    held = held_now()
    check(held["factors"][0]["d"] == 660 and held["factors"][0]["m"] == 30, held)
    check(0 < held["factors"][0]["bytes"] <= held["bytes"] <= held["max_bytes"], held)


@options("--workers", "4")
def test_one_factorization_condensed(s):
    check_shared_factor(s, {"operator": "condensed"})


@options("--workers", "4")
def test_one_factorization_factored(s):
    check_shared_factor(s, {"operator": "factored", "method": "auto" if service.INSTRUMENTED else "accelerated_restart"})


@options("--workers", "4")
def test_one_factorization_of_a_larger_body(s):
    """Each process factors once at most; none waits for another one's factor."""
    jobs = together(CLIENTS, lambda i: s.solve(scaled_scene(1 + i, (100, 33) if service.INSTRUMENTED else (200, 66))))
    fresh = sum(not job["summary"]["factor"]["cached"] for job in jobs)
    check(1 <= fresh <= WORKERS, fresh)
    energies = [job["summary"]["energy"]["primal"] / (1 + i) ** 2 for i, job in enumerate(jobs)]
    check(all(near(energy, energies[0]) for energy in energies) and near(energies[0], -3.9626e-3, 1e-3), energies)


@options("--workers", "4")
def test_one_factorization_of_matrices(s):
    """The springs under other loads: u2 = p2, and the stop holds the first wherever p1 > 1."""
    def work(i):
        out = []
        for p1 in (i, i + 0.5, -i):
            request = {"problem": {**MATRICES["problem"], "p": [p1, i]}}
            job = s.solve(request)
            out.append((p1, i, job, s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions").json))
        return out
    everything = [one for many in together(CLIENTS, work) for one in many]
    for p1, p2, job, result in everything:
        u, r = [min(p1 / 2, 0.5), p2], [-max(0, p1 - 1)]
        worst = max(abs(a - b) for a, b in zip(result["displacements"] + result["reactions"], u + r))
        check(worst < 1e-7, p1, p2, worst, job)
    fresh = sum(not job["summary"]["factor"]["cached"] for _, _, job, _ in everything)
    check(1 <= fresh <= WORKERS, fresh)


@options("--workers", "2")
def test_a_body_goes_where_it_was(s):
    """Two bodies, most likely in two processes; under other obstacles each finds its factor, also right after the last job."""
    def body(cells, depth, kinematics):
        request = scaled_scene(1, cells)
        obstacle = {"plane": {"point": [0, -depth], "normal": [0, 1]}}
        request["problem"].update(contacts=[{"on": "bottom", "obstacle": obstacle}], kinematics=kinematics)
        return request

    sizes = [(40, 12), (42, 12)]
    jobs = [s.post(body(cells, 0.001, "fixed")).json["id"] for cells in sizes]
    for job in jobs:
        s.wait_status(job, "successful")
    for i in range(1, 6):
        for cells in sizes:
            job = s.post(body(cells, 0.001 * i, ("fixed", "moving")[i % 2])).json["id"]
            factor = s.wait_status(job, "successful")["summary"]["factor"]
            check(factor["reused"]["factor"], i, cells, factor)


@options("--workers", "1")
def test_bodies_that_are_alike_share(s):
    """Another material has the pattern, other stops have K: the summary says what was there already."""
    def reused(K, N, h):
        problem = {**MATRICES["problem"], "K": K, "N": N, "h": h, "p": [4, 3]}
        summary = s.solve({"problem": problem})["summary"]
        check(summary["outcome"] == "converged", summary)
        return [name for name, was in summary["factor"]["reused"].items() if was]

    def K(scale):
        entries = "".join(f"{i} {j} {scale * v}\n" for i, j, v in [(1, 1, 2), (2, 1, -1), (2, 2, 3)])
        return "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n" + entries

    both = "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 2 1\n"
    one = "%%MatrixMarket matrix coordinate real general\n1 2 1\n1 2 1\n"
    check(reused(K(1), both, [0.5, 0.5]) == [])
    check(reused(K(1), both, [0.1, 0.5]) == ["assembly", "ordering", "factor", "operator"])
    check(reused(K(3), both, [0.5, 0.5]) == ["ordering"])
    check(reused(K(3), one, [0.5]) == ["ordering", "factor"])
    held = expect(s.get("/v1/factors"), 200).json
    check(len(held["factors"]) == 3 and held["bytes"] == sum(f["bytes"] for f in held["factors"]), held)


@options("--workers", "4", "--cache", "2M")
def test_small_cache_under_load(s):
    """More bodies than there is room for: factors come and go under their users, and no answer changes."""
    bodies = [(30 + 3 * i, 10 + i) for i in range(6)]
    alone = {cells: s.solve(scaled_scene(1, cells))["summary"]["energy"]["primal"] for cells in bodies}

    def work(i):
        for round_ in range(4 if service.INSTRUMENTED else 8):
            cells = bodies[(i + 5 * round_) % len(bodies)]
            summary = s.solve(scaled_scene(1 + i, cells))["summary"]
            check(near(summary["energy"]["primal"], (1 + i) ** 2 * alone[cells]), cells, alone[cells], summary)
    together(CLIENTS, work)
    held = s.get("/v1/factors").json  # what is in use may be more for a moment
    check(held["bytes"] <= held["max_bytes"] == 2 << 20, held)
    check(len(held["factors"]) < len(bodies), "nothing was ever put out")


@options("--workers", "4")
def test_unlike_jobs_at_once(s):
    """Every method and operator side by side, a body that fails among them: each gets what it gets alone."""
    broken = scaled_scene(1)
    broken["problem"].update(PUSHED_OFF)
    few_steps = ("auto", "active_set", "dual_active_set")
    kinds = [(method, "condensed") for method in ("uzawa", "accelerated", "auto")]
    kinds += [(method, "factored") for method in (few_steps if service.INSTRUMENTED else ("uzawa", "accelerated", "auto"))]
    requests = [scaled_scene(2, method=method, operator=operator) for method, operator in kinds] + [broken, MATRICES]
    jobs = together(CLIENTS, lambda i: [s.solve(requests[(i + k) % CLIENTS]) for k in range(3)])
    for i, three in enumerate(jobs):
        for k, job in enumerate(three):
            kind = (i + k) % CLIENTS
            if kind == 6:
                check(job["status"] == "failed" and job["error"]["code"] == "free_body", job)
            else:
                energy = -2.75 if kind == 7 else 4 * ENERGY
                check(near(job["summary"]["energy"]["primal"], energy), job)


# ---------------------------------------------------------------- cancel and wait

def wait_for_rows(s, job_id):
    """Until the job iterates."""
    s.wait_status(job_id, "running")
    deadline = time.monotonic() + PATIENT_S
    while not expect(s.get(f"/v1/jobs/{job_id}/history"), 200).json["rows"]:
        check(time.monotonic() < deadline, "no iteration yet", job_id)
        time.sleep(0.005)


@options("--workers", "2")
def test_cancel_queued_and_running(s):
    ids = [s.post(ENDLESS).json["id"] for _ in range(CLIENTS)]
    for job_id in ids[:2]:
        wait_for_rows(s, job_id)  # before the first there is no answer to keep
    check(all(s.get(f"/v1/jobs/{job_id}").json["status"] == "accepted" for job_id in ids[2:]), "more than two run")
    after = s.post(MATRICES).json["id"]

    def work(i):
        started = time.monotonic()
        reply = expect(delete(s, ids[i]), 200)
        job = s.wait_status(ids[i], "dismissed")
        check(reply.json["id"] == ids[i] and time.monotonic() - started < 40, job)
        return job
    jobs = together(CLIENTS, work)
    check(sum(job["attempts"] for job in jobs) >= 2, jobs)
    for job in jobs:
        if job["attempts"]:
            check(job["summary"]["outcome"] == "dismissed" and job["summary"]["certificate"], job)
            expect(s.get(f"/v1/jobs/{job['id']}/result"), 200)
        else:
            expect(s.get(f"/v1/jobs/{job['id']}/result"), 409, "no_result")
    check(s.wait_status(after, "successful")["summary"]["outcome"] == "converged", "the next job suffered")


@options("--workers", "2")
def test_cancel_races(s):
    """Many say stop to one job, while it waits, runs or ends: each is answered sensibly and it ends once."""
    for request in (ENDLESS, MATRICES, SCENE):
        for pause in (0.0, 0.002, 0.01):
            job_id = s.post(request).json["id"]
            time.sleep(pause)
            replies = together(CLIENTS, lambda i, job_id=job_id: delete(s, job_id))
            statuses = [reply.status for reply in replies]
            check(set(statuses) <= {200, 204, 404} and statuses.count(204) <= 1, statuses)
            reply = s.get(f"/v1/jobs/{job_id}", Prefer="wait=20")
            check(reply.status == 404 or reply.json["status"] in ("dismissed", "successful"), reply)
            check(204 not in statuses or reply.status == 404, "deleted, and there:", reply)
    check(s.solve(MATRICES)["status"] == "successful")


@options("--workers", "1")
def test_long_polls_wake(s):
    """All who wait for a job hear of its end at once, and those who wait for another one do not."""
    first, second, third = (s.post(request).json["id"] for request in (ENDLESS, ENDLESS, MATRICES))
    s.wait_status(first, "running")
    watched = [first] * 6 + [second] * 6 + [third] * 4
    woke = {}

    def work(i):
        if i == len(watched):
            time.sleep(0.5)
            for job_id in (second, first):
                woke[job_id] = time.monotonic()
                expect(delete(s, job_id), 200)
                time.sleep(0.5)
            return None
        reply = expect(s.get(f"/v1/jobs/{watched[i]}", Prefer="wait=60"), 200)
        return reply.json, time.monotonic()
    for i, result in enumerate(together(len(watched) + 1, work)[:-1]):
        job, when = result
        wanted = "successful" if watched[i] == third else "dismissed"
        check(job["id"] == watched[i] and job["status"] == wanted, job)
        cause = woke[first if watched[i] == third else watched[i]]
        check(0 <= when - cause < 40, watched[i], "woke", when - cause, "s after its cause, not after what it was to wait")


@options("--workers", "2")
def test_submit_and_wait_from_many(s):
    replies = together(16, lambda i: [s.post(MATRICES, {"Prefer": "wait=30"}) for _ in range(5)])
    for reply in (reply for many in replies for reply in many):
        check(expect(reply, 200).json["status"] == "successful", reply)
    check(expect(s.get("/readyz"), 200).json["jobs"]["successful"] == 80)


@options("--workers", "2")
def test_live_readers(s):
    """A running job's history read by many: rows ascend, none comes twice, and the tail is what the whole has."""
    job_id = s.post(ENDLESS).json["id"]
    s.wait_status(job_id, "running")
    until = time.monotonic() + PATIENT_S
    while not s.get(f"/v1/jobs/{job_id}/history").json["rows"] and time.monotonic() < until:
        time.sleep(0.05)

    def work(_):
        after, seen = -1, []
        for _ in range(10):
            connection = http.client.HTTPConnection(s.host, s.port, timeout=PATIENT_S)
            connection.request("GET", f"/v1/jobs/{job_id}/history?after={after}")
            rows = json.loads(connection.getresponse().read())["rows"]
            connection.close()
            seen += [row[0] for row in rows]
            after = int(seen[-1]) if seen else -1
        check(seen and all(a < b for a, b in zip(seen, seen[1:])), "rows do not ascend", len(seen))
    together(4, work)
    expect(delete(s, job_id), 200)
    s.wait_status(job_id, "dismissed")


# ---------------------------------------------------------------- lists

def pages(s, query=""):
    """The ids of a whole walk, page by page."""
    ids, cursor = [], None
    while True:
        page = expect(s.get(f"/v1/jobs?limit=7{query}" + (f"&cursor={cursor}" if cursor else "")), 200).json
        check(len(page["jobs"]) == 7 or page["next"] is None, "a short page that is not the last", page)
        ids += [job["id"] for job in page["jobs"]]
        cursor = page["next"]
        if cursor is None:
            return ids


@options("--workers", "2")
def test_paging_while_others_submit(s):
    """A walk sees every job that was there when it began, once, newest first, whatever comes meanwhile."""
    before = [s.post({**MATRICES, "tags": ["old"]}).json["id"] for _ in range(40)]
    stop = threading.Event()

    def work(i):
        if i < 4:
            made = []
            while not stop.is_set():
                made.append(s.post({**MATRICES, "tags": [f"new{i}"]}).json["id"])
            return made
        try:
            for query in ("", "&tag=old") * 2:
                ids = pages(s, query)
                check(ids == sorted(ids, reverse=True) and len(set(ids)) == len(ids), "out of order or twice")
                check(set(before) <= set(ids), "missed", set(before) - set(ids))
                check(query == "" or len(ids) == 40, "the filter let others in")
        finally:
            if i == 4:
                stop.set()
        return []
    made = together(6, work)
    for i in range(4):
        check(pages(s, f"&tag=new{i}") == sorted(made[i], reverse=True), "the list of", i, "is not what was made")
    check(sum(map(len, made)) > 20, "hardly anything was submitted meanwhile")
    check(sorted(pages(s)) == sorted(before + [job_id for many in made for job_id in many]))


@options("--workers", "2")
def test_paging_while_others_delete(s):
    ids = [s.post(MATRICES).json["id"] for _ in range(60)]
    for job_id in ids:
        s.wait_status(job_id, "successful")
    gone, kept = ids[::2], ids[1::2]

    def work(i):
        if i < 3:
            for job_id in gone[i::3]:
                expect(delete(s, job_id), 204)
            return
        for _ in range(4):
            seen = pages(s)
            check(set(kept) <= set(seen) and len(set(seen)) == len(seen), "a walk missed what stayed")
            for job_id in seen[:10]:
                check(s.get(f"/v1/jobs/{job_id}/result").status in (200, 404), job_id)
    together(5, work)
    check(sorted(pages(s)) == sorted(kept))


# ---------------------------------------------------------------- repeats

@options("--workers", "2")
def test_repeats_give_one_job(s):
    keys = [f"key {i}" for i in range(6)]
    replies = together(CLIENTS, lambda i: [s.post(SCENE, {"Idempotency-Key": keys[(i + k) % 6]}) for k in range(12)])
    ids = {key: set() for key in keys}
    for i, many in enumerate(replies):
        for k, reply in enumerate(many):
            check(reply.status in (200, 202), reply)
            check(reply.headers["location"] == f"/v1/jobs/{reply.json['id']}", reply)
            ids[keys[(i + k) % 6]].add(reply.json["id"])
    check(all(len(found) == 1 for found in ids.values()), ids)
    check(len(pages(s)) == 6, pages(s))
    for found in ids.values():
        check(s.wait_status(found.pop(), "successful")["attempts"] == 1, "a repeat ran it again")


@options("--workers", "2")
def test_one_key_with_unlike_bodies(s):
    """Of those who use one key for unlike bodies, one body wins and the others are told."""
    for round_ in range(4):
        replies = together(CLIENTS, lambda i, round_=round_: s.post(scaled_scene(1 + i % 2),
                                                                    {"Idempotency-Key": f"round {round_}"}))
        taken = [i for i, reply in enumerate(replies) if reply.status in (200, 202)]
        check(len(taken) == CLIENTS // 2 and len({i % 2 for i in taken}) == 1, [reply.status for reply in replies])
        check(len({replies[i].json["id"] for i in taken}) == 1, replies)
        for i, reply in enumerate(replies):
            if i not in taken:
                expect(reply, 422, "idempotency_key_reused")
    check(len(pages(s)) == 4)


def test_another_program_holds_the_database(s):
    """Nobody is told of a failure of the service, and what ran meanwhile is kept."""
    job = s.post({**SCENE, "solver": {"method": "uzawa", "alpha": 1e-9, "max_iterations": 1000000000, "time_limit_s": 0.5}}).json["id"]
    s.wait_status(job, "running")
    other = sqlite3.connect(s.file(), isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    reply = expect(s.post(MATRICES), 503, "store_locked")
    check(int(reply.headers["retry-after"]) > 0, reply)
    check(expect(s.get(f"/v1/jobs/{job}"), 200).json["status"] == "running")  # whose end waits
    other.execute("ROLLBACK")
    other.close()
    check(s.wait_status(job, "successful", "failed")["summary"]["outcome"] == "time_limit")
    check(s.solve(MATRICES)["status"] == "successful")


def test_the_database_goes_from_its_place(s):
    """What would be written to a file that no start finds again is not acknowledged."""
    kept = s.solve(MATRICES)["id"]
    os.rename(s.file(), s.file() + ".away")
    expect(s.post(MATRICES), 500, "store_error")
    check("replaced" in s.events("store_error")[-1]["cause"], s.log())
    time.sleep(1.1)
    expect(s.get("/readyz"), 503, "store_unavailable")
    expect(s.get(f"/v1/jobs/{kept}"), 200)
    os.rename(s.db + ".away", s.db)
    check(s.solve(MATRICES)["status"] == "successful")
    s.restart(15)
    check(len(s.get("/v1/jobs").json["jobs"]) == 2)


if __name__ == "__main__":
    service.main(globals())
