/* reach.c: solves that begin and end at a few dofs.
 *
 * L^-1 b is zero but on the paths from b's nonzeros to the root of the elimination tree (Gilbert and Peierls, SIAM J.
 * Sci. Stat. Comput. 9 (1988); Davis, "Direct Methods for Sparse Linear Systems", 2006, section 3.2), and L'^-1 y on
 * such a path asks for nothing outside it. All of it is by supernodes, in dense blocks. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"

#include <string.h>

/* Columns `first` up to first + columns of L, and their `rows` rows, the first of which are those columns. */
typedef struct {
    int64_t first, columns, rows;
    const SuiteSparse_long *row;
    const double *value; /* NULL in a symbolic factor */
} supernode;

static supernode at(const cholmod_factor *L, int64_t s)
{
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *rows = L->s;
    const double *x = L->x;
    return (supernode){super[s], super[s + 1] - super[s], pi[s + 1] - pi[s], rows + pi[s], x ? x + px[s] : NULL};
}

/* owner[j] (n): the supernode of column j. */
static void find_owners(int64_t *owner, const cholmod_factor *L)
{
    const SuiteSparse_long *super = L->super;
    for (size_t s = 0; s < L->nsuper; s++)
        for (int64_t j = super[s]; j < super[s + 1]; j++)
            owner[j] = (int64_t)s;
}

/* The supernode that s hands its rows below on to; -1: none. */
static int64_t parent_of(const cholmod_factor *L, int64_t s, const int64_t *owner)
{
    supernode node = at(L, s);
    return node.rows > node.columns ? owner[node.row[node.columns]] : -1;
}

double uz_condensing_flops(const cholmod_factor *L, bool last, const int64_t *dofs, int64_t n_dofs, int64_t rows)
{
    if (rows == 0 || n_dofs == 0)
        return 0.0;
    if (last)
        return (double)rows * (double)n_dofs * (double)(rows + n_dofs);
    const SuiteSparse_long *perm = L->Perm;
    bool *touched = uz_alloc_zero((int64_t)L->n, sizeof *touched);
    int64_t *owner = uz_alloc((int64_t)L->n, sizeof *owner), *below = uz_alloc_zero((int64_t)L->nsuper, sizeof *below);
    double flops = touched && owner && below ? 0.0 : -1.0;
    if (flops == 0.0) {
        find_owners(owner, L);
        for (int64_t k = 0; k < n_dofs; k++)
            touched[dofs[k]] = true;
        for (int64_t k = 0; k < (int64_t)L->n; k++)
            below[owner[k]] += touched[perm[k]];
    }
    for (int64_t s = 0; flops >= 0.0 && s < (int64_t)L->nsuper; s++) {
        supernode node = at(L, s);
        int64_t parent = parent_of(L, s, owner);
        double k = (double)node.columns, r = (double)(node.rows - node.columns);
        double c = (double)below[s] * (double)rows / (double)n_dofs; /* rows share dofs evenly, more or less */
        flops += k * k * c + 2.0 * r * k * c + k * c * c;
        if (parent >= 0)
            below[parent] += below[s];
    }
    uz_free_all(touched, owner, below);
    return flops;
}

struct uz_reach {
    const uz_factor *factor;
    int64_t count;
    int64_t *node;   /* count: supernodes, ascending: children before parents */
    int64_t *parent; /* count: where in `node` its parent is, -1: none */
};

