/* factor.c: the numeric factorization. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"

#include <stdlib.h>
#include <string.h>
#include <suitesparse/SuiteSparse_config.h>

/* As cholmod_factorize makes it by two transpositions with five passes over the entries: of a body in two dimensions
 * they take a tenth of the factorization. */
cholmod_sparse *uz_permute(const uz_csc *K, const int64_t *position, int64_t *place, cholmod_common *common)
{
    size_t n = (size_t)K->cols;
    cholmod_sparse *S = cholmod_l_allocate_sparse(n, n, (size_t)K->ptr[n], 0, 1, -1, CHOLMOD_REAL, common);
    if (!S)
        return NULL;
    SuiteSparse_long *next = S->p, *row = S->i;
    double *value = S->x;
    /* Where each column of P K P' begins, lower triangle: next (n + 1). */
    memset(next, 0, (size_t)(K->cols + 1) * sizeof *next);
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            int64_t a = position[j], b = position[K->idx[k]];
            next[(a < b ? a : b) + 1]++;
        }
    for (int64_t j = 0; j < K->cols; j++)
        next[j + 1] += next[j];
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            int64_t a = position[j], b = position[K->idx[k]], at = next[a < b ? a : b]++;
            row[at] = a < b ? b : a;
            value[at] = K->val[k];
            if (place)
                place[k] = at;
        }
    memmove(next + 1, next, n * sizeof *next); /* each column was filled up to where the next begins */
    next[0] = 0;
    return S;
}

extern void openblas_set_num_threads(int threads);

static int blas_threads =
    1; /* in a large factorization; set once, before threads start, as it is one for all of BLAS */

/* A tenth of a second: threads cost the milliseconds that they spin afterwards. */
#define LARGE_FLOPS 5e9

/* For each entry of L: where supernodes are small BLAS's threads take as long as one. */
#define DENSE_FLOPS 400.0

/* The two threads of refill.c take less time than two of BLAS (a cube of 104,544 dofs: 3.9 s and 4.9, one thread 7.2),
 * and where other programs run too those wait for each other at each of very many calls: 45 s, and 7. Only where more
 * are idle is a factor of large supernodes left to them. */
static bool is_for_many_threads(const uz_factor *factor)
{
    return blas_threads > 2 && factor->info.flops > LARGE_FLOPS &&
           factor->info.flops > DENSE_FLOPS * (double)factor->info.nnz;
}

void uz_factor_use_threads(int threads)
{
    blas_threads = threads;
}

/* column: in the factor's order. */
static uz_status refuse_pivot(const uz_factor *factor, int64_t column, uz_error *err)
{
    const int64_t dof = column < factor->n ? ((SuiteSparse_long *)factor->L.Perm)[column] : -1;
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is not positive definite: the elimination meets a pivot that is not positive at dof %lld "
                   "(numbered from 0). Support the body so that it can't move freely, or check the signs of K.",
                   (long long)dof);
}

/* cholmod_factorize, told that the matrix is in the factor's order already. A TRUE from it is no proof: status and
 * minor are looked at before anything resets them. */
static uz_status factorize(uz_factor *factor, cholmod_sparse *S, cholmod_common *common, uz_error *err)
{
    bool ok = S != NULL;
    if (S) {
        int ordering = factor->L.ordering;
        const bool threads = is_for_many_threads(factor);
        factor->L.ordering = CHOLMOD_NATURAL;
        if (threads)
            openblas_set_num_threads(blas_threads);
        ok = cholmod_l_factorize(S, &factor->L, common);
        if (threads)
            openblas_set_num_threads(1);
        factor->L.ordering = ordering;
    }
    int status = common->status;
    int64_t minor = (int64_t)factor->L.minor;
    if (!S || status == CHOLMOD_OUT_OF_MEMORY || status == CHOLMOD_TOO_LARGE)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %.3g bytes", 8.0 * (double)factor->L.xsize);
    if (status == CHOLMOD_NOT_POSDEF || minor < factor->n)
        return refuse_pivot(factor, minor, err);
    if (!ok || status != CHOLMOD_OK)
        return uz_fail(err, UZ_ERR_INTERNAL, "K", "factorization failed (CHOLMOD status %d)", status);
    return UZ_OK;
}

uz_status uz_factor_new(uz_factor **out, const uz_analysis *analysis, uz_error *err)
{
    uz_factor *factor = uz_alloc_zero(1, sizeof *factor);
    *out = factor;
    if (!factor)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor");
    factor->n = analysis->n;
    factor->analysis = (uz_analysis *)analysis; /* the count is all that is not constant of it */
    atomic_fetch_add(&factor->analysis->holders, 1);
    factor->L = *analysis->L;
    factor->info = uz_analysis_describe(analysis);
    return UZ_OK;
}

