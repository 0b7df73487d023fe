"""Random small problems posted to a daemon, judged in rational numbers by a program that shares nothing with it.

usage: posted.py BUILD_DIR [COUNT [SEED [KIND [ONLY]]]]

KIND `range` (default): up to 6 dofs and 10 rows; K, N, h and p have short entries times powers of two from all of the range
of double; rows repeat, oppose or depend on each other, meet in a point, contradict by a hair. KIND `hard`: up to 12 dofs
and 30 rows; K with conditions of 1e8 to 1e16, vertices with far more rows than dofs, rows of any size, loads that dwarf
strain. Methods, forms, scalings and requests are mixed. Every claim is checked: an outcome, both errors, both energies, the
radius. Prints each false one with the number of its problem (ONLY), and at the end how many were answered; fails where one
was false. `right` in that list: the answer is as near as was asked for, and that was not certified; `possible`: it is not,
but the exact one, rounded, would be.
"""
import json
import math
import pathlib
import random
import sys
from fractions import Fraction

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / "api")]

import service  # noqa: E402  the path is set above

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


def find_contact(D, gap):
    """Whether some press >= 0 has gap + D press >= 0 and no product of the two, and it; or the rows that rule that out."""
    contact, press = [], [Fraction(0)] * len(gap)
    while True:
        gaps = [g + sum(D[i][b] * press[b] for b in contact) for i, g in enumerate(gap)]
        q = min(range(len(gap)), key=gaps.__getitem__, default=0)
        if not gap or gaps[q] >= 0:
            return True, press
        now = gaps[q]
        while q not in contact:
            y, _ = solve_equations([[D[a][b] for b in contact] for a in contact], [[D[a][q]] for a in contact])
            eased = [x[0] for x in y]  # by so much the rows in contact press less for each unit of q
            rate = D[q][q] - sum(D[q][b] * x for b, x in zip(contact, eased))
            step, gone = min(((press[b] / x, b) for b, x in zip(contact, eased) if x > 0), default=(None, None))
            if rate > 0 and (gone is None or -now / rate <= step):
                step, gone = -now / rate, None
            elif gone is None:
                ray = [Fraction(0)] * len(gap)
                for b, x in zip(contact, eased):
                    ray[b] = -x
                ray[q] = Fraction(1)
                return False, ray
            for b, x in zip(contact, eased):
                press[b] -= step * x
            press[q] += step
            now += step * rate
            if gone is None:
                contact.append(q)
            else:
                contact.remove(gone)


class Truth:
    """definite: is K; feasible: is there a u; u, press: the answer. Found by the dual method of Goldfarb and Idnani, which can't go
    in circles without rounding; what counts is that the conditions of the answer, or of a contradiction, are met exactly."""

    def __init__(self, K, N, h, p):
        d, m = len(K), len(N)
        self.K, self.p, self.feasible, self.u, self.press = K, p, None, None, None
        X, self.definite = solve_equations(K, [[p[i]] + [row[i] for row in N] for i in range(d)])
        if not self.definite:
            return
        free, W = [x[0] for x in X], [[x[1 + j] for x in X] for j in range(m)]
        dot = lambda x, y: sum(a * b for a, b in zip(x, y) if a and b)
        D = [[dot(row, w) for w in W] for row in N]
        gap = [h[i] - dot(N[i], free) for i in range(m)]
        self.feasible, press = find_contact(D, gap)
        self.press = press
        if self.feasible:
            self.u = [free[j] - sum(w[j] * x for w, x in zip(W, press) if x) for j in range(d)]
            gaps = [b - dot(row, self.u) for row, b in zip(N, h)]
            balance = [dot(K[j], self.u) + sum(row[j] * x for row, x in zip(N, press) if x) - p[j] for j in range(d)]
            assert not any(balance) and all(x >= 0 and g >= 0 and not x * g for x, g in zip(press, gaps))
        else:
            assert all(x >= 0 for x in press) and dot(press, h) < 0
            assert not any(sum(row[j] * x for row, x in zip(N, press) if x) for j in range(d))

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


def make_ill_conditioned(chance, d):
    """Rounded to doubles, whatever that does to its smallest eigenvalues."""
    kind = chance.choice(["spectrum", "spectrum", "hilbert", "laeuchli", "chain", "plain"])
    if kind == "hilbert":
        n = min(d, 11)
        return kind, [[1 / (i + j + 1) if max(i, j) < n else float(i == j) for j in range(d)] for i in range(d)]
    if kind == "laeuchli":
        small = 10.0 ** chance.uniform(-15, -8)
        return kind, [[1 + small if i == j else 1.0 for j in range(d)] for i in range(d)]
    if kind == "chain":
        k = [10.0 ** chance.uniform(0, 12) for _ in range(d + 1)]
        at = lambda i, j: k[i] + k[i + 1] if i == j else -k[max(i, j)] if abs(i - j) == 1 else 0.0
        return kind, [[at(i, j) for j in range(d)] for i in range(d)]
    Q = []
    while len(Q) < d:  # Gram and Schmidt
        x = [chance.gauss(0, 1) for _ in range(d)]
        for _ in range(2):
            for q in Q:
                along = sum(a * b for a, b in zip(x, q))
                x = [a - along * b for a, b in zip(x, q)]
        length = math.sqrt(sum(a * a for a in x))
        Q.append([a / length for a in x])
    digits = 2 if kind == "plain" else chance.uniform(8, 15.5)
    value = [10.0 ** (-digits * (k / (d - 1) if d > 1 else 1)) for k in range(d)]
    K = [[sum(value[k] * Q[k][i] * Q[k][j] for k in range(d)) for j in range(d)] for i in range(d)]
    return kind, [[K[max(i, j)][min(i, j)] for j in range(d)] for i in range(d)]


