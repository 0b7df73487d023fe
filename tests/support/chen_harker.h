/* chen_harker.h: CHENHARK of the CUTE collection, after B. Chen and P. T. Harker, SIAM J. Matrix Anal. Appl. 14 (1993):
 * the sum of squares of u_1, u_n and the second differences of u, with 0 before and behind it, under u >= 0. */
#ifndef TESTS_CHEN_HARKER_H
#define TESTS_CHEN_HARKER_H

#include "uzawa.h"

#include <stdlib.h>

/* The solution is 1 on the first n_free of n dofs and 0 behind them, on the first n_degenerate there with r = 0. The
 * caller clears *qp, also on failure. */
static inline uz_status chen_harker_qp(uz_qp *qp, int64_t n, int64_t n_free, int64_t n_degenerate, uz_error *err)
{
    static const double stencil[] = {6.0, -4.0, 1.0};
    *qp = (uz_qp){.p = calloc((size_t)n, sizeof *qp->p), .h = calloc((size_t)n, sizeof *qp->h)};
    uz_status status = qp->p && qp->h ? uz_csc_init(&qp->K, n, n, 3 * n - 3, err) : UZ_ERR_MEMORY;
    if (status == UZ_OK)
        status = uz_csc_init(&qp->N, n, n, n, err);
    for (int64_t j = 0, at = 0; status == UZ_OK && j < n; j++) {
        for (int64_t k = 0; k < 3 && j + k < n; k++, at++) {
            qp->K.idx[at] = (int32_t)(j + k);
            qp->K.val[at] = stencil[k];
        }
        qp->K.ptr[j + 1] = at;
        qp->N.ptr[j + 1] = j + 1;
        qp->N.idx[j] = (int32_t)j;
        qp->N.val[j] = -1.0;
        for (int64_t k = -2; k <= 2; k++) /* p = K u* - r* */
            qp->p[j] += j + k >= 0 && j + k < n_free ? stencil[k < 0 ? -k : k] : 0.0;
        qp->p[j] -= j >= n_free + n_degenerate ? 1.0 : 0.0;
    }
    return status;
}

#endif
