"""Random small problems posted to a daemon, judged in rational numbers by a program that shares nothing with it.

usage: posted.py BUILD_DIR [COUNT [SEED [ONLY]]]

K, N, h and p have short entries times powers of two from all of the range of double; rows repeat, oppose or depend on
each other, meet in a point, contradict by a hair; methods, forms, scalings and requests are mixed. The answer is found by
trying all sets of rows in contact. Every claim is checked: an outcome, both errors, both energies, the radius. Prints each
false one with the number of its problem (ONLY), and at the end how many were answered; fails where one was false.
"""
import itertools
import json
import math
import pathlib
import random
import sys
from fractions import Fraction

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / "api")]

import service  # noqa: E402  the path is set above

MOST_SETS = 2500  # of rows in contact that are tried


# ------------------------------------------------------------------------------------------------ the truth, exactly

def solve_equations(A, B):
    """X with A X = B by Gauss and Jordan, and whether all pivots, on the diagonal, were positive; None: singular."""
    n, M, positive = len(A), [list(a) + list(b) for a, b in zip(A, B)], True
    for c in range(n):
        at = c if M[c][c] else next((i for i in range(c, n) if M[i][c]), None)
        positive = positive and M[c][c] > 0
        if at is None:
            return None, False
        M[c], M[at] = M[at], M[c]
        M[c] = [x / M[c][c] for x in M[c]]
        for i in range(n):
            if i != c and M[i][c]:
                factor = M[i][c]
                M[i] = [x - factor * y if y else x for x, y in zip(M[i], M[c])]
    return [row[n:] for row in M], positive


class Truth:
    """definite: is K; feasible: is there a u; u: the answer, None where too many sets would have to be tried."""

    def __init__(self, K, N, h, p):
        d, m = len(K), len(N)
        self.K, self.p, self.feasible, self.u = K, p, None, None
        X, self.definite = solve_equations(K, [[p[i]] + [row[i] for row in N] for i in range(d)])
        if not self.definite:
            return
        free, W = [x[0] for x in X], [[x[1 + j] for x in X] for j in range(m)]
        D = [[sum(a * b for a, b in zip(row, w) if a) for w in W] for row in N]
        gap = [h[i] - sum(a * b for a, b in zip(N[i], free) if a) for i in range(m)]
        tried = 0
        for contact in itertools.chain.from_iterable(itertools.combinations(range(m), k) for k in range(min(d, m) + 1)):
            tried += 1
            if tried > MOST_SETS:
                return
            press = []
            if contact:
                y, positive = solve_equations([[D[a][b] for b in contact] for a in contact], [[-gap[a]] for a in contact])
                press = [x[0] for x in y] if y else []
                if not positive or any(x < 0 for x in press):
                    continue
            if all(gap[i] + sum(D[i][b] * x for b, x in zip(contact, press)) >= 0 for i in range(m) if i not in contact):
                self.u = [free[j] - sum(W[b][j] * x for b, x in zip(contact, press)) for j in range(d)]
                self.feasible = True
                return
        self.feasible = False

    def square(self, x):
        return sum(a * b * self.K[i][j] for i, a in enumerate(x) for j, b in enumerate(x) if a and b)

    def energy(self):
        return self.square(self.u) / 2 - sum(a * b for a, b in zip(self.p, self.u))


# ---------------------------------------------------------------------------------------------------- problems

def short(chance, most=4):
    return float(chance.randint(-most, most))


def make_stiffness(chance, d):
    kind = chance.choice(["sum", "sum", "diagonal", "springs", "graded", "near"])
    if kind == "diagonal":
        return kind, [[float(chance.randint(1, 9)) if i == j else 0.0 for j in range(d)] for i in range(d)]
    if kind == "springs":
        k = [2.0 ** chance.randint(-30, 30) for _ in range(d)]
        at = lambda i, j: k[i] + (k[i + 1] if i + 1 < d else 0) if i == j else -k[max(i, j)] if abs(i - j) == 1 else 0.0
        return kind, [[at(i, j) for j in range(d)] for i in range(d)]
    B = [[short(chance, 3) for _ in range(d)] for _ in range(d)]
    if kind == "near":  # columns that nearly agree
        B = [[(B[0][j] if i else B[0][j]) + 2.0 ** -chance.randint(3, 24) * B[i][j] for j in range(d)] for i in range(d)]
    ridge = 0 if kind == "near" else chance.randint(1, 4)
    K = [[sum(B[k][i] * B[k][j] for k in range(d)) + (ridge if i == j else 0) for j in range(d)] for i in range(d)]
    if kind == "graded":
        s = [2.0 ** chance.randint(-25, 25) for _ in range(d)]
        K = [[K[i][j] * s[i] * s[j] for j in range(d)] for i in range(d)]
    return kind, K


