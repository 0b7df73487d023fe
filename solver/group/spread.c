#include "group/spread.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "group/divide.h"
#include "linalg/linalg.h"

#include <math.h>
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

/* Has this column the rows of the one before but for its diagonal, of the same node? */
static bool repeats(const uz_spread *map, const uz_csc *K, int64_t j)
{
    if (j == 0 || map->node[j] != map->node[j - 1])
        return false;
    const int64_t before = K->ptr[j - 1] + 1, at = K->ptr[j], count = K->ptr[j + 1] - at;
    return at - before == count && memcmp(K->idx + before, K->idx + at, (size_t)count * sizeof *K->idx) == 0;
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
            if (repeats(map, K, j))
                continue;
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
    map->dof = uz_alloc(map->size, sizeof *map->dof);
    map->number = uz_alloc(map->nodes, sizeof *map->number);
    if (!map->offset || !map->part || !map->order || !map->number || !map->dof || !make_graph(map, K))
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

/* Of two nodes of one process the earlier one has the block, since columns of K have what follows them; neighbours by
 * their numbers from now on. */
static void keep_half(uz_spread *map)
{
    int32_t kept = 0, at = 0;
    for (int64_t i = 0; i < map->nodes; i++) {
        const int32_t first = kept;
        for (; at < map->offset[i + 1]; at++) {
            const int32_t other = map->neighbour[at];
            if (map->part[other] != map->part[i] || map->number[other] > map->number[i])
                map->neighbour[kept++] = map->number[other];
        }
        map->offset[i] = first;
        uz_sort_32(map->neighbour + first, kept - first);
    }
    map->offset[map->nodes] = kept;
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
    for (int64_t i = 0; i < map->size; i++)
        map->dof[i] = -1;
    for (int64_t j = 0; j < map->d; j++) {
        map->place[j] += map->number[map->node[j]] * map->bs;
        map->dof[map->place[j]] = j;
    }
    keep_half(map);
    return UZ_OK;
}

void uz_spread_clear(uz_spread *map)
{
    void *own[] = {map->node, map->offset, map->neighbour, map->part, map->order, map->number, map->place, map->dof};
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    memset(map, 0, sizeof *map);
}

/* ---- rows */

/* The dofs of a node, which as a rule have numbers in a row. */
typedef struct {
    int64_t first;
    int count;
    bool in_a_row;
} dofs;

static dofs dofs_of(const uz_spread *map, int64_t number)
{
    const int64_t *dof = map->dof + number * map->bs;
    dofs of = {.first = dof[0], .in_a_row = true};
    for (; of.count < map->bs && dof[of.count] >= 0; of.count++)
        of.in_a_row = of.in_a_row && dof[of.count] == of.first + of.count;
    return of;
}

/* Entry by entry. at: [row][column], rows `width` apart. */
static void copy_entries(double *at, int64_t width, const uz_spread *map, const uz_csc *K, int64_t i, int64_t j)
{
    for (int64_t r = 0; r < map->bs; r++)
        for (int64_t c = 0; c < map->bs; c++) {
            const int64_t row = map->dof[i * map->bs + r], column = map->dof[j * map->bs + c];
            const int64_t k =
                row < 0 || column < 0 ? -1 : uz_csc_find(K, row > column ? row : column, row > column ? column : row);
            at[r * width + c] = k < 0 ? 0.0 : K->val[k];
        }
}

/* Where in the column of a node's first dof the rows of another begin. As a rule they are the next that are read there,
 * after its own, since nodes come in the order of their dofs. */
static int64_t find_rows(uz_spread_rows *rows, const dofs *later, const dofs *earlier, int64_t number)
{
    const uz_csc *K = rows->K;
    int64_t k = K->ptr[earlier->first] + (rows->read[number] > 0 ? rows->read[number] : earlier->count);
    if (k >= K->ptr[earlier->first + 1] || K->idx[k] != later->first)
        k = uz_csc_find(K, later->first, earlier->first);
    if (k >= 0)
        rows->read[number] = (int32_t)(k + later->count - K->ptr[earlier->first]);
    return k - K->ptr[earlier->first];
}

/* Column by column of the earlier node, in each of which the rows of the later one stand together. False: they do
 * not. i, j: numbers of both. */
static bool copy_columns(double *at, int64_t width, uz_spread_rows *rows, const dofs *row, const dofs *column,
                         int64_t i, int64_t j)
{
    const uz_csc *K = rows->K;
    const bool below = row->first > column->first;
    const dofs *later = below ? row : column, *earlier = below ? column : row;
    const int64_t there = find_rows(rows, later, earlier, below ? j : i);
    for (int64_t c = 0; c < earlier->count; c++) {
        const int64_t k = K->ptr[earlier->first + c] + there - c, last = k + later->count - 1;
        if (there < c || last >= K->ptr[earlier->first + c + 1] || K->idx[k] != later->first ||
            K->idx[last] != later->first + later->count - 1)
            return false;
        for (int64_t r = 0; r < later->count; r++)
            at[below ? r * width + c : c * width + r] = K->val[k + r];
    }
    return true;
}

/* The block of a node itself, at the heads of its columns. False: its entries are not all there. */
static bool copy_own(double *at, int64_t width, const uz_csc *K, const dofs *own)
{
    for (int64_t c = 0; c < own->count; c++)
        for (int64_t r = c; r < own->count; r++) {
            const int64_t k = K->ptr[own->first + c] + r - c;
            if (k >= K->ptr[own->first + c + 1] || K->idx[k] != own->first + r)
                return false;
            at[r * width + c] = at[c * width + r] = K->val[k];
        }
    return true;
}

/* Dofs that the node does not have. */
static void fill_diagonal(double *own, int64_t width, int64_t bs)
{
    double largest = 0.0;
    for (int64_t c = 0; c < bs; c++)
        largest = fmax(largest, own[c * width + c]);
    for (int64_t c = 0; c < bs; c++)
        if (own[c * width + c] == 0.0)
            own[c * width + c] = largest;
}

/* The rows of node i, counted by process; its blocks are the next of the buffers. */
static void make_rows(uz_spread_rows *rows, const uz_spread *map, int64_t i)
{
    const int64_t bs = map->bs;
    const int32_t node = map->order[i], before = map->offset[node], others = map->offset[node + 1] - before;
    const int64_t width = (others + 1) * bs;
    int32_t *columns = rows->columns + rows->blocks;
    double *values = rows->values + rows->blocks * bs * bs;
    const dofs own = dofs_of(map, i);
    int32_t count = 0;
    for (; count < others && map->neighbour[before + count] < i; count++)
        columns[count] = map->neighbour[before + count];
    const int32_t diagonal = count;
    columns[count++] = (int32_t)i;
    for (; count <= others; count++)
        columns[count] = map->neighbour[before + count - 1];
    memset(values, 0, (size_t)(width * bs) * sizeof *values);
    for (int32_t k = 0; k < count; k++) {
        const dofs other = dofs_of(map, columns[k]);
        double *at = values + k * bs;
        if (!own.in_a_row || !other.in_a_row ||
            !(k == diagonal ? copy_own(at, width, rows->K, &own)
                            : copy_columns(at, width, rows, &own, &other, i, columns[k])))
            copy_entries(at, width, map, rows->K, i, columns[k]);
    }
    fill_diagonal(values + diagonal * bs, width, bs);
    float *modes = rows->modes + rows->nodes * bs * map->modes;
    memset(modes, 0, (size_t)(bs * map->modes) * sizeof *modes);
    for (int c = 0; c < own.count; c++)
        memcpy(modes + c * map->modes, rows->from->value + map->dof[i * bs + c] * map->modes,
               (size_t)map->modes * sizeof *modes);
    rows->counts[rows->nodes++] = count;
    rows->blocks += count;
}

uz_status uz_spread_begin(uz_spread_rows *rows, const uz_spread *map, const uz_csc *K, const uz_modes *modes,
                          uz_error *err)
{
    const int64_t size = map->bs * map->bs;
    int64_t room = AT_ONCE / size;
    rows->K = K;
    rows->from = modes;
    rows->at = 0;
    while (rows->at < map->nodes && map->part[map->order[rows->at]] < rows->process)
        rows->at++;
    for (rows->end = rows->at; rows->end < map->nodes && map->part[map->order[rows->end]] == rows->process; rows->end++)
        room =
            uz_spread_blocks(map, map->order[rows->end]) > room ? uz_spread_blocks(map, map->order[rows->end]) : room;
    rows->room = room; /* a node has a block at least */
    rows->counts = uz_alloc(room, sizeof *rows->counts);
    rows->columns = uz_alloc(room, sizeof *rows->columns);
    rows->values = uz_alloc(room * size, sizeof *rows->values);
    rows->modes = uz_alloc(room * map->bs * map->modes, sizeof *rows->modes);
    rows->read = uz_alloc_zero(map->nodes, sizeof *rows->read);
    return rows->read && rows->counts && rows->columns && rows->values && rows->modes ? UZ_OK
                                                                                      : fail_memory(err, map->d);
}

bool uz_spread_next(uz_spread_rows *rows, const uz_spread *map)
{
    rows->nodes = rows->blocks = 0;
    while (rows->at < rows->end && rows->blocks + uz_spread_blocks(map, map->order[rows->at]) <= rows->room)
        make_rows(rows, map, rows->at++);
    return rows->nodes > 0;
}

void uz_spread_rows_clear(uz_spread_rows *rows)
{
    void *own[] = {rows->counts, rows->columns, rows->values, rows->modes, rows->read};
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    memset(rows, 0, sizeof *rows);
}
