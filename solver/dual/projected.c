#include "dual/projected.h"
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "linalg/blas.h"
#include "linalg/linalg.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct uz_projected {
    uz_multigrid base;
    const uz_multigrid *mg;
    const uz_dual *dual;
    const uz_csc *K;
    int64_t n, *row; /* the active rows, ascending */
    uz_factor *factor;
    uz_factor_workspace *ws;
    uz_csc G;                    /* where it was softened */
    double *b, *y, *step, *room; /* n each */
    double *e;                   /* d */
    size_t bytes;
};

/* Column k of the lower triangle of G is added to sum (n); its rows, ascending, to `met`. place (m): of each row of N
 * among the active ones, -1: it is none; seen (n): k where a row was met. */
static int64_t add_column(double *sum, int64_t *met, int64_t *seen, const uz_projected *x, const int64_t *place,
                          int64_t k)
{
    const uz_csc *N = &x->dual->N, *Nt = &x->dual->Nt;
    int64_t count = 0;
    for (int64_t q = Nt->ptr[x->row[k]]; q < Nt->ptr[x->row[k] + 1]; q++) {
        const int64_t j = Nt->idx[q];
        for (int64_t s = N->ptr[j]; s < N->ptr[j + 1]; s++) {
            const int64_t l = place[N->idx[s]];
            if (l < k)
                continue;
            if (seen[l] != k) {
                seen[l] = k;
                sum[l] = 0.0;
                met[count++] = l;
            }
            sum[l] += Nt->val[q] * uz_sparse_weight(x->K, j) * N->val[s];
        }
    }
    qsort(met, (size_t)count, sizeof *met, uz_ascending);
    return count;
}

static uz_status make_matrix(uz_csc *G, const uz_projected *x, uz_error *err)
{
    const int64_t n = x->n, m = x->dual->m;
    int64_t *place = uz_alloc(m, sizeof *place), *met = uz_alloc(n, sizeof *met), *seen = uz_alloc(n, sizeof *seen);
    double *sum = uz_alloc(n, sizeof *sum);
    uz_status status = place && met && seen && sum
                           ? UZ_OK
                           : uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)n);
    for (int64_t i = 0; place && i < m; i++)
        place[i] = -1;
    for (int64_t k = 0; place && k < n; k++)
        place[x->row[k]] = k;
    for (int pass = 0; status == UZ_OK && pass < 2; pass++) { /* counted, then filled */
        int64_t at = 0;
        for (int64_t k = 0; k < n; k++)
            seen[k] = -1;
        for (int64_t k = 0; k < n; k++) {
            const int64_t count = add_column(sum, met, seen, x, place, k);
            for (int64_t s = 0; pass == 1 && s < count; s++) {
                G->idx[at + s] = (int32_t)met[s];
                G->val[at + s] = sum[met[s]];
            }
            at += count;
            if (pass == 1)
                G->ptr[k + 1] = at;
        }
        if (pass == 0)
            status = uz_csc_init(G, n, n, at, err);
    }
    uz_free_all(place, met, seen, sum);
    return status;
}

/* Where rows depend on each other, as those of two sides that an obstacle touches beside their common edge, this share
 * of its diagonal is added to G before it is factored, and solves are refined against G itself: what rows agree on is
 * closed to rounding, and reactions are of the least squares among those that do the same. A share that were left would
 * let conjugate gradients leave the rows. */
#define SOFTENED    1e-8
#define REFINEMENTS 2

static void soften(uz_csc *G)
{
    for (int64_t k = 0; k < G->cols; k++)
        G->val[G->ptr[k]] *= 1.0 + SOFTENED;
}

