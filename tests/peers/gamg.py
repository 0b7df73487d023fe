"""Solids in contact by the daemon, and the linear solve of the same K by PETSc's GAMG at its defaults.
usage: gamg.py BUILD_DIR OUTPUT.json [CELLS="32 64"] [RUNS=3]

A cube of CELLS cells along a side, clamped on one side, pulled on the opposite one, pressed on a plane: as a box, as
hex8 whose inner nodes were moved, as tet4. Of GAMG: making it and conjugate gradients to 1e-8, for K that is there; with
the translations that it takes by itself or with all rigid motions, whichever takes less in the first run. Of the daemon:
the whole, from request to answer, with a mesh that is no box as an uploaded file, certified to 1e-6, with a body that it
has not seen and with another load on it. Seconds of processor; a ratio is of runs one after the other, medians of RUNS.
64 cells take some 4 minutes a run, and 5 GB."""
import itertools
import json
import pathlib
import statistics
import sys
import time

import numpy
import petsc4py
from cubes import CORNERS, POISSON, SIDE, YOUNG, by_daemon, gmsh, mesh, request

petsc4py.init([])
from petsc4py import PETSc  # noqa: E402  it reads the options when it is imported

NEIGHBOURS = 27  # of a node, itself among them
AT_ONCE = 1 << 14  # elements whose stiffness is there at the same time
LARGE = 400000  # unknowns, from which on the second of the targets holds
TARGETS = {"box": (0.3, 0.15), "hex8": (1.0, 0.7), "tet4": (1.0, 0.7)}


def stiffness(nodes, elements):
    """Of each element, by Gauss points of its own: (elements, dofs, dofs)."""
    lame, shear = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
    corners = elements.shape[1]
    points = [(t, 1 / 6) for t in [(0.25, 0.25, 0.25)]] if corners == 4 else \
        [(t, 1 / 8) for t in itertools.product(*3 * [(0.5 - 12 ** -0.5, 0.5 + 12 ** -0.5)])]
    K = numpy.zeros((len(elements), 3 * corners, 3 * corners))
    for point, weight in points:
        if corners == 4:
            slopes = numpy.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
        else:
            part = [[(t if c[a] else 1 - t) for a, t in enumerate(point)] for c in CORNERS]
            slopes = numpy.array([[(2 * c[a] - 1) * p[a - 2] * p[a - 1] for a in range(3)] for c, p in zip(CORNERS, part)])
        J = numpy.einsum("ca,ecx->eax", slopes, nodes[elements])
        g = numpy.einsum("exa,ca->ecx", numpy.linalg.inv(J), slopes)
        w = weight * numpy.linalg.det(J)
        own = numpy.einsum("e,ecx,edy->ecxdy", lame * w, g, g) + numpy.einsum("e,ecy,edx->ecxdy", shear * w, g, g)
        own += numpy.einsum("ecd,xy->ecxdy", numpy.einsum("e,ecx,edx->ecd", shear * w, g, g), numpy.eye(3))
        K += own.reshape(K.shape)
    return K


