"""Texts that are sent once and named by their digest: /v1/uploads and {"upload": id} in requests."""
import gzip
import hashlib
import os
import pathlib
import random
import resource
import signal
import threading
import time

import gmsh_files
import service
from service import MATRICES, PATIENT_S, ROOT, Skip, check, expect, options

K, N = (MATRICES["problem"][name].encode() for name in "KN")
VECTOR = b"%%MatrixMarket matrix array real general\n2 1\n2\n2\n"


def digest(text):
    return hashlib.sha256(text).hexdigest()


def send(s, text, **headers):
    return s.request("POST", "/v1/uploads", text, {name.replace("_", "-"): value for name, value in headers.items()})


def folder(s):
    return pathlib.Path(s.file() + "-uploads")


def files(s):
    return s.kept_uploads()


def with_uploads(**ids):
    return {"problem": {**MATRICES["problem"], **{name: {"upload": one} for name, one in ids.items()}}}


def test_send_read_delete(s):
    reply = expect(send(s, K), 201)
    check(reply.json["id"] == digest(K) and reply.json["bytes"] == len(K) and reply.json["used_by"] == 0, reply)
    path = reply.headers["location"]
    check(path == f"/v1/uploads/{digest(K)}", reply)
    again = expect(send(s, K, Content_Type="text/x-matrix-market"), 200)
    check(again.json["id"] == digest(K) and again.json["created"] == reply.json["created"], again)
    check(expect(s.get(path), 200).json["bytes"] == len(K))
    raw = expect(s.get(path, Accept="application/octet-stream"), 200)
    check(raw.body == K and raw.headers["content-type"] == "application/octet-stream", raw)
    head = expect(s.request("HEAD", path, headers={"Accept": "application/octet-stream"}), 200)
    check(head.body == b"" and head.headers["content-length"] == str(len(K)), head)
    check(files(s) == [digest(K)], files(s))
    expect(s.request("DELETE", path), 204)
    check(files(s) == [], files(s))
    for method in ("GET", "DELETE"):
        expect(s.request(method, path), 404, "not_found")
    expect(s.get("/v1/uploads/" + digest(K).upper()), 404, "not_found")
    expect(s.get("/v1/uploads"), 405, "method_not_allowed")


def test_gzip(s):
    squeezed = gzip.compress(K)
    check(expect(send(s, squeezed, Content_Encoding="gzip"), 201).json["id"] == digest(K))
    check(expect(send(s, squeezed), 201).json["id"] == digest(squeezed))
    two = gzip.compress(K[:20]) + gzip.compress(K[20:])  # members follow one another
    check(expect(send(s, two, Content_Encoding="x-gzip"), 200).json["id"] == digest(K))
    for wrong in (K, squeezed[:-3], squeezed + b"x", squeezed[:10], squeezed[:-6] + bytes(6)):
        expect(send(s, wrong, Content_Encoding="gzip"), 400, "bad_gzip")
    expect(send(s, K, Content_Encoding="br"), 415, "content_encoding")
    for two in ((b"gzip", b"gzip"), (b"identity", b"gzip")):  # one list of codings (RFC 9110, section 5.3)
        fields = b"".join(b"Content-Encoding: " + one + b"\r\n" for one in two)
        data, _ = s.raw(b"POST /v1/uploads HTTP/1.1\r\nHost: x\r\nConnection: close\r\n" + fields +
                        b"Content-Length: %d\r\n\r\n" % len(squeezed) + squeezed)
        check(service.head_of(data)[0] == 415, data)
    check(expect(send(s, squeezed, Content_Encoding="gzip "), 200).json["id"] == digest(K))
    expect(send(s, b""), 400, "empty_upload")
    check(len(files(s)) == 2, files(s))


@options("--max-upload", "1M")
def test_limit_of_one(s):
    expect(send(s, bytes(1 << 20)), 201)
    expect(send(s, bytes((1 << 20) + 1)), 413, "body_too_large")
    expect(send(s, iter([bytes(1 << 20), b"x"])), 413)  # chunked: the length is not known before
    bomb = gzip.compress(bytes(50 << 20))
    check(len(bomb) < 1 << 20)
    expect(send(s, bomb, Content_Encoding="gzip"), 413, "upload_too_large")
    check(len(files(s)) == 1, files(s))