def make_rows(chance, d, m):
    kind, rows = chance.choice(["short", "unit", "unit", "multiples", "near", "sums", "scaled"]), []
    for _ in range(m):
        row = [short(chance) for _ in range(d)]
        if kind == "unit" or (kind == "multiples" and chance.random() < 0.3):
            row = [0.0] * d
            row[chance.randrange(d)] = chance.choice([1.0, -1.0, 2.0, -0.5])
        elif kind == "multiples" and rows and chance.random() < 0.7:
            row = [chance.choice([-1, -1, -0.1, 0.3, 1, 2]) * x for x in chance.choice(rows)]
        elif kind == "near" and rows and chance.random() < 0.7:
            far, sign = 2.0 ** -chance.randint(8, 60), chance.choice([1, -1])
            row = [sign * x + far * short(chance) for x in chance.choice(rows)]
        elif kind == "sums" and len(rows) > 1 and chance.random() < 0.6:
            row = [-x - y for x, y in zip(*chance.sample(rows, 2))]
        elif kind == "scaled":
            row = [math.ldexp(x, chance.choice([-200, -30, 0, 30, 200])) for x in row]
        rows.append(row)
    return kind, rows


def make_gaps(chance, N, d):
    kind = chance.choice(["free", "zero", "point", "hair", "deep", "mixed"])
    if kind == "free":
        return kind, [chance.randint(0, 8) / 4 for _ in N]
    if kind == "zero":
        return kind, [0.0 for _ in N]
    if kind in ("point", "hair"):  # rows through one point, some of them passed by a hair
        x, hair = [short(chance) for _ in range(d)], 2.0 ** -chance.randint(10, 60)
        at = [float(sum(Fraction(a) * Fraction(b) for a, b in zip(row, x))) for row in N]
        return kind, [h + (chance.choice([0, 0, 1, -1]) * hair if kind == "hair" else 0) for h in at]
    if kind == "deep":
        return kind, [chance.choice([-1, 1, 1]) * chance.randint(0, 8) / 4 for _ in N]
    return kind, [math.ldexp(short(chance), -chance.randint(0, 70)) for _ in N]


def make_request(chance):
    d, m = chance.randint(1, 6), chance.randint(0, 10)
    (of_K, K), (of_N, N) = make_stiffness(chance, d), make_rows(chance, d, m)
    of_h, h = make_gaps(chance, N, d)
    p = [chance.choice([1, 1, 1, 0, 1e-3, 1e4]) * (short(chance) if chance.random() < 0.5 else chance.gauss(0, 1))
         for _ in range(d)]
    scale = {name: 0 for name in "KNhp"}
    if chance.random() < 0.5:
        for name in chance.sample("KNhp", chance.randint(1, 3)):
            scale[name] = chance.choice([-1060, -1000, -700, -520, -300, -100, -40, 40, 100, 300, 520, 700, 1000])
    times = lambda x, name: math.ldexp(x, scale[name]) if abs(x) < 1e15 or scale[name] < 0 else x
    try:
        K = [[times(x, "K") for x in row] for row in K]
        N = [[times(x, "N") for x in row] for row in N]
        h, p = [times(x, "h") for x in h], [times(x, "p") for x in p]
    except OverflowError:
        return None
    solver = {}
    if chance.random() < 0.6:
        solver["accuracy"] = {"relative_error": 10.0 ** chance.uniform(-14, -2)}
    if chance.random() < 0.4:
        solver["method"] = chance.choice(["active_set", "dual_active_set", "accelerated_restart", "uzawa", "conjugate"])
    if chance.random() < 0.4:
        solver["operator"] = chance.choice(["condensed", "factored", "matrix_free"])
    if chance.random() < 0.2:
        solver["row_scaling"] = chance.choice(["none", "unit"])
    solver["max_iterations"] = 20000
    name = f"{of_K} {of_N} {of_h} d{d} m{m} " + " ".join(f"{k}2^{e}" for k, e in scale.items() if e)
    return name, K, N, h, p, solver


def text_of(A, cols, symmetric):
    entries = [f"{i + 1} {j + 1} {x!r}" for i, row in enumerate(A) for j, x in enumerate(row)
               if x and not (symmetric and j > i)]
    kind = "symmetric" if symmetric else "general"
    return f"%%MatrixMarket matrix coordinate real {kind}\n{len(A)} {cols} {len(entries)}\n" + "\n".join(entries) + "\n"


