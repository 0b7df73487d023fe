/* galerkin.c: the matrix of the next level, P'A P, in blocks whose places are known before their numbers. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"
#include "core/order.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_MOST = 6 };

/* Columns of A P for each node, ascending. */
typedef struct {
    int64_t *ptr;    /* nodes + 1 */
    int32_t *column; /* ptr[nodes] */
} columns;

static bool grow(int32_t **list, int64_t *room, int64_t need)
{
    if (need <= *room)
        return true;
    *room = need + need / 2 + 1024;
    int32_t *larger = uz_realloc(*list, *room, sizeof **list);
    *list = larger ? larger : *list;
    return larger != NULL;
}

/* Adds the columns of j's rows of P that were not yet seen by i. */
static int64_t add_columns(int32_t *list, int64_t count, int32_t *seen, const uz_level *level, int64_t j, int32_t i)
{
    for (int64_t e = level->ptr[j]; e < level->ptr[j + 1]; e++)
        if (seen[level->block[e]] != i) {
            seen[level->block[e]] = i;
            list[count++] = level->block[e];
        }
    return count;
}

/* Rows of A P as the threads that share them see that: each part has its own list until all are known. */
typedef struct {
    columns *AP; /* ptr: ends within the part's list, then in all */
    const uz_level *level;
    const uz_below *below;
    int parts;
    int32_t *seen[UZ_ASIDE_MOST], *list[UZ_ASIDE_MOST]; /* seen: aggregates; NULL: no memory for the list */
} finding;

static int64_t first_node(const finding *x, int part)
{
    return x->level->A.nodes * part / x->parts;
}

static void find_part(void *ctx, int part)
{
    finding *x = ctx;
    const uz_level *level = x->level;
    const uz_below *below = x->below;
    const uz_blocks *A = &level->A;
    const int64_t first = first_node(x, part), end = first_node(x, part + 1);
    int32_t *seen = x->seen[part], *list = NULL;
    int64_t room = 0, count = 0;
    bool ok = grow(&list, &room, 8 * (end - first) + 1); /* a process may have no nodes */
    for (int64_t c = 0; c < level->aggregates; c++)
        seen[c] = -1;
    for (int64_t i = first; ok && i < end; i++) {
        int64_t most = level->ptr[i + 1] - level->ptr[i];
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            most += level->ptr[A->idx[e] + 1] - level->ptr[A->idx[e]];
        for (int64_t e = below->ptr[i]; e < below->ptr[i + 1]; e++)
            most += level->ptr[below->node[e] + 1] - level->ptr[below->node[e]];
        ok = grow(&list, &room, count + (most < level->aggregates ? most : level->aggregates));
        if (!ok)
            break;
        const int64_t from = count;
        count = add_columns(list, count, seen, level, i, (int32_t)i);
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            count = add_columns(list, count, seen, level, A->idx[e], (int32_t)i);
        for (int64_t e = below->ptr[i]; e < below->ptr[i + 1]; e++)
            count = add_columns(list, count, seen, level, below->node[e], (int32_t)i);
        uz_sort_32(list + from, count - from);
        x->AP->ptr[i + 1] = count;
    }
    if (!ok)
        free(list);
    x->list[part] = ok ? list : NULL;
}

/* Puts the lists of all parts behind the first one's. */
static bool join(finding *x)
{
    columns *AP = x->AP;
    const int64_t own = AP->ptr[first_node(x, 1)];
    int64_t all = own;
    for (int part = 1; part < x->parts; part++) {
        const int64_t before = all;
        all += AP->ptr[first_node(x, part + 1)];
        for (int64_t i = first_node(x, part); i < first_node(x, part + 1); i++)
            AP->ptr[i + 1] += before;
    }
    AP->column = x->parts > 1 ? uz_realloc(x->list[0], all, sizeof *AP->column) : x->list[0];
    if (!AP->column)
        return false;
    x->list[0] = NULL;
    for (int part = 1; part < x->parts; part++) {
        const int64_t first = AP->ptr[first_node(x, part)], end = AP->ptr[first_node(x, part + 1)];
        memcpy(AP->column + first, x->list[part], (size_t)(end - first) * sizeof *AP->column);
    }
    return true;
}

