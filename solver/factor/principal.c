/* principal.c: factors of principal submatrices of K: the body with some dofs held.
 *
 * Either of the reduced matrix, which keeps the order of the factor of K, so that its fill is part of that factor's: no
 * ordering is paid, and the more dofs are held the less is computed. Or by what changes of the factor of K (paths.c),
 * where that is less. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

struct uz_principal {
    const uz_factor *factor;
    uz_factor_workspace *ws;
    uz_paths *paths;   /* NULL: not needed yet */
    bool by_paths;     /* else L: */
    cholmod_factor *L; /* NULL when no dof is free */
    int64_t n_free;
    int64_t *dof;             /* n: which dof each row is, in the factor's order, n_free of them */
    int64_t *place;           /* n: the row of a free dof in the reduced matrix, -1 for the others */
    double *room;             /* n */
    cholmod_dense *X, *Y, *E; /* CHOLMOD's room, kept between solves */
    size_t most;              /* bytes that it has taken so far */
};

size_t uz_principal_bytes(const uz_principal *part)
{
    return part ? part->most : 0;
}

/* A: the reduced matrix, while it is there, which CHOLMOD transposes, or NULL. */
static void count_bytes(uz_principal *part, const cholmod_sparse *A)
{
    const cholmod_factor *L = part->L;
    size_t bytes = 24 * (size_t)part->factor->n + uz_paths_bytes(part->paths);
    bytes += A ? 2 * (16 * A->nzmax + 8 * A->ncol) : 0;
    bytes += A && L && L->is_super ? 8 * L->maxcsize : 0; /* what supernodes take from each other */
    if (L)
        bytes += 16 * L->n + (L->is_super ? 8 * (L->xsize + L->ssize + 3 * L->nsuper) : 16 * L->nzmax + 32 * L->n);
    part->most = bytes > part->most ? bytes : part->most;
}

/* K_FF in the factor's order, upper triangle, columns unsorted; NULL: no memory. */
static cholmod_sparse *reduce(const uz_principal *part, const uz_csc *K)
{
    const int64_t n = part->n_free, *place = part->place;
    SuiteSparse_long *next = uz_alloc_zero(n + 1, sizeof *next); /* where each column's next entry goes */
    cholmod_sparse *A = NULL;
    for (int pass = 0; next && (pass == 0 || A) && pass < 2; pass++) { /* entries are counted, then placed */
        for (int64_t j = 0; j < K->cols; j++)
            for (int64_t k = K->ptr[j]; place[j] >= 0 && k < K->ptr[j + 1]; k++) {
                const int64_t a = place[j], b = place[K->idx[k]], column = a > b ? a : b;
                if (b < 0)
                    continue;
                if (pass == 1) {
                    ((SuiteSparse_long *)A->i)[next[column]] = a > b ? b : a;
                    ((double *)A->x)[next[column]] = K->val[k];
                }
                next[pass == 1 ? column : column + 1]++;
            }
        if (pass == 1)
            break;
        for (int64_t j = 0; j < n; j++)
            next[j + 1] += next[j];
        A = cholmod_l_allocate_sparse((size_t)n, (size_t)n, (size_t)next[n], 0, 1, 1, CHOLMOD_REAL, &part->ws->common);
        if (A)
            memcpy(A->p, next, (size_t)(n + 1) * sizeof *next);
    }
    free(next);
    return A;
}

/* Entries of L, and of K in an analysis, that are passed in the time of a flop of a dense kernel; as in dual/cost.h. */
#define FLOPS_PER_ENTRY 8.0
#define ENTRY_PASSES    10.0
#define ANALYSIS_PASSES 60.0

