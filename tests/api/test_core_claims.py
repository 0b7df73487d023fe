"""What the daemon claims about problems whose claims were once false. usage: test_core_claims.py BUILD_DIR [FILTER]

The problems are read from ../shared/cases/core where that folder exists; generated ones of the same kinds are in
tests/support/conditioned.h. The reference is this file's own: elimination with a hundred decimals.
"""
# not under ThreadSanitizer: about answers, not about threads
import decimal
import json
from decimal import Decimal

import service
from service import ROOT, Skip, check, expect

SHARED = True  # one service for all tests

CASES = ROOT.parent / "shared" / "cases" / "core"


def request_of(name):
    path = CASES / f"{name}.json"
    if not path.is_file():
        raise Skip(f"../shared/cases/core/{name}.json is not here")
    return json.loads(path.read_text())


def dense(text, rows, columns):
    matrix = [[Decimal(0)] * columns for _ in range(rows)]
    for line in text.splitlines()[2:]:
        i, j, value = line.split()
        matrix[int(i) - 1][int(j) - 1] = Decimal(float(value))
        if "symmetric" in text[:60]:
            matrix[int(j) - 1][int(i) - 1] = Decimal(float(value))
    return matrix


def solve(matrix, right):
    """By Gaussian elimination with row interchanges."""
    n = len(matrix)
    rows = [row[:] + [b] for row, b in zip(matrix, right)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            if factor:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    x = [Decimal(0)] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def norm(K, u):
    return sum(u[i] * sum(K[i][j] * u[j] for j in range(len(u))) for i in range(len(u))).sqrt()


def true_errors(problem, result):
    """Absolute and relative, in the energy norm; the rows that press are those of the answer, which is checked."""
    decimal.getcontext().prec = 120
    d, m = len(problem["p"]), len(problem.get("h", []))
    K, N = dense(problem["K"], d, d), dense(problem["N"], m, d) if m else []
    p, h = [Decimal(x) for x in problem["p"]], [Decimal(x) for x in problem.get("h", [])]
    active = [i for i in range(m) if result["reactions"][i] < 0]
    system = [K[i] + [N[a][i] for a in active] for i in range(d)] + [N[a] + [Decimal(0)] * len(active) for a in active]
    x = solve(system, p + [h[a] for a in active])
    exact = x[:d]
    noise = Decimal(10) ** -60
    check(all(pressure >= 0 for pressure in x[d:]), "another row presses", x[d:])
    check(all(h[i] - sum(a * b for a, b in zip(N[i], exact)) >= -noise for i in range(m)), "another row touches")
    error = norm(K, [Decimal(a) - b for a, b in zip(result["displacements"], exact)])
    return error, error / norm(K, exact)


def check_claims(s, name, least=None):
    request = request_of(name)
    job = s.solve(request)
    check(job["status"] == "successful", name, job)
    summary = job["summary"]
    result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions"), 200).json
    error, relative = true_errors(request["problem"], result)
    claimed = summary["certificate"]
    for what, true in (("absolute_error", error), ("relative_error", relative)):
        check(claimed[what] is None or Decimal(claimed[what]) >= true, name, what, claimed, true)
    if summary["outcome"] == "converged":
        check(relative <= Decimal(summary["requested_error"]), name, relative, summary)
    if least is not None:
        check(summary["factor"]["rcond"] < least, name, summary["factor"])
    return summary


def test_ill_conditioned_answers_are_not_said_to_be_better_than_they_are(s):
    for name in ("ill_conditioned_converged", "bound_below_lauchli", "bound_below_moler"):
        check_claims(s, name, 1e-14)
    check_claims(s, "bound_below_small", 1e-9)


def test_a_bound_is_not_zero_by_underflow(s):
    for name in ("zero_bound_denormal", "zero_bound_tiny_load"):
        claimed = s.solve(request_of(name))["summary"]["certificate"]
        for what in ("relative_error", "absolute_error", "gap"):
            check(claimed[what] is None or claimed[what] > 0, name, what, claimed)


def test_loads_from_the_ends_of_double(s):
    """Times a power of two the answer is the same, bit for bit, and so is its certificate."""
    first = None
    for power in (0, -1000, -900, -500, -100, 100, 500, 900):
        unit = 2.0 ** power
        job = s.solve({"problem": {"kind": "matrices", "p": [unit, 3 * unit], "h": [-unit / 8, unit / 4, unit],
                                   "K": "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 3\n2 1 1\n2 2 2\n",
                                   "N": "%%MatrixMarket matrix coordinate real general\n3 2 4\n1 1 1\n2 2 1\n3 1 1\n3 2 1\n"}})
        told = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions"), 200).json
        summary = job["summary"]
        answer = [x / unit for x in told["displacements"] + told["reactions"]], summary["certificate"]["relative_error"]
        first = first or answer
        check(summary["outcome"] == "converged" and answer == first, power, answer, first, summary)
        check(summary["certificate"]["absolute_error"] > 0, power, summary)


def test_a_body_that_rows_keep_from_moving(s):
    """u = 0 exactly: an error has nothing to be relative to, and is 0 where reactions in doubles balance the load."""
    matrix = "%%MatrixMarket matrix coordinate real {}\n{}\n"
    for K, N, h, p in (("1 1 1\n1 1 3", "1 1 1\n1 1 -1", [0], [-3]), ("1 1 1\n1 1 6e24", "3 1 2\n2 1 1\n3 1 -1", [4, 0, 2], [7.5e33]),
                       ("2 2 3\n1 1 2\n2 1 -1\n2 2 2", "2 2 2\n1 1 1\n2 2 2", [0, 0], [1, 2])):
        job = s.solve({"problem": {"kind": "matrices", "K": matrix.format("symmetric", K), "N": matrix.format("general", N), "h": h, "p": p}})
        check(job["summary"]["outcome"] == "converged" and job["summary"]["certificate"]["relative_error"] == 0, job["summary"])


def test_a_stiffness_without_digits_is_refused(s):
    for value in ("5e-324", "3e-310", "1e-300"):
        request = {"problem": {"kind": "matrices", "p": [1], "h": [1],
                               "K": f"%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 {value}\n",
                               "N": "%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 1\n"}}
        refused = expect(s.post(request), 422, "out_of_range").json
        check(refused["pointer"] == "/problem/K", refused)


def test_a_matrix_that_is_not_definite_by_less_than_rounding_is_refused(s):
    job = s.solve(request_of("not_positive_definite"))
    check(job["status"] == "failed" and job["error"]["code"] == "not_positive_definite", job)


if __name__ == "__main__":
    service.main(globals())