class Linear:
    """K of the dofs that are not held, p, and the rigid motions."""

    def __init__(self, nodes, elements, faces):
        free = numpy.ones(len(nodes), bool)
        free[faces["left"]] = False
        number = numpy.where(free, numpy.cumsum(free) - 1, -1)
        dof = 3 * number[elements][:, :, None] + numpy.arange(3)
        dof = numpy.where(number[elements][:, :, None] < 0, -1, dof).reshape(len(elements), -1)
        n = 3 * int(free.sum())
        self.K = PETSc.Mat().createAIJ((n, n), bsize=3, nnz=3 * NEIGHBOURS, comm=PETSc.COMM_SELF)
        dof = dof.astype(PETSc.IntType)
        for first in range(0, len(dof), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            self.K.setValuesRCV(dof[some], dof[some], stiffness(nodes, elements[some]).reshape(len(dof[some]), -1), addv=True)
        self.K.assemble()
        self.K.setOption(PETSc.Mat.Option.SPD, True)
        self.p, self.x = self.K.createVecLeft(), self.K.createVecRight()
        force = numpy.zeros((len(nodes), 3))
        for side, traction in (("top", (0, -0.05, 0)), ("right", (0.5, 0, 0))):
            share = SIDE ** 2 / faces[side].size  # of a face's area to each of its nodes, all being about alike
            numpy.add.at(force, faces[side].ravel(), share * numpy.array(traction))
        self.p.setArray(force[free].ravel())
        place = PETSc.Vec().createWithArray(nodes[free].ravel(), bsize=3, comm=PETSc.COMM_SELF)
        self.ways = (None, PETSc.NullSpace().createRigidBody(place))

    def solve(self):
        """Of the quicker way, the only one from then on: seconds of making the multigrid and of the solve, and its
        iterations."""
        runs = [self.solve_with(motions) for motions in self.ways]
        best = min(range(len(runs)), key=lambda k: runs[k][0] + runs[k][1])
        self.ways = self.ways[best:best + 1]
        return runs[best]

    def solve_with(self, motions):
        K = self.K.copy()  # nothing is kept of an earlier run
        if motions:
            K.setNearNullSpace(motions)
        ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        ksp.setType("cg")
        ksp.setOperators(K)
        ksp.getPC().setType("gamg")
        ksp.setTolerances(rtol=1e-8)
        start = time.process_time()
        ksp.setUp()
        made = time.process_time()
        ksp.solve(self.p, self.x)
        end = time.process_time()
        if ksp.getConvergedReason() <= 0:
            raise RuntimeError(f"PETSc ended with reason {ksp.getConvergedReason()}")
        return made - start, end - made, ksp.getIterationNumber()


def row_of(build, kind, n, repeats):
    nodes, elements, faces = mesh(kind, n)
    asked, file = request("box", n, nodes, elements, faces), None if kind == "box" else gmsh(kind, nodes, elements, faces)
    linear, runs = Linear(nodes, elements, faces), []
    for _ in range(repeats):
        made, solved, iterations = linear.solve()
        (cold, cached), summary = by_daemon(build, asked, file)
        runs.append((made, solved, cold, cached, cold / (made + solved), cached / (made + solved)))
    middle = [statistics.median(run[k] for run in runs) for k in range(6)]
    spread = [min(run[4] for run in runs), max(run[4] for run in runs)]
    unknowns = linear.p.getSize()
    target = TARGETS[kind][unknowns >= LARGE]
    row = {"name": f"{kind} {unknowns}", "mesh": kind, "unknowns": unknowns, "runs": repeats, "gamg_setup_s": middle[0], "gamg_solve_s": middle[1],
           "gamg_iterations": iterations, "cold_s": middle[2], "cached_s": middle[3], "cold_ratio": middle[4], "cached_ratio": middle[5],
           "cold_spread": spread, "target": target, "operator": summary["operator"], "certified": summary["certificate"]["relative_error"]}
    if summary["problem"]["d"] != unknowns:
        raise RuntimeError(f"{summary['problem']['d']} unknowns, of GAMG's K {unknowns}")
    print(f"{kind:6s} {unknowns:9d} {middle[0]:10.2f} {middle[1]:10.2f} {iterations:5d} {middle[2]:8.2f} {middle[3]:8.2f} "
          f"{middle[4]:7.2f} ({spread[0]:.2f} to {spread[1]:.2f}; target {target}) {middle[5]:7.2f}  {row['operator']}", flush=True)
    return row


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    given = {"CELLS": "32", "RUNS": "3", **dict(word.split("=") for word in sys.argv[3:])}
    print(f"{'mesh':6s} {'unknowns':>9s} {'GAMG made':>10s} {'solved':>10s} {'its':>5s} {'cold':>8s} {'cached':>8s} {'ratio':>7s} {'':28s} {'cached':>7s}")
    rows = [row_of(sys.argv[1], kind, int(n), int(given["RUNS"])) for n in given["CELLS"].split() for kind in TARGETS]
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"rows": rows}), encoding="utf-8")


if __name__ == "__main__":
    main()