static bool find_columns(columns *AP, finding *x)
{
    bool ok = (AP->ptr = uz_alloc_zero(x->level->A.nodes + 1, sizeof *AP->ptr)) != NULL;
    if (ok)
        uz_aside_share(find_part, x, x->parts);
    for (int part = 0; part < x->parts; part++)
        ok = ok && x->list[part];
    ok = ok && join(x);
    for (int part = 0; part < x->parts; part++)
        free(x->list[part]);
    return ok;
}

/* coarse->ptr and idx: of an aggregate all that stands left of it in the rows of A P that its modes reach. */
static bool find_pattern(uz_blocks *coarse, int32_t *seen, const uz_level *level, const columns *AP)
{
    const int64_t nodes = level->A.nodes, entries = level->ptr[nodes];
    int64_t *start = uz_alloc_zero(level->aggregates + 2, sizeof *start), room = 0, count = 0;
    int32_t *reached = uz_alloc(entries, sizeof *reached); /* nodes of each aggregate's column of P */
    coarse->ptr = uz_alloc_zero(level->aggregates + 1, sizeof *coarse->ptr);
    bool ok = start && reached && coarse->ptr && grow(&coarse->idx, &room, 16 * level->aggregates);
    for (int64_t e = 0; ok && e < entries; e++)
        start[level->block[e] + 2]++;
    for (int64_t a = 0; ok && a < level->aggregates; a++)
        start[a + 2] += start[a + 1];
    for (int64_t i = 0; ok && i < nodes; i++)
        for (int64_t e = level->ptr[i]; e < level->ptr[i + 1]; e++)
            reached[start[level->block[e] + 1]++] = (int32_t)i;
    for (int64_t c = 0; ok && c < level->aggregates; c++)
        seen[c] = -1;
    for (int64_t a = 0; ok && a < level->aggregates; a++) {
        const int64_t from = count;
        ok = grow(&coarse->idx, &room, count + a);
        for (int64_t q = start[a]; ok && q < start[a + 1]; q++)
            for (int64_t e = AP->ptr[reached[q]]; e < AP->ptr[reached[q] + 1] && AP->column[e] < a; e++)
                if (seen[AP->column[e]] != a) {
                    seen[AP->column[e]] = (int32_t)a;
                    coarse->idx[count++] = AP->column[e];
                }
        if (ok)
            uz_sort_32(coarse->idx + from, count - from);
        coarse->ptr[a + 1] = count;
    }
    free(start);
    free(reached);
    return ok;
}

/* What the numbers of a node's rows are made with. Threads share the rows of the coarse matrix: each adds to those of
 * its aggregates, in the order of the nodes, and goes through all nodes that have a part in them. So few nodes are gone
 * through by two, as aggregates are numbered much as nodes are. */
typedef struct {
    uz_blocks *coarse;
    const uz_level *level;
    const uz_below *below;
    const columns *AP;
    int32_t *place;     /* aggregates: where its columns stand in row */
    double *row;        /* the node's rows of A P: a block for each of its columns */
    int32_t first, end; /* aggregates */
} product;

typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef double two __attribute__((vector_size(16), aligned(8), may_alias));

/* Rows of A P have room for so many numbers each, read and written four at a time: what follows the k is anything. */
static inline int width_of(int k)
{
    return k > 4 ? 8 : 4;
}

/* to += block P_j, a column of blocks after the other; or with the block transposed. */
static inline __attribute__((always_inline)) void add_product(const product *x, const double *A, bool transposed,
                                                              int64_t j, int b, int k)
{
    const uz_level *level = x->level;
    const int width = width_of(k);
    for (int64_t e = level->ptr[j]; e < level->ptr[j + 1]; e++) {
        double *to = x->row + (int64_t)x->place[level->block[e]] * b * width;
        for (int q = 0; q < width; q += 4) {
            const float *P = level->value + e * b * k + q;
            four row[ROWS_MOST];
            for (int s = 0; s < b; s++)
                row[s] = __builtin_convertvector(*(const four_floats *)(P + s * k), four);
            for (int r = 0; r < b; r++) {
                four sum = *(const four *)(to + r * width + q);
                for (int s = 0; s < b; s++)
                    sum += (transposed ? A[s * b + r] : A[r * b + s]) * row[s];
                *(four *)(to + r * width + q) = sum;
            }
        }
    }
}