static uz_status factor_rows(uz_projected *x, bool *usable, const uz_hooks *hooks, uz_error *err)
{
    uz_csc G = {0};
    uz_analysis *analysis = NULL;
    uz_error inner = {0};
    uz_status status = make_matrix(&G, x, err);
    *usable = true;
    if (status == UZ_OK)
        status = uz_analysis_create(&analysis, &G, NULL, 0, 0, UZ_ORDERING_AMD, hooks, err);
    if (status == UZ_OK) {
        status = uz_factor_create(&x->factor, &G, analysis, 0, hooks, &inner);
        if (status == UZ_ERR_NOT_SPD) {
            status = uz_csc_copy(&x->G, &G, err);
            soften(&G);
            if (status == UZ_OK)
                status = uz_factor_create(&x->factor, &G, analysis, 0, hooks, &inner);
        }
        *usable = status != UZ_ERR_NOT_SPD; /* else a row is 0, or no number */
        if (status == UZ_ERR_NOT_SPD)
            status = UZ_OK;
        else if (status != UZ_OK)
            uz_fail(err, status, inner.where, "%s", inner.message);
    }
    if (x->factor)
        x->bytes +=
            uz_factor_describe(x->factor).bytes + uz_analysis_bytes(analysis) + uz_csc_bytes(&G) + uz_csc_bytes(&x->G);
    uz_analysis_free(analysis);
    uz_csc_clear(&G);
    return status;
}

/* y = G^-1 b; b is lost. */
static uz_status solve(uz_projected *x, uz_error *err)
{
    if (x->n == 0)
        return UZ_OK;
    uz_status status = uz_factor_solve(x->factor, x->ws, x->y, x->b, x->room, err);
    memcpy(x->step, x->y, (size_t)x->n * sizeof *x->y);
    for (int again = x->G.ptr ? REFINEMENTS : 0; status == UZ_OK && again > 0; again--) {
        uz_csc_symv(x->b, &x->G, -1.0, x->step);
        status = uz_factor_solve(x->factor, x->ws, x->step, x->b, x->room, err);
        uz_axpy(x->n, 1.0, x->step, x->y);
    }
    return status;
}

static double row_dot(const uz_projected *x, int64_t k, const double *u)
{
    const uz_csc *Nt = &x->dual->Nt;
    double sum = 0.0;
    for (int64_t q = Nt->ptr[x->row[k]]; q < Nt->ptr[x->row[k] + 1]; q++)
        sum += Nt->val[q] * u[Nt->idx[q]];
    return sum;
}

/* u += factor W A'y, or without W. */
static void add_rows(const uz_projected *x, double *u, double factor, bool weighted)
{
    const uz_csc *Nt = &x->dual->Nt;
    for (int64_t k = 0; k < x->n; k++)
        for (int64_t q = Nt->ptr[x->row[k]]; q < Nt->ptr[x->row[k] + 1]; q++)
            u[Nt->idx[q]] += factor * Nt->val[q] * x->y[k] * (weighted ? uz_sparse_weight(x->K, Nt->idx[q]) : 1.0);
}

uz_status uz_projected_close(uz_projected *x, double *u, const double *h, uz_error *err)
{
    for (int64_t k = 0; k < x->n; k++)
        x->b[k] = (h ? h[x->row[k]] : 0.0) - row_dot(x, k, u);
    const uz_status status = solve(x, err);
    if (status == UZ_OK)
        add_rows(x, u, 1.0, true);
    return status;
}

/* y = G^-1 A W force */
static uz_status find_reactions(uz_projected *x, const double *force, uz_error *err)
{
    const uz_csc *Nt = &x->dual->Nt;
    for (int64_t k = 0; k < x->n; k++) {
        x->b[k] = 0.0;
        for (int64_t q = Nt->ptr[x->row[k]]; q < Nt->ptr[x->row[k] + 1]; q++)
            x->b[k] += Nt->val[q] * uz_sparse_weight(x->K, Nt->idx[q]) * force[Nt->idx[q]];
    }
    return solve(x, err);
}

uz_status uz_projected_react(uz_projected *x, double *r, const double *force, uz_error *err)
{
    const uz_status status = find_reactions(x, force, err);
    memset(r, 0, (size_t)x->dual->m * sizeof *r);
    for (int64_t k = 0; status == UZ_OK && k < x->n; k++)
        r[x->row[k]] = x->y[k];
    return status;
}

