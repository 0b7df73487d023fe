/* prolong.c: from the modes of each aggregate to the prolongation. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------ tentative basis */

/* A mode that differs less than this from the span of earlier ones on an aggregate adds nothing there. */
#define DEPENDENT 1e-4

/* Aggregates as the threads that share them see them. */
typedef struct {
    float *basis, *coarse;
    const float *modes;
    const int64_t *start; /* of the members of each in `node` */
    const int32_t *node;
    int64_t aggregates, longest; /* members of one, at most */
    int b, k, parts;
    double *room; /* parts x longest x b x k */
} factoring;

/* Modified Gram-Schmidt on the modes of each, Q_old = Q R; dependent columns become 0. */
static void factor_part(void *ctx, int part)
{
    const factoring *x = ctx;
    const int b = x->b, k = x->k;
    const int64_t each = (int64_t)b * k, end = x->aggregates * (part + 1) / x->parts;
    double *Q = x->room + part * x->longest * each;
    for (int64_t a = x->aggregates * part / x->parts; a < end; a++) {
        const int64_t members = x->start[a + 1] - x->start[a], rows = members * b;
        const int32_t *own = x->node + x->start[a];
        for (int64_t i = 0; i < members; i++)
            for (int64_t c = 0; c < each; c++)
                Q[i * each + c] = (double)x->modes[own[i] * each + c];
        for (int c = 0; c < k; c++) {
            double before = 0.0, after = 0.0;
            float *R = x->coarse + a * k * k;
            for (int64_t i = 0; i < rows; i++)
                before += Q[i * k + c] * Q[i * k + c];
            for (int other = 0; other < c; other++) {
                double dot = 0.0;
                for (int64_t i = 0; i < rows; i++)
                    dot += Q[i * k + other] * Q[i * k + c];
                for (int64_t i = 0; i < rows; i++)
                    Q[i * k + c] -= dot * Q[i * k + other];
                R[other * k + c] = (float)dot;
            }
            for (int64_t i = 0; i < rows; i++)
                after += Q[i * k + c] * Q[i * k + c];
            const bool kept = after > DEPENDENT * DEPENDENT * before;
            const double norm = sqrt(after);
            R[c * k + c] = kept ? (float)norm : 0.0F;
            for (int64_t i = 0; i < rows; i++)
                Q[i * k + c] = kept ? Q[i * k + c] / norm : 0.0;
        }
        for (int64_t i = 0; i < members; i++)
            for (int64_t c = 0; c < each; c++)
                x->basis[own[i] * each + c] = (float)Q[i * each + c];
    }
}

/* Aggregates of a part, at least: some 0.2 ms. */
enum { AGGREGATES_LEAST = 256 };

uz_status uz_tentative(float *basis, float *coarse, const float *modes, const int32_t *aggregate, int64_t nodes, int b,
                       int64_t aggregates, int k, uz_error *err)
{
    const int64_t n = nodes * b;
    const int parts = aggregates < 2 * AGGREGATES_LEAST ? 1 : uz_aside_threads();
    int64_t *start = uz_alloc_zero(aggregates + 2, sizeof *start);
    int32_t *node = uz_alloc(nodes, sizeof *node);
    factoring x = {basis, coarse, modes, start, node, aggregates, 0, b, k, parts, NULL};
    if (start && node) {
        uz_list_members(start, node, aggregate, nodes, aggregates);
        for (int64_t a = 0; a < aggregates; a++)
            x.longest = start[a + 1] - start[a] > x.longest ? start[a + 1] - start[a] : x.longest;
        x.room = uz_alloc(parts * x.longest * b * k, sizeof *x.room);
    }
    memset(basis, 0, (size_t)(n * k) * sizeof *basis);
    memset(coarse, 0, (size_t)(aggregates * k * k) * sizeof *coarse);
    const bool ok = x.room != NULL;
    if (ok)
        uz_aside_share(factor_part, &x, parts);
    uz_free_all(start, node, x.room);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
}

