#include "group/spread.h"

#include "core/alloc.h"
#include "core/error.h"
#include "group/divide.h"

#include <stdlib.h>
#include <string.h>

/* A node of more dofs is none; where nodes differ by so much that the unit rows add this share, each dof is a node. */
enum { DOFS_MOST = 6, AT_ONCE = 1 << 17 /* numbers in a message */ };
#define PADDING_MOST 1.3

static uz_status fail_memory(uz_error *err, int64_t d)
{
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to spread %lld dofs over processes", (long long)d);
}

/* node and place of each dof. */
static bool number_dofs(uz_spread *map, const uz_modes *modes)
{
    int32_t *filled = uz_alloc_zero(modes->n_nodes, sizeof *filled);
    int64_t most = 1;
    if (!filled)
        return false;
    for (int64_t j = 0; j < map->d; j++) {
        map->node[j] = modes->node[j];
        map->place[j] = filled[map->node[j]]++;
        most = map->place[j] + 1 > most ? map->place[j] + 1 : most;
    }
    /* nodes without dofs, as those that a support holds, are left out */
    int32_t count = 0;
    for (int64_t i = 0; i < modes->n_nodes; i++)
        filled[i] = filled[i] > 0 ? count++ : -1;
    map->nodes = count;
    map->bs = most;
    for (int64_t j = 0; j < map->d; j++)
        map->node[j] = filled[map->node[j]];
    if (most > DOFS_MOST || (double)(most * count) > PADDING_MOST * (double)map->d) {
        map->nodes = map->d;
        map->bs = 1;
        for (int64_t j = 0; j < map->d; j++) {
            map->node[j] = (int32_t)j;
            map->place[j] = 0;
        }
    }
    map->size = map->nodes * map->bs;
    free(filled);
    return true;
}

/* The graph of nodes: pairs from both sides of each coupling, then without repetition. */
static bool make_graph(uz_spread *map, const uz_csc *K)
{
    const int64_t n = map->nodes;
    int64_t *start = uz_alloc_zero(n + 2, sizeof *start);
    int32_t *seen = uz_alloc(n, sizeof *seen), *last = uz_alloc(n, sizeof *last), *pair = NULL;
    bool made = start && seen && last;
    for (int pass = 0; made && pass < 2; pass++) {
        /* seen: the node whose columns have shown this one last; columns of a node that are apart show it again */
        memset(last, 0xff, (size_t)n * sizeof *last);
        for (int64_t j = 0; j < K->cols; j++) {
            const int32_t b = map->node[j];
            for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
                const int32_t a = map->node[K->idx[k]];
                if (a == b || last[a] == b)
                    continue;
                last[a] = b;
                if (pass == 0) {
                    start[a + 2]++;
                    start[b + 2]++;
                } else {
                    pair[start[a + 1]++] = b;
                    pair[start[b + 1]++] = a;
                }
            }
        }
        for (int64_t i = 0; pass == 0 && i < n; i++)
            start[i + 2] += start[i + 1];
        if (pass == 0)
            made = (pair = uz_alloc(start[n + 1], sizeof *pair)) != NULL;
    }
    int64_t kept = 0;
    if (made)
        memset(seen, 0xff, (size_t)n * sizeof *seen);
    for (int32_t i = 0; made && i < n; i++) {
        map->offset[i] = (int32_t)kept;
        for (int64_t k = start[i]; k < start[i + 1]; k++)
            if (seen[pair[k]] != i) {
                seen[pair[k]] = i;
                pair[kept++] = pair[k];
            }
        made = kept < INT32_MAX;
    }
    if (made)
        map->offset[n] = (int32_t)kept;
    map->neighbour = pair;
    free(start);
    free(seen);
    free(last);
    return made;
}

uz_status uz_spread_init(uz_spread *map, const uz_csc *K, const uz_modes *modes, uz_error *err)
{
    const int64_t d = K->cols;
    memset(map, 0, sizeof *map);
    map->d = d;
    map->modes = modes->count;
    if (d >= INT32_MAX / DOFS_MOST)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "K", "distributed holds up to %d dofs, these are %lld",
                       INT32_MAX / DOFS_MOST - 1, (long long)d);
    for (int64_t j = 0; j < d; j++)
        if (K->ptr[j] == K->ptr[j + 1] || K->idx[K->ptr[j]] != j || !(K->val[K->ptr[j]] > 0.0))
            return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                           "K is not positive definite: its diagonal entry of dof %lld (numbered from 0) is not "
                           "positive. Support the body so that it can't move freely, or check the signs of K.",
                           (long long)j);
    map->node = uz_alloc(d, sizeof *map->node);
    map->place = uz_alloc(d, sizeof *map->place);
    if (!map->node || !map->place || !number_dofs(map, modes))
        return fail_memory(err, d);
    map->offset = uz_alloc(map->nodes + 1, sizeof *map->offset);
    map->part = uz_alloc_zero(map->nodes, sizeof *map->part);
    map->order = uz_alloc(map->nodes, sizeof *map->order);
    map->number = uz_alloc(map->nodes, sizeof *map->number);
    if (!map->offset || !map->part || !map->order || !map->number || !make_graph(map, K))
        return fail_memory(err, d);
    return UZ_OK;
}