uz_status uz_principal_hold(bool *positive, uz_principal *part, const uz_csc *K, const bool *fixed, const uz_stop *stop,
                            uz_error *err)
{
    const int64_t n = part->factor->n;
    const SuiteSparse_long *perm = part->factor->L.Perm;
    cholmod_sparse *A = NULL;
    uz_status status = UZ_OK;
    *positive = true;
    part->n_free = 0;
    for (int64_t k = 0; k < n; k++) {
        const int64_t i = perm[k];
        part->place[i] = fixed[i] ? -1 : part->n_free;
        if (!fixed[i])
            part->dof[part->n_free++] = i;
    }
    if (!part->paths)
        status = uz_paths_create(&part->paths, K, part->factor, part->ws, err);
    /* flops, about, to factor the reduced matrix: of K with fewer dofs */
    const uz_factor_info *info = &part->factor->info;
    const double share = (double)part->n_free / (double)n;
    const double anew =
        share * share * info->flops + FLOPS_PER_ENTRY * (ENTRY_PASSES * share * (double)info->nnz +
                                                         ANALYSIS_PASSES * share * (double)K->ptr[K->cols]);
    part->by_paths = status == UZ_OK && uz_paths_work(part->paths, fixed) < anew;
    if (status == UZ_OK && part->by_paths) {
        status = uz_paths_hold(positive, part->paths, fixed, stop, err);
        count_bytes(part, NULL);
        return status;
    }
    cholmod_common *common = &part->ws->common;
    cholmod_l_free_factor(&part->L, common);
    if (status == UZ_OK && part->n_free > 0 && !(A = reduce(part, K)))
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
    *positive = !uz_stop_is_due(stop);
    if (status == UZ_OK && A && *positive) {
        /* few flops for each entry of L make supernodes a burden: CHOLMOD_AUTO decides by that ratio */
        common->supernodal = CHOLMOD_AUTO;
        common->method[0].ordering = CHOLMOD_NATURAL;
        part->L = cholmod_l_analyze(A, common);
        common->supernodal = CHOLMOD_SUPERNODAL;
        common->method[0].ordering = CHOLMOD_GIVEN;
        *positive = !part->L || !uz_stop_is_due(stop);
    }
    if (status == UZ_OK && A && *positive) {
        const bool ok = part->L && cholmod_l_factorize(A, part->L, common);
        const int state = common->status;
        *positive = state == CHOLMOD_OK && part->L && (int64_t)part->L->minor == part->n_free;
        if (state == CHOLMOD_OUT_OF_MEMORY || state == CHOLMOD_TOO_LARGE)
            status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)part->n_free);
        else if (!*positive && state != CHOLMOD_NOT_POSDEF && !ok)
            status = uz_fail(err, UZ_ERR_INTERNAL, "K", "factorization failed (CHOLMOD status %d)", state);
    }
    count_bytes(part, A);
    cholmod_l_free_sparse(&A, common);
    return status;
}

uz_status uz_principal_create(uz_principal **out, const uz_csc *K, const bool *fixed, const uz_factor *factor,
                              uz_factor_workspace *ws, const uz_stop *stop, uz_error *err)
{
    const int64_t n = factor->n;
    uz_principal *part = uz_alloc_zero(1, sizeof *part);
    uz_status status = UZ_OK;
    bool positive = false;
    *out = NULL;
    if (part) {
        part->factor = factor;
        part->ws = ws;
        part->dof = uz_alloc(n, sizeof *part->dof);
        part->place = uz_alloc(n, sizeof *part->place);
        part->room = uz_alloc(n, sizeof *part->room);
    }
    if (!part || !part->dof || !part->place || !part->room)
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
    else
        status = uz_principal_hold(&positive, part, K, fixed, stop, err);
    if (status == UZ_OK && positive)
        *out = part;
    else
        uz_principal_free(part);
    return status;
}

void uz_principal_free(uz_principal *part)
{
    if (!part)
        return;
    cholmod_common *common = &part->ws->common;
    cholmod_l_free_factor(&part->L, common);
    cholmod_l_free_dense(&part->X, common);
    cholmod_l_free_dense(&part->Y, common);
    cholmod_l_free_dense(&part->E, common);
    uz_paths_free(part->paths);
    uz_free_all(part->dof, part->place, part->room, part);
}

/* Rooms of a substitution for one right-hand side. CHOLMOD 3 makes them itself, one after the other, but forgets that
 * there was no memory for the first where there is for the second, and reads it (cholmod_solve2). */
static bool make_rooms(uz_principal *part, size_t n)
{
    const cholmod_factor *L = part->L;
    cholmod_common *common = &part->ws->common;
    return cholmod_l_ensure_dense(&part->Y, n, 1, n, CHOLMOD_REAL, common) &&
           (!L->is_super || cholmod_l_ensure_dense(&part->E, 1, L->maxesize, 1, CHOLMOD_REAL, common));
}

uz_status uz_principal_solve(double *x, uz_principal *part, uz_error *err)
{
    if (part->n_free == 0)
        return UZ_OK;
    if (part->by_paths)
        return uz_paths_solve(x, part->paths, err);
    cholmod_common *common = &part->ws->common;
    const size_t n_free = (size_t)part->n_free;
    cholmod_dense B = {.nrow = n_free,
                       .ncol = 1,
                       .nzmax = n_free,
                       .d = n_free,
                       .x = part->room,
                       .xtype = CHOLMOD_REAL,
                       .dtype = CHOLMOD_DOUBLE};
    for (int64_t k = 0; k < part->n_free; k++)
        part->room[k] = x[part->dof[k]];
    const bool room = make_rooms(part, n_free);
    bool ok = room && cholmod_l_solve2(CHOLMOD_A, part->L, &B, NULL, &part->X, NULL, &part->Y, &part->E, common);
    if (!room || common->status == CHOLMOD_OUT_OF_MEMORY)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to solve for %lld dofs", (long long)part->n_free);
    if (!ok || common->status != CHOLMOD_OK)
        return uz_fail(err, UZ_ERR_INTERNAL, "", "substitution failed (CHOLMOD status %d)", common->status);
    const double *solution = part->X->x;
    for (int64_t k = 0; k < part->n_free; k++)
        x[part->dof[k]] = solution[k];
    return UZ_OK;
}