/* ------------------------------------------------------------------- smoothing */

uz_status uz_fail_stopped(uz_error *err)
{
    return uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the multigrid was made");
}

/* The node's rows while they are added up. */
typedef struct {
    int32_t
        *slot; /* aggregates: where its block stands, -1: not met; while blocks are counted the last node that met it */
    int32_t *met;  /* the aggregates met, in order, */
    double *block; /* and b x k each */
    int64_t count, longest;
} rows_of_node;

/* All nodes, as the threads that share them see that. */
typedef struct {
    uz_level *level;
    const uz_below *below;
    const float *basis;
    const int32_t *aggregate;
    double omega;
    int k, parts;
    rows_of_node row[UZ_ASIDE_MOST];
    pthread_t owner; /* who asks whether it has to stop: hooks are called from the solving thread */
    const uz_stop *stop;
    atomic_bool over; /* it had to */
} smoothing;

static bool goes_on(smoothing *x, int64_t i)
{
    if (i % UZ_ROWS_AT_ONCE != 0)
        return true;
    if (pthread_equal(pthread_self(), x->owner) && uz_stop_is_due(x->stop))
        atomic_store(&x->over, true);
    return !atomic_load(&x->over);
}

static int64_t first_of_part(const smoothing *x, int part)
{
    return x->level->A.nodes * part / x->parts;
}

static int64_t meet(rows_of_node *row, int32_t aggregate, int64_t i)
{
    if (aggregate < 0 || row->slot[aggregate] == (int32_t)i)
        return 0;
    row->slot[aggregate] = (int32_t)i;
    return 1;
}

/* level->ptr[i + 1]: the blocks of node i. */
static void count_part(void *ctx, int part)
{
    smoothing *x = ctx;
    const uz_blocks *A = &x->level->A;
    rows_of_node *row = &x->row[part];
    for (int64_t a = 0; a < x->level->aggregates; a++)
        row->slot[a] = -1;
    for (int64_t i = first_of_part(x, part); i < first_of_part(x, part + 1) && goes_on(x, i); i++) {
        int64_t count = meet(row, x->aggregate[i], i);
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            count += meet(row, x->aggregate[A->idx[e]], i);
        for (int64_t e = x->below->ptr[i]; e < x->below->ptr[i + 1]; e++)
            count += meet(row, x->aggregate[x->below->node[e]], i);
        x->level->ptr[i + 1] = count;
        row->longest = count > row->longest ? count : row->longest;
    }
}

/* The block of an aggregate, 0 when it is new. */
static inline double *block_of(rows_of_node *row, int32_t aggregate, int64_t size)
{
    int32_t slot = row->slot[aggregate];
    if (slot < 0) {
        slot = row->slot[aggregate] = (int32_t)row->count;
        row->met[row->count++] = aggregate;
        memset(row->block + slot * size, 0, (size_t)size * sizeof *row->block);
    }
    return row->block + slot * size;
}

/* to -= A basis for one block of A, or its transpose. */
UZ_INLINE void subtract(rows_of_node *row, int32_t aggregate, const double *A, bool transposed, const float *basis,
                        int b, int k)
{
    if (aggregate < 0)
        return;
    double *to = block_of(row, aggregate, (int64_t)b * k);
    for (int r = 0; r < b; r++)
        for (int s = 0; s < b; s++) {
            const double factor = transposed ? A[s * b + r] : A[r * b + s];
            for (int c = 0; c < k; c++)
                to[r * k + c] -= factor * (double)basis[s * k + c];
        }
}

