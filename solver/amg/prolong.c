/* prolong.c: from the modes of each aggregate to the prolongation, and with it the next level's matrix. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------ tentative basis */

/* A mode that differs less than this from the span of earlier ones on an aggregate adds nothing there. */
#define DEPENDENT 1e-4

uz_status uz_tentative(float *basis, float *coarse, const float *modes, const int32_t *of, int64_t n,
                       int64_t aggregates, int k, uz_error *err)
{
    int64_t *start = uz_alloc_zero(aggregates + 2, sizeof *start), longest = 0;
    int32_t *dof = uz_alloc(n, sizeof *dof);
    double *Q = NULL;
    if (start && dof) {
        uz_list_members(start, dof, of, n, aggregates);
        for (int64_t a = 0; a < aggregates; a++)
            longest = start[a + 1] - start[a] > longest ? start[a + 1] - start[a] : longest;
        Q = uz_alloc(longest * k, sizeof *Q);
    }
    memset(basis, 0, (size_t)(n * k) * sizeof *basis);
    memset(coarse, 0, (size_t)(aggregates * k * k) * sizeof *coarse);
    for (int64_t a = 0; Q && a < aggregates; a++) {
        int64_t rows = start[a + 1] - start[a];
        const int32_t *own = dof + start[a];
        for (int64_t i = 0; i < rows * k; i++)
            Q[i] = (double)modes[own[i / k] * (int64_t)k + i % k];
        /* modified Gram-Schmidt on the k columns of Q, Q_old = Q R; dependent columns become 0 */
        for (int c = 0; c < k; c++) {
            double before = 0.0, after = 0.0;
            float *R = coarse + a * k * k;
            for (int64_t i = 0; i < rows; i++)
                before += Q[i * k + c] * Q[i * k + c];
            for (int b = 0; b < c; b++) {
                double dot = 0.0;
                for (int64_t i = 0; i < rows; i++)
                    dot += Q[i * k + b] * Q[i * k + c];
                for (int64_t i = 0; i < rows; i++)
                    Q[i * k + c] -= dot * Q[i * k + b];
                R[b * k + c] = (float)dot;
            }
            for (int64_t i = 0; i < rows; i++)
                after += Q[i * k + c] * Q[i * k + c];
            const bool kept = after > DEPENDENT * DEPENDENT * before;
            const double norm = sqrt(after);
            R[c * k + c] = kept ? (float)norm : 0.0F;
            for (int64_t i = 0; i < rows; i++)
                Q[i * k + c] = kept ? Q[i * k + c] / norm : 0.0;
        }
        for (int64_t i = 0; i < rows * k; i++)
            basis[own[i / k] * (int64_t)k + i % k] = (float)Q[i];
    }
    bool ok = Q != NULL;
    free(start);
    free(dof);
    free(Q);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
}

/* --------------------------------------------------------- sparse row of blocks */

/* The row that is being added up: a dense k-block for each aggregate met. */
typedef struct {
    int32_t *slot; /* aggregates: where its block stands, -1: not met */
    int32_t *met;  /* the aggregates met, in order */
    double *block; /* k each */
    int64_t count, room;
    int k;
} block_row;

static bool block_row_init(block_row *row, int64_t aggregates, int k)
{
    memset(row, 0, sizeof *row);
    row->k = k;
    row->slot = uz_alloc(aggregates, sizeof *row->slot);
    for (int64_t a = 0; row->slot && a < aggregates; a++)
        row->slot[a] = -1;
    return row->slot != NULL;
}

static void block_row_clear(block_row *row)
{
    free(row->slot);
    free(row->met);
    free(row->block);
}

static void block_row_empty(block_row *row)
{
    for (int64_t s = 0; s < row->count; s++)
        row->slot[row->met[s]] = -1;
    row->count = 0;
}

/* The block of an aggregate, 0 when it is new; NULL: no memory. */
static double *block_of(block_row *row, int32_t aggregate)
{
    int32_t slot = row->slot[aggregate];
    if (slot < 0) {
        if (row->count == row->room) {
            const int64_t room = row->room ? 2 * row->room : 64;
            int32_t *met = uz_realloc(row->met, room, sizeof *met);
            row->met = met ? met : row->met;
            double *block = met ? uz_realloc(row->block, room * row->k, sizeof *block) : NULL;
            if (!block)
                return NULL;
            row->block = block;
            row->room = room;
        }
        slot = row->slot[aggregate] = (int32_t)row->count;
        row->met[row->count++] = aggregate;
        memset(row->block + (int64_t)slot * row->k, 0, (size_t)row->k * sizeof *row->block);
    }
    return row->block + (int64_t)slot * row->k;
}

/* ------------------------------------------------------------------- smoothing */

