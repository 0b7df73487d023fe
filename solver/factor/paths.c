/* paths.c: the factor of K with some dofs held, from the factor of K.
 *
 * A held dof is a column of the unit matrix. Its row in the columns that are eliminated before it stays what it is
 * while it is free: they do not depend on it, substitutions have 0 in its place, and when it is let go all is there. So
 * the dofs that are held and let go change the supernodes on their paths to the root of the elimination tree, and no
 * others (Davis and Hager, SIAM J. Matrix Anal. Appl. 26 (2005), for rows of a factor by columns). These are made anew,
 * each from the rows of K and what its descendants take from it, as the left-looking supernodal factorization makes all
 * (Ng and Peyton, SIAM J. Sci. Comput. 14 (1993)). Where a contact grows or shrinks that is little beside the whole. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <stdlib.h>
#include <string.h>

/* Rows begin .. end - 1 of supernode `from` are columns of the supernode that it takes something from. */
typedef struct {
    int64_t from, begin, end;
} link;

struct uz_paths {
    const uz_factor *factor;
    uz_factor_workspace *ws;
    cholmod_sparse *K; /* in the factor's order, lower triangle */
    int64_t *parent;   /* nsuper: -1: none */
    int64_t *first;    /* nsuper + 1: where the links into each begin */
    link *links;
    double *work;   /* nsuper: flops to make one anew */
    bool *changed;  /* nsuper: to be made anew */
    bool *held;     /* n, in the factor's order */
    double **block; /* nsuper: those made anew; NULL: the factor's, or all its columns are held */
    bool *idle;     /* nsuper: all its columns are held */
    int64_t *local; /* n: a row's place in the current supernode */
    double *room;   /* n_room: the largest product of a link */
    size_t n_room;
    double *x; /* n */
};

/* An entry that is cleared, gathered and passed, in flops; of memory that has been used before. */
#define FLOPS_PER_ENTRY 16.0

/* The supernodes that take something from others: counted (links NULL), or listed. owner (n): the supernode of each
 * column; next (nsuper + 1): how many links lead into each, or where its next one goes. */
static void list_links(uz_paths *x, int64_t *next, const int64_t *owner, size_t *most)
{
    const cholmod_factor *L = &x->factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *rows = L->s;
    for (int64_t d = 0; d < (int64_t)L->nsuper; d++) {
        const int64_t columns = super[d + 1] - super[d], count = pi[d + 1] - pi[d];
        for (int64_t begin = columns, end; begin < count; begin = end) {
            const int64_t s = owner[rows[pi[d] + begin]];
            for (end = begin + 1; end < count && owner[rows[pi[d] + end]] == s;)
                end++;
            if (!x->links) {
                const size_t size = (size_t)(count - begin) * (size_t)(end - begin);
                next[s + 1]++;
                *most = size > *most ? size : *most;
                x->work[s] += (double)size * ((double)columns + FLOPS_PER_ENTRY);
                continue;
            }
            x->links[next[s]++] = (link){d, begin, end};
        }
    }
}

size_t uz_paths_bytes(const uz_paths *x)
{
    if (!x)
        return 0;
    const cholmod_factor *L = &x->factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi;
    size_t bytes = 16 * x->K->nzmax + 25 * L->n + 34 * L->nsuper;
    bytes += (size_t)x->first[L->nsuper] * sizeof *x->links + x->n_room * sizeof *x->room;
    for (size_t s = 0; s < L->nsuper; s++)
        bytes += x->block[s] ? 8 * (size_t)((super[s + 1] - super[s]) * (pi[s + 1] - pi[s])) : 0;
    return bytes;
}

