/* lanczos.h: the largest eigenvalue of the dual operator. */
#ifndef UZ_DUAL_LANCZOS_H
#define UZ_DUAL_LANCZOS_H

#include "dual/dual.h"

/* Largest eigenvalue of D, or of W D W (weight: m, NULL: all 1), by Lanczos with full reorthogonalisation: Ritz value
 * plus residual bound, relative accuracy `tolerance`. Errors: those of the form's apply; UZ_ERR_CANCELLED, which nobody
 * was told, where the load's stop came. */
uz_status uz_lanczos_max(double *lambda, uz_dual_load *load, const double *weight, double tolerance, uz_error *err);

#endif
