/* files.h: how problems and answers go from program to program: numbers of this machine, nothing to parse.
 *
 * Problem: int64 d, m, nonzeros of K, of N; then of K (lower triangle, compressed columns) d + 1 int64 pointers, row
 * indices, values; the same of N; h (m); p (d). Answer: int64 d, m, 1 if there is a u, 1 if there is an r; u (d); r
 * (m). Condensed: int64 m; D (m x m); g0 (m). */
#ifndef TESTS_PEERS_FILES_H
#define TESTS_PEERS_FILES_H

#include "uzawa.h"

/* All: false, with a line on stderr, where the file can't be read or written in full. */
bool peers_write_problem(const char *path, const uz_qp *qp);
bool peers_read_problem(uz_qp *qp, const char *path); /* clear with uz_qp_clear, after a failure too */

/* u (d) or r (m) may be NULL: the peer does not give it. */
bool peers_write_answer(const char *path, const uz_qp *qp, const double *u, const double *r);
/* *u and *r: the caller frees them; NULL where the file has none. */
bool peers_read_answer(double **u, double **r, const char *path, const uz_qp *qp);

bool peers_write_condensed(const char *path, int64_t m, const double *D, const double *g0);

#endif