@options("--uploads", "100K")
def test_limit_of_all(s):
    expect(send(s, bytes(60000)), 201)
    expect(send(s, bytes(50000)), 507, "uploads_full")  # the first was used too lately to make room
    s.terminate()
    s.sql("UPDATE upload SET used = used - 3600")
    s.start()
    expect(send(s, bytes(50000)), 201)
    check(files(s) == [digest(bytes(50000))], files(s))
    expect(s.get(f"/v1/uploads/{digest(bytes(60000))}"), 404, "not_found")


def test_a_full_disk(s):
    """What is refused in the middle of a body says when to come again."""
    s.file()  # what is half written lies beside it
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (100000, resource.RLIM_INFINITY))
    reply = expect(send(s, bytes(1000000)), 507, "storage_full")
    check(int(reply.headers["retry-after"]) > 0, reply)
    check(not files(s), files(s))


def test_in_a_job(s):
    plain = s.solve(MATRICES)
    for text in (K, N, VECTOR):
        expect(send(s, text), 201)
    body = {**with_uploads(K=digest(K), N=digest(N), p=digest(VECTOR)), "cases": [{"name": "a", "p": [2, 2]},
                                                                            {"name": "b", "p": {"upload": digest(VECTOR)}}]}
    job = s.solve(body)
    check(job["summary"]["outcome"] == "converged", job)
    one = s.get(f"/v1/jobs/{job['id']}/result?case=b").json
    check(one["reactions"] == s.get(f"/v1/jobs/{plain['id']}/result").json["reactions"], one)
    upload = s.get(f"/v1/uploads/{digest(VECTOR)}").json
    check(upload["used_by"] == 1, upload)
    expect(s.request("DELETE", f"/v1/uploads/{digest(VECTOR)}"), 409, "upload_in_use")
    refined = s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": "exact"}, {"Prefer": "wait=30"})
    check(expect(refined, 200).json["summary"]["outcome"] == "converged", refined)
    check(s.get(f"/v1/uploads/{digest(K)}").json["used_by"] == 2)
    for one in (job, refined.json):
        expect(s.request("DELETE", f"/v1/jobs/{one['id']}"), 204)
    expect(s.request("DELETE", f"/v1/uploads/{digest(VECTOR)}"), 204)


def test_in_verify(s):
    expect(send(s, K), 201)
    answer = {"displacements": [0.5, 2], "reactions": [-1]}
    reply = s.request("POST", "/v1/verify", {**with_uploads(K=digest(K)), "answer": answer})
    check(expect(reply, 200).json["summary"]["outcome"] == "verified", reply)
    u = b"%%MatrixMarket matrix array real general\n2 1\n0.5\n2\n"
    answer["displacements"] = {"upload": expect(send(s, u), 201).json["id"]}
    reply = s.request("POST", "/v1/verify", {**with_uploads(K=digest(K)), "answer": answer})
    check(expect(reply, 200).json["summary"]["outcome"] == "verified", reply)
    answer["displacements"] = {"upload": "0" * 64}
    reply = expect(s.request("POST", "/v1/verify", {**MATRICES, "answer": answer}), 422, "unknown_upload")
    check(reply.json["pointer"] == "/answer/displacements/upload", reply)


DISC = (ROOT / "tests/data/meshes/skfem_mixedtriquad.msh").read_bytes()


def disc(gmsh):
    """A disc on springs that is pulled down onto a plane close below it."""
    return {"problem": {"kind": "scene", "model": "plane_strain", "mesh": {"gmsh": gmsh},
                        "materials": [{"on": "domain", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "boundary", "spring": [10, 10]}],
                        "loads": [{"on": "all", "body_force": [0, -2]}],
                        "contacts": [{"on": "boundary", "obstacle": {"plane": {"point": [0, -0.251], "normal": [0, 1]}}}]},
            "solver": {"accuracy": "precise"}}


def answer(s, job, fields="reactions,gaps,displacements"):
    return expect(s.get(f"/v1/jobs/{job['id']}/result?fields={fields}"), 200).json


