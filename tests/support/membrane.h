/* membrane.h: a membrane over an obstacle, with rows of every shape: the five-point Laplacian on n x n dofs, pulled
 * down by a load that varies, over a floor at depth 0.3, which about half of it reaches. */
#ifndef TESTS_MEMBRANE_H
#define TESTS_MEMBRANE_H

#include "uzawa.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

typedef struct {
    int64_t n, m;  /* n x n dofs, m <= n n / 2 rows */
    bool pairs;    /* rows of two entries; else of one */
    bool repeated; /* one more row, which is row 0 again at another scale */
    bool loose;    /* nothing holds the edges: K is singular, and only the floor holds the membrane */
} membrane;

/* Lower triangle. */
static inline uz_status membrane_stiffness(uz_csc *K, const membrane *kind, uz_error *err)
{
    int64_t n = kind->n, d = n * n, nnz = 0;
    uz_status status = uz_csc_init(K, d, d, d + 2 * n * (n - 1), err);
    for (int64_t j = 0; status == UZ_OK && j < d; j++) {
        int64_t x = j % n, y = j / n, edges = (x == 0) + (x == n - 1) + (y == 0) + (y == n - 1);
        K->idx[nnz] = (int32_t)j;
        K->val[nnz++] = 4.0 - (kind->loose ? 1.0 : 0.5) * (double)edges;
        if (x + 1 < n) {
            K->idx[nnz] = (int32_t)(j + 1);
            K->val[nnz++] = -1.0;
        }
        if (y + 1 < n) {
            K->idx[nnz] = (int32_t)(j + n);
            K->val[nnz++] = -1.0;
        }
        K->ptr[j + 1] = nnz;
    }
    return status;
}

/* Row i is -u_2i, or -u_2i - 1/2 u_(2i+1). */
static inline uz_status membrane_rows(uz_csc *N, const membrane *kind, uz_error *err)
{
    int64_t m = kind->m + kind->repeated, nnz = 0;
    uz_status status = uz_csc_init(N, m, kind->n * kind->n, 2 * m, err);
    for (int64_t j = 0; status == UZ_OK && j < N->cols; j++) {
        double value = j % 2 == 0 ? -1.0 : kind->pairs ? -0.5 : 0.0;
        bool used = value != 0.0 && j / 2 < kind->m;
        if (used) {
            N->idx[nnz] = (int32_t)(j / 2);
            N->val[nnz++] = value;
        }
        if (used && kind->repeated && j / 2 == 0) {
            N->idx[nnz] = (int32_t)(m - 1);
            N->val[nnz++] = 3.0 * value;
        }
        N->ptr[j + 1] = nnz;
    }
    return status;
}

/* The load of case `which`: 0, 1, ... differ. p: n n. */
static inline void membrane_load(double *p, int64_t n, int64_t which)
{
    for (int64_t j = 0; j < n * n; j++) {
        double x = (double)(j % n) / (double)n, y = (double)(j / n) / (double)n;
        p[j] = -8.0 / (double)(n * n) * (1.0 + 0.5 * sin(9.0 * x + 0.7 * (double)which) * cos(7.0 * y));
    }
}

static inline uz_status membrane_qp(uz_qp *qp, const membrane *kind, uz_error *err)
{
    int64_t d = kind->n * kind->n, m = kind->m + kind->repeated;
    *qp = (uz_qp){.p = calloc((size_t)d, sizeof(double)), .h = calloc((size_t)m, sizeof(double))};
    if (!qp->p || !qp->h)
        abort();
    membrane_load(qp->p, kind->n, 0);
    for (int64_t i = 0; i < m; i++)
        qp->h[i] = (kind->pairs ? 0.45 : 0.3) * (i < kind->m ? 1.0 : 3.0);
    uz_status status = membrane_stiffness(&qp->K, kind, err);
    return status == UZ_OK ? membrane_rows(&qp->N, kind, err) : status;
}

#endif
