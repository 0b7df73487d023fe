/* rational.h: the same problem in rational numbers, exactly: do the rows contradict, and what is the answer? */
#ifndef TESTS_RATIONAL_H
#define TESTS_RATIONAL_H

#include "uzawa.h"

#include <gmp.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* n rationals of zero. */
static inline mpq_t *rationals(int64_t n)
{
    mpq_t *x = malloc((size_t)(n + 1) * sizeof *x);
    if (!x)
        abort();
    for (int64_t i = 0; i < n; i++)
        mpq_init(x[i]);
    return x;
}

static inline void rationals_free(mpq_t *x, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        mpq_clear(x[i]);
    free(x);
}

/* Gauss-Jordan on rows x cols of A: column c out of all rows but r, where it becomes 1. */
static inline void rational_pivot(mpq_t *A, int64_t rows, int64_t cols, int64_t r, int64_t c)
{
    mpq_t factor, product;
    mpq_inits(factor, product, NULL);
    mpq_set(factor, A[r * cols + c]);
    for (int64_t k = 0; k < cols; k++)
        mpq_div(A[r * cols + k], A[r * cols + k], factor);
    for (int64_t i = 0; i < rows; i++) {
        if (i == r || mpq_sgn(A[i * cols + c]) == 0)
            continue;
        mpq_set(factor, A[i * cols + c]);
        for (int64_t k = 0; k < cols; k++)
            if (mpq_sgn(A[r * cols + k]) != 0) {
                mpq_mul(product, factor, A[r * cols + k]);
                mpq_sub(A[i * cols + k], A[i * cols + k], product);
            }
    }
    mpq_clears(factor, product, NULL);
}

/* Is there a u with N u <= h? Slacks s = h - N u; u is eliminated first, then dual simplex pivots without an objective,
 * the least index first (Bland 1977), until all slacks are >= 0 or a row says that they can't be. */
static inline bool is_feasible_exactly(const uz_csc *N, const double *h)
{
    const int64_t m = N->rows, d = N->cols, cols = d + m + 1;
    mpq_t *A = rationals(m * cols); /* N u + s = h */
    int64_t *basic = malloc((size_t)(m + 1) * sizeof *basic);
    bool feasible = true, done = false;
    if (!basic)
        abort();
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            mpq_set_d(A[N->idx[k] * cols + j], N->val[k]);
    for (int64_t i = 0; i < m; i++) {
        mpq_set_ui(A[i * cols + d + i], 1, 1);
        mpq_set_d(A[i * cols + cols - 1], h[i]);
        basic[i] = d + i;
    }
    for (int64_t j = 0; j < d; j++)
        for (int64_t i = 0; i < m; i++)
            if (basic[i] >= d && mpq_sgn(A[i * cols + j]) != 0) {
                rational_pivot(A, m, cols, i, j);
                basic[i] = j;
                break;
            }
    while (!done) {
        int64_t out = -1, in = -1;
        for (int64_t i = 0; i < m; i++)
            if (basic[i] >= d && mpq_sgn(A[i * cols + cols - 1]) < 0 && (out < 0 || basic[i] < basic[out]))
                out = i;
        for (int64_t k = d; out >= 0 && in < 0 && k < d + m; k++)
            if (mpq_sgn(A[out * cols + k]) < 0)
                in = k;
        done = out < 0 || in < 0;
        feasible = out < 0;
        if (!done) {
            rational_pivot(A, m, cols, out, in);
            basic[out] = in;
        }
    }
    rationals_free(A, m * cols);
    free(basic);
    return feasible;
}

/* The answer whose rows in contact are `active`: u (d) exactly, if K u = p + N'r with closed gaps there has one, and it
 * meets all conditions with r <= 0: it is the answer then. Rows that depend on others in contact get no reaction. */
