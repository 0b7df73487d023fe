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
    atomic_init(&analysis->holders, 1);
    analysis->n = K->cols;
    analysis->nnz = K->ptr[K->cols];
    analysis->n_last = n_dofs;
    analysis->last = uz_alloc(n_dofs, sizeof *dofs);
    analysis->position = uz_alloc(K->cols, sizeof *analysis->position);
    int64_t *group = uz_alloc(K->cols, sizeof *group);
    const bool ok = analysis->last && analysis->position && group;
    if (ok && n_dofs > 0)
        memcpy(analysis->last, dofs, (size_t)n_dofs * sizeof *dofs);
    cholmod_sparse *graph = ok ? uz_compress(group, K, analysis->last, n_dofs, &common) : NULL;
    uz_status status =
        graph ? uz_choose(analysis, graph, group, rows, ordering, &common, err)
              : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld dofs", (long long)K->cols);
    cholmod_l_free_sparse(&graph, &common);
    free(group);
    for (int64_t k = 0; status == UZ_OK && k < K->cols; k++)
        analysis->position[((const SuiteSparse_long *)analysis->L->Perm)[k]] = k;
    if (status == UZ_OK && !(analysis->share = uz_share_tree(analysis->L)))
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld dofs", (long long)K->cols);
    for (size_t s = 0; status == UZ_OK && s < analysis->L->nsuper; s++)
        analysis->is_shared = analysis->is_shared || analysis->share[s] != UZ_REST;
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

void uz_analysis_free(uz_analysis *analysis)
{
    cholmod_common common;
    if (!analysis || atomic_fetch_sub(&analysis->holders, 1) > 1)
        return;
    if (analysis->L && uz_cholmod_start(&common)) {
        cholmod_l_free_factor(&analysis->L, &common);
        cholmod_l_finish(&common);
    }
    uz_refill_free(atomic_load(&analysis->spare));
    uz_free_all(analysis->last, analysis->position, analysis->share, analysis);
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
        .position = analysis->position,
        .last = analysis->last,
        .n_last = analysis->chosen.contact_last ? analysis->n_last : 0,
    };
    memcpy(info.considered, analysis->considered, sizeof info.considered);
    return info;
}

/* Perm, ColCount and position; super, pi, px and shares; the row indices. */
size_t uz_analysis_bytes(const uz_analysis *analysis)
{
    const cholmod_factor *L = analysis->L;
    return sizeof *analysis + sizeof *L + L->nsuper +
           8 * (3 * L->n + 3 * (L->nsuper + 1) + L->ssize + (size_t)analysis->n_last);
}
