/* aggregate.c: nodes that hang together strongly become one node of the next level (Vanek, Mandel, Brezina 1996,
 * section 5). */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Strong neighbours of each node, both ways. */
typedef struct {
    int64_t *ptr;  /* nodes + 1 */
    int32_t *node; /* ptr[nodes] */
} graph;

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

/* a_ij^2 > square a_ii a_jj for some pair of dofs of the two nodes. */
static bool is_strong(const uz_level *level, double square, int64_t i, int64_t e)
{
    const int b = level->A.b;
    double room[UZ_MODES_MOST * UZ_MODES_MOST];
    const double *block = uz_level_block(room, level, false, e, b * b);
    const float *of_row = level->inverse + i * b, *of_column = level->inverse + (int64_t)level->A.idx[e] * b;
    for (int r = 0; r < b; r++)
        for (int c = 0; c < b; c++) {
            const double value = block[r * b + c];
            if (value * (double)of_row[r] * (value * (double)of_column[c]) > square)
                return true;
        }
    return false;
}

/* Which blocks are strong, as the threads that share them see that. */
typedef struct {
    const uz_level *level;
    double square;
    bool *strong;
} judgement;

static void judge_nodes(void *ctx, int64_t begin, int64_t end)
{
    const judgement *x = ctx;
    for (int64_t i = begin; i < end; i++)
        for (int64_t e = x->level->A.ptr[i]; e < x->level->A.ptr[i + 1]; e++)
            x->strong[e] = is_strong(x->level, x->square, i, e);
}

static bool build_graph(graph *g, const uz_level *level, const uz_below *below, double square)
{
    const uz_blocks *A = &level->A;
    const int64_t count = A->ptr[A->nodes];
    bool *strong = uz_alloc(count, sizeof *strong);
    int64_t links = 0;
    g->ptr = uz_alloc_zero(A->nodes + 1, sizeof *g->ptr);
    if (strong)
        uz_by_pieces(judge_nodes, &(judgement){level, square, strong}, A->nodes);
    for (int64_t e = 0; strong && e < count; e++)
        links += strong[e];
    g->node = strong ? uz_alloc(2 * links, sizeof *g->node) : NULL;
    int64_t at = 0;
    for (int64_t i = 0; g->node && g->ptr && i < A->nodes; i++) {
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            if (strong[e])
                g->node[at++] = A->idx[e];
        for (int64_t e = below->ptr[i]; e < below->ptr[i + 1]; e++)
            if (strong[below->at[e]])
                g->node[at++] = below->node[e];
        g->ptr[i + 1] = at;
    }
    free(strong);
    return g->node && g->ptr;
}

enum { NONE = -1, ALONE = -2 };

static void take_free_neighbours(const graph *g, int32_t *aggregate, int64_t a, int32_t number)
{
    aggregate[a] = number;
    for (int64_t k = g->ptr[a]; k < g->ptr[a + 1]; k++)
        if (aggregate[g->node[k]] == NONE)
            aggregate[g->node[k]] = number;
}

uz_status uz_aggregate(int32_t *aggregate, int64_t *count, const uz_level *level, const uz_below *below,
                       double threshold, uz_error *err)
{
    const int64_t n_nodes = level->A.nodes;
    graph g = {0};
    const bool ok = build_graph(&g, level, below, threshold * threshold);
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
    free(g.ptr);
    free(g.node);
    return ok ? UZ_OK
              : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)(n_nodes * level->A.b));
}
