/* compress.c: the graph of nodes behind a matrix of dofs.
 *
 * Dofs of one node have the same neighbours, and an ordering never gains by separating them. Ordering and analysing the
 * graph of groups of such dofs is several times cheaper and gives the same fill (Ashcraft, SIAM J. Sci. Comput. 16
 * (1995)). */
#include "factor/factor_private.h"

#include "core/alloc.h"

#include <stdlib.h>

/* A fixed 64-bit mix (the finaliser of splitmix64). */
static uint64_t mix(uint64_t x)
{
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
}

/* Groups are told by sum[i]: of mix(j) over the neighbours j of i and i itself, and something else
 * for the last dofs. Equal sums mean equal neighbourhoods but for a chance of 2^-64, and a wrong guess costs fill,
 * never correctness: the graph has an edge for every entry of the matrix. */
bool uz_group_dofs(int64_t *head, const uz_csc *A, const int64_t *last, int64_t n_last)
{
    const int64_t n = A->cols, *ptr = A->ptr;
    const int32_t *idx = A->idx;
    uint64_t *sum = uz_alloc(n, sizeof *sum);
    if (!sum)
        return false;
    for (int64_t j = 0; j < n; j++)
        sum[j] = mix((uint64_t)j);
    for (int64_t j = 0; j < n; j++) {
        uint64_t own = mix((uint64_t)j), total = 0;
        for (int64_t k = ptr[j]; k < ptr[j + 1]; k++) {
            int64_t i = idx[k];
            if (i == j)
                continue;
            sum[i] += own;
            total += mix((uint64_t)i);
        }
        sum[j] += total;
    }
    for (int64_t k = 0; k < n_last; k++)
        sum[last[k]] += mix(UINT64_MAX);
    for (int64_t j = 0; j < n; j++)
        head[j] = j;
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = ptr[j]; head[j] == j && k < ptr[j + 1]; k++)
            if (idx[k] != j && head[idx[k]] == idx[k] && sum[idx[k]] == sum[j])
                head[idx[k]] = j;
    free(sum);
    return true;
}

/* Counts the edges between groups by the column they belong to, or places them (rows not NULL) at next[column]. An edge
 * met before in the same group's columns, mostly neighbours, is left out; some come twice all the same. mark: a place
 * for each group. */
static void collect_edges(SuiteSparse_long *next, SuiteSparse_long *rows, int64_t *mark, const uz_csc *A,
                          const int64_t *group, int64_t groups)
{
    const int64_t *ptr = A->ptr;
    const int32_t *idx = A->idx;
    for (int64_t g = 0; g < groups; g++)
        mark[g] = -1;
    for (int64_t j = 0; j < A->cols; j++) {
        int64_t own = group[j];
        for (int64_t k = ptr[j]; k < ptr[j + 1]; k++) {
            int64_t other = group[idx[k]], column = other < own ? other : own;
            if (other == own || mark[other] == own)
                continue;
            mark[other] = own;
            if (rows)
                rows[next[column]] = other < own ? own : other;
            next[column]++;
        }
    }
}

cholmod_sparse *uz_compress(int64_t *group, const uz_csc *A, const int64_t *last, int64_t n_last,
                            cholmod_common *common)
{
    const int64_t n = A->cols;
    int64_t groups = 0, edges = 0;
    if (!uz_group_dofs(group, A, last, n_last))
        return NULL;
    for (int64_t j = 0; j < n; j++) /* from heads to numbers, in the order of the heads */
        group[j] = group[j] == j ? groups++ : group[group[j]];
    SuiteSparse_long *next = uz_alloc_zero(groups + 1, sizeof *next), *mark = uz_alloc(groups, sizeof *mark);
    cholmod_sparse *graph = NULL;
    if (next && mark) {
        collect_edges(next, NULL, mark, A, group, groups);
        for (int64_t g = 0; g <= groups; g++) { /* from counts to where columns begin */
            int64_t count = next[g];
            next[g] = edges;
            edges += count;
        }
        graph =
            cholmod_l_allocate_sparse((size_t)groups, (size_t)groups, (size_t)edges, 0, 1, -1, CHOLMOD_PATTERN, common);
    }
    if (graph) {
        SuiteSparse_long *ptr = graph->p, *rows = graph->i, at = 0;
        collect_edges(next, rows, mark, A, group, groups);
        for (int64_t g = 0; g < groups; g++)
            mark[g] = -1;
        ptr[0] = 0;
        for (int64_t g = 0, begin = 0; g < groups; g++) { /* each edge once */
            const int64_t end = next[g];                  /* each column was filled up to here */
            for (int64_t k = begin; k < end; k++) {
                if (mark[rows[k]] == g)
                    continue;
                mark[rows[k]] = g;
                rows[at++] = rows[k];
            }
            begin = end;
            ptr[g + 1] = at;
        }
    }
    uz_free_all(next, mark);
    return graph;
}
