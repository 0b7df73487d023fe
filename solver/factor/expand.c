/* expand.c: from the supernodes of the graph of groups to those of the matrix of dofs.
 *
 * A group's dofs are eliminated in a row and meet the same rows below them, so a supernode of groups is one of dofs
 * with every group written out. */
#include "factor/factor_private.h"

#include "core/alloc.h"

/* The sizes of all supernodes: super, pi, px, and the largest. */
static void size_supernodes(cholmod_factor *L, const cholmod_factor *G, const int64_t *start)
{
    const SuiteSparse_long *from = G->super, *pi = G->pi, *s = G->s;
    SuiteSparse_long *super = L->super, *rows_begin = L->pi, *values_begin = L->px;
    L->ssize = L->xsize = L->maxesize = 0;
    for (size_t k = 0; k <= G->nsuper; k++) {
        super[k] = start[from[k]];
        rows_begin[k] = (SuiteSparse_long)L->ssize;
        values_begin[k] = (SuiteSparse_long)L->xsize;
        size_t rows = 0, columns = k < G->nsuper ? (size_t)(start[from[k + 1]] - start[from[k]]) : 0;
        for (int64_t e = pi[k]; k < G->nsuper && e < pi[k + 1]; e++)
            rows += (size_t)(start[s[e] + 1] - start[s[e]]);
        L->ssize += rows;
        L->xsize += rows * columns;
        L->maxesize = rows - columns > L->maxesize ? rows - columns : L->maxesize;
    }
}

/* The rows of the supernodes, the counts of their columns, and the largest block with which one supernode updates
 * another: its rows from the first in that supernode on, by its rows within it. owner (n) is room. */
static void write_rows(cholmod_factor *L, const cholmod_factor *G, const int64_t *start, int64_t *owner)
{
    const SuiteSparse_long *super = L->super, *pi = L->pi, *group = G->s;
    SuiteSparse_long *count = L->ColCount, *s = L->s;
    size_t at = 0;
    for (size_t e = 0; e < G->ssize; e++)
        for (int64_t i = start[group[e]]; i < start[group[e] + 1]; i++)
            s[at++] = i;
    L->maxcsize = 1;
    for (size_t k = 0; k < L->nsuper; k++)
        for (int64_t j = super[k]; j < super[k + 1]; j++) {
            owner[j] = (int64_t)k;
            count[j] = pi[k + 1] - pi[k] - (j - super[k]);
        }
    for (size_t k = 0; k < L->nsuper; k++) {
        int64_t end = pi[k + 1], next;
        for (int64_t e = pi[k] + super[k + 1] - super[k]; e < end; e = next) {
            for (next = e + 1; next < end && owner[s[next]] == owner[s[e]]; next++)
                ;
            size_t size = (size_t)(next - e) * (size_t)(end - e);
            L->maxcsize = size > L->maxcsize ? size : L->maxcsize;
        }
    }
}

cholmod_factor *uz_expand(const cholmod_factor *G, const int64_t *group, int64_t n, cholmod_common *common)
{
    int64_t groups = (int64_t)G->n;
    int64_t *first = uz_alloc(groups + 1, sizeof *first), *start = uz_alloc(groups + 1, sizeof *start);
    int64_t *room = uz_alloc(n, sizeof *room);
    cholmod_factor *L = first && start && room ? cholmod_l_allocate_factor((size_t)n, common) : NULL;
    bool ok = L != NULL;
    if (ok) {
        L->nsuper = G->nsuper;
        L->super = cholmod_l_malloc(L->nsuper + 1, sizeof(SuiteSparse_long), common);
        L->pi = cholmod_l_malloc(L->nsuper + 1, sizeof(SuiteSparse_long), common);
        L->px = cholmod_l_malloc(L->nsuper + 1, sizeof(SuiteSparse_long), common);
        L->is_super = L->is_ll = 1;
        ok = L->super && L->pi && L->px;
    }
    if (ok) {
        /* first[g] (groups + 1): where group g's dofs begin in `member` (n), ascending within a group. */
        for (int64_t g = 0; g <= groups; g++)
            first[g] = 0;
        for (int64_t i = 0; i < n; i++)
            first[group[i] + 1]++;
        for (int64_t g = 0; g < groups; g++)
            first[g + 1] += first[g];
        for (int64_t i = 0; i < n; i++)
            room[first[group[i]]++] = i;
        for (int64_t g = groups; g > 0; g--)
            first[g] = first[g - 1];
        first[0] = 0;
        /* start[k] (groups + 1): the position of the first dof of the k-th group in the order of elimination. */
        const SuiteSparse_long *order = G->Perm;
        SuiteSparse_long *perm = L->Perm;
        int64_t at = 0;
        for (int64_t k = 0; k < (int64_t)G->n; k++) {
            start[k] = at;
            for (int64_t e = first[order[k]]; e < first[order[k] + 1]; e++)
                perm[at++] = room[e];
        }
        start[G->n] = at;
        size_supernodes(L, G, start);
        L->s = cholmod_l_malloc(L->ssize, sizeof(SuiteSparse_long), common);
        L->ordering = G->ordering;
        ok = L->s != NULL;
    }
    if (ok)
        write_rows(L, G, start, room);
    else
        cholmod_l_free_factor(&L, common);
    uz_free_all(first, start, room);
    return L;
}
