/* multipliers.h: the contact problem with given rows as equations, where rows have several entries each and only a
 * factor of K is there.
 *
 * Augmented Lagrangian (Hestenes 1969, Powell 1969): with S = K + N_A' Sigma N_A, sparse and positive definite however
 * the rows depend on each other, and the residuals e of equilibrium and f of the gaps,
 *
 *     S du = e + N_A' Sigma f,   dr = Sigma (f - N_A du)
 *
 * takes as many digits in each pass as Sigma is large beside the inverse of D_AA; where that is few, Sigma grows. Cost:
 * a factorization of S, and a few substitutions. */
#ifndef UZ_DUAL_MULTIPLIERS_H
#define UZ_DUAL_MULTIPLIERS_H

#include "dual/sparse.h"

/* See uz_active_end. *end stays as it is where rows are too dense for S, contradict each other, or it had
 * to stop. */
uz_status uz_multipliers_solve(uz_sparse_load *x, uz_factor_workspace *ws, uz_active_end *end, double *r, double *g,
                               const bool *active, uz_error *err);

#endif
