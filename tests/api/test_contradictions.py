"""Rows that contradict each other, exactly or but for rounding: what is feasible is never called infeasible."""
# not under ThreadSanitizer: about answers, not about threads
import json

import service
from service import ROOT, check

SHARED = True  # one service for all tests

BANNER = "%%MatrixMarket matrix coordinate real "
CASES = ROOT / "tests" / "data" / "contradictions"


def entries(rows):
    lines = [f"{i + 1} {j + 1} {value!r}" for i, row in enumerate(rows) for j, value in enumerate(row) if value]
    return f"{BANNER}general\n{len(rows)} {len(rows[0])} {len(lines)}\n" + "\n".join(lines) + "\n"


def result_of(s, job):
    return s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions").json


def solve(s, N, h):
    K = f"{BANNER}symmetric\n2 2 2\n1 1 1\n2 2 1\n"
    return s.solve({"problem": {"kind": "matrices", "K": K, "p": [0, 0], "N": entries(N), "h": h}})


def test_feasible_in_rationals(s):
    """Two rows leave a slab, a cone or a corner that is far away: solved as far as doubles hold the answer."""
    reach = {"1": None, "2": None, "cone": None, "slab": None, "thin": [-1, 1e8]}
    for name, u in reach.items():
        job = s.solve(json.loads((CASES / f"feasible_{name}.json").read_text()))
        summary, answer = job["summary"], result_of(s, job)
        check(summary["outcome"] == "converged", name, summary)
        check(summary["certificate"]["relative_error"] < 1e-9, name, summary)
        check(u is None or answer["displacements"] == u, name, answer)


def test_infeasible_names_its_rows(s):
    """An exact ray, also where doubles can hardly tell; and rows that only look the same."""
    unit = 2.0 ** -52
    for N, h in ([[1, 0], [-1, 0]], [1, -1 - unit]), ([[0.6, 0.8], [-1.2, -1.6]], [1, -3]), \
                ([[0, 1], [1, 1], [-2, -3]], [0, 0, -unit]), ([[0.5, 0.1], [0, 0]], [1, -unit]):
        job = solve(s, N, h)
        summary, ray = job["summary"], result_of(s, job)["ray"]
        check(summary["outcome"] == "infeasible" and summary["infeasible_radius"] is None, N, summary)
        rows = ", ".join(str(i) for i, y in enumerate(ray) if y < 0)
        check(rows and summary["message"].endswith(f"contradict: {rows}"), N, summary)
    job = solve(s, [[1, 0.5], [-1, -0.5 - unit]], [1, -1 - 8 * unit])
    check(job["summary"]["outcome"] == "converged", job)


def test_out_of_reach(s):
    """Feasible from u_2 = 1e300 on, where the energy is no double any more."""
    job = solve(s, [[1, 0], [-1, -1e-300]], [1, -2])
    summary, answer = job["summary"], result_of(s, job)
    check(summary["outcome"] == "out_of_reach" and 0.9e300 < summary["infeasible_radius"] <= 1e300, summary)
    check(summary["message"].endswith("contradict: 0, 1") and len(answer["ray"]) == 2, summary)
    check(answer["displacements"] == [None] * 2 and summary["certificate"]["relative_error"] is None, answer)
    refused = s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": "exact"})
    check(refused.status == 409, refused)


if __name__ == "__main__":
    service.main(globals())