def test_a_mesh_in_every_form(s):
    plain = s.solve(disc(DISC.decode()))
    check(plain["summary"]["outcome"] == "converged" and plain["summary"]["contact"]["active"] > 0, plain)
    wanted = answer(s, plain)
    for file in (DISC, gmsh_files.binary_41(DISC.decode()), gmsh_files.binary_22(DISC.decode())):
        upload = expect(send(s, gzip.compress(file), Content_Encoding="gzip"), 201).json["id"]
        job = s.solve(disc({"upload": upload}))
        check(job["summary"]["outcome"] == "converged", job)
        got = answer(s, job)
        worst = max(abs(a - b) for name in ("reactions", "gaps") for a, b in zip(got[name], wanted[name], strict=True))
        check(worst < 1e-8, file[:30], worst)
        check(s.get(f"/v1/uploads/{upload}").json["used_by"] == 1)
        expect(s.request("DELETE", f"/v1/uploads/{upload}"), 409, "upload_in_use")


def test_what_follows_an_uploaded_mesh(s):
    """Everything that reads the stored request again finds the mesh, also after a restart."""
    upload = expect(send(s, gmsh_files.binary_41(DISC.decode())), 201).json["id"]
    loads = disc(upload)["problem"]["loads"]
    job = s.solve({**disc({"upload": upload}), "cases": [{"name": "one", "loads": loads}, {"name": "none", "loads": []}]})
    check(job.get("summary") and job["summary"]["outcome"] == "converged", job)
    s.restart()
    path = f"/v1/jobs/{job['id']}"
    fields = answer(s, job, "stress,von_mises,nodes&case=one")
    check(len(fields["von_mises"]) == len(fields["nodes"]) > 50, fields.keys())
    vtu = expect(s.get(f"{path}/result.vtu?case=one"), 200)
    check(b"UnstructuredGrid" in vtu.body, vtu)
    picture = expect(s.get(f"{path}/deformed.svg?case=one"), 200)
    check(picture.body.startswith(b"<") and b"</svg>" in picture.body, picture)
    refined = s.request("POST", f"{path}/refine", {"accuracy": "exact"}, {"Prefer": "wait=30"})
    check(expect(refined, 200).json["summary"]["outcome"] in ("converged", "precision_limit"), refined)
    check(s.get(f"/v1/uploads/{upload}").json["used_by"] == 2)
    one = s.solve(disc({"upload": upload}))
    known = answer(s, one, "displacements,reactions")
    body = {"problem": disc({"upload": upload})["problem"],
            "answer": {name: known[name] for name in ("displacements", "reactions")}}
    reply = expect(s.request("POST", "/v1/verify", body), 200)
    check(reply.json["summary"]["outcome"] == "verified", reply)


def test_an_uploaded_mesh_that_is_none(s):
    for wrong in ("0" * 64, digest(DISC)):  # not sent yet
        reply = expect(s.post(disc({"upload": wrong})), 422, "unknown_upload")
        check(reply.json["pointer"] == "/problem/mesh/gmsh/upload", reply)
    reply = expect(s.post(disc({"upload": "short"})), 422, "out_of_range")
    check(reply.json["pointer"] == "/problem/mesh/gmsh/upload", reply)
    whole = gmsh_files.binary_41(DISC.decode())
    for file, code in ((K, "gmsh_syntax"), (whole[:-300], "gmsh_syntax"), (whole.replace(b"4.1 1", b"9.9 1"), "gmsh_unsupported")):
        upload = expect(send(s, file), 201).json["id"]
        reply = expect(s.post(disc({"upload": upload})), 422, code)
        check(reply.json["pointer"] == "/problem/mesh/gmsh", reply)
        expect(s.request("DELETE", f"/v1/uploads/{upload}"), 204)
    check(s.get("/v1/jobs").json["jobs"] == [])


def test_refusals(s):
    expect(send(s, b"%%MatrixMarket matrix coordinate real general\n1 x 1\n"), 201)
    bad = digest(b"%%MatrixMarket matrix coordinate real general\n1 x 1\n")
    reply = expect(s.post(with_uploads(N=bad)), 422, "matrix_market_syntax")
    check(reply.json["pointer"] == "/problem/N" and reply.json["line"] == 2, reply)
    for wrong in ("0" * 64, "../" * 21 + "x", digest(K).upper()):
        reply = expect(s.post(with_uploads(K=wrong)), 422, "unknown_upload")
        check(reply.json["pointer"] == "/problem/K/upload", reply)
    reply = s.post({**MATRICES, "cases": [{"name": "a", "h": {"upload": "0" * 64}}]})
    check(expect(reply, 422, "unknown_upload").json["pointer"] == "/cases/0/h/upload", reply)
    for wrong, code in (("short", "out_of_range"), (7, "wrong_type")):
        reply = expect(s.post(with_uploads(p=wrong)), 422, code)
        check(reply.json["pointer"] == "/problem/p/upload", reply)
    reply = expect(s.post({"problem": {**MATRICES["problem"], "K": {"upload": "0" * 64, "x": 1}}}), 422, "unknown_key")
    check(reply.json["pointer"] == "/problem/K/x", reply)
    check(s.get("/v1/jobs").json["jobs"] == [])


