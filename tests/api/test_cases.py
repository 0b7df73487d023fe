"""Problems and malformed files that others made. usage: test_cases.py BUILD_DIR [FILTER]

The small problems are in tests/data/qp; the rest is read from ../shared/cases where that folder exists. The references
have the reactions with the opposite sign and were solved by other programs.
"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import math

import service
from matrices import Matrix, cholesky_solve, dot
from service import MATRICES, ROOT, Skip, check, expect

CASES = ROOT.parent / "shared" / "cases"
OURS = ROOT / "tests" / "data" / "qp"
AS_JSON = {"Content-Type": "application/json"}


def folder(*names):
    path = CASES.joinpath(*names)
    if not path.is_dir():
        raise Skip(f"{'/'.join(('../shared/cases', *names))} is not here")
    return path


# ---------------------------------------------------------------- reference problems

class Case:
    """One problem with its reference answer."""

    def __init__(self, path):
        self.name = path.name
        self.texts = {name: (path / f"{name}.mtx").read_text() for name in ("K", "N", "h", "p")}
        self.reference = json.loads((path / "ref.json").read_text())
        self.objective = self.reference.get("objective")
        self.path = path

    def request(self, **solver):
        return {"problem": {"kind": "matrices", **self.texts}, "solver": solver}

    def read(self):
        """The matrices, for checks of our own."""
        self.K, self.N = Matrix(self.texts["K"]), Matrix(self.texts["N"])
        self.h, self.p = Matrix(self.texts["h"]).vector(), Matrix(self.texts["p"]).vector()
        self.ref_u = Matrix((self.path / "ref_u.mtx").read_text()).vector()
        return self

    def energy_norm(self, u):
        return math.sqrt(max(0.0, dot(u, self.K.apply(u))))

    def true_error(self, u):
        """Relative error in the energy norm against the reference, which has some 1e-10 of its own."""
        return self.energy_norm([a - b for a, b in zip(u, self.ref_u)]) / self.energy_norm(self.ref_u)


def solve(s, case, **solver):
    """The summary, and the vectors by name."""
    job = s.solve(case.request(**solver))
    check(job["status"] == "successful", case.name, solver, job)
    result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions,gaps"), 200).json
    return job["summary"], result


def check_answer(s, case):
    summary, result = solve(s, case)
    what = (case.name, summary)
    check(summary["outcome"] == "converged", what)
    check(0 <= summary["certificate"]["relative_error"] <= summary["requested_error"] == 1e-8, what)
    for side in ("primal", "dual"):
        check(abs(summary["energy"][side] - case.objective) <= 1e-9 * abs(case.objective), side, case.objective, what)
    check(summary["contact"]["candidates"] == len(result["reactions"]) == case.reference["m"], what)
    if not case.reference["degenerate"]:
        check(summary["contact"]["active"] == case.reference["kkt"]["n_active"], case.reference["kkt"], what)
    check_optimality(case.read(), summary, result)


def check_optimality(case, summary, result):
    """Feasible, compressive, in equilibrium, near the reference: from the vectors that were sent, not the summary."""
    u, r, g = result["displacements"], result["reactions"], result["gaps"]
    check(max(r) <= 0.0, case.name, "tension", max(r))
    travel = max(map(abs, u)) * max(map(abs, case.N.entries.values())) + max(map(abs, case.h))
    lift = max(abs(h - nu - gap) for h, nu, gap in zip(case.h, case.N.apply(u), g))
    check(lift <= 1e-13 * travel, case.name, "g is not h - N u:", lift, travel)
    check(min(g) >= -1e-13 * travel, case.name, "penetration", min(g), travel)
    forces = [ku - p - nr for ku, p, nr in zip(case.K.apply(u), case.p, case.N.apply_transposed(r))]
    size = math.sqrt(dot(case.p, case.p) + dot(r, r))
    check(math.sqrt(dot(forces, forces)) <= 1e-5 * size, case.name, "out of balance by", max(map(abs, forces)))
    error = case.true_error(u)
    check(error <= summary["certificate"]["relative_error"] + 1e-8, case.name, "true error", error, summary)


def test_small_cases(s):
    found = sorted(path.parent for path in OURS.glob("*/ref.json"))
    check(len(found) >= 5, f"{OURS} has {len(found)} problems")
    for path in found:
        check_answer(s, Case(path))


def test_reference_cases(s):
    paths = sorted(path.parent for path in folder("qp").glob("*/ref.json"))
    check(len(paths) >= 12, paths)
    for path in paths:
        check_answer(s, Case(path))


def test_every_method_and_operator(s):
    for name in ("FC_CubeH8", "FEM_skfem_box", "MM_HS118", "MM_HS21", "MM_HS268", "MM_HS35", "MM_HS76"):
        case = Case(folder("qp", name))
        for method in ("uzawa", "accelerated", "accelerated_restart", "conjugate"):
            for operator in ("condensed", "factored"):
                summary, _ = solve(s, case, method=method, operator=operator)
                what = (name, method, operator, summary)
                check(summary["method"] == method and summary["operator"] == operator, what)
                if (method, summary["outcome"]) == ("uzawa", "iteration_limit"):
                    continue  # the plain method may need more steps than anybody allows
                check(summary["outcome"] == "converged", what)
                check(abs(summary["energy"]["primal"] - case.objective) <= 1e-9 * abs(case.objective), what)


def test_certificate_bounds_the_true_error(s):
    """Stopped anywhere, the bound holds: the answer may be poor but never poorer than it says."""
    for name in ("FC_CubeH8", "FC_SpheresInBox", "FEM_skfem_box", "MM_HS118", "MM_HS21", "MM_HS268", "MM_HS35",
                 "MM_HS76", "SEMI_bcsstk01", "CUTE_TORSIONA"):
        case = Case(folder("qp", name)).read()
        for limit in (0, 1, 7, 60, 400):
            summary, result = solve(s, case, method="accelerated_restart", max_iterations=limit)
            bound, energy = summary["certificate"]["relative_error"], summary["energy"]
            slack = 1e-9 * abs(case.objective)
            check(summary["outcome"] in ("converged", "iteration_limit") and summary["iterations"] <= limit, summary)
            check(energy["dual"] is None or energy["dual"] <= case.objective + slack, name, limit, summary)
            check(energy["primal"] is None or energy["primal"] >= case.objective - slack, name, limit, summary)
            error = case.true_error(result["displacements"])
            check(bound is None or error <= bound * (1 + 1e-6) + 1e-8, name, limit, "true error", error, summary)


def test_indefinite_matrix_is_refused(s):
    path = folder("qp_refuse", "CUTE_BQPGAUSS")
    request = {"problem": {"kind": "matrices", **{name: (path / f"{name}.mtx").read_text() for name in "KNhp"}}}
    for solver in ({}, {"operator": "factored"}, {"method": "uzawa"}, {"ordering": "metis"}, {"ordering": "amd"}):
        job = s.solve({**request, "solver": solver})
        check(job["status"] == "failed" and "summary" not in job or not job["summary"], solver, job)
        check(job["error"]["code"] == "not_positive_definite" and job["error"]["pointer"] == "/problem/K", solver, job)
        check("pivot" in job["error"]["detail"] or "eigenvalue" in job["error"]["detail"], job)
        expect(s.get(f"/v1/jobs/{job['id']}/result"), 409, "job_failed")


# ---------------------------------------------------------------- JSON

def test_json_suite(s):
    """n_ is no JSON and says so; y_ and i_ are never refused for their grammar, except for what this service refuses
    on purpose (a repeated key)."""
    files = sorted(folder("json", "test_parsing").glob("*.json"))
    check(len(files) == 318, len(files))
    for path in files:
        reply = s.request("POST", "/v1/jobs", path.read_bytes(), AS_JSON)
        kind, code = path.name[0], reply.json["code"]
        what = (path.name, reply)
        if kind == "n":
            check(reply.status == 400 and code in ("json_syntax", "json_depth"), what)
        elif kind == "y":
            check(reply.status in (400, 422) and code not in ("json_syntax", "json_depth"), what)
            check(code != "duplicate_key" or "duplicated" in path.name, what)
        else:
            check(reply.status in (400, 422), what)
        check(reply.json["detail"], what)
    check(s.get("/healthz").status == 200 and s.get("/v1/jobs").json["jobs"] == [], "a job was made")


# ---------------------------------------------------------------- Matrix Market

def mm_verdicts():
    for line in (ROOT / "tests" / "data" / "mm_edge_verdicts.txt").read_text().splitlines():
        if not line.startswith("#"):
            yield line.split()[:3]


def request_with(text):
    """The text as K, and a load that fits if it can be read."""
    try:
        rows = Matrix(text).rows
    except (ValueError, IndexError, KeyError):
        rows = 1
    return {"problem": {"kind": "matrices", "K": text, "p": [1.0] * (rows if 0 < rows < 2000 else 1)}}


def judged_as_matrix(s, name, request, text):
    """What a legal file must lead to, from a reading of our own."""
    matrix = Matrix(text)
    reply = s.post(request, {"Prefer": "wait=60"})
    if matrix.rows != matrix.cols or not matrix.is_symmetric():
        code = "size_mismatch" if matrix.rows != matrix.cols else "not_symmetric"
        check(expect(reply, 422, code).json["pointer"] == "/problem/K", name, reply)
        return
    check(reply.status == 200, name, reply)
    job = s.get(f"/v1/jobs/{reply.json['id']}").json
    u = cholesky_solve(matrix, request["problem"]["p"])
    if u is None:
        check(job["status"] == "failed" and job["error"]["code"] == "not_positive_definite", name, job)
        return
    check(job["status"] == "successful" and job["summary"]["outcome"] == "converged", name, job)
    got = s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json["displacements"]
    worst = max(abs(a - b) for a, b in zip(got, u))
    check(worst <= 1e-6 * max(map(abs, u)), name, "wrong by", worst)


def test_matrix_market_edge_cases(s):
    root = folder("mm_edge")
    seen = {"ok": 0}
    for name, status, line in mm_verdicts():
        text = (root / name).read_bytes().decode("utf-8", "replace")
        request = request_with(text)
        seen[status] = seen.get(status, 0) + 1
        if status == "ok":
            judged_as_matrix(s, name, request, text)
            continue
        reply = s.post(request)
        if text == "" or "\0" in text:  # refused before it is looked at as a matrix
            check(reply.status in (400, 422) and reply.json["code"] != "internal", name, reply)
            continue
        check(reply.status == 422 and reply.json["code"] == status, name, status, reply)
        check(reply.json["pointer"] == "/problem/K" and reply.json["line"] == int(line), name, line, reply)
    check(len(seen) == 5 and seen["ok"] > 50, seen)
    check(s.get("/healthz").status == 200)


def test_matrix_market_edge_cases_as_vectors(s):
    """The same files as p and as h: refused or of the wrong size, never anything else."""
    root = folder("mm_edge")
    for name, status, _ in mm_verdicts():
        text = (root / name).read_bytes().decode("utf-8", "replace")
        for member in ("p", "h"):
            request = copy.deepcopy(MATRICES)
            request["problem"][member] = text
            reply = s.post(request, query="?validate=true")
            check(reply.status in ((200, 422) if status == "ok" else (400, 422)), name, member, reply)
            if reply.status == 422:
                check(reply.json["pointer"] == f"/problem/{member}", name, member, reply)


# ---------------------------------------------------------------- requests that were answered wrongly

def test_alpha_belongs_to_the_rows_as_given(s):
    """The paper's body with N times 4 and alpha = 1 / lambda_max of that N; then without alpha, and on unit rows."""
    request = json.loads((folder("core") / "alpha_rowscale_4.json").read_text())
    alpha = request["solver"]["alpha"]
    for more, scaling in (({}, "none"), ({"alpha": None}, "none"), ({"row_scaling": "unit"}, "none")):
        solver = {key: value for key, value in {**request["solver"], **more}.items() if value is not None}
        got = s.solve({**request, "solver": solver})["summary"]
        check(got["iterations"] == 283 and got["restarts"] == 2 and got["row_scaling"] == scaling, more, got)
        check(abs(got["alpha"] / alpha - 1) < 1e-4, more, got)
        check("alpha" in solver or abs(got["alpha"] * got["lambda_max"] - 1) < 1e-12, more, got)
    rows = [line.split() for line in request["problem"]["N"].splitlines()[2:]]
    mixed = "\n".join(request["problem"]["N"].splitlines()[:2] +
                      [f"{i} {j} {float(value) * (1, 8, 0.25)[int(i) % 3]!r}" for i, j, value in rows]) + "\n"
    request["problem"]["N"] = mixed
    for solver, scaling in (({}, "unit"), ({"method": "conjugate"}, "unit"), ({"method": "accelerated"}, "none"),
                            ({"stopping": "paper"}, "none"), ({"method": "uzawa", "row_scaling": "unit"}, "unit")):
        got = s.solve({**request, "solver": solver})["summary"]
        check(got["row_scaling"] == scaling, solver, got)


if __name__ == "__main__":
    service.main(globals())
