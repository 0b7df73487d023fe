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

/* ------------------------------------------------------------------ in parts */

/* Nodes of a part of a coarse level at least: some 30 microseconds of a sweep. A rest that is more of all nodes is not
 * worth it. */
#define PART_LEAST 200
#define MOST_REST  0.2

/* The part that a node is of, or whose seam it is of. */
static int8_t part_of(const uz_blocks *A, int64_t node)
{
    const int64_t *first = node < A->part[A->parts] ? A->part : A->seam;
    int8_t part = 0;
    while (part + 1 < A->parts && node >= first[part + 1])
        part++;
    return part;
}

/* The first part among those of a node and its neighbours. */
typedef struct {
    const uz_blocks *A;
    const uz_below *below;
    const int8_t *from;
    int8_t *to;
} spread;

static void spread_to(void *ctx, int64_t begin, int64_t end)
{
    const spread *x = ctx;
    for (int64_t i = begin; i < end; i++) {
        int8_t first = x->from[i];
        for (int64_t e = x->A->ptr[i]; e < x->A->ptr[i + 1]; e++)
            first = x->from[x->A->idx[e]] < first ? x->from[x->A->idx[e]] : first;
        for (int64_t e = x->below->ptr[i]; e < x->below->ptr[i + 1]; e++)
            first = x->from[x->below->node[e]] < first ? x->from[x->below->node[e]] : first;
        x->to[i] = first;
    }
}

/* Aggregates have a block with each other where nodes that smoothed modes of theirs reach, their own and the neighbours
 * of these, are neighbours, three links apart at most. */
enum { LINKS = 3 };

bool uz_part_aggregates(uz_blocks *parts, int32_t *aggregate, int64_t count, const uz_level *level,
                        const uz_below *below)
{
    const uz_blocks *A = &level->A;
    const int most = A->parts;
    if (most < 2 || count < most * PART_LEAST)
        return true;
    int8_t *part = uz_alloc(count, sizeof *part), *near = uz_alloc(A->nodes, sizeof *near),
           *next = uz_alloc(A->nodes, sizeof *next);
    bool *rest = uz_alloc_zero(count, sizeof *rest);
    int32_t *number = uz_alloc(count, sizeof *number);
    const bool ok = part && near && next && rest && number;
    if (ok) {
        memset(part, most, (size_t)count * sizeof *part);
        for (int64_t i = 0; i < A->nodes; i++)
            if (aggregate[i] >= 0 && part[aggregate[i]] == most)
                part[aggregate[i]] = part_of(A, i);
        for (int64_t i = 0; i < A->nodes; i++)
            near[i] = aggregate[i] >= 0 ? part[aggregate[i]] : (int8_t)most;
        for (int link = 0; link < LINKS; link++) {
            uz_by_pieces(spread_to, &(spread){A, below, near, next}, A->nodes);
            int8_t *const done = near;
            near = next;
            next = done;
        }
        int64_t left = 0, at = 0;
        for (int64_t i = 0; i < A->nodes; i++)
            if (aggregate[i] >= 0 && near[i] < part[aggregate[i]])
                rest[aggregate[i]] = true;
        for (int64_t a = 0; a < count; a++)
            left += rest[a];
        if ((double)left <= MOST_REST * (double)count) {
            parts->parts = most;
            for (int p = 0; p < 2 * most; p++) {
                *(p < most ? parts->part + p : parts->seam + p - most) = at;
                for (int64_t a = 0; a < count; a++)
                    if (part[a] == p % most && rest[a] == (p >= most))
                        number[a] = (int32_t)at++;
            }
            parts->part[most] = parts->seam[0];
            parts->seam[most] = count;
            for (int64_t i = 0; i < A->nodes; i++)
                aggregate[i] = aggregate[i] >= 0 ? number[aggregate[i]] : aggregate[i];
        }
    }
    uz_free_all(part, near, next, rest, number);
    return ok;
}

bool uz_blocks_take_parts(uz_blocks *A, const uz_blocks *parts)
{
    const int64_t *part = parts->part, *seam = parts->seam;
    if (parts->parts == 0)
        return true;
    int8_t *taken = uz_alloc(A->nodes, sizeof *taken); /* by a seam */
    bool apart = true, seams_apart = true;
    for (int p = 0; taken && p < parts->parts; p++)
        for (int64_t i = part[p]; i < part[p + 1]; i++)
            apart = apart && (A->ptr[i] == A->ptr[i + 1] || A->idx[A->ptr[i]] >= part[p]);
    if (taken)
        memset(taken, -1, (size_t)A->nodes * sizeof *taken);
    for (int8_t s = 0; taken && s < parts->parts; s++)
        for (int64_t i = seam[s]; i < seam[s + 1]; i++) {
            seams_apart = seams_apart && (taken[i] < 0 || taken[i] == s);
            taken[i] = s;
            for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
                seams_apart = seams_apart && (taken[A->idx[e]] < 0 || taken[A->idx[e]] == s);
                taken[A->idx[e]] = s;
            }
        }
    if (apart) {
        A->parts = parts->parts;
        memcpy(A->part, part, sizeof A->part);
        memcpy(A->seam, seam, sizeof A->seam);
        A->seams = seams_apart ? parts->parts : 0;
    }
    const bool ok = taken != NULL;
    free(taken);
    return ok;
}