/* The node's rows of (I - omega D^-1 A) basis, aggregates ascending. */
UZ_INLINE void smooth_node(const smoothing *x, rows_of_node *row, int64_t i, int b, int k)
{
    uz_level *level = x->level;
    const uz_blocks *A = &level->A;
    const uz_below *below = x->below;
    const int32_t *aggregate = x->aggregate;
    const int64_t size = (int64_t)b * k, square = (int64_t)b * b;
    double room[UZ_MODES_MOST * UZ_MODES_MOST];
    row->count = 0;
    subtract(row, aggregate[i], uz_level_block(room, level, true, i, square), false, x->basis + i * size, b, k);
    for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
        subtract(row, aggregate[A->idx[e]], uz_level_block(room, level, false, e, square), false,
                 x->basis + A->idx[e] * size, b, k);
    for (int64_t e = below->ptr[i]; e < below->ptr[i + 1]; e++)
        subtract(row, aggregate[below->node[e]], uz_level_block(room, level, false, below->at[e], square), true,
                 x->basis + below->node[e] * size, b, k);
    for (int64_t s = 1; s < row->count; s++) /* few, and nearly in order */
        for (int64_t t = s; t > 0 && row->met[t] < row->met[t - 1]; t--) {
            const int32_t swap = row->met[t];
            row->met[t] = row->met[t - 1];
            row->met[t - 1] = swap;
        }
    for (int64_t s = 0; s < row->count; s++) {
        const int64_t at = level->ptr[i] + s;
        const double *from = row->block + row->slot[row->met[s]] * size;
        float *to = level->value + at * size;
        level->block[at] = row->met[s];
        for (int64_t c = 0; c < size; c++) {
            const double own = row->met[s] == aggregate[i] ? (double)x->basis[i * size + c] : 0.0;
            to[c] = (float)(own + x->omega * (double)level->inverse[i * b + c / k] * from[c]);
        }
    }
    for (int64_t s = 0; s < row->count; s++)
        row->slot[row->met[s]] = -1;
}

static void smooth_part(void *ctx, int part)
{
    smoothing *x = ctx;
    const int b = x->level->A.b, k = x->k;
    rows_of_node *row = &x->row[part];
    for (int64_t a = 0; a < x->level->aggregates; a++)
        row->slot[a] = -1;
    for (int64_t i = first_of_part(x, part); i < first_of_part(x, part + 1) && goes_on(x, i); i++) {
        if (b == 3 && k == 6)
            smooth_node(x, row, i, 3, 6);
        else if (b == 6 && k == 6)
            smooth_node(x, row, i, 6, 6);
        else if (b == 2 && k == 3)
            smooth_node(x, row, i, 2, 3);
        else
            smooth_node(x, row, i, b, k);
    }
}

/* level->ptr, and room for all blocks. false: no memory, or it had to stop. */
static bool find_places(smoothing *x)
{
    uz_level *level = x->level;
    const int64_t nodes = level->A.nodes, size = (int64_t)level->A.b * x->k;
    bool ok = (level->ptr = uz_alloc_zero(nodes + 1, sizeof *level->ptr)) != NULL;
    for (int part = 0; part < x->parts; part++)
        ok = (x->row[part].slot = uz_alloc(level->aggregates, sizeof(int32_t))) && ok;
    if (!ok)
        return false;
    uz_aside_share(count_part, x, x->parts);
    if (atomic_load(&x->over))
        return false;
    for (int64_t i = 0; i < nodes; i++)
        level->ptr[i + 1] += level->ptr[i];
    for (int part = 0; part < x->parts; part++) {
        rows_of_node *row = &x->row[part];
        ok = (row->met = uz_alloc(row->longest, sizeof *row->met)) && ok;
        ok = (row->block = uz_alloc(row->longest * size, sizeof *row->block)) && ok;
    }
    level->block = uz_alloc(level->ptr[nodes], sizeof *level->block);
    level->value = uz_alloc(level->ptr[nodes] * size + 8, sizeof *level->value);
    return ok && level->block && level->value;
}

/* Nodes of a part, at least. */
enum { PART_LEAST = 4096 };

