"""Bound-constrained methods of PETSc's TAO on the dual: minimize 1/2 z'Dz + g0'z over z >= 0.
usage: tao_peer.py CONDENSED D_OF_THE_PROBLEM"""
import sys

import numpy
import petsc4py

petsc4py.init([])
from petsc4py import PETSc  # noqa: E402  it reads the options when it is imported

import exchange  # noqa: E402

dual = exchange.Condensed(sys.argv[1])
# Many times what each takes where it converges (here: 23,000, 1,200 and 80); the methods of second order stall otherwise.
MOST = {"blmvm": 100000, "tron": 10000, "bqpip": 2000}


class Quadratic:
    def __init__(self):
        self.D = PETSc.Mat().createDense((dual.m, dual.m), array=dual.D.copy(), comm=PETSc.COMM_SELF)
        self.D.assemble()
        self.D.setOption(PETSc.Mat.Option.SPD, True)
        self.product = self.D.createVecLeft()

    def value_and_gradient(self, tao, z, gradient):
        self.D.mult(z, self.product)
        value = 0.5 * z.dot(self.product) + dual.g0 @ z.array_r
        gradient.array[:] = self.product.array_r + dual.g0
        return value

    def hessian(self, tao, z, H, P):
        pass


def solver(method, tolerance, quadratic):
    tao = PETSc.TAO().create(PETSc.COMM_SELF)
    tao.setType(method)
    tao.setObjectiveGradient(quadratic.value_and_gradient, None)
    tao.setHessian(quadratic.hessian, quadratic.D, quadratic.D)
    tao.setTolerances(gatol=tolerance * numpy.linalg.norm(dual.g0), grtol=0, gttol=0)
    tao.setMaximumIterations(MOST[method])
    tao.setMaximumFunctionEvaluations(1000000)
    if method != "blmvm":  # the reduced systems are dense and small
        tao.getKSP().getPC().setType("cholesky" if method == "bqpip" else "jacobi")
    return tao


def solve(method, tolerance):
    quadratic = Quadratic()
    z, low = quadratic.D.createVecRight(), quadratic.D.createVecRight()
    high = quadratic.D.createVecRight()
    low.set(0)
    high.set(PETSc.INFINITY)
    tao = solver(method, tolerance, quadratic)
    tao.setVariableBounds((low, high))
    tao.solve(z)
    reason = tao.getConvergedReason()
    return None, -z.array_r.copy(), tao.getIterationNumber(), "ok" if reason > 0 else f"TAO reason {reason}"


exchange.serve(int(sys.argv[2]), solve)