uz_status uz_paths_create(uz_paths **out, const uz_csc *K, const uz_factor *factor, uz_factor_workspace *ws,
                          uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *rows = L->s;
    const int64_t n = factor->n, count = (int64_t)L->nsuper;
    uz_paths *x = uz_alloc_zero(1, sizeof *x);
    int64_t *owner = uz_alloc(n, sizeof *owner), *next = uz_alloc(count + 1, sizeof *next);
    size_t most = 1;
    bool ok = x && owner && next;
    *out = NULL;
    if (x)
        *x = (uz_paths){.factor = factor,
                        .ws = ws,
                        .K = uz_permute(K, factor->analysis->position, NULL, &ws->common),
                        .parent = uz_alloc(count, sizeof *x->parent),
                        .first = uz_alloc_zero(count + 1, sizeof *x->first),
                        .work = uz_alloc_zero(count, sizeof *x->work),
                        .changed = uz_alloc_zero(count, sizeof *x->changed),
                        .held = uz_alloc_zero(n, sizeof *x->held),
                        .block = uz_alloc_zero(count, sizeof *x->block),
                        .idle = uz_alloc_zero(count, sizeof *x->idle),
                        .local = uz_alloc(n, sizeof *x->local),
                        .x = uz_alloc(n, sizeof *x->x)};
    ok = ok && x->K && x->parent && x->first && x->work && x->changed && x->held && x->block && x->idle && x->local &&
         x->x;
    for (int64_t s = 0; ok && s < count; s++)
        for (int64_t j = super[s]; j < super[s + 1]; j++)
            owner[j] = s;
    for (int64_t s = 0; ok && s < count; s++) {
        const double columns = (double)(super[s + 1] - super[s]), height = (double)(pi[s + 1] - pi[s]);
        x->parent[s] = height > columns ? owner[rows[pi[s] + super[s + 1] - super[s]]] : -1;
        x->work[s] = columns * height * (columns + FLOPS_PER_ENTRY);
    }
    if (ok) {
        list_links(x, x->first, owner, &most);
        for (int64_t s = 0; s < count; s++)
            x->first[s + 1] += x->first[s];
        memcpy(next, x->first, (size_t)(count + 1) * sizeof *next);
        x->links = uz_alloc(x->first[count], sizeof *x->links);
        x->room = uz_alloc((int64_t)most, sizeof *x->room);
        x->n_room = most;
        ok = x->links && x->room;
    }
    if (ok)
        list_links(x, next, owner, &most);
    uz_free_all(owner, next);
    if (ok) {
        *out = x;
        return UZ_OK;
    }
    uz_paths_free(x);
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for the paths of a factor of %lld dofs", (long long)n);
}

/* Back to the factor's own: no dof is held. */
static void reset(uz_paths *x)
{
    const int64_t count = (int64_t)x->factor->L.nsuper;
    for (int64_t s = 0; x->block && s < count; s++) {
        free(x->block[s]);
        x->block[s] = NULL;
    }
    if (x->held)
        memset(x->held, 0, (size_t)x->factor->n * sizeof *x->held);
    if (x->idle)
        memset(x->idle, 0, (size_t)count * sizeof *x->idle);
}

void uz_paths_free(uz_paths *x)
{
    if (!x)
        return;
    reset(x);
    cholmod_l_free_sparse(&x->K, &x->ws->common);
    uz_free_all(x->parent, x->first, x->links, x->work, x->changed, x->held, x->block, x->idle, x->local, x->room,
                x->x);
    free(x);
}

double uz_paths_work(uz_paths *x, const bool *fixed)
{
    const cholmod_factor *L = &x->factor->L;
    const SuiteSparse_long *super = L->super, *perm = L->Perm;
    double work = 0.0;
    memset(x->changed, 0, L->nsuper * sizeof *x->changed);
    for (int64_t s = 0; s < (int64_t)L->nsuper; s++) { /* children come before parents */
        bool all = true;
        for (int64_t j = super[s]; j < super[s + 1]; j++) {
            x->changed[s] = x->changed[s] || x->held[j] != fixed[perm[j]];
            all = all && fixed[perm[j]];
        }
        if (x->changed[s] && x->parent[s] >= 0)
            x->changed[x->parent[s]] = true;
        if (x->changed[s] && !all)
            work += x->work[s];
    }
    return work;
}

/* Below so many flops a product of matrices takes longer to begin than to do. */
enum { FEW_FLOPS = 256 };