uz_status uz_prolong_smoothed(uz_level *level, const uz_below *below, const float *basis, const int32_t *aggregate,
                              double omega, int k, const uz_stop *stop, uz_error *err)
{
    const int64_t nodes = level->A.nodes, most = nodes / PART_LEAST;
    const int threads = most < 2 ? 1 : uz_aside_threads();
    smoothing x = {.level = level,
                   .below = below,
                   .basis = basis,
                   .aggregate = aggregate,
                   .omega = omega,
                   .k = k,
                   .parts = threads < most ? threads
                            : most > 1     ? (int)most
                                           : 1,
                   .owner = pthread_self(),
                   .stop = stop};
    const bool ok = find_places(&x);
    if (ok) {
        uz_aside_share(smooth_part, &x, x.parts);
        memset(level->value + level->ptr[nodes] * level->A.b * k, 0, 8 * sizeof *level->value);
    }
    for (int part = 0; part < x.parts; part++) {
        uz_free_all(x.row[part].slot, x.row[part].met, x.row[part].block);
    }
    if (atomic_load(&x.over))
        return uz_fail_stopped(err);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld nodes", (long long)nodes);
}

/* ---------------------------------------------------------- to corners, linear */

/* to (b x b) = share of the displacement of node j in that of node i. Their dofs are along directions that the first
 * dim modes tell, translations, and in units of their own: a unit of dof c moves the node by 1 / |modes of c|. */
static void add_share(float *to, const float *modes, int64_t i, int64_t j, double share, int b, int dim, int k)
{
    for (int r = 0; r < b; r++)
        for (int c = 0; c < b; c++) {
            const float *row = modes + (i * b + r) * k, *column = modes + (j * b + c) * k;
            double across = 0.0, own = 0.0;
            for (int m = 0; m < dim; m++) {
                across += (double)row[m] * (double)column[m];
                own += (double)column[m] * (double)column[m];
            }
            to[r * b + c] = own > 0.0 ? (float)(share * (across / own)) : 0.0F;
        }
}

uz_status uz_prolong_linear(uz_level *level, float **modes, const int32_t *ends, int dim, int k, uz_error *err)
{
    const int b = level->A.b;
    const int64_t nodes = level->A.nodes, size = (int64_t)b * b;
    int32_t *corner = uz_alloc(nodes, sizeof *corner);
    int64_t count = 0;
    level->ptr = uz_alloc_zero(nodes + 1, sizeof *level->ptr);
    for (int64_t i = 0; corner && level->ptr && i < nodes; i++) {
        const int32_t *of = ends + 2 * i;
        const bool middle = of[0] >= 0 || of[1] >= 0;
        corner[i] = middle ? -1 : (int32_t)level->aggregates++;
        count += middle ? (of[0] >= 0) + (of[1] >= 0) : 1;
        level->ptr[i + 1] = count;
    }
    level->block = uz_alloc(count, sizeof *level->block);
    level->value = uz_alloc_zero(count * size + 8, sizeof *level->value);
    float *coarse = uz_alloc(level->aggregates * b * k, sizeof *coarse);
    const bool ok = corner && level->ptr && level->block && level->value && coarse;
    for (int64_t i = 0; ok && i < nodes; i++) {
        int64_t at = level->ptr[i];
        if (corner[i] >= 0) {
            level->block[at] = corner[i];
            for (int r = 0; r < b; r++)
                level->value[at * size + r * b + r] = level->inverse[i * b + r] > 0.0F ? 1.0F : 0.0F;
            memcpy(coarse + (int64_t)corner[i] * b * k, *modes + i * b * k, (size_t)(b * k) * sizeof *coarse);
            continue;
        }
        const int32_t *of = ends + 2 * i, turned = of[0] > of[1] ? 1 : 0; /* corners are numbered as nodes are */
        for (int side = 0; side < 2; side++) {
            const int32_t j = of[side ^ turned];
            if (j < 0)
                continue;
            level->block[at] = corner[j];
            add_share(level->value + at++ * size, *modes, i, j, 0.5, b, dim, k);
        }
    }
    free(corner);
    if (ok) {
        free(*modes);
        *modes = coarse;
    } else {
        free(coarse);
    }
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld nodes", (long long)nodes);
}
