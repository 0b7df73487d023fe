/* prolong.c: from the modes of each aggregate to the prolongation. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------ tentative basis */

/* A mode that differs less than this from the span of earlier ones on an aggregate adds nothing there. */
#define DEPENDENT 1e-4

uz_status uz_tentative(float *basis, float *coarse, const float *modes, const int32_t *aggregate, int64_t nodes, int b,
                       int64_t aggregates, int k, uz_error *err)
{
    const int64_t n = nodes * b;
    int64_t *start = uz_alloc_zero(aggregates + 2, sizeof *start), longest = 0;
    int32_t *node = uz_alloc(nodes, sizeof *node);
    double *Q = NULL;
    if (start && node) {
        uz_list_members(start, node, aggregate, nodes, aggregates);
        for (int64_t a = 0; a < aggregates; a++)
            longest = start[a + 1] - start[a] > longest ? start[a + 1] - start[a] : longest;
        Q = uz_alloc(longest * b * k, sizeof *Q);
    }
    memset(basis, 0, (size_t)(n * k) * sizeof *basis);
    memset(coarse, 0, (size_t)(aggregates * k * k) * sizeof *coarse);
    for (int64_t a = 0; Q && a < aggregates; a++) {
        const int64_t members = start[a + 1] - start[a], rows = members * b, each = (int64_t)b * k;
        const int32_t *own = node + start[a];
        for (int64_t i = 0; i < members; i++)
            for (int64_t c = 0; c < each; c++)
                Q[i * each + c] = (double)modes[own[i] * each + c];
        /* modified Gram-Schmidt on the k columns of Q, Q_old = Q R; dependent columns become 0 */
        for (int c = 0; c < k; c++) {
            double before = 0.0, after = 0.0;
            float *R = coarse + a * k * k;
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
                basis[own[i] * each + c] = (float)Q[i * each + c];
    }
    bool ok = Q != NULL;
    free(start);
    free(node);
    free(Q);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
}

/* ------------------------------------------------------------------- smoothing */

uz_status uz_fail_stopped(uz_error *err)
{
    return uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the multigrid was made");
}

/* The node's rows while they are added up: a block for each aggregate met. */
typedef struct {
    int32_t *slot; /* aggregates: where its block stands, -1: not met */
    int32_t *met;  /* the aggregates met, in order, */
    double *block; /* and b x k each */
    int64_t count, room, size;
} rows_of_node;

/* The block of an aggregate, 0 when it is new; NULL: no memory. */
static double *block_of(rows_of_node *row, int32_t aggregate)
{
    int32_t slot = row->slot[aggregate];
    if (slot < 0) {
        if (row->count == row->room) {
            const int64_t room = row->room ? 2 * row->room : 64;
            int32_t *met = uz_realloc(row->met, room, sizeof *met);
            row->met = met ? met : row->met;
            double *block = met ? uz_realloc(row->block, room * row->size, sizeof *block) : NULL;
            if (!block)
                return NULL;
            row->block = block;
            row->room = room;
        }
        slot = row->slot[aggregate] = (int32_t)row->count;
        row->met[row->count++] = aggregate;
        memset(row->block + slot * row->size, 0, (size_t)row->size * sizeof *row->block);
    }
    return row->block + slot * row->size;
}

/* to -= A basis for one block of A, or its transpose. false: no memory. */
static bool subtract(rows_of_node *row, int32_t aggregate, const double *A, bool transposed, const float *basis, int b,
                     int k)
{
    double *to = aggregate < 0 ? NULL : block_of(row, aggregate);
    if (!to)
        return aggregate < 0;
    for (int r = 0; r < b; r++)
        for (int s = 0; s < b; s++) {
            const double factor = transposed ? A[s * b + r] : A[r * b + s];
            for (int c = 0; c < k; c++)
                to[r * k + c] -= factor * (double)basis[s * k + c];
        }
    return true;
}

typedef struct {
    uz_level *level;
    int64_t count, room; /* blocks of the prolongation so far, and room for */
} prolongation;

static bool reserve_blocks(prolongation *p, int64_t more, int64_t size)
{
    if (p->count + more <= p->room)
        return true;
    int64_t room = p->room + p->room / 2 + more;
    int32_t *block = uz_realloc(p->level->block, room, sizeof *block);
    if (block)
        p->level->block = block;
    float *value = block ? uz_realloc(p->level->value, room * size + 8, sizeof *value) : NULL;
    if (!value)
        return false;
    p->level->value = value;
    p->room = room;
    return true;
}

/* The node's rows of (I - omega D^-1 A) basis, aggregates ascending. */
static bool smooth_node(prolongation *p, rows_of_node *row, const uz_below *below, const float *basis,
                        const int32_t *aggregate, double omega, int k, int64_t i)
{
    uz_level *level = p->level;
    const uz_blocks *A = &level->A;
    const int b = A->b;
    const int64_t size = (int64_t)b * k, square = (int64_t)b * b;
    row->count = 0;
    bool ok = subtract(row, aggregate[i], A->diag + i * square, false, basis + i * size, b, k);
    for (int64_t e = A->ptr[i]; ok && e < A->ptr[i + 1]; e++)
        ok = subtract(row, aggregate[A->idx[e]], A->off + e * square, false, basis + A->idx[e] * size, b, k);
    for (int64_t e = below->ptr[i]; ok && e < below->ptr[i + 1]; e++)
        ok = subtract(row, aggregate[below->node[e]], A->off + below->at[e] * square, true,
                      basis + below->node[e] * size, b, k);
    if (!ok || !reserve_blocks(p, row->count, size))
        return false;
    for (int64_t s = 1; s < row->count; s++) /* few, and nearly in order */
        for (int64_t t = s; t > 0 && row->met[t] < row->met[t - 1]; t--) {
            const int32_t swap = row->met[t];
            row->met[t] = row->met[t - 1];
            row->met[t - 1] = swap;
        }
    for (int64_t s = 0; s < row->count; s++, p->count++) {
        const double *from = row->block + row->slot[row->met[s]] * size;
        float *to = level->value + p->count * size;
        level->block[p->count] = row->met[s];
        for (int64_t c = 0; c < size; c++) {
            const double own = row->met[s] == aggregate[i] ? (double)basis[i * size + c] : 0.0;
            to[c] = (float)(own + omega * (double)level->inverse[i * b + c / k] * from[c]);
        }
    }
    for (int64_t s = 0; s < row->count; s++)
        row->slot[row->met[s]] = -1;
    level->ptr[i + 1] = p->count;
    return true;
}

uz_status uz_prolong_smoothed(uz_level *level, const uz_below *below, const float *basis, const int32_t *aggregate,
                              double omega, int k, const uz_stop *stop, uz_error *err)
{
    const int64_t nodes = level->A.nodes, size = (int64_t)level->A.b * k;
    rows_of_node row = {.slot = uz_alloc(level->aggregates, sizeof *row.slot), .size = size};
    prolongation p = {level, 0, 0};
    bool over = false;
    for (int64_t a = 0; row.slot && a < level->aggregates; a++)
        row.slot[a] = -1;
    level->ptr = uz_alloc_zero(nodes + 1, sizeof *level->ptr);
    bool ok = row.slot && level->ptr && reserve_blocks(&p, 2 * nodes, size);
    for (int64_t i = 0; ok && !(over = i % UZ_ROWS_AT_ONCE == 0 && uz_stop_is_due(stop)) && i < nodes; i++)
        ok = smooth_node(&p, &row, below, basis, aggregate, omega, k, i);
    if (ok) {
        int32_t *block = uz_realloc(p.level->block, p.count, sizeof *block);
        float *value = uz_realloc(p.level->value, p.count * size + 8, sizeof *value);
        p.level->block = block ? block : p.level->block;
        p.level->value = value ? value : p.level->value;
        memset(p.level->value + p.count * size, 0, 8 * sizeof *value);
    }
    free(row.slot);
    free(row.met);
    free(row.block);
    if (over)
        return uz_fail_stopped(err);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld nodes", (long long)nodes);
}