/* Supernode s for the dofs that are held now. */
static uz_status make(bool *positive, uz_paths *x, int64_t s, uz_error *err)
{
    const cholmod_factor *L = &x->factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *row = (SuiteSparse_long *)L->s + pi[s],
                           *ptr = x->K->p, *index = x->K->i;
    const int64_t columns = super[s + 1] - super[s], height = pi[s + 1] - pi[s];
    const double *value = x->K->x;
    x->idle[s] = true;
    for (int64_t j = super[s]; j < super[s + 1]; j++)
        x->idle[s] = x->idle[s] && x->held[j];
    if (x->idle[s])
        return UZ_OK;
    if (!x->block[s] && !(x->block[s] = uz_alloc(columns * height, sizeof(double))))
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)x->factor->n);
    double *block = x->block[s];
    memset(block, 0, (size_t)(columns * height) * sizeof *block);
    for (int64_t i = 0; i < height; i++)
        x->local[row[i]] = i;
    for (int64_t c = 0; c < columns; c++)
        for (int64_t e = ptr[super[s] + c]; !x->held[super[s] + c] && e < ptr[super[s] + c + 1]; e++)
            block[x->local[index[e]] + c * height] = value[e];
    for (int64_t k = x->first[s]; k < x->first[s + 1]; k++) { /* what its rows take from s: block -= L_d L_d' */
        const link *from = &x->links[k];
        const int64_t d = from->from, own_columns = super[d + 1] - super[d], ld = pi[d + 1] - pi[d],
                      width = from->end - from->begin, rest = ld - from->begin;
        const SuiteSparse_long *row_of_d = (SuiteSparse_long *)L->s + pi[d];
        const double *L_d = x->block[d] ? x->block[d] : (double *)L->x + px[d];
        const bool few = own_columns * width * rest <= FEW_FLOPS;
        if (x->idle[d])
            continue;
        if (!few)
            uz_block_outer(&(uz_outer){.rows = rest,
                                       .n = width,
                                       .k = own_columns,
                                       .A = L_d + from->begin,
                                       .ld = ld,
                                       .C = x->room,
                                       .ldc = rest});
        for (int64_t c = from->begin; c < from->end; c++) {
            double *to = block + x->local[row_of_d[c]] * height;
            const double *product = x->room + (c - from->begin) * rest;
            if (x->held[row_of_d[c]])
                continue;
            for (int64_t q = 0; few && q < own_columns; q++)
                for (int64_t i = c; i < ld; i++)
                    to[x->local[row_of_d[i]]] -= L_d[i + q * ld] * L_d[c + q * ld];
            for (int64_t i = c; !few && i < ld; i++)
                to[x->local[row_of_d[i]]] -= product[i - from->begin];
        }
    }
    for (int64_t c = 0; c < columns; c++) {
        if (!x->held[super[s] + c])
            continue;
        for (int64_t b = 0; b < c; b++)
            block[c + b * height] = 0.0;
        block[c + c * height] = 1.0;
    }
    *positive = uz_block_factor(columns, height - columns, block, height) == columns;
    return UZ_OK;
}

/* Flops between two questions: milliseconds. */
#define FLOPS_AT_ONCE 1e7

uz_status uz_paths_hold(bool *positive, uz_paths *x, const bool *fixed, const uz_stop *stop, uz_error *err)
{
    const SuiteSparse_long *perm = x->factor->L.Perm;
    double since = 0.0;
    uz_status status = UZ_OK;
    *positive = true;
    (void)uz_paths_work(x, fixed);
    for (int64_t j = 0; j < x->factor->n; j++)
        x->held[j] = fixed[perm[j]];
    for (int64_t s = 0; s < (int64_t)x->factor->L.nsuper && status == UZ_OK && *positive; s++) {
        if (!x->changed[s])
            continue;
        since += x->work[s];
        if (since > FLOPS_AT_ONCE) {
            since = 0.0;
            *positive = !uz_stop_is_due(stop);
        }
        if (*positive)
            status = make(positive, x, s, err);
    }
    if (status != UZ_OK || !*positive)
        reset(x);
    return status;
}

uz_status uz_paths_solve(double *v, uz_paths *x, uz_error *err)
{
    const SuiteSparse_long *perm = x->factor->L.Perm;
    const uz_overlay overlay = {(const double *const *)x->block, x->held};
    for (int64_t k = 0; k < x->factor->n; k++)
        x->x[k] = x->held[k] ? 0.0 : v[perm[k]];
    x->ws->overlay = &overlay;
    uz_status status = uz_factor_solve_one(x->factor, x->ws, x->x, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(x->factor, x->ws, x->x, false, err);
    x->ws->overlay = NULL;
    for (int64_t k = 0; status == UZ_OK && k < x->factor->n; k++)
        if (!x->held[k])
            v[perm[k]] = x->x[k];
    return status;
}
