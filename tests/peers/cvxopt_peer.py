"""CVXOPT's coneqp (Vandenberghe, "The CVXOPT linear and quadratic cone program solvers", 2010), a primal-dual
interior-point method with Nesterov-Todd scaling, on the sparse problem. usage: cvxopt_peer.py PROBLEM
Method "chol2": its default, Cholesky factorizations of K + N'W^-2 N by CHOLMOD."""
import sys

import cvxopt
import cvxopt.solvers
import numpy

import exchange

problem = exchange.Problem(sys.argv[1])


def sparse(matrix, rows, cols):
    pointers, indices, values = matrix
    columns = numpy.repeat(numpy.arange(cols), numpy.diff(pointers))
    return cvxopt.spmatrix(cvxopt.matrix(values), cvxopt.matrix(indices), cvxopt.matrix(columns), (rows, cols))


K, N = sparse(problem.K, problem.d, problem.d), sparse(problem.N, problem.m, problem.d)
P, H = cvxopt.matrix(-problem.p), cvxopt.matrix(problem.h)


def solve(method, tolerance):
    options = {"show_progress": False, "maxiters": 200, "abstol": 1e-300, "reltol": tolerance,
               "feastol": max(tolerance, 1e-9)}  # its absolute gap would be one in whatever units the problem has
    found = cvxopt.solvers.qp(K, P, N, H, kktsolver=method, options=options)
    return (numpy.array(found["x"]).ravel(), -numpy.array(found["z"]).ravel(), found["iterations"],
            "ok" if found["status"] == "optimal" else found["status"])


exchange.serve(problem.d, solve)