# ------------------------------------------------------------------------------------------------------ claims

def exactly(values):
    return [Fraction(x) for x in values]


def judge(truth, requested, told, u):
    """What of the summary is false, as a list of sentences, and the kind of end it was."""
    outcome, c, false = told["outcome"], told.get("certificate") or {}, []
    if not truth.definite:
        return (["K is not positive definite"] if outcome == "converged" else []), "not definite: " + outcome
    if truth.feasible is None:
        return [], "not judged: " + outcome
    if not truth.feasible:
        return (["contradictory, but " + outcome] if outcome == "converged" else []), "contradictory: " + outcome
    largest = max(abs(x) for x in truth.u)
    if outcome == "infeasible":
        return ["feasible, but infeasible"], "feasible: " + outcome
    if outcome == "out_of_reach" and told.get("infeasible_radius") and Fraction(told["infeasible_radius"]) > largest:
        return ["the radius is larger than the answer"], "feasible: " + outcome
    bound, relative = c.get("absolute_error"), c.get("relative_error")
    if outcome == "converged" and (relative is None or relative > requested):
        false.append("converged without the certificate for it")
    if bound is None or u is None or any(x is None for x in u):
        return false + (["converged without an answer"] if outcome == "converged" else []), f"feasible: {outcome}, no bound"
    error = truth.square([a - b for a, b in zip(exactly(u), truth.u)])
    whole = truth.square(truth.u)
    if error > Fraction(bound) ** 2:
        false.append(f"absolute error {float(error) ** 0.5 if error > 1e-300 else error} above {bound}")
    if relative is not None and error > Fraction(relative) ** 2 * whole * (1 + Fraction(1, 2 ** 30)):
        false.append(f"relative error {float(error / whole) ** 0.5 if whole else 'infinite'} above {relative}")
    energy, below, above = truth.energy(), told.get("energy", {}).get("dual"), told.get("energy", {}).get("primal")
    if (below is not None and Fraction(below) > energy) or (above is not None and Fraction(above) < energy):
        false.append(f"energies {below} {above} do not enclose the least one")
    right = whole and error <= whole / 10 ** 24
    end = ", right to 1e-12" if outcome == "precision_limit" and right else ""
    return false, "feasible: " + outcome + end


def run(s, numbers, seed, show=False):
    """Posts the problems of these numbers to service s. How often each kind of end came, and the false claims."""
    tally, wrong = {}, []
    for k in numbers:
        made = make_request(random.Random(f"{seed} {k}"))
        if not made:
            continue
        name, K, N, h, p, solver = made
        request = {"problem": {"kind": "matrices", "K": text_of(K, len(K), True), "p": p, "h": h,
                               "N": text_of(N, len(K), False)}, "solver": solver}
        posted = s.request("POST", "/v1/jobs", json.dumps(request), {"Content-Type": "application/json", "Prefer": "wait=120"})
        job = posted.json
        if posted.status >= 500:
            false, end = [f"status {posted.status}"], "failed"
        elif posted.status >= 400 or job["status"] != "successful":
            code = job["code"] if posted.status >= 400 else job["error"]["code"]
            false, end = ["internal"] if code == "internal" else [], "refused: " + code
        else:
            told = job["summary"]
            u = s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json.get("displacements")
            truth = Truth([exactly(x) for x in K], [exactly(x) for x in N], exactly(h), exactly(p))
            requested = solver.get("accuracy", {}).get("relative_error", told["requested_error"] or 0)
            false, end = judge(truth, requested, told, u)
        if show:
            print(json.dumps(request), json.dumps(job, indent=1))
        tally[end] = tally.get(end, 0) + 1
        if false:
            wrong.append(f"{k}: {name} {json.dumps(solver)}: {'; '.join(false)}")
    return tally, wrong


def main():
    count, seed = int(sys.argv[2]) if len(sys.argv) > 2 else 2000, int(sys.argv[3]) if len(sys.argv) > 3 else 1
    only = int(sys.argv[4]) if len(sys.argv) > 4 else None
    s = service.Service(sys.argv[1], "--workers", "1", "--keep-jobs", "100").start()
    try:
        tally, wrong = run(s, range(count) if only is None else [only], seed, only is not None)
    finally:
        s.stop()
    print(*wrong, f"seed {seed}: {sum(tally.values())} problems, {len(wrong)} with a false claim", sep="\n")
    for end in sorted(tally):
        print(f"  {tally[end]:6d}  {end}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