uz_status uz_reach_create(uz_reach **out, const uz_factor *factor, const int64_t *dofs, int64_t n_dofs, uz_error *err)
{
    *out = NULL;
    uz_reach *reach = uz_alloc_zero(1, sizeof *reach);
    int64_t *owner = uz_alloc(factor->n, sizeof *owner);
    int64_t *place = uz_alloc((int64_t)factor->L.nsuper, sizeof *place);
    bool ok = reach && owner && place;
    if (ok) {
        /* The supernodes of the dofs and all that they lead to; place: -1, or the place in `node`. */
        const cholmod_factor *L = &factor->L;
        reach->factor = factor;
        find_owners(owner, L);
        for (size_t s = 0; s < L->nsuper; s++)
            place[s] = -1;
        for (int64_t k = 0; k < n_dofs; k++)
            for (int64_t s = owner[factor->analysis->position[dofs[k]]]; s >= 0 && place[s] < 0;
                 s = parent_of(L, s, owner)) {
                place[s] = 0;
                reach->count++;
            }
        reach->node = uz_alloc(reach->count, sizeof *reach->node);
        reach->parent = uz_alloc(reach->count, sizeof *reach->parent);
        ok = reach->node && reach->parent;
    }
    for (int64_t s = 0, count = 0; ok && s < (int64_t)factor->L.nsuper; s++)
        if (place[s] == 0) {
            place[s] = count;
            reach->node[count++] = s;
        }
    for (int64_t k = 0; ok && k < reach->count; k++) {
        const int64_t parent = parent_of(&factor->L, reach->node[k], owner);
        reach->parent[k] = parent < 0 ? -1 : place[parent];
    }
    uz_free_all(owner, place);
    if (ok) {
        *out = reach;
        return UZ_OK;
    }
    uz_reach_free(reach);
    return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for the paths of %lld dofs", (long long)n_dofs);
}

void uz_reach_free(uz_reach *reach)
{
    if (!reach)
        return;
    uz_free_all(reach->node, reach->parent, reach);
}

uz_status uz_reach_forward(const uz_reach *reach, uz_factor_workspace *ws, double *x, uz_error *err)
{
    const cholmod_factor *L = &reach->factor->L;
    uz_status status = uz_need_panel(ws, L->maxesize, err);
    for (int64_t k = 0; status == UZ_OK && k < reach->count; k++) {
        supernode s = at(L, reach->node[k]);
        int64_t below = s.rows - s.columns;
        memset(ws->panel, 0, (size_t)below * sizeof *ws->panel);
        uz_trsv_lower(s.columns, s.value, s.rows, x + s.first, false);
        uz_block_gemv(below, s.columns, s.value + s.columns, s.rows, x + s.first, ws->panel, false);
        for (int64_t i = 0; i < below; i++)
            x[s.row[s.columns + i]] += ws->panel[i];
    }
    return status;
}

uz_status uz_reach_backward(const uz_reach *reach, uz_factor_workspace *ws, double *x, uz_error *err)
{
    const cholmod_factor *L = &reach->factor->L;
    uz_status status = uz_need_panel(ws, L->maxesize, err);
    for (int64_t k = reach->count - 1; status == UZ_OK && k >= 0; k--) {
        supernode s = at(L, reach->node[k]);
        int64_t below = s.rows - s.columns;
        for (int64_t i = 0; i < below; i++)
            ws->panel[i] = x[s.row[s.columns + i]];
        uz_block_gemv(below, s.columns, s.value + s.columns, s.rows, ws->panel, x + s.first, true);
        uz_trsv_lower(s.columns, s.value, s.rows, x + s.first, true);
    }
    return status;
}

/* What a supernode has of Z = L^-1 P N', and what it leaves to its parent. */
typedef struct {
    int64_t *column; /* count: rows of N whose paths lead here */
    int64_t count;
    double *block; /* the supernode's rows x count: Z on its columns, right-hand sides still to solve below */
    int64_t next;  /* the next child of the same parent, -1: none */
} share;

typedef struct {
    const uz_reach *reach;
    const uz_csc *N;
    double *D, *gram; /* m x m; room for Z'Z of one supernode */
    share *shares;    /* of all nodes of the reach */
    int64_t *child;   /* the first child whose share waits, -1: none */
    int64_t *slot;    /* m: a row's column in the current share, -1: none */
    int64_t *local;   /* n: a row's place in the current supernode, where it has one */
} gathering;

static void add_column(gathering *g, share *own, int64_t row)
{
    if (g->slot[row] >= 0)
        return;
    g->slot[row] = own->count;
    own->column[own->count++] = row;
}

