/* analysis.c: what is known of a factor before its numbers: the order of elimination and the supernodes. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"

#include <stdlib.h>
#include <string.h>

bool uz_cholmod_start(cholmod_common *common)
{
    if (!cholmod_l_start(common))
        return false;
    common->print = 0;
    common->supernodal = CHOLMOD_SUPERNODAL;
    common->final_ll = 1; /* LL': a non-positive pivot is reported, LDL' would go on with it */
    common->nmethods = 1;
    common->method[0].ordering = CHOLMOD_GIVEN;
    common->postorder = 1;
    common->quick_return_if_not_posdef = 1;
    return true;
}

static uz_status analyze(uz_analysis *analysis, cholmod_sparse *A, int64_t rows, uz_ordering ordering,
                         cholmod_common *common, uz_error *err)
{
    int64_t *group = uz_alloc(analysis->n, sizeof *group);
    cholmod_sparse *graph = group ? uz_compress(group, A, analysis->last, analysis->n_last, common) : NULL;
    uz_status status = UZ_OK;
    if (graph)
        status = uz_choose(analysis, graph, group, rows, ordering, common, err);
    else
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld dofs", (long long)analysis->n);
    cholmod_l_free_sparse(&graph, common);
    free(group);
    if (status != UZ_OK)
        return status;
    const SuiteSparse_long *perm = analysis->L->Perm;
    for (int64_t k = 0; k < analysis->n; k++)
        analysis->position[perm[k]] = k;
    return UZ_OK;
}

uz_status uz_analysis_create(uz_analysis **out, const uz_csc *K, const int64_t *dofs, int64_t n_dofs, int64_t rows,
                             uz_ordering ordering, const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    if (K->rows != K->cols || K->rows < 1)
        return uz_fail(err, UZ_ERR_SIZE, "K", "K must be square with at least one dof, it is %lld x %lld",
                       (long long)K->rows, (long long)K->cols);
    double start = uz_seconds();
    cholmod_common common;
    uz_analysis *analysis = uz_alloc_zero(1, sizeof *analysis);
    if (!analysis || !uz_cholmod_start(&common)) {
        free(analysis);
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor");
    }
    uz_expect_factor(K);
    cholmod_sparse A;
    memset(&A, 0, sizeof A);
    A.nrow = (size_t)K->rows;
    A.ncol = (size_t)K->cols;
    A.nzmax = (size_t)K->ptr[K->cols];
    A.p = K->ptr;
    A.i = K->idx;
    A.x = K->val;
    A.stype = -1;
    A.itype = CHOLMOD_LONG;
    A.xtype = CHOLMOD_REAL;
    A.dtype = CHOLMOD_DOUBLE;
    A.sorted = 1;
    A.packed = 1;
    atomic_init(&analysis->holders, 1);
    analysis->n = K->cols;
    analysis->nnz = K->ptr[K->cols];
    analysis->n_last = n_dofs;
    analysis->last = uz_alloc(n_dofs, sizeof *dofs);
    analysis->position = uz_alloc(K->cols, sizeof *analysis->position);
    uz_status status = UZ_OK;
    if (!analysis->last || !analysis->position)
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to analyse a matrix of %lld dofs", (long long)K->cols);
    else if (n_dofs > 0)
        memcpy(analysis->last, dofs, (size_t)n_dofs * sizeof *dofs);
    if (status == UZ_OK)
        status = analyze(analysis, &A, rows, ordering, &common, err);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the factorization");
    cholmod_l_finish(&common);
    analysis->seconds = uz_seconds() - start;
    if (status == UZ_OK)
        *out = analysis;
    else
        uz_analysis_free(analysis);
    return status;
}

uz_analysis *uz_analysis_hold(const uz_analysis *analysis)
{
    uz_analysis *shared = (uz_analysis *)analysis; /* the count is all that is not constant of it */
    atomic_fetch_add(&shared->holders, 1);
    return shared;
}

void uz_analysis_free(uz_analysis *analysis)
{
    cholmod_common common;
    if (!analysis || atomic_fetch_sub(&analysis->holders, 1) > 1)
        return;
    if (analysis->L && uz_cholmod_start(&common)) {
        cholmod_l_free_factor(&analysis->L, &common);
        cholmod_l_finish(&common);
    }
    free(analysis->last);
    free(analysis->position);
    free(analysis);
}

uz_factor_info uz_analysis_describe(const uz_analysis *analysis)
{
    const cholmod_factor *L = analysis->L;
    uz_factor_info info = {
        .ordering = analysis->chosen.ordering,
        .contact_last = analysis->chosen.contact_last,
        .n = analysis->n,
        .nnz = (int64_t)L->xsize,
        .flops = analysis->chosen.flops,
        .n_considered = analysis->n_considered,
        .bytes = 8 * L->xsize + 8 * L->ssize + 32 * (size_t)analysis->n,
        .room = 8 * (L->maxcsize + 3 * (size_t)analysis->n),
        .order_s = analysis->seconds,
    };
    memcpy(info.considered, analysis->considered, sizeof info.considered);
    return info;
}

/* Perm, ColCount and position; super, pi and px; the row indices. */
size_t uz_analysis_bytes(const uz_analysis *analysis)
{
    const cholmod_factor *L = analysis->L;
    return sizeof *analysis + sizeof *L + 8 * (3 * L->n + 3 * (L->nsuper + 1) + L->ssize + (size_t)analysis->n_last);
}
