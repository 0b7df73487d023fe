/* springs.h: K with springs at the rows, S = K + N' Sigma N, sparse: where rows of several entries become equations
 * (multipliers.h), and in steps of an interior point (interior.h). The pattern is made and analysed once, values as
 * Sigma changes. */
#ifndef UZ_DUAL_SPRINGS_H
#define UZ_DUAL_SPRINGS_H

#include "dual/dual.h"

typedef struct {
    uz_csc S;              /* d x d, lower triangle; ptr NULL: S would have far more entries than K and N */
    uz_analysis *analysis; /* of S: that of K's factor where springs couple no dofs that K does not; NULL as S.ptr */
    const uz_csc *K;       /* borrowed */
    const uz_dual *dual;
    const bool *rows; /* m, borrowed: those with springs; NULL: all */
    int64_t *of_K;    /* where its entries stand in S; NULL: where they stand in K */
    int64_t *of_rows; /* the same of n_i n_i', lower triangle, column after column, row after row */
} uz_springs;

/* K (lower triangle), dual, which has a factor of it, rows: must outlive it. Errors: UZ_ERR_MEMORY. */
uz_status uz_springs_create(uz_springs *a, const uz_csc *K, const uz_dual *dual, const bool *rows, uz_error *err);
/* sigma (m), >= 0. */
void uz_springs_fill(uz_springs *a, const double *sigma);
void uz_springs_clear(uz_springs *a);

#endif