/* The right-hand sides of a supernode: the rows of N on its own dofs, and all that its children left. */
static bool collect(gathering *g, int64_t k, const supernode *s)
{
    const cholmod_factor *L = &g->reach->factor->L;
    const SuiteSparse_long *perm = L->Perm;
    share *own = &g->shares[k];
    int64_t most = 0;
    for (int64_t j = s->first; j < s->first + s->columns; j++)
        most += g->N->ptr[perm[j] + 1] - g->N->ptr[perm[j]];
    for (int64_t c = g->child[k]; c >= 0; c = g->shares[c].next)
        most += g->shares[c].count;
    own->column = uz_alloc(most < g->N->rows ? most : g->N->rows, sizeof *own->column);
    if (!own->column)
        return false;
    for (int64_t j = s->first; j < s->first + s->columns; j++)
        for (int64_t e = g->N->ptr[perm[j]]; e < g->N->ptr[perm[j] + 1]; e++)
            add_column(g, own, g->N->idx[e]);
    for (int64_t c = g->child[k]; c >= 0; c = g->shares[c].next)
        for (int64_t q = 0; q < g->shares[c].count; q++)
            add_column(g, own, g->shares[c].column[q]);
    own->block = uz_alloc_zero(s->rows * own->count, sizeof *own->block);
    if (!own->block)
        return false;
    for (int64_t i = 0; i < s->rows; i++)
        g->local[s->row[i]] = i;
    for (int64_t j = 0; j < s->columns; j++)
        for (int64_t e = g->N->ptr[perm[s->first + j]]; e < g->N->ptr[perm[s->first + j] + 1]; e++)
            own->block[j + g->slot[g->N->idx[e]] * s->rows] += g->N->val[e];
    for (int64_t c = g->child[k]; c >= 0; c = g->shares[c].next) {
        supernode from = at(L, g->reach->node[c]);
        /* What the child left goes row by row where it belongs. */
        share *child = &g->shares[c];
        for (int64_t q = 0; q < child->count; q++) {
            double *to = own->block + g->slot[child->column[q]] * s->rows;
            const double *left = child->block + q * from.rows;
            for (int64_t i = from.columns; i < from.rows; i++)
                to[g->local[from.row[i]]] += left[i];
        }
        uz_free_all(child->column, child->block);
        child->column = NULL;
        child->block = NULL;
    }
    return true;
}

static bool visit(gathering *g, int64_t k)
{
    supernode s = at(&g->reach->factor->L, g->reach->node[k]);
    share *own = &g->shares[k];
    int64_t parent = g->reach->parent[k];
    if (!collect(g, k, &s))
        return false;
    uz_block_eliminate(s.columns, s.rows - s.columns, own->count, s.value, s.rows, own->block, s.rows);
    /* D += Z_s'Z_s */
    int64_t m = g->N->rows, count = own->count;
    uz_block_syrk_t(count, s.columns, own->block, s.rows, g->gram);
    for (int64_t q = 0; q < count; q++)
        for (int64_t p = q; p < count; p++) {
            int64_t a = own->column[p], b = own->column[q];
            g->D[a > b ? a + b * m : b + a * m] += g->gram[p + q * count];
        }
    for (int64_t q = 0; q < own->count; q++)
        g->slot[own->column[q]] = -1;
    if (parent >= 0) {
        own->next = g->child[parent];
        g->child[parent] = k;
    } else {
        uz_free_all(own->column, own->block);
        own->column = NULL;
        own->block = NULL;
    }
    return true;
}

uz_status uz_reach_gram(double *D, const uz_reach *reach, const uz_csc *N, uz_error *err)
{
    const int64_t count = reach->count, m = N->rows;
    gathering g = {.reach = reach,
                   .N = N,
                   .D = D,
                   .gram = uz_alloc(m * m, sizeof *g.gram),
                   .shares = uz_alloc_zero(count, sizeof *g.shares),
                   .child = uz_alloc(count, sizeof *g.child),
                   .slot = uz_alloc(m, sizeof *g.slot),
                   .local = uz_alloc(reach->factor->n, sizeof *g.local)};
    bool ok = g.shares && g.child && g.slot && g.local && g.gram;
    memset(D, 0, (size_t)(m * m) * sizeof *D);
    for (int64_t k = 0; ok && k < count; k++)
        g.child[k] = -1;
    for (int64_t i = 0; ok && i < m; i++)
        g.slot[i] = -1;
    for (int64_t k = 0; ok && k < count; k++)
        ok = visit(&g, k);
    for (int64_t k = 0; g.shares && k < count; k++)
        uz_free_all(g.shares[k].column, g.shares[k].block);
    uz_free_all(g.shares, g.child, g.slot, g.local, g.gram);
    if (ok)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)m);
}