static uz_status apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err)
{
    uz_projected *x = (uz_projected *)mg; /* made for one thread */
    memcpy(x->e, r, (size_t)mg->n * sizeof *r);
    uz_status status = find_reactions(x, r, err);
    if (status != UZ_OK)
        return status;
    add_rows(x, x->e, -1.0, false);
    status = x->mg->kind->apply(x->mg, K, room, z, x->e, err);
    return status == UZ_OK ? uz_projected_close(x, z, NULL, err) : status;
}

static void multiply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *y, const double *of)
{
    const uz_multigrid *whole = ((const uz_projected *)mg)->mg;
    whole->kind->multiply(whole, K, room, y, of);
}

static const uz_multigrid_kind PROJECTED = {.apply = apply, .multiply = multiply};

uz_status uz_projected_create(uz_projected **out, const uz_multigrid *mg, const uz_dual *dual, const uz_csc *K,
                              const bool *active, const uz_hooks *hooks, uz_error *err)
{
    uz_projected *x = uz_alloc_zero(1, sizeof *x);
    bool usable = true;
    *out = NULL;
    if (!x)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for rows as equations");
    x->base = (uz_multigrid){.kind = &PROJECTED, .n = mg->n, .levels = mg->levels, .knows_K = mg->knows_K};
    x->mg = mg;
    x->dual = dual;
    x->K = K;
    for (int64_t i = 0; i < dual->m; i++)
        x->n += active[i];
    x->row = uz_alloc(x->n, sizeof *x->row);
    x->b = uz_alloc(x->n, sizeof *x->b);
    x->y = uz_alloc_zero(x->n, sizeof *x->y);
    x->step = uz_alloc(x->n, sizeof *x->step);
    x->room = uz_alloc(x->n, sizeof *x->room);
    x->e = uz_alloc(mg->n, sizeof *x->e);
    x->ws = uz_factor_workspace_new();
    uz_status status = x->row && x->b && x->y && x->step && x->room && x->e && x->ws
                           ? UZ_OK
                           : uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)x->n);
    for (int64_t i = 0, k = 0; status == UZ_OK && i < dual->m; i++)
        if (active[i])
            x->row[k++] = i;
    x->bytes = sizeof *x + 40 * (size_t)x->n + 8 * (size_t)mg->n;
    if (status == UZ_OK && x->n > 0)
        status = factor_rows(x, &usable, hooks, err);
    if (status == UZ_OK && usable)
        *out = x;
    else
        uz_projected_free(x);
    return status;
}

void uz_projected_free(uz_projected *x)
{
    if (!x)
        return;
    uz_factor_free(x->factor);
    uz_factor_workspace_free(x->ws);
    uz_csc_clear(&x->G);
    uz_free_all(x->row, x->b, x->y, x->step, x->room, x->e, x);
}

double uz_projected_scale(const uz_projected *x, int64_t i, const double *h, const double *u)
{
    const uz_csc *Nt = &x->dual->Nt;
    double sum = fabs(h[i]);
    for (int64_t q = Nt->ptr[i]; q < Nt->ptr[i + 1]; q++)
        sum += fabs(Nt->val[q] * u[Nt->idx[q]]);
    return sum;
}

/* A row is missed where its gap is this, relative to the largest scale of one. */
#define MISSED 1e-12

bool uz_projected_release(const uz_projected *x, double *r, const double *h, const double *u, const double *g)
{
    double scale = 0.0, most = 0.0, open = 0.0;
    for (int64_t k = 0; x->G.ptr && k < x->n; k++) {
        const int64_t i = x->row[k];
        scale = fmax(scale, uz_projected_scale(x, i, h, u));
        most = fmax(most, fabs(g[i]));
        open = fmax(open, g[i]);
    }
    const bool any = r && open > MISSED * scale;
    for (int64_t k = 0; any && k < x->n; k++)
        if (g[x->row[k]] > 0.5 * open)
            r[x->row[k]] = fmax(fabs(r[x->row[k]]), DBL_MIN);
    return any || most <= MISSED * scale;
}

size_t uz_projected_bytes(const uz_projected *x)
{
    return x->bytes;
}

const uz_multigrid *uz_projected_multigrid(const uz_projected *x)
{
    return &x->base;
}