/* Entries of K up to which what is found of its pattern is kept beside an analysis: some 10 MB. Of larger bodies it
 * takes next to nothing of a factorization. */
enum { SPARED = 1 << 18 };

static uz_status create(uz_factor **out, const uz_csc *K, const uz_analysis *analysis, size_t memory_limit,
                        bool briefly, const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    if (K->rows != K->cols || K->cols != analysis->n || K->ptr[K->cols] != analysis->nnz)
        return uz_fail(err, UZ_ERR_ARGUMENT, "K", "K is not of the pattern that was analysed");
    cholmod_common common;
    uz_factor *factor;
    uz_status status = uz_factor_new(&factor, analysis, err);
    if (status != UZ_OK)
        return status;
    if (!uz_cholmod_start(&common)) {
        uz_factor_free(factor);
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor");
    }
    double start = uz_seconds();
    const double bytes = 8.0 * (double)factor->L.xsize + 8.0 * (double)factor->L.ssize + 24.0 * (double)factor->n;
    if (memory_limit > 0 && bytes > (double)memory_limit)
        status = uz_fail(err, UZ_ERR_LIMIT, "K",
                         "the factor would take %.0f bytes and the limit is %zu: raise the limit", bytes, memory_limit);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the factorization");
    if (status == UZ_OK && !is_for_many_threads(factor)) {
        const bool again = briefly && analysis->nnz <= SPARED; /* others of the pattern are likely to follow */
        uz_refill *numbers = again ? atomic_exchange(&factor->analysis->spare, NULL) : NULL;
        int64_t refused;
        if (numbers)
            uz_refill_renew(numbers, K);
        else
            status = uz_refill_new(&numbers, factor, K, !again, err);
        if (status == UZ_OK)
            status = uz_refill_run(&refused, numbers, factor, err);
        if (status == UZ_OK && refused < factor->n)
            status = refuse_pivot(factor, refused, err);
        uz_refill_free(again ? atomic_exchange(&factor->analysis->spare, numbers) : numbers);
    } else if (status == UZ_OK) {
        cholmod_sparse *S = uz_permute(K, factor->analysis->position, NULL, &common);
        status = factorize(factor, S, &common, err);
        cholmod_l_free_sparse(&S, &common);
    }
    if (status == UZ_OK)
        status = uz_find_least_pivot(factor, K, err);
    if (status == UZ_OK && !briefly)
        status = uz_find_condition(factor, K, &common, err);
    factor->info.factor_s = uz_seconds() - start;
    cholmod_l_finish(&common);
    if (status == UZ_OK)
        *out = factor;
    else
        uz_factor_free(factor);
    return status;
}

uz_status uz_factor_create(uz_factor **out, const uz_csc *K, const uz_analysis *analysis, size_t memory_limit,
                           const uz_hooks *hooks, uz_error *err)
{
    return create(out, K, analysis, memory_limit, false, hooks, err);
}

uz_status uz_factor_create_briefly(uz_factor **out, const uz_csc *K, const uz_analysis *analysis, size_t memory_limit,
                                   const uz_hooks *hooks, uz_error *err)
{
    return create(out, K, analysis, memory_limit, true, hooks, err);
}

void uz_factor_free(uz_factor *factor)
{
    if (!factor)
        return;
    uz_refill_free(factor->refill);
    SuiteSparse_free(factor->L.x); /* all else of L is the analysis's */
    uz_analysis_free(factor->analysis);
    free(factor);
}

uz_factor_info uz_factor_describe(const uz_factor *factor)
{
    return factor->info;
}

uz_analysis *uz_factor_analysis(const uz_factor *factor)
{
    atomic_fetch_add(&factor->analysis->holders, 1);
    return factor->analysis;
}

bool uz_factor_ends_with(const uz_factor *factor, const int64_t *dofs, int64_t n)
{
    int64_t found = 0;
    for (int64_t k = 0; k < factor->info.n_last && found < n; k++)
        found += factor->info.last[k] == dofs[found];
    return found == n;
}

uz_status uz_factor_describe_for(uz_factor_info *out, const uz_factor *factor, const int64_t *dofs, int64_t n_dofs,
                                 int64_t rows, uz_error *err)
{
    const bool last = uz_factor_ends_with(factor, dofs, n_dofs);
    *out = factor->info;
    out->condensing = uz_condensing_flops(&factor->L, last, dofs, n_dofs, last || rows > 0 ? rows : n_dofs);
    return out->condensing < 0.0 ? uz_no_memory(err, "what a contact reaches") : UZ_OK;
}