/* to (k x k) += (rows of P)' rows of A P. */
static inline __attribute__((always_inline)) void add_block(double *to, const float *P, const double *row, int b, int k)
{
    const int width = width_of(k);
    for (int p = 0; p < k; p++) {
        int c = 0;
        for (; c + 4 <= k; c += 4) {
            four sum = *(const four *)(to + p * k + c);
            for (int r = 0; r < b; r++)
                sum += (double)P[r * k + p] * *(const four *)(row + r * width + c);
            *(four *)(to + p * k + c) = sum;
        }
        for (; c + 2 <= k; c += 2) {
            two sum = *(const two *)(to + p * k + c);
            for (int r = 0; r < b; r++)
                sum += (double)P[r * k + p] * *(const two *)(row + r * width + c);
            *(two *)(to + p * k + c) = sum;
        }
        for (; c < k; c++)
            for (int r = 0; r < b; r++)
                to[p * k + c] += (double)P[r * k + p] * row[r * width + c];
    }
}

static inline __attribute__((always_inline)) void add_node(const product *x, int64_t i, int b, int k)
{
    const uz_level *level = x->level;
    const uz_blocks *A = &level->A;
    const int32_t *column = x->AP->column + x->AP->ptr[i];
    const int64_t count = x->AP->ptr[i + 1] - x->AP->ptr[i], square = (int64_t)b * b;
    int64_t begin = level->ptr[i], end = level->ptr[i + 1]; /* its blocks, by aggregates */
    while (begin < end && level->block[begin] < x->first)
        begin++;
    while (begin < end && level->block[end - 1] >= x->end)
        end--;
    if (begin == end)
        return;
    for (int64_t s = 0; s < count; s++)
        x->place[column[s]] = (int32_t)s;
    memset(x->row, 0, (size_t)(count * b * width_of(k)) * sizeof *x->row);
    double room[ROWS_MOST * ROWS_MOST];
    add_product(x, uz_level_block(room, level, true, i, square), false, i, b, k);
    for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
        add_product(x, uz_level_block(room, level, false, e, square), false, A->idx[e], b, k);
    for (int64_t e = x->below->ptr[i]; e < x->below->ptr[i + 1]; e++)
        add_product(x, uz_level_block(room, level, false, x->below->at[e], square), true, x->below->node[e], b, k);
    for (int64_t e = begin; e < end; e++) { /* coarse += (rows of P)' rows of A P */
        const int32_t a = level->block[e], *idx = x->coarse->idx;
        const float *P = level->value + e * b * k;
        int64_t at = x->coarse->ptr[a];
        for (int64_t s = 0; s < count && column[s] <= a; s++) {
            while (column[s] < a && idx[at] < column[s]) /* both ascend, and it is there */
                at++;
            double *to = column[s] == a ? x->coarse->diag + (int64_t)a * k * k : x->coarse->off + at * k * k;
            add_block(to, P, x->row + s * b * width_of(k), b, k);
        }
    }
}

static inline __attribute__((always_inline)) void add_any(const product *x, int64_t i, int k)
{
    const int b = x->level->A.b;
    if (b == 3 && k == 6)
        add_node(x, i, 3, 6);
    else if (b == 6 && k == 6)
        add_node(x, i, 6, 6);
    else if (b == 2 && k == 3)
        add_node(x, i, 2, 3);
    else if (b == 3 && k == 3)
        add_node(x, i, 3, 3);
    else
        add_node(x, i, b, k);
}

UZ_AVX2_FMA static void add_fused(const product *x, int64_t i, int k)
{
    add_any(x, i, k);
}

static void add_plain(const product *x, int64_t i, int k)
{
    add_any(x, i, k);
}

/* All numbers, as the threads that share them see that. */
typedef struct {
    product of[UZ_ASIDE_MOST];
    int parts, k;
    int64_t first, end; /* nodes */
    pthread_t owner;    /* who asks whether it has to stop: hooks are called from the solving thread */
    const uz_stop *stop;
    atomic_bool over; /* it had to */
} numbers;

