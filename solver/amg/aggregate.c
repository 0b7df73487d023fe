/* aggregate.c: nodes that hang together strongly become one node of the next level (Vanek, Mandel, Brezina 1996,
 * section 5). */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Strong neighbours of each node, both ways. */
typedef struct {
    int64_t *ptr;  /* n_nodes + 1 */
    int32_t *node; /* ptr[n_nodes] */
} graph;

/* The dofs of each node. */
typedef struct {
    int64_t *ptr; /* n_nodes + 1 */
    int32_t *dof; /* n */
} members;

void uz_list_members(int64_t *start, int32_t *member, const int32_t *of, int64_t n, int64_t groups)
{
    for (int64_t i = 0; i < n; i++)
        if (of[i] >= 0)
            start[of[i] + 2]++;
    for (int64_t a = 0; a <= groups; a++)
        start[a + 1] += start[a];
    for (int64_t i = 0; i < n; i++)
        if (of[i] >= 0)
            member[start[of[i] + 1]++] = (int32_t)i;
}

/* What is needed to visit the strong neighbours of a node in the lower triangle once each. */
typedef struct {
    const uz_csc *A;
    const double *inverse;
    const int32_t *node;
    const members *list;
    int32_t *seen; /* n_nodes: the last node from which it was met, plus 1 */
    double square; /* threshold squared: strong is a_ij^2 > square a_ii a_jj for some pair of their dofs */
} visit;

/* Lists in `found` the nodes that a's columns reach strongly, a itself left out; their number. */
static int64_t strong_below(int32_t *found, const visit *v, int32_t a)
{
    int64_t count = 0;
    for (int64_t q = v->list->ptr[a]; q < v->list->ptr[a + 1]; q++) {
        int32_t j = v->list->dof[q];
        for (int64_t k = v->A->ptr[j] + 1; k < v->A->ptr[j + 1]; k++) {
            int64_t i = v->A->idx[k];
            int32_t b = v->node[i];
            double value = v->A->val[k];
            if (b == a || v->seen[b] == a + 1 || value * v->inverse[i] * (value * v->inverse[j]) <= v->square)
                continue;
            v->seen[b] = a + 1;
            found[count++] = b;
        }
    }
    return count;
}

/* Both ways; a pair may occur twice where dofs of two nodes are numbered in turns, which does no harm. */
static bool build_graph(graph *g, visit *v, int32_t *found, int64_t n_nodes)
{
    g->ptr = uz_alloc_zero(n_nodes + 2, sizeof *g->ptr);
    if (!g->ptr)
        return false;
    for (int64_t a = 0; a < n_nodes; a++) {
        int64_t count = strong_below(found, v, (int32_t)a);
        g->ptr[a + 2] += count;
        for (int64_t k = 0; k < count; k++)
            g->ptr[found[k] + 2]++;
    }
    for (int64_t a = 0; a <= n_nodes; a++)
        g->ptr[a + 1] += g->ptr[a];
    g->node = uz_alloc(g->ptr[n_nodes + 1], sizeof *g->node);
    if (!g->node)
        return false;
    memset(v->seen, 0, (size_t)n_nodes * sizeof *v->seen);
    for (int64_t a = 0; a < n_nodes; a++) {
        int64_t count = strong_below(found, v, (int32_t)a);
        for (int64_t k = 0; k < count; k++) {
            g->node[g->ptr[a + 1]++] = found[k];
            g->node[g->ptr[found[k] + 1]++] = (int32_t)a;
        }
    }
    return true;
}

enum { NONE = -1, ALONE = -2 };

static void take_free_neighbours(const graph *g, int32_t *aggregate, int64_t a, int32_t number)
{
    aggregate[a] = number;
    for (int64_t k = g->ptr[a]; k < g->ptr[a + 1]; k++)
        if (aggregate[g->node[k]] == NONE)
            aggregate[g->node[k]] = number;
}

uz_status uz_aggregate(int32_t *aggregate, int64_t *count, const uz_csc *A, const double *inverse, const int32_t *node,
                       int64_t n_nodes, double threshold, uz_error *err)
{
    members list = {uz_alloc_zero(n_nodes + 2, sizeof *list.ptr), uz_alloc(A->cols, sizeof *list.dof)};
    graph g = {0};
    int32_t *found = uz_alloc(n_nodes, sizeof *found), *seen = uz_alloc_zero(n_nodes, sizeof *seen);
    visit v = {A, inverse, node, &list, seen, threshold * threshold};
    bool ok = found && seen && list.ptr && list.dof;
    if (ok)
        uz_list_members(list.ptr, list.dof, node, A->cols, n_nodes);
    ok = ok && build_graph(&g, &v, found, n_nodes);
    /* whole neighbourhoods first; then what is left joins a neighbour's aggregate; what has none forms its own */
    int32_t number = 0;
    for (int64_t a = 0; ok && a < n_nodes; a++)
        aggregate[a] = g.ptr[a] == g.ptr[a + 1] ? ALONE : NONE;
    for (int64_t a = 0; ok && a < n_nodes; a++) {
        bool free_around = aggregate[a] == NONE;
        for (int64_t k = g.ptr[a]; free_around && k < g.ptr[a + 1]; k++)
            free_around = aggregate[g.node[k]] < 0;
        if (free_around)
            take_free_neighbours(&g, aggregate, a, number++);
    }
    const int32_t kept = number;
    for (int64_t a = 0; ok && a < n_nodes; a++)
        for (int64_t k = g.ptr[a]; aggregate[a] == NONE && k < g.ptr[a + 1]; k++) {
            int32_t joined = aggregate[g.node[k]];
            if (joined >= 0 && joined < kept)
                aggregate[a] = kept + joined; /* marked, so that joiners attract no joiners */
        }
    for (int64_t a = 0; ok && a < n_nodes; a++)
        aggregate[a] = aggregate[a] >= kept ? aggregate[a] - kept : aggregate[a];
    for (int64_t a = 0; ok && a < n_nodes; a++)
        if (aggregate[a] == NONE)
            take_free_neighbours(&g, aggregate, a, number++);
    for (int64_t a = 0; ok && a < n_nodes; a++)
        aggregate[a] = aggregate[a] == ALONE ? -1 : aggregate[a];
    *count = number;
    free(found);
    free(seen);
    free(list.ptr);
    free(list.dof);
    free(g.ptr);
    free(g.node);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)A->cols);
}
