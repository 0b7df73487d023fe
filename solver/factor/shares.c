/* shares.c: which supernodes two threads can work at without waiting for each other.
 *
 * A subtree of the elimination tree needs nothing from outside (Liu, SIAM J. Matrix Anal. Appl. 11 (1990)). The tree is
 * cut below its heaviest nodes until the subtrees that are left share out evenly among two threads; what was cut off is
 * the rest, which comes after both. What is done, and in which order, does not depend on how many threads there are. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/aside.h"

#include <math.h>
#include <string.h>

/* Less is not worth waking a thread. */
#define LEAST_FLOPS 1e7
/* A supernode with more is made by two threads, if no share has it: then it costs so much of its flops. */
#define LARGE_FLOPS 2e7
#define TOGETHER    0.55
/* Of all flops, as the longer share and the rest: a cut that leaves more is none. */
#define MOST_SHARE 0.9
/* Cuts, and subtrees that are shared out, at most. */
enum { CUTS = 64, TREES = 256 };

typedef struct {
    int64_t *parent, *child, *next; /* nsuper: -1: none; a node's first child, and a node's next sibling */
    double *work;                   /* nsuper: flops of the subtree */
} tree;

/* Sum of (r - j)^2, j below c. */
static double flops_of(double c, double r)
{
    return c * r * r - c * (c - 1.0) * r + c * (c - 1.0) * (2.0 * c - 1.0) / 6.0;
}

bool uz_is_large(int64_t columns, int64_t rows)
{
    return flops_of((double)columns, (double)rows) > LARGE_FLOPS;
}

/* The heavier trees first, each to the side that has less so far. Returns the flops of the longer side. */
static double share_out(unsigned char *side, const tree *t, int64_t *root, int64_t count)
{
    double sum[2] = {0};
    for (int64_t i = 1; i < count; i++) { /* nearly sorted: one was replaced by its children */
        const int64_t moved = root[i];
        int64_t at = i;
        for (; at > 0 && t->work[root[at - 1]] < t->work[moved]; at--)
            root[at] = root[at - 1];
        root[at] = moved;
    }
    for (int64_t i = 0; i < count; i++) {
        side[i] = sum[1] < sum[0];
        sum[side[i]] += t->work[root[i]];
    }
    return sum[0] > sum[1] ? sum[0] : sum[1];
}

static void cut(unsigned char *share, const tree *t, int64_t count)
{
    int64_t root[TREES], best[TREES], n = 0, n_best = 0;
    unsigned char side[TREES], best_side[TREES];
    double all = 0.0, rest = 0.0, least = INFINITY;
    bool fits = true;
    for (int64_t s = 0; s < count; s++) {
        all += t->parent[s] < 0 ? t->work[s] : 0.0;
        fits = fits && (t->parent[s] >= 0 || n < TREES);
        if (t->parent[s] < 0 && fits)
            root[n++] = s;
        share[s] = UZ_REST;
    }
    for (int cuts = 0; fits && n > 0 && cuts < CUTS && rest < least; cuts++) {
        const double longer = rest + share_out(side, t, root, n);
        if (longer < least) {
            least = longer;
            n_best = n;
            memcpy(best, root, (size_t)n * sizeof *root);
            memcpy(best_side, side, (size_t)n * sizeof *side);
        }
        const int64_t heaviest = root[0];
        double own = t->work[heaviest];
        root[0] = root[--n];
        for (int64_t c = t->child[heaviest]; c >= 0 && fits; c = t->next[c]) {
            fits = n < TREES;
            own -= t->work[c];
            if (fits)
                root[n++] = c;
        }
        rest += own > LARGE_FLOPS ? TOGETHER * own : own;
    }
    if (all < LEAST_FLOPS || least > MOST_SHARE * all)
        return;
    for (int64_t i = 0; i < n_best; i++)
        share[best[i]] = best_side[i];
    for (int64_t s = count - 1; s >= 0; s--) /* parents come later */
        if (t->parent[s] >= 0 && share[t->parent[s]] != UZ_REST)
            share[s] = share[t->parent[s]];
}

unsigned char *uz_share_tree(const cholmod_factor *L)
{
    const SuiteSparse_long *super = L->super, *pi = L->pi, *row = L->s;
    const int64_t count = (int64_t)L->nsuper;
    unsigned char *share = uz_alloc(count, sizeof *share);
    int64_t *owner = uz_alloc((int64_t)L->n, sizeof *owner);
    tree t = {uz_alloc(count, sizeof *t.parent), uz_alloc(count, sizeof *t.child), uz_alloc(count, sizeof *t.next),
              uz_alloc_zero(count, sizeof *t.work)};
    const bool ok = share && owner && t.parent && t.child && t.next && t.work;
    for (int64_t s = 0; ok && s < count; s++) {
        t.child[s] = t.next[s] = -1;
        for (int64_t j = super[s]; j < super[s + 1]; j++)
            owner[j] = s;
    }
    for (int64_t s = 0; ok && s < count; s++) {
        const int64_t columns = super[s + 1] - super[s], rows = pi[s + 1] - pi[s];
        t.work[s] += flops_of((double)columns, (double)rows);
        t.parent[s] = rows > columns ? owner[row[pi[s] + columns]] : -1;
        if (t.parent[s] >= 0) {
            t.work[t.parent[s]] += t.work[s];
            t.next[s] = t.child[t.parent[s]];
            t.child[t.parent[s]] = s;
        }
    }
    if (ok)
        cut(share, &t, count);
    uz_free_all(owner, t.parent, t.child, t.next, t.work, ok ? NULL : share);
    return ok ? share : NULL;
}

void uz_run_shares(const uz_analysis *analysis, void (*run)(void *ctx, int share), void *ctx)
{
    if (analysis->is_shared)
        uz_aside_share(run, ctx, UZ_REST);
    for (int share = 0; share < UZ_REST && !analysis->is_shared; share++)
        run(ctx, share);
}