def make_hard_request(chance):
    d, m = chance.randint(1, 12), chance.randint(0, 30)
    (of_K, K), kind, N = make_ill_conditioned(chance, d), chance.choice(["vertex", "copies", "bounds", "general"]), []
    at, touching = [short(chance) for _ in range(d)], chance.random()
    for _ in range(m):
        row = [short(chance) if chance.random() < 0.6 else 0.0 for _ in range(d)]
        if kind == "bounds":
            row = [0.0] * d
        row[chance.randrange(d)] = chance.choice([1.0, -1.0])
        if kind == "copies" and N and chance.random() < 0.6:
            row = [chance.choice([1.0, -1.0, 3.0, -0.1, 0.7]) * x for x in chance.choice(N)]
        N.append(row)
    h = []
    for row in N:
        reach = float(sum(Fraction(a) * Fraction(b) for a, b in zip(row, at)))
        h.append(reach + (0 if chance.random() < touching else abs(chance.gauss(0, 1)) * 10.0 ** chance.uniform(-12, 1)))
    if chance.random() < 0.5:  # `at` is the answer, and some rows touch without a reaction
        press = [chance.choice([0, 0, 1]) * abs(chance.gauss(0, 1)) for _ in N]
        p = [sum(a * b for a, b in zip(K[j], at)) + sum(row[j] * x for row, x in zip(N, press)) for j in range(d)]
    else:
        p = [chance.gauss(0, 1) for _ in range(d)]
    far = 10.0 ** chance.choice([0, 0, 0, 3, 6, 9, 12, 20])
    p = [far * x for x in p]
    if chance.random() < 0.5:  # rows of any size, rounded or not
        for i, row in enumerate(N):
            size = chance.choice([10.0 ** chance.uniform(-6, 6), 2.0 ** chance.randint(-20, 20)])
            N[i], h[i] = [size * x for x in row], size * h[i]
    solver = {"accuracy": {"relative_error": 10.0 ** chance.uniform(-13, -4)}, "max_iterations": 20000}
    if chance.random() < 0.3:
        solver["method"] = chance.choice(["active_set", "dual_active_set", "conjugate"])
    if chance.random() < 0.4:
        solver["operator"] = chance.choice(["condensed", "factored", "matrix_free"])
    return f"{of_K} {kind} d{d} m{m} p{far:.0e}", K, N, h, p, solver


KINDS = {"range": make_request, "hard": make_hard_request}


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
    whole, known = truth.square(truth.u), bound is not None and u is not None and all(x is not None for x in u)
    error = truth.square([a - b for a, b in zip(exactly(u), truth.u)]) if known else None
    if known and error > Fraction(bound) ** 2:
        false.append(f"absolute error {float(error) ** 0.5 if error > 1e-300 else error} above {bound}")
    if known and relative is not None and error > Fraction(relative) ** 2 * whole * (1 + Fraction(1, 2 ** 30)):
        false.append(f"relative error {float(error / whole) ** 0.5 if whole else 'infinite'} above {relative}")
    energy, below, above = truth.energy(), told.get("energy", {}).get("dual"), told.get("energy", {}).get("primal")
    if known and ((below is not None and Fraction(below) > energy) or (above is not None and Fraction(above) < energy)):
        false.append(f"energies {below} {above} do not enclose the least one")
    if outcome == "converged" and not known:
        false.append("converged without an answer")
    end = "feasible: " + outcome + ("" if known else ", no bound")
    if outcome in ("precision_limit", "out_of_reach") and whole:
        asked = Fraction(requested) ** 2 * whole / 4
        held = all(abs(x) < Fraction(2) ** 1023 for x in truth.u + truth.press)  # by doubles at all
        best = truth.square([Fraction(float(x)) - x for x in truth.u]) if held else None
        end += ", right" if known and error <= asked else ", possible" if held and best <= asked else ""
    return false, end


def run(s, numbers, seed, kind="range", show=False):
    """Posts the problems of these numbers to service s. How often each kind of end came, and the false claims."""
    tally, wrong = {}, []
    for k in numbers:
        made = KINDS[kind](random.Random(f"{seed} {k}"))
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
        elif end.endswith((", right", ", possible")):
            print(f"{k}: {name} {json.dumps(solver)}: {end}", flush=True)
        tally[end] = tally.get(end, 0) + 1
        if false:
            wrong.append(f"{k}: {name} {json.dumps(solver)}: {'; '.join(false)}")
    return tally, wrong


def main():
    count, seed = int(sys.argv[2]) if len(sys.argv) > 2 else 2000, int(sys.argv[3]) if len(sys.argv) > 3 else 1
    kind, only = sys.argv[4] if len(sys.argv) > 4 else "range", int(sys.argv[5]) if len(sys.argv) > 5 else None
    s = service.Service(sys.argv[1], "--workers", "1", "--keep-jobs", "100").start()
    try:
        tally, wrong = run(s, range(count) if only is None else [only], seed, kind, only is not None)
    finally:
        s.stop()
    print(*wrong, f"{kind}, seed {seed}: {sum(tally.values())} problems, {len(wrong)} with a false claim", sep="\n")
    for end in sorted(tally):
        print(f"  {tally[end]:6d}  {end}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
