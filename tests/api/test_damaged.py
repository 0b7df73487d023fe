"""A bit that changes in the database file is found by its row's checksum: what is not what was written is never told as an
answer, and everything else goes on. usage: test_damaged.py BUILD_DIR [FILTER]
"""
# not under ThreadSanitizer: about a file, not about threads
import pathlib
import signal
import struct
import subprocess

import service
from service import ENDLESS, MATRICES, SCENE, check, expect, options


def change(s, old, new):
    """Changes the one place in the file of a stopped daemon that holds these bytes."""
    check(len(old) == len(new) and old != new, old, new)
    data = pathlib.Path(s.file()).read_bytes()
    check(data.count(old) == 1, old, data.count(old))
    pathlib.Path(s.file()).write_bytes(data.replace(old, new))


def stop(s):
    check(s.terminate() == 0, s.log())


def flipped(data, at, bit=0):
    return data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1:]


def doubles(values):
    return struct.pack(f"<{len(values)}d", *values)


def findings(s):
    done = subprocess.run(s.command("--check-db", "--db", s.file()), capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def check_named(reply, job):
    expect(reply, 500, "stored_data_damaged")
    check(job in reply.json["detail"], reply)


def test_a_vector(s):
    job, other = s.solve(SCENE)["id"], s.solve(MATRICES)["id"]
    path = f"/v1/jobs/{job}/result"
    gaps = doubles(s.get(path + "?fields=gaps").json["gaps"])
    stop(s)
    check(findings(s)[0] == 0, findings(s))
    change(s, gaps, flipped(gaps, 8 * 20 + 3, 5))
    code, text = findings(s)
    check(code != 0 and job in text and "gaps" in text and other not in text, code, text)
    s.start()
    check_named(s.get(path), job)
    check_named(s.get(path + "?fields=gaps"), job)
    check(len(s.get(path + "?fields=reactions").json["reactions"]) == 30)  # this one is as it was
    expect(s.get(f"/v1/jobs/{job}"), 200)
    expect(s.get(f"/v1/jobs/{other}/result"), 200)
    check(any(event["job"] == job for event in s.events("stored_data_damaged")), s.log())
    check_found = expect(s.request("POST", "/v1/admin/check"), 200).json
    check(not check_found["whole"] and any(job in one for one in check_found["findings"]), check_found)
    expect(s.request("DELETE", f"/v1/jobs/{job}"), 204)  # the way out
    stop(s)
    check(findings(s)[0] == 0, findings(s))
    s.start()


def test_the_name_of_a_vector(s):
    """One bit of it, and the vector is another one's: the answer must not come without."""
    job = s.solve(SCENE)["id"]
    stop(s)
    s.sql("UPDATE vector SET name = 'reactionr' WHERE name = 'reactions'")
    check("reactionr" in findings(s)[1], findings(s))
    s.start()
    check_named(s.get(f"/v1/jobs/{job}/result"), job)
    check_named(s.get(f"/v1/jobs/{job}/result?fields=reactions"), job)
    expect(s.get(f"/v1/jobs/{job}/result?fields=gaps"), 200)
    stop(s)
    s.sql("DELETE FROM vector WHERE name = 'gaps'")
    check("missing" in findings(s)[1], findings(s))
    s.start()
    check_named(s.get(f"/v1/jobs/{job}/result?fields=gaps"), job)


@options("--workers", "1")
def test_a_log_that_was_cut(s):
    """To SQLite a write-ahead log without its end is one that ends there: what was acknowledged would be gone unsaid."""
    kept = s.solve(MATRICES)["id"]
    wal = pathlib.Path(s.file() + "-wal")
    size = wal.stat().st_size
    lost = [s.post(MATRICES, {"Prefer": "wait=30"}).json["id"] for _ in range(3)]
    s.terminate(number=signal.SIGKILL)
    with open(wal, "r+b") as file:
        file.truncate(size)
    code, text = findings(s)
    check(code != 0 and all(one in text for one in lost) and "write-ahead log" in text, text)
    s.start()
    missing = s.events("commits_missing")
    check(len(missing) == 1 and missing[0]["level"] == "error" and all(f"submitted {one}" in missing[0]["cause"] for one in lost), missing)
    check(kept not in missing[0]["cause"] and s.get(f"/v1/jobs/{kept}").status == 200, missing)
    s.solve(MATRICES)  # it goes on, and says it once
    s.restart()
    check(len(s.events("commits_missing")) == 1, s.log())
    stop(s)
    check(findings(s)[0] == 0, findings(s))
    s.start()


@options("--workers", "1")
def test_an_upload(s):
    """A matrix on disk that is another one now is no matrix of anybody's problem."""
    text = MATRICES["problem"]["K"].encode()
    upload = s.request("POST", "/v1/uploads", text).json["id"]
    body = {"problem": {**MATRICES["problem"], "K": {"upload": upload}}}
    running = s.post(ENDLESS).json["id"]  # the only worker: the next job waits
    s.wait_status(running, "running")
    waits = s.post(body).json["id"]
    file = pathlib.Path(s.file() + "-uploads") / upload
    file.write_bytes(text.replace(b"1 1 2", b"1 1 9"))
    refused = expect(s.post(body), 500, "stored_data_damaged")
    check(refused.json["pointer"] == "/problem/K/upload" and "again" in refused.json["detail"], refused)
    expect(s.get(f"/v1/uploads/{upload}", Accept="application/octet-stream"), 500, "stored_data_damaged")
    s.request("DELETE", f"/v1/jobs/{running}")
    job = s.wait_status(waits, "failed", "successful")
    check(job["status"] == "failed" and job["error"]["code"] == "stored_data_damaged", job)
    found = expect(s.request("POST", "/v1/admin/check"), 200).json
    check(not found["whole"] and any(upload in one for one in found["findings"]), found)
    check(findings(s)[0] != 0, findings(s))
    expect(s.request("POST", "/v1/uploads", text), 200)  # the way out
    check(s.solve(body)["summary"]["outcome"] == "converged")
    check(findings(s)[0] == 0, findings(s))


@options("--workers", "1")
def test_an_upload_that_was_solved(s):
    """A mesh that a process has read and keeps stands for a file that is there and what it was."""
    text = b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n$Elements\n" \
           b"3\n1 1 0 1 2\n2 2 0 1 2 3\n3 2 0 2 4 3\n$EndElements\n$Comments\n" + (1 << 20) * b"x" + b"\n$EndComments\n"
    upload = s.request("POST", "/v1/uploads", text).json["id"]
    body = {"problem": {"kind": "scene", "model": "plane_strain", "mesh": {"gmsh": {"upload": upload}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": {"where": {"y": 0}}, "ux": 0, "uy": 0}],
                        "loads": [{"on": "all", "body_force": [0, -1]}]}}
    first = s.solve(body)
    again = s.solve(body)
    check(first["summary"]["energy"] == again["summary"]["energy"], first, again)
    other = s.request("POST", "/v1/uploads", text + b"\n").json["id"]  # another file of the same mesh has its body
    same = s.solve({"problem": {**body["problem"], "mesh": {"gmsh": {"upload": other}}}})
    check(same["summary"]["factor"]["cached"], same)
    running = s.post(ENDLESS).json["id"]  # the only worker: the next job waits
    s.wait_status(running, "running")
    waits = s.post(body).json["id"]
    file = pathlib.Path(s.file() + "-uploads") / upload
    file.write_bytes(text.replace(b"4 1 1 0", b"4 1 2 0"))
    s.request("DELETE", f"/v1/jobs/{running}")
    job = s.wait_status(waits, "failed", "successful")
    check(job["status"] == "failed" and job["error"]["code"] == "stored_data_damaged", job)


def test_a_start(s):
    """A run does not begin where a damaged one ended."""
    job = s.solve(SCENE)["id"]
    reactions = doubles(s.get(f"/v1/jobs/{job}/result").json["reactions"])
    stop(s)
    data = pathlib.Path(s.file()).read_bytes()
    at = data.index(reactions)  # the state holds them too
    pathlib.Path(s.file()).write_bytes(flipped(data, at + 8 * 3 + 1))
    s.start()
    named = s.get(f"/v1/jobs/{job}/result?fields=reactions").status == 500
    warm = s.post({**SCENE, "solver": {**SCENE["solver"], "warm_start": {"job": job}}})
    if named:
        check_named(warm, job)
    else:  # it was the state: the run begins at zero, and ends where it did
        check(s.wait_status(warm.json["id"], "successful")["summary"]["outcome"] == "converged", warm)


def test_a_history(s):
    job = s.solve(SCENE)["id"]
    rows = s.get(f"/v1/jobs/{job}/history").json["rows"]
    some = b"".join(struct.pack("<d", x) for x in rows[5] if x is not None)[:40]
    stop(s)
    change(s, some, flipped(some, 26, 3))
    check("history" in findings(s)[1], findings(s))
    s.start()
    check_named(s.get(f"/v1/jobs/{job}/history"), job)
    check_named(s.get(f"/v1/jobs/{job}/history.csv"), job)
    expect(s.get(f"/v1/jobs/{job}/result"), 200)


def test_a_summary(s):
    """A digit of a certificate."""
    job, other = s.solve(SCENE), s.solve(MATRICES)
    stop(s)
    data = pathlib.Path(s.file()).read_bytes()
    old = b'"iterations":' + str(job["summary"]["iterations"]).encode()
    check(data.count(old) == 1, old)
    change(s, old, flipped(old, len(old) - 1))
    s.start()
    path = f"/v1/jobs/{job['id']}"
    for of_it in ("", "/result", "/history", "/events", "/result.vtu", "/deformed.svg"):
        check_named(s.get(path + of_it), job["id"])
    check_named(s.request("POST", path + "/refine", {"accuracy": {"relative_error": 1e-9}}), job["id"])
    listed = {one["id"]: one for one in s.get("/v1/jobs").json["jobs"]}
    check(listed[job["id"]]["summary"] is None and listed[job["id"]]["error"]["code"] == "stored_data_damaged", listed)
    check(listed[other["id"]] == other, listed)


def test_the_summary_of_a_case(s):
    cases = [{"name": "one", "loads": SCENE["problem"]["loads"]}, {"name": "two", "loads": SCENE["problem"]["loads"][:1]}]
    job = s.solve({**SCENE, "cases": cases})["id"]
    two = s.get(f"/v1/jobs/{job}/result?case=two").json["summary"]
    stop(s)
    old = b'"iterations":%d,' % two["iterations"]
    data = pathlib.Path(s.file()).read_bytes()
    at = data.rindex(old) if data.count(old) else -1
    check(at >= 0)
    pathlib.Path(s.file()).write_bytes(flipped(data, at + len(old) - 2))
    s.start()
    replies = [s.get(f"/v1/jobs/{job}" + one) for one in ("/result?case=one", "/result?case=two", "/result", "")]
    bad = [one for one in replies if one.status == 500]
    check(bad, replies)
    for one in bad:
        check_named(one, job)


@options("--workers", "1")
def test_a_request(s):
    """A problem that is not the one that was sent is not solved; those behind it are."""
    first = s.post(ENDLESS).json["id"]
    s.wait_status(first, "running")
    damaged = s.post({**MATRICES, "tags": ["damaged-one"]}).json["id"]
    behind = s.post(MATRICES).json["id"]
    s.terminate(number=signal.SIGKILL)
    body, = s.sql("SELECT body FROM request WHERE job = ?", (damaged,))[0]  # also what stands in the journal
    check(b"[2, 2]" in body)
    s.sql("UPDATE request SET body = ? WHERE job = ?", (body.replace(b"[2, 2]", b"[2, 3]"), damaged))
    s.sql("UPDATE job SET status = 4 WHERE id = ?", (first,))
    s.start()
    failed = s.wait_status(damaged, "failed")
    check(failed["error"]["code"] == "stored_data_damaged" and failed["summary"] is None, failed)
    check(s.wait_status(behind, "successful")["summary"]["outcome"] == "converged")


if __name__ == "__main__":
    service.main(globals())