/* A plane that cuts more couplings of a body than this share, for each halving, is no good way to divide it: a body
 * that winds, or a small one. */
#define CUT_MOST 0.02
enum { NODES_LEAST = 8 }; /* of a process */

static bool is_good_cut(const int32_t *part, const uz_spread *map, int64_t processes)
{
    int64_t cut = 0;
    double most = 0.0;
    for (int64_t i = 0; i < map->nodes; i++)
        for (int32_t k = map->offset[i]; k < map->offset[i + 1]; k++)
            cut += part[i] != part[map->neighbour[k]];
    for (int64_t k = 1; k < processes; k *= 2)
        most += CUT_MOST;
    return (double)cut <= most * map->offset[map->nodes];
}

uz_status uz_spread_divide(bool *divided, uz_spread *map, const uz_modes *modes, int64_t processes, uz_error *err)
{
    const int dim = modes->dim;
    *divided = false;
    if (!modes->xyz || map->nodes < NODES_LEAST * processes)
        return UZ_OK;
    double *x = uz_alloc(map->nodes * dim, sizeof *x);
    int32_t *part = uz_alloc(map->nodes, sizeof *part);
    for (int64_t j = 0; x && j < map->d; j++)
        memcpy(x + map->node[j] * (int64_t)dim, modes->xyz + modes->node[j] * (int64_t)dim, (size_t)dim * sizeof *x);
    const bool made = x && part && uz_divide(part, x, map->nodes, dim, processes);
    *divided = made && is_good_cut(part, map, processes);
    if (*divided)
        memcpy(map->part, part, (size_t)map->nodes * sizeof *part);
    free(x);
    free(part);
    return made ? UZ_OK : fail_memory(err, map->d);
}