static void add_part(void *ctx, int part)
{
    numbers *n = ctx;
    void (*const add)(const product *, int64_t, int) = uz_cpu_has_avx2_fma() ? add_fused : add_plain;
    for (int64_t i = n->first; i < n->end; i++) {
        if (i % UZ_ROWS_AT_ONCE == 0) {
            if (pthread_equal(pthread_self(), n->owner) && uz_stop_is_due(n->stop))
                atomic_store(&n->over, true);
            if (atomic_load(&n->over))
                return;
        }
        add(&n->of[part], i, n->k);
    }
}

/* So that each part has as many blocks of P. count: room for the aggregates. */
static void share_out(numbers *n, const uz_level *level, int32_t *count)
{
    const int64_t all = level->ptr[level->A.nodes];
    int64_t so_far = 0;
    int part = 0;
    memset(count, 0, (size_t)level->aggregates * sizeof *count);
    for (int64_t e = 0; n->parts > 1 && e < all; e++)
        count[level->block[e]]++;
    for (int64_t a = 0; a < level->aggregates; a++) {
        for (; part + 1 < n->parts && so_far * n->parts >= all * (part + 1); part++)
            n->of[part].end = n->of[part + 1].first = (int32_t)a;
        so_far += count[a];
    }
    for (; part < n->parts; part++) {
        n->of[part].end = (int32_t)level->aggregates;
        if (part + 1 < n->parts)
            n->of[part + 1].first = (int32_t)level->aggregates;
    }
}

/* Nodes of a part, at least. */
enum { PART_LEAST = 4096 };

uz_status uz_galerkin(uz_blocks *coarse, const uz_level *level, const uz_below *below, int k, const uz_team *team,
                      const uz_stop *stop, uz_error *err)
{
    const int64_t nodes = level->A.nodes, aggregates = level->aggregates;
    const int threads = nodes < 2 * PART_LEAST ? 1 : uz_aside_threads();
    columns AP = {0};
    numbers n = {.parts = nodes / PART_LEAST < threads ? (int)(nodes / PART_LEAST) : threads,
                 .k = k,
                 .first = uz_team_first(team, 0, nodes),
                 .end = uz_team_first(team, 1, nodes),
                 .owner = pthread_self(),
                 .stop = stop};
    n.parts = n.parts > 1 ? n.parts : 1;
    *coarse = (uz_blocks){.nodes = aggregates, .b = k};
    bool ok = true;
    for (int part = 0; part < n.parts; part++) {
        n.of[part] = (product){.coarse = coarse, .level = level, .below = below, .AP = &AP};
        ok = (n.of[part].place = uz_alloc(aggregates, sizeof(int32_t))) && ok;
    }
    int32_t *seen = n.of[0].place;
    finding rows = {.AP = &AP, .level = level, .below = below, .parts = n.parts};
    for (int part = 0; part < n.parts; part++)
        rows.seen[part] = n.of[part].place;
    ok = ok && find_columns(&AP, &rows) && find_pattern(coarse, seen, level, &AP);
    if (ok) {
        int64_t longest = 1;
        for (int64_t i = 0; i < nodes; i++)
            longest = AP.ptr[i + 1] - AP.ptr[i] > longest ? AP.ptr[i + 1] - AP.ptr[i] : longest;
        int32_t *idx = uz_realloc(coarse->idx, coarse->ptr[aggregates], sizeof *idx);
        coarse->idx = idx ? idx : coarse->idx;
        for (int part = 0; part < n.parts; part++)
            ok = (n.of[part].row = uz_alloc(longest * level->A.b * width_of(k), sizeof(double))) && ok;
        coarse->off = uz_alloc_zero(coarse->ptr[aggregates] * k * k + 4, sizeof *coarse->off);
        coarse->diag = uz_alloc_zero(aggregates * k * k + 4, sizeof *coarse->diag);
        ok = ok && coarse->off && coarse->diag;
        share_out(&n, level, seen);
    }
    if (ok)
        uz_aside_share(add_part, &n, n.parts);
    const bool over = atomic_load(&n.over);
    if (ok && !over)
        uz_team_sum(team, coarse);
    free(AP.ptr);
    free(AP.column);
    for (int part = 0; part < n.parts; part++) {
        free(n.of[part].place);
        free(n.of[part].row);
    }
    if (over)
        return uz_fail_stopped(err);
    return ok ? UZ_OK
              : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a coarse matrix of %lld aggregates",
                        (long long)aggregates);
}
