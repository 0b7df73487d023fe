"""Solves a row of springs against stops by a method of its own, and has the answer certified.

usage: verify.py [SWEEPS]                       exit status 0: certified to 1e-6

The method is Gauss-Seidel on the displacements, each cut at its stop (projected SOR with factor 1: C. W. Cryer, SIAM
J. Control 9 (1971) 385-392); too few sweeps give an answer that the certificate does not take.
"""
import sys

from uzawa import Uzawa

N, STIFFNESS, FORCE, GAP = 12, 1000.0, 0.4, 0.02


def springs():
    """Tridiagonal K of N springs in a row, fixed at one end, pulled at each joint; joint i stops at GAP."""
    entries = [(i, i, 2 * STIFFNESS if i < N - 1 else STIFFNESS) for i in range(N)]
    entries += [(i + 1, i, -STIFFNESS) for i in range(N - 1)]
    rows = "".join(f"{i + 1} {j + 1} {value:.17g}\n" for i, j, value in entries)
    return f"%%MatrixMarket matrix coordinate real symmetric\n{N} {N} {len(entries)}\n{rows}"


def residual(u, i):
    """Row i of K u - p."""
    left = u[i - 1] if i > 0 else 0.0
    right = u[i + 1] - u[i] if i < N - 1 else 0.0
    return STIFFNESS * (u[i] - left - right) - FORCE


def solve(sweeps):
    u = [0.0] * N
    for _ in range(sweeps):
        for i in range(N):
            diagonal = 2 * STIFFNESS if i < N - 1 else STIFFNESS
            u[i] = min(u[i] - residual(u, i) / diagonal, GAP)
    reactions = [min(residual(u, i), 0.0) if u[i] >= GAP else 0.0 for i in range(N)]
    return u, reactions


def main(sweeps):
    u, r = solve(sweeps)
    unit = "".join(f"{i + 1} {i + 1} 1\n" for i in range(N))
    problem = {"kind": "matrices", "K": springs(), "h": [GAP] * N, "p": [FORCE] * N,
               "N": f"%%MatrixMarket matrix coordinate real general\n{N} {N} {N}\n{unit}"}
    summary = Uzawa().verify({"problem": problem, "answer": {"displacements": u, "reactions": r},
                              "solver": {"accuracy": {"relative_error": 1e-6}}})["summary"]
    bound = summary["certificate"]["relative_error"]  # None: nothing could be certified
    print(f"{summary['outcome']}: {summary['contact']['active']} of {N} joints touch, "
          f"relative error {'unknown' if bound is None else f'at most {bound:.2g}'}")
    return 0 if summary["outcome"] == "verified" else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000))
