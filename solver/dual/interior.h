/* interior.h: which rows touch, by an interior point method on the whole body.
 *
 * With u = K^-1 p + w, reactions -z and gaps s the problem is K w + N'z = 0, N w + s = g0, s and z not negative, their
 * products zero: Newton's method on products of mu, with the predictor and the corrector of S. Mehrotra, SIAM J. Optim.
 * 2 (1992), and the proximal terms of Friedlander and Orban, Math. Prog. Comp. 4 (2012), which keep its matrices
 *
 *     S = K + N' Sigma N,   sigma_i = z_i / (s_i + delta_i z_i)
 *
 * definite where rows depend on each other. Some 10 to 30 steps, however badly K is conditioned and however many rows
 * touch: where single exchanges are left, on slender bodies and long chains of rows, each of which moves all the
 * others, that is far less. Cost of a step: a factorization of S and two solves. */
#ifndef UZ_DUAL_INTERIOR_H
#define UZ_DUAL_INTERIOR_H

#include "dual/dual.h"

/* active (m): the rows that touch, as the last step has it. most_work: passed entries of matrices that it may take;
 * where it is expected to take more, *can is false. *can false: also where the rows are too dense for S, S can't be
 * factored, or it had to stop; only then active was written. Errors: UZ_ERR_MEMORY, _INTERNAL. */
uz_status uz_dual_load_interior(uz_dual_load *load, bool *can, bool *active, double most_work, uz_error *err);

#endif
