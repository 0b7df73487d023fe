/* distrust.h: how far may a factorization of K be trusted?
 *
 * No pivot says it, and no bound in advance on the rounding of the factor is both safe and of use. So it is measured on
 * the original K. With K ~ S S' (S = P'L of a Cholesky factor) let M = I - S^-1 K S^-T. Then
 *
 *     (1 - ||M||) e'K^-1 e  <=  ||S^-1 e||^2  <=  (1 + ||M||) e'K^-1 e,
 *
 * and ||M|| < 1 proves K positive definite. K times a vector is summed in double-double precision: what rounding adds
 * in the substitutions is of the order of eps times the root of the condition, where M itself is eps times the
 * condition. */
#ifndef UZ_DISTRUST_H
#define UZ_DISTRUST_H

#include "core/hooks.h"
#include "uzawa.h"

/* In place on X (d x columns, column-major), K ~ S S': X = S^-1 X, or S^-T X. S may have its rows in any order. */
typedef uz_status (*uz_half_solve)(void *ctx, double *X, int64_t columns, bool transposed, uz_error *err);

/* *norm >= ||M||, except with a probability below 1e-12; INFINITY where nothing was found out. A few linear solves with
 * eight columns (few where d is large or M is small), with cancellation points between them (stop NULL: none):
 * UZ_ERR_CANCELLED. UZ_ERR_NOT_SPD: some y has y'K y < 0, by more than the rounding of that. */
uz_status uz_distrust(double *norm, const uz_csc *K, uz_half_solve half, void *ctx, const uz_stop *stop, uz_error *err);

#endif