static inline bool solve_exactly(mpq_t *u, const uz_qp *qp, const bool *active)
{
    const int64_t m = qp->N.rows, d = qp->K.cols, n = d + m, cols = n + 1;
    mpq_t *A = rationals(n * cols), gap, product;
    int64_t *row = malloc((size_t)(n + 1) * sizeof *row); /* of column c; -1: free, zero */
    bool *used = calloc((size_t)n + 1, sizeof *used), good = true;
    if (!row || !used)
        abort();
    mpq_inits(gap, product, NULL);
    for (int64_t j = 0; j < d; j++) {
        for (int64_t k = qp->K.ptr[j]; k < qp->K.ptr[j + 1]; k++) {
            mpq_set_d(A[qp->K.idx[k] * cols + j], qp->K.val[k]);
            mpq_set_d(A[j * cols + qp->K.idx[k]], qp->K.val[k]);
        }
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            if (active[qp->N.idx[k]]) {
                mpq_set_d(A[j * cols + d + qp->N.idx[k]], -qp->N.val[k]);
                mpq_set_d(A[(d + qp->N.idx[k]) * cols + j], qp->N.val[k]);
            }
        mpq_set_d(A[j * cols + n], qp->p[j]);
    }
    for (int64_t i = 0; i < m; i++)
        if (active[i])
            mpq_set_d(A[(d + i) * cols + n], qp->h[i]);
    for (int64_t c = 0; c < n; c++) {
        row[c] = -1;
        for (int64_t i = 0; i < n && row[c] < 0; i++)
            if (!used[i] && mpq_sgn(A[i * cols + c]) != 0)
                row[c] = i;
        if (row[c] < 0)
            continue;
        used[row[c]] = true;
        rational_pivot(A, n, cols, row[c], c);
    }
    for (int64_t i = 0; i < n; i++) /* an equation that can't be met */
        good = good && (used[i] || mpq_sgn(A[i * cols + n]) == 0);
    for (int64_t c = 0; c < d; c++) {
        good = good && row[c] >= 0;
        if (row[c] >= 0)
            mpq_set(u[c], A[row[c] * cols + n]);
    }
    for (int64_t c = d; c < n; c++)
        good = good && (row[c] < 0 || mpq_sgn(A[row[c] * cols + n]) <= 0);
    for (int64_t i = 0; i < m && good; i++) {
        mpq_set_d(gap, qp->h[i]);
        for (int64_t j = 0; j < d; j++)
            for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
                if (qp->N.idx[k] == i) {
                    mpq_set_d(product, qp->N.val[k]);
                    mpq_mul(product, product, u[j]);
                    mpq_sub(gap, gap, product);
                }
        good = mpq_sgn(gap) >= 0;
    }
    rationals_free(A, n * cols);
    mpq_clears(gap, product, NULL);
    free(row);
    free(used);
    return good;
}

/* ||v - u||_K / ||u||_K for v (d), squared exactly; INFINITY where u is 0 and v is not. */
static inline double error_exactly(const uz_csc *K, const double *v, mpq_t *u)
{
    const int64_t d = K->cols;
    mpq_t *e = rationals(d), error, norm, term;
    mpq_inits(error, norm, term, NULL);
    for (int64_t j = 0; j < d; j++) {
        mpq_set_d(e[j], v[j]);
        mpq_sub(e[j], e[j], u[j]);
    }
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            for (int part = 0; part < 2; part++) {
                mpq_t *x = part ? u : e;
                mpq_set_d(term, (K->idx[k] == j ? 1.0 : 2.0) * K->val[k]);
                mpq_mul(term, term, x[j]);
                mpq_mul(term, term, x[K->idx[k]]);
                mpq_add(part ? norm : error, part ? norm : error, term);
            }
    double result = mpq_sgn(error) == 0 ? 0.0 : (double)INFINITY;
    if (mpq_sgn(norm) > 0) {
        mpq_div(error, error, norm);
        result = sqrt(mpq_get_d(error));
    }
    rationals_free(e, d);
    mpq_clears(error, norm, term, NULL);
    return result;
}

#endif