static int ascending(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

uz_status uz_spread_number(uz_spread *map, int64_t processes, uz_error *err)
{
    int64_t *next = uz_alloc_zero(processes + 1, sizeof *next);
    if (!next)
        return fail_memory(err, map->d);
    for (int64_t i = 0; i < map->nodes; i++)
        if (map->part[i] < 0 || map->part[i] >= processes) {
            free(next);
            return uz_fail(err, UZ_ERR_INTERNAL, "", "node %lld was given to no process", (long long)i);
        } else {
            next[map->part[i] + 1]++;
        }
    for (int64_t p = 0; p < processes; p++)
        next[p + 1] += next[p];
    for (int32_t i = 0; i < map->nodes; i++) {
        map->number[i] = (int32_t)next[map->part[i]];
        map->order[next[map->part[i]]++] = i;
    }
    free(next);
    for (int64_t j = 0; j < map->d; j++)
        map->place[j] += map->number[map->node[j]] * map->bs;
    for (int64_t i = 0; i < map->nodes; i++) { /* neighbours by their numbers from now on */
        for (int32_t k = map->offset[i]; k < map->offset[i + 1]; k++)
            map->neighbour[k] = map->number[map->neighbour[k]];
        qsort(map->neighbour + map->offset[i], (size_t)(map->offset[i + 1] - map->offset[i]), sizeof *map->neighbour,
              ascending);
    }
    return UZ_OK;
}

void uz_spread_clear(uz_spread *map)
{
    void *own[] = {map->node, map->offset, map->neighbour, map->part, map->order, map->number, map->place};
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    memset(map, 0, sizeof *map);
}

/* ---- rows */

/* Where the block (row, column) is, rows by their place in the process's. */
static int64_t find_block(const uz_spread_rows *rows, int64_t row, int32_t column)
{
    int64_t low = rows->from[row], high = rows->from[row + 1];
    while (low + 1 < high) {
        const int64_t middle = (low + high) / 2;
        if (rows->columns[middle] <= column)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* A dof: the number of its node, counted from the first of the process, and which of its dofs it is. */
typedef struct {
    int64_t node, place;
} dof_place;

static inline dof_place place_of(const uz_spread_rows *rows, const uz_spread *map, int64_t dof)
{
    const int64_t number = map->number[map->node[dof]];
    return (dof_place){number - rows->first, map->place[dof] - number * map->bs};
}

/* Entry (i, j), if row i is one of the process's. *block, pair: of the entry before, which is often a neighbour of this
 * one. */
static inline void put_entry(uz_spread_rows *rows, const uz_spread *map, dof_place i, dof_place j, double value,
                             int64_t *block, int64_t pair[2])
{
    const int64_t bs = map->bs;
    if (i.node < 0 || i.node >= rows->end - rows->first)
        return;
    if (pair[0] != i.node || pair[1] != j.node) {
        pair[0] = i.node;
        pair[1] = j.node;
        *block = find_block(rows, i.node, (int32_t)(j.node + rows->first));
    }
    /* the matrix row i.place of the node follows the one before as in a matrix by rows */
    const int64_t before = rows->from[i.node], width = (rows->from[i.node + 1] - before) * bs;
    rows->values[before * bs * bs + i.place * width + (*block - before) * bs + j.place] = value;
}

uz_status uz_spread_fill(uz_spread_rows *rows, const uz_spread *map, const uz_csc *K, const uz_modes *modes,
                         uz_error *err)
{
    const int64_t bs = map->bs;
    rows->first = 0;
    while (rows->first < map->nodes && map->part[map->order[rows->first]] < rows->process)
        rows->first++;
    for (rows->end = rows->first; rows->end < map->nodes && map->part[map->order[rows->end]] == rows->process;)
        rows->end++;
    const int64_t nodes = rows->end - rows->first;
    int64_t blocks = 0;
    rows->at = rows->first;
    for (int64_t i = rows->first; i < rows->end; i++)
        blocks += map->offset[map->order[i] + 1] - map->offset[map->order[i]] + 1;
    rows->from = uz_alloc(nodes + 1, sizeof *rows->from);
    rows->counts = uz_alloc(nodes, sizeof *rows->counts);
    rows->columns = uz_alloc(blocks, sizeof *rows->columns);
    rows->values = uz_alloc_zero(blocks * bs * bs, sizeof *rows->values);
    rows->mode_values = uz_alloc_zero(nodes * bs * map->modes, sizeof *rows->mode_values);
    if (!rows->from || !rows->counts || !rows->columns || !rows->values || !rows->mode_values)
        return fail_memory(err, map->d);
    rows->from[0] = 0;
    for (int64_t i = 0; i < nodes; i++) {
        const int32_t node = map->order[rows->first + i], own = (int32_t)(rows->first + i);
        int64_t at = rows->from[i];
        int32_t k = map->offset[node];
        for (; k < map->offset[node + 1] && map->neighbour[k] < own; k++)
            rows->columns[at++] = map->neighbour[k];
        rows->columns[at++] = own;
        for (; k < map->offset[node + 1]; k++)
            rows->columns[at++] = map->neighbour[k];
        rows->counts[i] = (int32_t)(at - rows->from[i]);
        rows->from[i + 1] = at;
    }
    int64_t block[2] = {0, 0}, pair[2][2] = {{-1, -1}, {-1, -1}};
    for (int64_t j = 0; j < map->d; j++) {
        const dof_place to = place_of(rows, map, j);
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            const dof_place from = place_of(rows, map, K->idx[k]);
            put_entry(rows, map, from, to, K->val[k], &block[0], pair[0]);
            put_entry(rows, map, to, from, K->val[k], &block[1], pair[1]);
        }
        for (int64_t c = 0; to.node >= 0 && to.node < nodes && c < map->modes; c++)
            rows->mode_values[(to.node * bs + to.place) * map->modes + c] = modes->value[j * map->modes + c];
    }
    for (int64_t i = 0; i < nodes; i++) { /* dofs that the node does not have */
        const int64_t before = rows->from[i], width = (rows->from[i + 1] - before) * bs;
        const int64_t own = find_block(rows, i, (int32_t)(rows->first + i)) - before;
        double largest = 0.0;
        for (int pass = 0; pass < 2; pass++)
            for (int64_t c = 0; c < bs; c++) {
                double *diagonal = &rows->values[before * bs * bs + c * width + own * bs + c];
                if (pass == 0)
                    largest = *diagonal > largest ? *diagonal : largest;
                else if (*diagonal == 0.0)
                    *diagonal = largest;
            }
    }
    return UZ_OK;
}

bool uz_spread_next(uz_spread_rows *rows, const uz_spread *map)
{
    const int64_t bs = map->bs, begin = rows->at - rows->first, nodes = rows->end - rows->first;
    int64_t i = begin;
    while (i < nodes && (i == begin || (rows->from[i + 1] - rows->from[begin]) * bs * bs <= AT_ONCE))
        i++;
    rows->nodes = i - begin;
    if (rows->nodes == 0)
        return false;
    rows->blocks = rows->from[i] - rows->from[begin];
    rows->count = rows->counts + begin;
    rows->column = rows->columns + rows->from[begin];
    rows->value = rows->values + rows->from[begin] * bs * bs;
    rows->mode = rows->mode_values + begin * bs * map->modes;
    rows->at = rows->first + i;
    return true;
}

void uz_spread_rows_clear(uz_spread_rows *rows)
{
    void *own[] = {rows->from, rows->counts, rows->columns, rows->values, rows->mode_values};
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    memset(rows, 0, sizeof *rows);
}
