"""Solvers of linear complementarity problems of Siconos numerics on the dual: w = D z + g0 >= 0, z >= 0, w'z = 0.
usage: siconos_peer.py CONDENSED D_OF_THE_PROBLEM"""
import sys

import numpy
import siconos.numerics as numerics

import exchange

dual = exchange.Condensed(sys.argv[1])
METHODS = {"lemke": numerics.SICONOS_LCP_LEMKE, "newton_min": numerics.SICONOS_LCP_NEWTON_MIN_FBLSA,
           "newton_fb": numerics.SICONOS_LCP_NEWTON_FB_FBLSA, "psor": numerics.SICONOS_LCP_PSOR}
MOST = {"lemke": 100 * dual.m, "newton_min": 1000, "newton_fb": 1000, "psor": 100000}


def solve(method, tolerance):
    options = numerics.SolverOptions(METHODS[method])
    options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = MOST[method]
    options.dparam[numerics.SICONOS_DPARAM_TOL] = tolerance
    z, w = numpy.zeros(dual.m), numpy.zeros(dual.m)
    problem = numerics.LCP(dual.D, dual.g0)
    info = numerics.linearComplementarity_driver(problem, z, w, options)
    iterations = options.iparam[numerics.SICONOS_IPARAM_ITER_DONE]
    return None, -z, iterations, "ok" if info == 0 else f"Siconos info {info}"


exchange.serve(int(sys.argv[2]), solve)
