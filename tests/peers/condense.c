/* condense.c: the dual problem that solvers of complementarity and bound-constrained problems get: D and g0, as a user
 * of CHOLMOD would form them: one factorization, and N' as right-hand sides in blocks that keep its BLAS 3 busy. */
#include "cholmod_copy.h"
#include "core/alloc.h"
#include "peers/lab.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK = 32 };

struct lab_factor {
    cholmod_common common;
    cholmod_factor *L;
    int64_t d;
};

lab_factor *lab_factor_new(const uz_csc *K)
{
    lab_factor *factor = uz_alloc_zero(1, sizeof *factor);
    if (!factor)
        return NULL;
    factor->d = K->cols;
    cholmod_l_start(&factor->common);
    factor->common.print = 0;
    cholmod_sparse *A = cholmod_copy_of(K, &factor->common);
    factor->L = A ? cholmod_l_analyze(A, &factor->common) : NULL;
    const bool ok = factor->L && cholmod_l_factorize(A, factor->L, &factor->common) &&
                    factor->common.status == CHOLMOD_OK && factor->L->minor == (size_t)K->cols;
    cholmod_l_free_sparse(&A, &factor->common);
    if (ok)
        return factor;
    lab_factor_free(factor);
    return NULL;
}

void lab_factor_free(lab_factor *factor)
{
    if (!factor)
        return;
    cholmod_l_free_factor(&factor->L, &factor->common);
    cholmod_l_finish(&factor->common);
    free(factor);
}

bool lab_factor_solve(lab_factor *factor, double *X, const double *B, int64_t count)
{
    double *copy = uz_alloc(count * factor->d, sizeof *copy);
    if (!copy)
        return false;
    memcpy(copy, B, (size_t)(count * factor->d) * sizeof *copy);
    cholmod_dense view;
    memset(&view, 0, sizeof view);
    view.nrow = view.d = (size_t)factor->d;
    view.ncol = (size_t)count;
    view.nzmax = view.nrow * view.ncol;
    view.x = copy;
    view.xtype = CHOLMOD_REAL;
    cholmod_dense *x = cholmod_l_solve(CHOLMOD_A, factor->L, &view, &factor->common);
    bool ok = x != NULL;
    if (ok)
        memcpy(X, x->x, (size_t)(count * factor->d) * sizeof *X);
    cholmod_l_free_dense(&x, &factor->common);
    free(copy);
    return ok;
}

/* Columns [first, first + count) of D. room: d x BLOCK. */
static bool condense_block(double *D, lab_factor *factor, const uz_csc *N, const uz_csc *Nt, double *room,
                           int64_t first, int64_t count)
{
    int64_t d = N->cols, m = N->rows;
    memset(room, 0, (size_t)(count * d) * sizeof *room);
    for (int64_t i = 0; i < count; i++)
        for (int64_t k = Nt->ptr[first + i]; k < Nt->ptr[first + i + 1]; k++)
            room[i * d + Nt->idx[k]] = Nt->val[k];
    if (!lab_factor_solve(factor, room, room, count))
        return false;
    for (int64_t i = 0; i < count; i++)
        uz_csc_gaxpy(D + (first + i) * m, N, 1.0, room + i * d);
    return true;
}

static void symmetrize(double *D, int64_t m)
{
    for (int64_t i = 0; i < m; i++)
        for (int64_t j = 0; j < i; j++)
            D[i * m + j] = D[j * m + i] = 0.5 * (D[i * m + j] + D[j * m + i]);
}

static bool fill(double *D, double *g0, double *room, lab_factor *factor, const uz_qp *qp)
{
    int64_t m = qp->N.rows;
    uz_csc Nt;
    memcpy(g0, qp->h, (size_t)m * sizeof *g0);
    bool ok = uz_csc_transpose(&Nt, &qp->N, NULL) == UZ_OK && lab_factor_solve(factor, room, qp->p, 1);
    if (ok)
        uz_csc_gaxpy(g0, &qp->N, -1.0, room);
    for (int64_t first = 0; ok && first < m; first += BLOCK)
        ok = condense_block(D, factor, &qp->N, &Nt, room, first, m - first < BLOCK ? m - first : BLOCK);
    if (ok)
        symmetrize(D, m);
    uz_csc_clear(&Nt);
    return ok;
}

bool lab_condense(double **D, double **g0, lab_factor *factor, const uz_qp *qp, double most)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    *D = *g0 = NULL;
    if (8.0 * (double)m * (double)m > most)
        return false;
    double *room = uz_alloc(BLOCK * d, sizeof *room);
    *D = uz_alloc_zero(m * m, sizeof **D);
    *g0 = uz_alloc(m, sizeof **g0);
    bool ok = room && *D && *g0 && fill(*D, *g0, room, factor, qp);
    free(room);
    if (ok)
        return true;
    free(*D);
    free(*g0);
    *D = *g0 = NULL;
    return false;
}
