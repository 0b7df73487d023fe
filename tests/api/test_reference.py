"""The reference values of the paper's body through HTTP. usage: test_reference.py BUILD_DIR [FILTER]

The numbers come from an independent program (mm, N, MPa). Energies and sums are compared at 1e-8 relative, counts
exactly, iterations and restarts within 2 %.
"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import os

import service
from service import SCENE, check, expect

SHARED = True  # one service for all tests

# cells: lambda_max(D), energy, sum of r, contacts, and for each (method, alpha) the (iterations, restarts)
TABLE = {
    (30, 10): (9.427e-4, -3.9608186040e-3, -10.51371700, 22,
               {("accelerated_restart", None): (283, 2), ("accelerated", None): (684, 0), ("uzawa", None): (2872, 0),
                ("accelerated_restart", 93.51): (615, 3)}),
    (60, 20): (1.838e-3, -3.9620174378e-3, -10.53866779, 44,
               {("accelerated_restart", None): (263, 2), ("accelerated", None): (635, 0), ("uzawa", None): (4054, 0),
                ("accelerated_restart", 25.20): (675, 2)}),
    (120, 40): (3.625e-3, -3.9624809230e-3, -10.54546589, 88, {("accelerated_restart", None): (361, 1)}),
}
COLUMNS = ["iteration", "seconds", "dual_objective", "residual_total", "e1", "e2", "e3", "e4", "step_norm",
           "error_bound", "contacts", "restart"]


def body(cells=(30, 10), **solver):
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = list(cells)
    request["solver"] = solver
    return request


def paper(cells, method, alpha=None, **more):
    step = {} if alpha is None else {"alpha": alpha}
    return body(cells, method=method, stopping="paper", epsilon=1e-6, **step, **more)


def close(got, want, relative):
    return abs(got - want) <= relative * abs(want)


def summary_of(s, request):
    job = s.solve(request)
    check(job["status"] == "successful", job)
    return job["summary"]


def history_of(s, request):
    job = s.solve(request)
    history = expect(s.get(f"/v1/jobs/{job['id']}/history"), 200).json
    check(history["columns"] == COLUMNS, history["columns"])
    return job["summary"], history["rows"]


def reactions_of(s, request):
    job = s.solve(request)
    return s.get(f"/v1/jobs/{job['id']}/result?fields=reactions").json["reactions"]


def check_counts(s, operator):
    for cells, (lambda_max, _, _, contacts, runs) in TABLE.items():
        for (method, alpha), (iterations, restarts) in runs.items():
            got = summary_of(s, paper(cells, method, alpha, operator=operator))
            what = (cells, method, alpha, operator, got)
            check(got["method"] == method and got["operator"] == operator, what)
            check(got["outcome"] in ("converged", "paper_rule"), what)
            check(close(got["iterations"], iterations, 0.02) and got["restarts"] == restarts, what)
            check(got["contact"]["candidates"] == cells[0] and got["contact"]["active"] == contacts, what)
            check(alpha or close(got["lambda_max"], lambda_max, 2e-4), what)  # with alpha given nobody needs it
            check(close(got["alpha"], alpha or 1 / lambda_max, 2e-4), what)


def test_paper_iterations_condensed(s):
    check_counts(s, "condensed")


def test_paper_iterations_factored(s):
    check_counts(s, "factored")


def test_certified_energies(s):
    for cells, (_, energy, reaction_sum, contacts, _) in TABLE.items():
        for solver in ({}, {"accuracy": "exact"}, {"method": "accelerated_restart", "operator": "factored"},
                       {"method": "accelerated", "accuracy": {"relative_error": 1e-9}}):
            got = summary_of(s, body(cells, **solver))
            what = (cells, solver, got)
            check(got["outcome"] == "converged", what)
            check(got["certificate"]["relative_error"] <= max(got["requested_error"], 1e-12), what)
            for side in ("primal", "dual"):
                check(close(got["energy"][side], energy, 1e-8), side, what)
            check(got["energy"]["dual"] <= got["energy"]["primal"] + 1e-15 * abs(energy), what)
            check(close(got["contact"]["reaction_sum"], reaction_sum, 1e-8), what)
            check(got["contact"]["active"] == contacts and got["contact"]["candidates"] == cells[0], what)
            check(got["contact"]["max_penetration"] <= 1e-15, what)
            check(close(got["contact"]["force"][1], -reaction_sum, 1e-8) and got["contact"]["force"][0] == 0, what)


def test_plain_method_is_certified_too(s):
    got = summary_of(s, body((30, 10), method="uzawa"))
    _, energy, reaction_sum, contacts, _ = TABLE[30, 10]
    check(got["outcome"] == "converged" and got["method"] == "uzawa", got)
    check(close(got["energy"]["primal"], energy, 1e-8), got)
    check(close(got["contact"]["reaction_sum"], reaction_sum, 1e-8), got)
    check(got["contact"]["active"] == contacts, got)


def compare_histories(rows, others, cells):
    """Column by column; a column's rounding is measured by its largest value. The error bound is left out: it is the
    bound of the answer held, which the two operators build by different moves."""
    check(len(rows) == len(others), cells, len(rows), len(others))
    for i, name in enumerate(COLUMNS):
        if name in ("seconds", "error_bound"):
            continue
        scale = max(abs(row[i]) for row in rows)
        exact = name in ("iteration", "contacts", "restart")
        worst = max(abs(row[i] - other[i]) for row, other in zip(rows, others))
        check(worst <= (0 if exact else 1e-9 * scale), cells, name, "differs by", worst, "of", scale)


def test_operators_agree(s):
    for cells in TABLE:
        for method in ("accelerated_restart", "accelerated", "uzawa"):
            if method == "uzawa" and cells != (30, 10):
                continue  # thousands of rows that say the same
            condensed, rows = history_of(s, paper(cells, method, operator="condensed"))
            factored, others = history_of(s, paper(cells, method, operator="factored"))
            check((condensed["operator"], factored["operator"]) == ("condensed", "factored"), condensed, factored)
            for name in ("iterations", "restarts"):
                check(condensed[name] == factored[name], cells, method, condensed, factored)
            compare_histories(rows, others, (cells, method))


def test_history_ends_where_the_rule_does(s):
    summary, rows = history_of(s, paper((30, 10), "accelerated_restart"))
    step = COLUMNS.index("step_norm")
    check(rows[0][0] == 0 and rows[-1][0] == summary["iterations"], rows[0], rows[-1])
    check(rows[-1][step] <= 1e-6 and min(row[step] for row in rows[1:-1]) > 1e-6, rows[-2:])
    check(sum(row[COLUMNS.index("restart")] for row in rows) == summary["restarts"], summary)
    check(rows[-1][COLUMNS.index("contacts")] == summary["contact"]["active"], rows[-1], summary)


def test_paper_rule_leaves_an_error_in_the_reactions(s):
    """The printed tolerance is a force, so what it leaves grows with the mesh: 7e-4 of the largest reaction at 30 x 10
    and 1e-1 at 600 x 200 (LONG=1), which is why nobody gets it by default."""
    cases = [((30, 10), 7e-4)] + ([((600, 200), 1e-1)] if os.environ.get("LONG") else [])
    for cells, error in cases:
        exact = reactions_of(s, body(cells, accuracy={"relative_error": 1e-9}))
        loose = reactions_of(s, paper(cells, "accelerated_restart"))
        worst = max(abs(a - b) for a, b in zip(exact, loose)) / max(map(abs, exact))
        check(close(worst, error, 0.1), cells, worst, error)


def test_accuracy_against_iterations(s):
    """The algebraic error at 10, 50 and 283 iterations; the certificate bounds it and is not far above it."""
    for iterations, error in ((10, 2.5e-2), (50, 1.4e-3), (283, 7.7e-6)):
        got = summary_of(s, body(method="accelerated_restart", max_iterations=iterations))
        bound = got["certificate"]["relative_error"]
        check(got["outcome"] == "iteration_limit" and got["iterations"] == iterations and got["message"], got)
        check(0.97 * error <= bound <= 2 * error, iterations, error, bound)


def test_balanced_stops_early(s):
    got = summary_of(s, body(accuracy="balanced"))
    check(got["outcome"] == "converged" and got["iterations"] < 100, got)
    check(close(got["discretization_error"], 2.2e-2, 0.25), got)
    check(close(got["requested_error"], got["discretization_error"] / 10, 1e-6), got)
    check(got["certificate"]["relative_error"] <= got["requested_error"], got)


def test_upward_traction_has_no_contact(s):
    request = body()
    request["problem"]["loads"][1]["traction"] = [0, 0.5]
    got = summary_of(s, request)
    check(got["outcome"] == "converged" and got["contact"]["active"] == 0 and got["iterations"] == 0, got)
    check(got["contact"]["reaction_sum"] == 0, got)


def metres(request):
    """The same body in m, N and Pa: energies shrink by 1000, forces stay."""
    problem = request["problem"]
    problem["thickness"] *= 1e-3
    problem["mesh"]["box"]["size"] = [size * 1e-3 for size in problem["mesh"]["box"]["size"]]
    problem["materials"][0]["young"] *= 1e6
    for load in problem["loads"]:
        load["traction"] = [traction * 1e6 for traction in load["traction"]]
    return request


def test_units_change_nothing(s):
    for solver in ({}, {"accuracy": "exact"}, {"method": "accelerated_restart"}, {"method": "uzawa"},
                   {"method": "accelerated_restart", "operator": "factored"}):
        mm, m = summary_of(s, body(**solver)), summary_of(s, metres(body(**solver)))
        what = (solver, mm, m)
        check(mm["outcome"] == m["outcome"] == "converged", what)
        check(close(m["iterations"], mm["iterations"], 0.02) and m["restarts"] == mm["restarts"], what)
        check(close(m["energy"]["primal"], 1e-3 * mm["energy"]["primal"], 1e-9), what)
        check(close(m["contact"]["reaction_sum"], mm["contact"]["reaction_sum"], 1e-7), what)
        check(m["contact"]["active"] == mm["contact"]["active"] == 22, what)


if __name__ == "__main__":
    service.main(globals())
