/* factor.c: ordering, analysis and numeric factorization. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"

#include <float.h>
#include <math.h>
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

static cholmod_sparse view_lower(const uz_csc *K)
{
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
    return A;
}

static uz_status analyze(uz_factor *factor, cholmod_sparse *A, cholmod_common *common, uz_error *err)
{
    int64_t *perm = uz_alloc(factor->n, sizeof *perm);
    if (!perm)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a permutation of %lld dofs", (long long)factor->n);
    uz_status status = uz_order(perm, A, factor->last, factor->n_last, &factor->info.ordering, common, err);
    if (status == UZ_OK) {
        factor->L = cholmod_l_analyze_p(A, (SuiteSparse_long *)perm, NULL, 0, common);
        if (!factor->L)
            status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to analyse a matrix of %lld dofs (CHOLMOD status %d)",
                             (long long)factor->n, common->status);
    }
    free(perm);
    return status;
}

/* The supernodal factor's numbers, before they are allocated. */
static uz_status check_memory(const uz_factor *factor, size_t memory_limit, uz_error *err)
{
    double bytes = 8.0 * (double)factor->L->xsize + 8.0 * (double)factor->L->ssize + 24.0 * (double)factor->n;
    if (memory_limit == 0 || bytes <= (double)memory_limit)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_LIMIT, "K", "the factor would take %.0f bytes and the limit is %zu: raise the limit",
                   bytes, memory_limit);
}

/* A TRUE from cholmod_factorize is no proof: status and minor are looked at before anything resets them. */
static uz_status factorize(uz_factor *factor, cholmod_sparse *A, cholmod_common *common, uz_error *err)
{
    bool ok = cholmod_l_factorize(A, factor->L, common);
    int status = common->status;
    int64_t minor = (int64_t)factor->L->minor;
    if (status == CHOLMOD_OUT_OF_MEMORY || status == CHOLMOD_TOO_LARGE)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %.3g bytes", 8.0 * (double)factor->L->xsize);
    if (status == CHOLMOD_NOT_POSDEF || minor < factor->n) {
        int64_t dof = minor < factor->n ? ((SuiteSparse_long *)factor->L->Perm)[minor] : -1;
        return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                       "K is not positive definite: the elimination meets a pivot that is not positive at dof %lld "
                       "(numbered from 0). Support the body so that it can't move freely, or check the signs of K.",
                       (long long)dof);
    }
    if (!ok || status != CHOLMOD_OK)
        return uz_fail(err, UZ_ERR_INTERNAL, "K", "factorization failed (CHOLMOD status %d)", status);
    return UZ_OK;
}

/* Below this times n the factor's own rounding errors are as large as its smallest pivot: of a body that is free to
 * move, rounding was seen to leave up to half of n eps. */
#define RCOND_LEAST DBL_EPSILON

/* min_j L_jj^2 / K_jj: what elimination left of each diagonal entry. It does not depend on the units of single dofs,
 * and the accuracy of a Cholesky factorization is governed by the condition after diagonal scaling (Demmel 1989; Higham
 * 2002, section 10.1). */
static double least_pivot_share(const uz_factor *factor, const cholmod_sparse *A)
{
    const cholmod_factor *L = factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *perm = L->Perm, *first = A->p;
    const double *x = L->x, *K = A->x;
    double least = 1.0;
    for (size_t s = 0; s < L->nsuper; s++)
        for (int64_t k = super[s]; k < super[s + 1]; k++) {
            int64_t j = k - super[s], rows = pi[s + 1] - pi[s];
            double pivot = x[px[s] + j + j * rows], share = pivot * pivot / K[first[perm[k]]];
            least = share < least || isnan(share) ? share : least;
        }
    return least;
}

static uz_status describe(uz_factor *factor, const cholmod_sparse *A, uz_error *err)
{
    uz_factor_info *info = &factor->info;
    const SuiteSparse_long *perm = factor->L->Perm;
    factor->position = uz_alloc(factor->n, sizeof *factor->position);
    if (!factor->position)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld dofs", (long long)factor->n);
    for (int64_t k = 0; k < factor->n; k++)
        factor->position[perm[k]] = k;
    info->n = factor->n;
    info->nnz = (int64_t)factor->L->xsize;
    info->bytes = 8 * factor->L->xsize + 8 * factor->L->ssize + 32 * (size_t)factor->n;
    info->rcond = least_pivot_share(factor, A);
    if (!(info->rcond >= RCOND_LEAST * (double)factor->n))
        return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                       "K is singular to working precision (reciprocal condition %.2g): the body can move without "
                       "resistance, or its stiffnesses differ by more than double precision can hold",
                       info->rcond);
    return UZ_OK;
}

static uz_status build(uz_factor *factor, cholmod_sparse *A, size_t memory_limit, const uz_hooks *hooks,
                       cholmod_common *common, uz_error *err)
{
    double start = uz_seconds();
    uz_status status = analyze(factor, A, common, err);
    factor->info.order_s = uz_seconds() - start;
    if (status == UZ_OK)
        status = check_memory(factor, memory_limit, err);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the factorization");
    start = uz_seconds();
    if (status == UZ_OK)
        status = factorize(factor, A, common, err);
    if (status == UZ_OK)
        status = describe(factor, A, err);
    factor->info.factor_s = uz_seconds() - start;
    return status;
}

uz_status uz_factor_create(uz_factor **out, const uz_csc *K, const int64_t *last, int64_t n_last, uz_ordering ordering,
                           size_t memory_limit, const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    if (K->rows != K->cols || K->rows < 1)
        return uz_fail(err, UZ_ERR_SIZE, "K", "K must be square with at least one dof, it is %lld x %lld",
                       (long long)K->rows, (long long)K->cols);
    cholmod_common common;
    uz_factor *factor = uz_alloc_zero(1, sizeof *factor);
    bool started = factor && uz_cholmod_start(&common);
    uz_status status = UZ_OK;
    if (started) {
        factor->n = K->rows;
        factor->n_last = n_last;
        factor->info.ordering = ordering == UZ_ORDERING_AUTO ? UZ_ORDERING_AMD : ordering;
        factor->last = uz_alloc(n_last, sizeof *last);
    }
    if (!started || !factor->last) {
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor");
    } else {
        cholmod_sparse A = view_lower(K);
        if (n_last > 0)
            memcpy(factor->last, last, (size_t)n_last * sizeof *last);
        status = build(factor, &A, memory_limit, hooks, &common, err);
    }
    if (started)
        cholmod_l_finish(&common);
    if (status == UZ_OK)
        *out = factor;
    else
        uz_factor_free(factor);
    return status;
}

void uz_factor_free(uz_factor *factor)
{
    cholmod_common common;
    if (!factor)
        return;
    if (factor->L && uz_cholmod_start(&common)) {
        cholmod_l_free_factor(&factor->L, &common);
        cholmod_l_finish(&common);
    }
    free(factor->last);
    free(factor->position);
    free(factor);
}

uz_factor_info uz_factor_describe(const uz_factor *factor)
{
    return factor->info;
}

const int64_t *uz_factor_position(const uz_factor *factor)
{
    return factor->position;
}