uz_status uz_fail_stopped(uz_error *err)
{
    return uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the multigrid was made");
}

typedef struct {
    uz_level *level;
    int64_t count, room; /* blocks of the prolongation so far, and room for */
} prolongation;

static bool reserve_blocks(prolongation *p, int64_t more, int k)
{
    if (p->count + more <= p->room)
        return true;
    int64_t room = p->room + p->room / 2 + more;
    int32_t *block = uz_realloc(p->level->block, room, sizeof *block);
    if (block)
        p->level->block = block;
    float *value = block ? uz_realloc(p->level->value, room * k, sizeof *value) : NULL;
    if (!value)
        return false;
    p->level->value = value;
    p->room = room;
    return true;
}

uz_status uz_prolong_smoothed(uz_level *level, const uz_csc *A, const float *basis, const int32_t *of, double omega,
                              int k, const uz_stop *stop, uz_error *err)
{
    int64_t n = level->n;
    uz_row_walk walk;
    block_row row;
    prolongation p = {level, 0, 0};
    bool ok = uz_row_walk_init(&walk, A), over = false;
    ok = block_row_init(&row, level->aggregates, k) && ok;
    level->ptr = uz_alloc_zero(n + 1, sizeof *level->ptr);
    ok = ok && level->ptr && reserve_blocks(&p, 2 * n, k);
    for (int64_t i = 0; ok && !(over = i % UZ_ROWS_AT_ONCE == 0 && uz_stop_is_due(stop)) && i < n; i++) {
        uz_row_walk_read(&walk, i);
        for (int64_t q = 0; level->inverse[i] > 0.0 && ok && q < walk.count; q++) {
            const int64_t j = walk.column[q];
            if (of[j] < 0)
                continue;
            double *to = block_of(&row, of[j]);
            const double factor = (j == i ? 1.0 : 0.0) - omega * level->inverse[i] * walk.value[q];
            ok = to != NULL;
            for (int c = 0; ok && c < k; c++)
                to[c] += factor * (double)basis[j * k + c];
        }
        ok = ok && reserve_blocks(&p, row.count, k);
        for (int64_t s = 0; ok && s < row.count; s++, p.count++) {
            level->block[p.count] = row.met[s];
            for (int c = 0; c < k; c++)
                level->value[p.count * k + c] = (float)row.block[s * k + c];
        }
        level->ptr[i + 1] = p.count;
        block_row_empty(&row);
    }
    if (ok) {
        int32_t *block = uz_realloc(p.level->block, p.count, sizeof *block);
        float *value = uz_realloc(p.level->value, p.count * k, sizeof *value);
        p.level->block = block ? block : p.level->block;
        p.level->value = value ? value : p.level->value;
    }
    uz_row_walk_clear(&walk);
    block_row_clear(&row);
    if (over)
        return uz_fail_stopped(err);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
}

/* ---------------------------------------------------------------- coarse matrix */

/* The blocks of P'A P with row >= column, found by their place: open addressing, linear probing. */
typedef struct {
    uint64_t *key; /* room: row << 32 | column, plus 1; 0: empty */
    int32_t *at;   /* room: which block */
    int64_t room, count, blocks_room;
    double *block;   /* k x k each, row by row */
    uint64_t *place; /* key of each block */
    int k;
} block_table;

static uint64_t hash_place(uint64_t key)
{
    key *= 0x9E3779B97F4A7C15u;
    return key ^ (key >> 29);
}

/* The block of this place, 0 when it is new; NULL: no memory. */
static double *coarse_block(block_table *table, int32_t row, int32_t column)
{
    const uint64_t key = ((uint64_t)row << 32 | (uint32_t)column) + 1;
    const int64_t size = (int64_t)table->k * table->k;
    if (2 * table->count >= table->room) { /* twice as many places, with what there is at its new ones */
        const int64_t room = table->room ? 2 * table->room : 1024;
        free(table->key);
        free(table->at);
        table->key = uz_alloc_zero(room, sizeof *table->key);
        table->at = uz_alloc(room, sizeof *table->at);
        if (!table->key || !table->at)
            return NULL;
        table->room = room;
        for (int64_t b = 0; b < table->count; b++) {
            uint64_t mask = (uint64_t)room - 1, h = hash_place(table->place[b]) & mask;
            while (table->key[h])
                h = (h + 1) & mask;
            table->key[h] = table->place[b];
            table->at[h] = (int32_t)b;
        }
    }
    uint64_t mask = (uint64_t)table->room - 1, h = hash_place(key) & mask;
    for (; table->key[h]; h = (h + 1) & mask)
        if (table->key[h] == key)
            return table->block + table->at[h] * size;
    if (table->count == table->blocks_room) {
        const int64_t room = table->blocks_room ? table->blocks_room + table->blocks_room / 2 : 512;
        uint64_t *place = uz_realloc(table->place, room, sizeof *place);
        table->place = place ? place : table->place;
        double *block = place ? uz_realloc(table->block, room * size, sizeof *block) : NULL;
        if (!block)
            return NULL;
        table->block = block;
        table->blocks_room = room;
    }
    table->key[h] = key;
    table->at[h] = (int32_t)table->count;
    table->place[table->count] = key;
    memset(table->block + table->count * size, 0, (size_t)size * sizeof(double));
    return table->block + table->count++ * size;
}

