/* lanczos.h: the largest eigenvalue of the dual operator. */
#ifndef UZ_DUAL_LANCZOS_H
#define UZ_DUAL_LANCZOS_H

#include "uzawa.h"

/* Largest eigenvalue of a symmetric positive semidefinite operator of order m by Lanczos with full
 * reorthogonalisation: Ritz value plus residual bound, relative accuracy `tolerance`. */
typedef uz_status (*uz_apply)(void *ctx, double *y, const double *x, uz_error *err);
uz_status uz_lanczos_max(double *lambda, int64_t m, uz_apply apply, void *ctx, double tolerance, uz_error *err);

#endif
