"""Problems and answers in files (files.h), and the loop of a peer that is written in Python (peer.h)."""
import json
import sys
import time

import numpy


class Problem:
    """K (lower triangle) and N as (pointers, rows, values) by columns, h, p."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.d, self.m, nnz_K, nnz_N = numpy.fromfile(file, numpy.int64, 4)
            self.K = self._matrix(file, nnz_K)
            self.N = self._matrix(file, nnz_N)
            self.h = numpy.fromfile(file, numpy.float64, self.m)
            self.p = numpy.fromfile(file, numpy.float64, self.d)

    def _matrix(self, file, nnz):
        return (numpy.fromfile(file, numpy.int64, self.d + 1), numpy.fromfile(file, numpy.int64, nnz),
                numpy.fromfile(file, numpy.float64, nnz))


class Condensed:
    """The dual: minimize 1/2 z'Dz + g0'z over z >= 0, with r = -z. d is 0: there is no u in its answers."""

    d = 0

    def __init__(self, path):
        with open(path, "rb") as file:
            self.m = int(numpy.fromfile(file, numpy.int64, 1)[0])
            self.D = numpy.fromfile(file, numpy.float64, self.m * self.m).reshape(self.m, self.m)
            self.g0 = numpy.fromfile(file, numpy.float64, self.m)


def write_answer(path, d, r, u=None):
    with open(path, "wb") as file:
        numpy.array([d, len(r), u is not None, 1], numpy.int64).tofile(file)
        if u is not None:
            numpy.asarray(u, numpy.float64).tofile(file)
        numpy.asarray(r, numpy.float64).tofile(file)


def serve(d, solve):
    """Answers lines until there are no more. Seconds are of the processor (peer_seconds in peer.h). solve(method, tolerance) gives u or None, r, iterations and the status."""
    print(json.dumps({"status": "ready"}), flush=True)
    for line in sys.stdin:
        method, tolerance, path = line.split()
        start = time.process_time()
        try:
            u, r, iterations, status = solve(method, float(tolerance))
            seconds = time.process_time() - start
            write_answer(path, d, r, u)
        except MemoryError:
            seconds, iterations, status = time.process_time() - start, 0, "out of memory"
        except (ArithmeticError, ValueError, RuntimeError, TypeError) as error:
            seconds, iterations, status = time.process_time() - start, 0, f"{type(error).__name__}: {error}"[:80]
        print(json.dumps({"status": status, "seconds": seconds, "iterations": int(iterations)}), flush=True)
