/* compress.c: the graph of nodes behind a matrix of dofs.
 *
 * Dofs of one node have the same neighbours, and an ordering never gains by separating them. Ordering the graph of
 * groups of such dofs is several times cheaper and gives the same fill (Ashcraft, SIAM J. Sci. Comput. 16 (1995)). */
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

/* sum[i]: of mix(j) over the neighbours j of i and i itself. Equal sums mean equal neighbourhoods but for a chance of
 * 2^-64, and a wrong guess costs fill, never correctness. */
static void sum_neighbourhoods(uint64_t *sum, const int64_t *ptr, const int64_t *idx, int64_t n)
{
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
}

/* head[i]: the first dof of i's group. */
static void find_heads(int64_t *head, const uint64_t *sum, const int64_t *ptr, const int64_t *idx, int64_t n)
{
    for (int64_t j = 0; j < n; j++)
        head[j] = j;
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = ptr[j]; head[j] == j && k < ptr[j + 1]; k++)
            if (idx[k] != j && head[idx[k]] == idx[k] && sum[idx[k]] == sum[j])
                head[idx[k]] = j;
}

/* Numbers the groups; number[i] is that of a head, else -1. */
static int64_t number_groups(int64_t *number, const int64_t *head, int64_t n)
{
    int64_t count = 0;
    for (int64_t j = 0; j < n; j++)
        number[j] = head[j] == j ? count++ : -1;
    return count;
}

/* Edges between groups are those between their heads. */
static cholmod_sparse *group_graph(const int64_t *ptr, const int64_t *idx, const int64_t *number, int64_t n,
                                   int64_t groups, cholmod_common *common)
{
    int64_t entries = 0, at = 0;
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = ptr[j]; number[j] >= 0 && k < ptr[j + 1]; k++)
            entries += number[idx[k]] >= 0;
    cholmod_sparse *graph =
        cholmod_l_allocate_sparse((size_t)groups, (size_t)groups, (size_t)entries, 1, 1, -1, CHOLMOD_PATTERN, common);
    if (!graph)
        return NULL;
    SuiteSparse_long *p = graph->p, *i = graph->i;
    for (int64_t j = 0; j < n; j++) {
        if (number[j] < 0)
            continue;
        p[number[j]] = at;
        for (int64_t k = ptr[j]; k < ptr[j + 1]; k++)
            if (number[idx[k]] >= 0)
                i[at++] = number[idx[k]];
    }
    p[groups] = at;
    return graph;
}

cholmod_sparse *uz_compress(int64_t *head, const cholmod_sparse *A, cholmod_common *common)
{
    int64_t n = (int64_t)A->ncol;
    const int64_t *ptr = A->p, *idx = A->i;
    uint64_t *sum = uz_alloc(n, sizeof *sum);
    int64_t *number = uz_alloc(n, sizeof *number);
    cholmod_sparse *graph = NULL;
    if (sum && number) {
        sum_neighbourhoods(sum, ptr, idx, n);
        find_heads(head, sum, ptr, idx, n);
        graph = group_graph(ptr, idx, number, n, number_groups(number, head, n), common);
    }
    free(sum);
    free(number);
    return graph;
}

bool uz_expand(int64_t *perm, const int64_t *group_perm, const int64_t *head, int64_t n, int64_t groups)
{
    int64_t *first = uz_alloc(groups + 1, sizeof *first), *group = uz_alloc(n, sizeof *group), count = 0;
    int64_t *place = uz_alloc(groups, sizeof *place);
    bool ok = first && group && place;
    for (int64_t j = 0; ok && j < n; j++)
        group[j] = head[j] == j ? count++ : group[head[j]];
    for (int64_t k = 0; ok && k < groups; k++) {
        place[group_perm[k]] = k;
        first[k + 1] = 0;
    }
    for (int64_t j = 0; ok && j < n; j++)
        first[place[group[j]] + 1]++;
    if (ok)
        first[0] = 0;
    for (int64_t k = 0; ok && k < groups; k++)
        first[k + 1] += first[k];
    for (int64_t j = 0; ok && j < n; j++)
        perm[first[place[group[j]]]++] = j;
    free(first);
    free(group);
    free(place);
    return ok;
}
