/* null_space.h: the null space of a K that is known by its matrix only. */
#ifndef UZ_NULL_SPACE_H
#define UZ_NULL_SPACE_H

#include "factor/factor.h"
#include "uzawa.h"

/* Is K (lower triangle) positive semidefinite but for rounding? Checked by a Cholesky factorization of K + delta
 * diag(K), delta 16 d eps: it exists only where no eigenvalue of the K with a unit diagonal is below -delta (and
 * rounding of the size of d eps). UZ_ERR_NOT_SPD when it isn't. K and its factor are not kept. */
uz_status uz_check_semidefinite(const uz_csc *K, const uz_settings *settings, const uz_hooks *hooks, uz_error *err);

/* *Z: d x *k, column by column, each of largest entry 1: a basis of the null space of K, where K_R = K + N'R N (weight:
 * R's diagonal, m) is positive definite and `factor` its factor. A null vector is an eigenvector of K_R^-1 N'R N for
 * the eigenvalue 1, the largest, so subspace iteration finds it (Golub and Van Loan 2013, section 8.2.4). At most
 * UZ_NULL_MOST; *k is more when there are more, *Z then NULL. The caller frees *Z. hooks may
 * be NULL; asked between linear solves: UZ_ERR_CANCELLED. */
enum { UZ_NULL_MOST = 64 };
uz_status uz_null_space(double **Z, int64_t *k, const uz_csc *K, const uz_csc *K_R, const uz_csc *N, const uz_csc *Nt,
                        const double *weight, const uz_factor *factor, const uz_hooks *hooks, uz_error *err);

#endif