@options(None)
def test_what_is_unused_goes_by_age(s):
    s.start()
    expect(send(s, K), 201)
    check(s.solve(with_uploads(K=digest(K)))["status"] == "successful")
    expect(send(s, VECTOR), 201)
    s.options = ("--upload-days", "0.00001")  # from here on: before, K could go before its job came
    s.restart(signal.SIGTERM)
    end = time.monotonic() + PATIENT_S
    while digest(VECTOR) in files(s) and time.monotonic() < end:
        time.sleep(0.1)
    check(files(s) == [digest(K)], files(s))
    expect(s.get(f"/v1/uploads/{digest(VECTOR)}"), 404, "not_found")


def start_sending(s, text, count):
    """Sends the head of an upload and the first bytes of its body."""
    c = s.connect()
    c.sendall(b"POST /v1/uploads HTTP/1.1\r\nHost: x\r\nContent-Type: application/octet-stream\r\n"
              b"Content-Length: %d\r\n\r\n" % len(text) + text[:count])
    end = time.monotonic() + PATIENT_S
    while not any(name.startswith("incoming-") and (folder(s) / name).stat().st_size >= count for name in files(s)):
        check(time.monotonic() < end, files(s))
        time.sleep(0.01)
    return c


def test_a_broken_send_leaves_nothing(s):
    s.file()  # what is half written lies beside it
    text = random.Random(1).randbytes(300000)
    start_sending(s, text, 100000).close()
    end = time.monotonic() + PATIENT_S
    while files(s) and time.monotonic() < end:
        time.sleep(0.02)
    check(files(s) == [], files(s))
    check(expect(send(s, text), 201).json["id"] == digest(text))


def test_kill_while_it_comes(s):
    s.file()  # what is half written lies beside it
    expect(send(s, K), 201)
    text = random.Random(2).randbytes(300000)
    with start_sending(s, text, 100000):
        s.restart()
    check(files(s) == [digest(K)], files(s))
    expect(s.get(f"/v1/uploads/{digest(text)}"), 404, "not_found")
    check(s.get(f"/v1/uploads/{digest(K)}", Accept="application/octet-stream").body == K)
    # A file that was renamed before its row was committed.
    (folder(s) / digest(VECTOR)).write_bytes(VECTOR)
    (folder(s) / "mine.txt").write_text("not the service's")
    s.restart()
    check(files(s) == sorted([digest(K), "mine.txt"]), files(s))
    expect(send(s, text), 201)


def test_many_at_once(s):
    texts = [random.Random(i % 3).randbytes(50000) for i in range(9)]
    ids = []

    def run(text):
        ids.append(send(s, text).json["id"])
    threads = [threading.Thread(target=run, args=(text,)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    check(sorted(ids) == sorted(map(digest, texts)), ids)
    check(files(s) == sorted(set(ids)), files(s))


def test_memory_stays_small(s):
    """A body goes to disk as it comes: 64 MB are not in memory at once."""
    squeezed = gzip.compress(bytes(64 << 20), 1)
    before = peak(s)
    expect(send(s, squeezed, Content_Encoding="gzip"), 201)
    raw = s.get(f"/v1/uploads/{digest(bytes(64 << 20))}", Accept="application/octet-stream")
    check(raw.body == bytes(64 << 20))
    check(peak(s) - before < 32 << 10, before, peak(s))


def peak(s):
    """Largest resident set yet, in kB."""
    for line in pathlib.Path(f"/proc/{s.process.pid}/status").read_text().splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1])
    raise Skip("no /proc")


def test_folder_is_a_file(s):
    folder(s).write_text("in the way")
    expect(send(s, K), 500, "store_error")
    os.unlink(folder(s))
    expect(send(s, K), 201)


if __name__ == "__main__":
    service.main(globals())
