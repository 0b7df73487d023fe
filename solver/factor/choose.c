/* choose.c: which ordering, and whether the contact comes last: by the flops that their symbolic factors show. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

typedef struct {
    uz_analysis *analysis;
    cholmod_sparse *graph;
    const int64_t *group; /* n: of each dof */
    int64_t groups, rows;
    int64_t *last; /* n_last: groups of the contact dofs */
    int64_t n_last;
    int64_t *perm, *metis; /* groups */
    bool has_metis;        /* in `metis`: it is slow and serves both forms */
    cholmod_common *common;
} chooser;

/* Analyses one ordering, notes what it costs and keeps it if it is the cheapest so far. The cost: additions and
 * multiplications of the supernodal factorization, filled-in zeros included, and what condensing adds: nothing where a
 * trailing block does and the operator can wait, else Z and Z'Z, either dense on the contact or along the reach. */
static uz_status consider(chooser *c, uz_ordering ordering, bool contact_last, uz_error *err)
{
    uz_analysis *analysis = c->analysis;
    double flops = 0.0;
    const int64_t n_last = contact_last ? c->n_last : 0;
    uz_status status = UZ_OK;
    if (ordering != UZ_ORDERING_METIS) {
        status = uz_order(c->perm, c->graph, c->last, n_last, ordering, c->common, err);
    } else {
        if (!c->has_metis)
            status = uz_order(c->metis, c->graph, NULL, 0, ordering, c->common, err);
        c->has_metis = status == UZ_OK;
        if (status == UZ_OK) {
            memcpy(c->perm, c->metis, (size_t)c->groups * sizeof *c->perm);
            status = uz_move_last(c->perm, c->groups, c->last, n_last, err);
        }
    }
    if (status != UZ_OK)
        return status;
    cholmod_factor *G = cholmod_l_analyze_p(c->graph, (SuiteSparse_long *)c->perm, NULL, 0, c->common);
    cholmod_factor *L = G ? uz_expand(G, c->group, analysis->n, c->common) : NULL;
    cholmod_l_free_factor(&G, c->common);
    for (size_t j = 0; L && j < L->n; j++) {
        const double count = (double)((const SuiteSparse_long *)L->ColCount)[j];
        flops += count * count;
    }
    const double condensing = L ? uz_condensing_flops(L, contact_last, analysis->last, analysis->n_last, c->rows) : 0.0;
    flops += condensing;
    if (condensing < 0.0) /* no memory */
        cholmod_l_free_factor(&L, c->common);
    if (!L)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to analyse a matrix of %lld dofs (CHOLMOD status %d)",
                       (long long)analysis->n, c->common->status);
    uz_order_choice choice = {ordering, contact_last, (int64_t)L->xsize, flops};
    analysis->considered[analysis->n_considered++] = choice;
    if (!analysis->L || choice.flops < analysis->chosen.flops) {
        cholmod_factor *swap = analysis->L;
        analysis->L = L;
        L = swap;
        analysis->chosen = choice;
    }
    cholmod_l_free_factor(&L, c->common);
    return UZ_OK;
}

/* Nested dissection is worth a try where a body has three dimensions, as in two minimum degree does as well (its flops
 * for each edge are then some 50 times the root of the number of nodes; in three, 1000 times or more), and where
 * sparing half the flops, at 3e10 a second, pays for the some 1e-6 s that METIS takes for an edge. */
#define FLOPS_PER_EDGE 6e4
#define NOT_PLANAR     300.0

/* One ordering in the forms that may pay: with the contact last where rows are no fewer than dofs, or nearly; among the
 * others where they are fewer. (The paper's body with oblique normals, n_b = 2m, d = 241,200: 15.6 and 8.5 Gflop. The
 * cube with n_b = 3m, d = 43,125: 66 and 45.) */
static uz_status consider_forms(chooser *c, uz_ordering contact_last, uz_ordering free_of_it, uz_error *err)
{
    int64_t n_b = c->analysis->n_last;
    bool last = n_b > 0 && (c->rows == 0 || 2 * n_b < 3 * c->rows);
    bool among = n_b == 0 || (c->rows > 0 && c->rows < n_b);
    uz_status status = last ? consider(c, contact_last, true, err) : UZ_OK;
    return status == UZ_OK && among ? consider(c, free_of_it, false, err) : status;
}

uz_status uz_choose(uz_analysis *analysis, cholmod_sparse *graph, const int64_t *group, int64_t rows,
                    uz_ordering ordering, cholmod_common *common, uz_error *err)
{
    chooser c = {.analysis = analysis,
                 .graph = graph,
                 .group = group,
                 .groups = (int64_t)graph->nrow,
                 .rows = rows,
                 .common = common};
    c.perm = uz_alloc(c.groups, sizeof *c.perm);
    c.metis = uz_alloc(c.groups, sizeof *c.metis);
    c.last = uz_alloc(analysis->n_last, sizeof *c.last);
    uz_status status = UZ_OK;
    /* To what size and up to which share of zeros small supernodes are merged (Ashcraft and Grimes, ACM TOMS 15 (1989);
     * for CHOLMOD's own numbers see its guide, `nrelax`). Sizes are in columns, and supernodes are counted in groups
     * here. A little more than CHOLMOD's: 7 % more entries, a tenth less time on the paper's body. */
    static const size_t columns[3] = {8, 24, 48};
    static const double zeros[3] = {0.8, 0.15, 0.08};
    for (int k = 0; k < 3; k++) {
        common->nrelax[k] = (columns[k] * (size_t)c.groups + (size_t)analysis->n / 2) / (size_t)analysis->n;
        common->zrelax[k] = zeros[k];
    }
    bool *seen = uz_alloc_zero(c.groups, sizeof *seen);
    if (!c.perm || !c.metis || !c.last || !seen)
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld nodes", (long long)c.groups);
    for (int64_t k = 0; status == UZ_OK && k < analysis->n_last; k++) { /* groups of the contact dofs, each once */
        const int64_t of = group[analysis->last[k]];
        if (!seen[of])
            c.last[c.n_last++] = of;
        seen[of] = true;
    }
    if (status == UZ_OK && ordering != UZ_ORDERING_AUTO) {
        status = consider_forms(&c, ordering, ordering, err);
    } else if (status == UZ_OK) {
        status = consider_forms(&c, UZ_ORDERING_CAMD, UZ_ORDERING_AMD, err);
        const double per_edge = analysis->chosen.flops / (double)((const SuiteSparse_long *)graph->p)[c.groups];
        if (status == UZ_OK && per_edge > FLOPS_PER_EDGE && per_edge > NOT_PLANAR * sqrt((double)c.groups))
            status = consider_forms(&c, UZ_ORDERING_METIS, UZ_ORDERING_METIS, err);
    }
    uz_free_all(seen, c.perm, c.metis, c.last);
    return status;
}
