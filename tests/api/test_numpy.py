"""NumPy's files in and out: answers that numpy.load reads, matrices that scipy and numpy have written.
usage: test_numpy.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import io
import json
import os
import subprocess
import sys
import tempfile
import zipfile

import service
from service import MATRICES, SCENE, Skip, check, expect

SHARED = True  # one service for all tests

try:
    import numpy as np
except ImportError:
    np = None
try:
    from scipy import sparse
except ImportError:
    sparse = None

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
K, N = [[2.0, 0.0], [0.0, 1.0]], [[1.0, 0.0]]


def needed(*modules):
    if not all(modules):
        raise Skip("numpy or scipy is not installed")


def saved(write, *arrays, **named):
    file = io.BytesIO()
    write(file, *arrays, **named)
    return file.getvalue()


def npy(*arrays, **named):
    return saved(np.save, *arrays, **named)


def sent(s, data):
    return {"upload": s.request("POST", "/v1/uploads", data).json["id"]}


def request(s, **files):
    return {"problem": {**MATRICES["problem"], **{name: sent(s, data) for name, data in files.items()}}}


def answer(s, body):
    job = expect(s.post(body, {"Prefer": "wait=60"}), 200).json
    check(job["status"] == "successful", job)
    return expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions"), 200).json


def arrays(s, job, query=""):
    reply = expect(s.get(f"/v1/jobs/{job}/result.npz{query}"), 200)
    check(reply.headers["content-type"] == "application/zip", reply.headers)
    check(zipfile.ZipFile(io.BytesIO(reply.body)).testzip() is None)
    return dict(np.load(io.BytesIO(reply.body)))


# -------------------------------------------------------------------- out

def test_an_answer_as_arrays(s):
    needed(np)
    fields = ["nodes", "displacements", "reactions", "gaps", "pressure", "contact_status", "stress", "principal", "von_mises", "strain"]
    job = expect(s.post(SCENE, {"Prefer": "wait=60"}), 200).json["id"]
    text = expect(s.get(f"/v1/jobs/{job}/result?fields={','.join(fields)},stress_gauss"), 200).json
    found = arrays(s, job, f"?fields={','.join(fields)},stress_gauss")
    for name in [*fields, "contact_nodes"]:
        check(np.array_equal(found[name], np.array(text[name])), name, found[name])
        check(found[name].dtype == (np.int64 if name in ("contact_nodes", "contact_status") else np.float64), name, found[name].dtype)
    for name in ("elements", "points", "stress"):
        check(np.array_equal(found[f"stress_gauss_{name}"], np.array(text["stress_gauss"][name])), name)
    check(found["displacements"].shape == (341, 2) and found["stress"].shape == (341, 4) and found["principal"].shape == (341, 3))
    check(found["nodes"][found["contact_nodes"]].shape == (30, 2))  # whole numbers, so that they choose
    head = json.loads(found["result.json"])
    check(head == {name: text[name] for name in ("job", "summary", "components")}, head)
    few = arrays(s, job)
    check(set(few) == {"result.json", "reactions", "gaps", "contact_nodes"}, few.keys())
    part = arrays(s, job, "?fields=displacements&from=5&count=3")
    check(np.array_equal(part["displacements"], found["displacements"][5:8]) and json.loads(part["result.json"])["from"] == 5, part)
    expect(s.get(f"/v1/jobs/{job}/result.npz?fields=presure"), 400, "bad_parameter")
    tag = expect(s.get(f"/v1/jobs/{job}/result.npz"), 200).headers["etag"]
    expect(s.get(f"/v1/jobs/{job}/result.npz", **{"If-None-Match": tag}), 304)


def test_cases_and_matrices(s):
    needed(np)
    body = copy.deepcopy(SCENE)
    body["cases"] = [{"name": "one", "loads": body["problem"]["loads"]}, {"name": "none", "loads": []}]
    job = expect(s.post(body, {"Prefer": "wait=60"}), 200).json["id"]
    expect(s.get(f"/v1/jobs/{job}/result.npz"), 400, "case_needed")
    found = arrays(s, job, "?case=none&fields=displacements,pressure")
    check(not found["displacements"].any() and json.loads(found["result.json"])["case"] == "none", found)
    job = expect(s.post(MATRICES, {"Prefer": "wait=60"}), 200).json["id"]
    found = arrays(s, job, "?fields=displacements,reactions")
    check(np.allclose(found["displacements"], [0.5, 2], rtol=1e-14) and np.allclose(found["reactions"], [-1], rtol=1e-14), found)
    expect(s.get(f"/v1/jobs/{job}/result.npz?fields=stress"), 409, "not_a_scene")
    expect(s.get("/v1/jobs/" + "0" * 32 + "/result.npz"), 404, "not_found")


def test_the_client_writes_and_sends_them(s):
    needed(np, sparse)
    with tempfile.TemporaryDirectory() as folder:
        def path(name):
            return os.path.join(folder, name)

        def run(*words):
            done = subprocess.run([CLIENT, "--server", s.url, *words], capture_output=True, timeout=60)
            check(done.returncode == 0, words, done.stderr)
            return done.stdout
        sparse.save_npz(path("K.npz"), sparse.csr_matrix(K))
        sparse.save_npz(path("N.npz"), sparse.coo_matrix(N))
        np.save(path("h.npy"), np.array([0.5]))
        np.save(path("p.npy"), np.array([2, 2]))
        job = run("submit", "--K", path("K.npz"), "--N", path("N.npz"), "--h", path("h.npy"), "--p", path("p.npy"), "--wait", "--quiet").decode().strip()
        run("result", job, "--format", "npz", "--fields", "displacements,gaps", "-o", path("out.npz"))
        found = np.load(path("out.npz"))
        check(np.allclose(found["displacements"], [0.5, 2], rtol=1e-14) and set(found.files) == {"result.json", "displacements", "gaps"}, found.files)
        with open(path("out.npz"), "rb") as file:
            check(run("result", job, "--format", "npz", "--fields", "displacements,gaps") == file.read(), "nothing behind it")


# --------------------------------------------------------------------- in

def test_sparse_matrices_of_scipy(s):
    needed(np, sparse)
    want = answer(s, MATRICES)
    for kind in ("csr", "csc", "coo"):
        for compressed in (True, False):
            body = request(s, K=saved(sparse.save_npz, sparse.csr_matrix(K).asformat(kind), compressed=compressed),
                           N=saved(sparse.save_npz, sparse.csr_matrix(N).asformat(kind), compressed=compressed),
                           h=npy(np.array([0.5])), p=npy(np.array([[2], [2]], dtype=">i2")))
            found = answer(s, body)
            check(found["displacements"] == want["displacements"] and found["reactions"] == want["reactions"], kind, found)
    # entries of one place are added, and long ones and lone halves are no matter
    twice = sparse.coo_matrix(([1.0, 1, 1], ([0, 0, 1], [0, 0, 1])), shape=(2, 2))
    check(answer(s, request(s, K=saved(sparse.save_npz, twice)))["displacements"] == want["displacements"])
    wide = sparse.csr_matrix(K)
    wide.indices, wide.indptr = wide.indices.astype(np.int64), wide.indptr.astype(np.int64)
    check(answer(s, request(s, K=saved(sparse.save_npz, wide)))["displacements"] == want["displacements"])


def test_a_large_one_is_what_its_text_is(s):
    """A body of springs in space: to the last digit what Matrix Market gives."""
    needed(np, sparse)
    n = 400
    generator = np.random.default_rng(7)
    A = sparse.random(n, n, 0.01, random_state=7, format="csr")
    matrix = (A @ A.T + sparse.diags(1 + generator.random(n))).tocsr()
    rows = sparse.csr_matrix((np.ones(40), (np.arange(40), generator.permutation(n)[:40])), shape=(40, n))
    h, p = generator.random(40) * 0.1, generator.standard_normal(n)

    def text(M):
        coo = M.tocoo()
        lines = "".join(f"{i + 1} {j + 1} {v!r}\n" for i, j, v in zip(coo.row.tolist(), coo.col.tolist(), coo.data.tolist()))
        return f"%%MatrixMarket matrix coordinate real general\n{M.shape[0]} {M.shape[1]} {coo.nnz}\n{lines}"
    by_text = answer(s, {"problem": {"kind": "matrices", "K": text(matrix), "N": text(rows), "h": h.tolist(), "p": p.tolist()}})
    by_file = answer(s, request(s, K=saved(sparse.save_npz, matrix), N=saved(sparse.save_npz, rows.tocsc()), h=npy(h), p=npy(p)))
    check(by_text["displacements"] == by_file["displacements"] and by_text["reactions"] == by_file["reactions"])
    check(min(by_file["reactions"]) < 0)


def test_dense_matrices_and_single_archives(s):
    needed(np)
    want = answer(s, MATRICES)["displacements"]
    for dtype in ("<f8", ">f8", "<f4", "<i8", ">i4", "<i2", "|i1", "|u1", "<u2", ">u4", "<u8"):
        for order in "CF":
            check(answer(s, request(s, K=npy(np.array(K, dtype=dtype, order=order)), N=npy(np.array(N))))["displacements"] == want, dtype)
    check(answer(s, request(s, p=saved(np.savez, np.array([2.0, 2]))))["displacements"] == want)
    check(answer(s, request(s, p=saved(np.savez_compressed, loads=np.array([[2.0, 2]]))))["displacements"] == want)
    for version in ((1, 0), (2, 0), (3, 0)):
        file = io.BytesIO()
        np.lib.format.write_array(file, np.array(K), version=version)
        check(answer(s, request(s, K=file.getvalue()))["displacements"] == want, version)


def test_answers_are_certified_from_files(s):
    """displacements as result.npz has them: a row for each node."""
    needed(np)
    job = expect(s.post(SCENE, {"Prefer": "wait=60"}), 200).json["id"]
    found = arrays(s, job, "?fields=displacements,reactions")
    body = {"problem": SCENE["problem"], "solver": {"accuracy": {"relative_error": 1e-4}},
            "answer": {name: sent(s, npy(found[name])) for name in ("displacements", "reactions")}}
    check(expect(s.request("POST", "/v1/verify", json.dumps(body).encode(), {"Content-Type": "application/json", "Prefer": "wait=60"}),
                 200).json["summary"]["outcome"] == "verified")
    body["answer"]["displacements"] = sent(s, npy(np.zeros((341, 3))))
    reply = s.request("POST", "/v1/verify", json.dumps(body).encode(), {"Content-Type": "application/json"})
    check(expect(reply, 422, "size_mismatch").json["pointer"] == "/answer/displacements", reply)


def test_what_is_no_matrix_is_refused(s):
    needed(np, sparse)
    good = npy(np.array(K))
    packed = saved(sparse.save_npz, sparse.csr_matrix(K))
    broken = bytearray(packed)
    broken[packed.index(b"data.npy") + 40] ^= 255

    def archive(**changed):
        parts = {"format": b"csr", "shape": (2, 2), "data": [2.0, 1], "indices": [0, 1], "indptr": [0, 1, 2], **changed}
        return saved(np.savez, **{name: value for name, value in parts.items() if value is not None})
    for file, code, says in (
            (good[:-1], "numpy_syntax", "whole file"), (good + b"0", "numpy_syntax", "whole file"), (good[:9], "numpy_syntax", "header"),
            (good.replace(b"descr", b"desks"), "numpy_syntax", "descr, fortran_order"), (b"\x93NUMPY\x09" + good[7:], "numpy_unsupported", "version"),
            (good.replace(b"(2, 2)", b"(2,9)L"), "numpy_syntax", ""), (good.replace(b"(2, 2), }", b"(9999999999999999999, 2), }"), "numpy_syntax", ""),
            (npy(np.array(K, dtype=complex)), "numpy_unsupported", "<c16"), (npy(np.array(K, dtype="f2")), "numpy_unsupported", "<f2"),
            (npy(np.array(K, dtype=object)), "numpy_unsupported", "|O"), (npy(np.zeros(2, dtype="f8,i4")), "numpy_unsupported", "record"),
            (npy(np.array(K) > 0), "numpy_unsupported", "|b1"), (npy(np.array([["a"]])), "numpy_syntax", "texts"),
            (npy(np.zeros((2, 2, 2))), "numpy_unsupported", "3 dimensions"), (npy(np.zeros(4)), "size_mismatch", "two"),
            (npy(np.array([[np.nan, 0], [0, 1]])), "not_finite", "number 0"), (npy(np.array([[1, 0], [0, np.inf]])), "not_finite", "number 3"),
            (bytes(broken), "numpy_syntax", "damaged"), (packed[:-1], "numpy_syntax", "cut off"), (packed[:200], "numpy_syntax", "cut off"),
            (saved(np.savez, a=np.zeros(2), b=np.zeros(2)), "numpy_unsupported", "2 members"), (saved(np.savez), "numpy_unsupported", "0 members"),
            (saved(sparse.save_npz, sparse.bsr_matrix(K)), "numpy_unsupported", "bsr"), (saved(sparse.save_npz, sparse.dia_matrix(K)), "numpy_unsupported", "dia"),
            (archive(indices=None), "numpy_syntax", "no indices.npy"), (archive(indices=[0, 2]), "numpy_syntax", "column 2"),
            (archive(indices=[0, -1]), "numpy_syntax", "column -1"), (archive(indptr=[0, 2, 1]), "numpy_syntax", "indptr"),
            (archive(indptr=[0, 1, 3]), "numpy_syntax", "indptr"), (archive(indptr=[1, 1, 2]), "numpy_syntax", "indptr"),
            (archive(indptr=[0, 2]), "numpy_syntax", "lengths"), (archive(data=[1.0]), "numpy_syntax", "lengths"),
            (archive(indices=[0.0, 1.0]), "numpy_syntax", "whole numbers"), (archive(shape=(2, 2, 2)), "size_mismatch", "two numbers"),
            (archive(shape=(-2, 2)), "numpy_syntax", "negative"), (archive(format=b"csc", shape=(2**62, 2)), "memory_limit", ""),
            (archive(format=b"csr", shape=(2, 2**62)), "memory_limit", ""), (archive(data=[2.0, np.inf]), "not_finite", "data.npy")):
        reply = expect(s.post(request(s, K=file)), 422, code)
        check(reply.json["pointer"] == "/problem/K" and says in reply.json["detail"], says, reply.json)
    for file, code in ((npy(np.zeros((2, 2))), "size_mismatch"), (npy(np.array(2.0)), "size_mismatch"), (npy(np.zeros(3)), "size_mismatch"),
                       (packed, "numpy_unsupported")):
        reply = expect(s.post(request(s, p=file)), 422, code)
        check(reply.json["pointer"] == "/problem/p", reply.json)


def test_what_unpacks_to_too_much_is_refused(s):
    """Zeros, a thousandth when packed."""
    needed(np)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("p.npy", npy(np.zeros(2, dtype=np.uint8))[:128] + bytes(200_000_000))
    reply = expect(s.post(request(s, p=file.getvalue())), 422, "memory_limit")
    check("p.npy" in reply.json["detail"], reply.json)
    with zipfile.ZipFile(file, "w") as archive:
        for i in range(40):
            archive.writestr(f"{i}.npy", b"")
    expect(s.post(request(s, p=file.getvalue())), 422, "numpy_unsupported")


service.main(globals())