typedef struct {
    uint64_t by_column; /* column << 32 | row */
    int64_t block;
} placed;

static int compare_placed(const void *a, const void *b)
{
    const placed *x = a, *y = b;
    return (x->by_column > y->by_column) - (x->by_column < y->by_column);
}

/* The matrix column by column: the blocks of one block column stand together, rows ascending. */
static uz_status convert(uz_csc *coarse, block_table *table, int64_t aggregates, uz_error *err)
{
    const int64_t k = table->k;
    int64_t entries = 0, at = 0, from = 0, to = 0;
    for (int32_t J = 0; J < aggregates; J++) /* each has its diagonal block, be it empty */
        if (!coarse_block(table, J, J))
            return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a coarse matrix");
    placed *order = uz_alloc(table->count, sizeof *order);
    if (!order)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a coarse matrix");
    for (int64_t b = 0; b < table->count; b++) {
        uint64_t place = table->place[b] - 1, row = place >> 32, column = place & 0xffffffffu;
        order[b] = (placed){column << 32 | row, b};
        entries += row == column ? k * (k + 1) / 2 : k * k;
    }
    qsort(order, (size_t)table->count, sizeof *order, compare_placed);
    uz_status status = uz_csc_init(coarse, aggregates * k, aggregates * k, entries, err);
    for (int64_t J = 0; status == UZ_OK && J < aggregates; J++, from = to) {
        while (to < table->count && (int64_t)(order[to].by_column >> 32) == J)
            to++;
        for (int64_t b = 0; b < k; b++) {
            for (int64_t s = from; s < to; s++) {
                const int64_t I = (int64_t)(order[s].by_column & 0xffffffffu);
                const double *block = table->block + order[s].block * k * k;
                for (int64_t a = I == J ? b : 0; a < k; a++) {
                    const bool unused = I == J && a == b && block[a * k + b] == 0.0; /* no mode: see uz_level */
                    coarse->idx[at] = I * k + a;
                    coarse->val[at++] = unused ? 1.0 : block[a * k + b];
                }
            }
            coarse->ptr[J * k + b + 1] = at;
        }
    }
    free(order);
    return status;
}

uz_status uz_galerkin(uz_csc *coarse, const uz_level *level, const uz_csc *A, int k, const uz_stop *stop, uz_error *err)
{
    uz_row_walk walk;
    block_row row;
    block_table table = {.k = k};
    bool ok = uz_row_walk_init(&walk, A), over = false;
    ok = block_row_init(&row, level->aggregates, k) && ok;
    for (int64_t i = 0; ok && !(over = i % UZ_ROWS_AT_ONCE == 0 && uz_stop_is_due(stop)) && i < level->n; i++) {
        uz_row_walk_read(&walk, i);
        if (level->ptr[i] == level->ptr[i + 1])
            continue;
        for (int64_t q = 0; q < walk.count && ok; q++) /* row = row i of A P */
            for (int64_t e = level->ptr[walk.column[q]]; e < level->ptr[walk.column[q] + 1] && ok; e++) {
                double *block = block_of(&row, level->block[e]);
                ok = block != NULL;
                for (int c = 0; c < k && ok; c++)
                    block[c] += walk.value[q] * (double)level->value[e * k + c];
            }
        for (int64_t e = level->ptr[i]; e < level->ptr[i + 1] && ok;
             e++) /* table += (row i of P)' row, lower triangle */
            for (int64_t s = 0; s < row.count && ok; s++) {
                if (row.met[s] > level->block[e])
                    continue;
                double *to = coarse_block(&table, level->block[e], row.met[s]);
                ok = to != NULL;
                for (int a = 0; a < k && ok; a++)
                    for (int b = 0; b < k; b++)
                        to[a * k + b] += (double)level->value[e * k + a] * row.block[s * k + b];
            }
        block_row_empty(&row);
    }
    uz_status status = over ? uz_fail_stopped(err)
                       : ok ? convert(coarse, &table, level->aggregates, err)
                            : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a coarse matrix of %lld aggregates",
                                      (long long)level->aggregates);
    uz_row_walk_clear(&walk);
    block_row_clear(&row);
    free(table.key);
    free(table.at);
    free(table.block);
    free(table.place);
    return status;
}
