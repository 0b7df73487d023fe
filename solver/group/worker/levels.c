/* levels.c: the finest level by the rows of each process, the next matrix as a sum over processes, and what follows
 * from it on each of them: smoothed aggregates as in amg/multigrid.c, of which all but what passes between processes is
 * used here.
 *
 * Aggregates are of nodes of one process. The prolongation is smoothed across processes: for that each knows of its
 * ghosts their aggregates and basis. Then A_next = P'A P is the sum of P_e' A_e P_e, e the own nodes and the ghosts of
 * a process, A_e its own blocks and half of those that couple it with others, which the other side has, too. */
#include "worker.h"

#include "core/alloc.h"
#include "core/order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void *new_room(int64_t count, size_t size)
{
    void *made = uz_alloc(count > 0 ? count : 1, size); /* on large pages */
    if (!made)
        end_group("no memory");
    return made;
}

void *new_zeros(int64_t count, size_t size)
{
    void *made = new_room(count, size);
    memset(made, 0, (size_t)(count > 0 ? count : 1) * size);
    return made;
}

static void must(uz_status status, const uz_error *err)
{
    if (status != UZ_OK)
        end_group(err->message);
}

/* ---- the finest level */

static int64_t place_of_ghost(const neighbours *near, int32_t number)
{
    int64_t low = 0, high = near->ghosts - 1;
    while (low < high) {
        const int64_t middle = (low + high) / 2;
        if (near->number[middle] < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The row of the level that has the block with this node. */
static int64_t row_of(const neighbours *near, int32_t begin, int32_t number)
{
    const int64_t j = number - (int64_t)begin;
    return j >= 0 && j < near->here ? j : near->here + place_of_ghost(near, number);
}

static void find_places(spread_system *s, const spread_rows *rows)
{
    uz_blocks *A = &s->level.A;
    const neighbours *near = &s->near;
    const int32_t begin = rows->first[near->rank];
    const int64_t here = near->here, size = (int64_t)s->b * s->b;
    *A = (uz_blocks){.nodes = here + near->ghosts, .b = s->b};
    A->ptr = new_zeros(A->nodes + 2, sizeof *A->ptr);
    for (int64_t i = 0; i < here; i++)
        for (int64_t e = rows->ptr[i]; e < rows->ptr[i + 1]; e++) {
            const int64_t j = row_of(near, begin, rows->column[e]);
            A->ptr[j + 1] += j != i;
        }
    for (int64_t i = 0; i < A->nodes; i++)
        A->ptr[i + 1] += A->ptr[i];
    A->idx = new_zeros(A->ptr[A->nodes], sizeof *A->idx);
    A->off = new_room(A->ptr[A->nodes] * size + 4, sizeof *A->off); /* all but the last four are filled */
    memset(A->off + A->ptr[A->nodes] * size, 0, 4 * sizeof *A->off);
    A->diag = new_zeros(A->nodes * size + 4, sizeof *A->diag);
}

/* Blocks as they come, times the scales of their rows and columns; a block stands in the row of its later node. */
UZ_INLINE void fill_blocks(spread_system *s, const spread_rows *rows, const double *scale_of_ghosts, int b)
{
    uz_blocks *A = &s->level.A;
    const neighbours *near = &s->near;
    const int64_t here = near->here, size = (int64_t)b * b;
    int64_t *next = new_zeros(A->nodes, sizeof *next);
    memcpy(next, A->ptr, (size_t)A->nodes * sizeof *next);
    for (int64_t i = 0; i < here; i++) {
        const int64_t width = (rows->ptr[i + 1] - rows->ptr[i]) * b;
        const double *from = rows->value + rows->ptr[i] * size, *of_row = s->scale + i * b;
        for (int64_t e = rows->ptr[i]; e < rows->ptr[i + 1]; e++, from += b) {
            const int64_t j = row_of(near, rows->first[near->rank], rows->column[e]);
            const double *of_column = j < here ? s->scale + j * b : scale_of_ghosts + (j - here) * b;
            double *to = A->diag + i * size;
            if (j != i) {
                A->idx[next[j]] = (int32_t)i;
                to = A->off + next[j]++ * size;
            }
            for (int r = 0; r < b; r++)
                for (int c = 0; c < b; c++)
                    to[c * b + r] = of_row[r] * of_column[c] * from[r * width + c];
        }
    }
    free(next);
}

static void fill_level(spread_system *s, const spread_rows *rows, const double *scale_of_ghosts)
{
    if (s->b == 3)
        fill_blocks(s, rows, scale_of_ghosts, 3);
    else
        fill_blocks(s, rows, scale_of_ghosts, s->b);
}

static void find_scale(spread_system *s, const spread_rows *rows)
{
    const int b = s->b;
    const int32_t begin = rows->first[s->near.rank];
    s->scale = new_zeros(s->near.here * b, sizeof *s->scale);
    for (int64_t i = 0; i < s->near.here; i++) {
        const int64_t from = rows->ptr[i], width = (rows->ptr[i + 1] - from) * b;
        for (int64_t e = from; e < rows->ptr[i + 1]; e++)
            for (int r = 0; rows->column[e] - begin == i && r < b; r++) {
                const double own = rows->value[from * b * b + r * width + (e - from) * b + r];
                s->scale[i * b + r] = own > 0.0 ? ldexp(1.0, -ilogb(own) / 2) : 1.0;
            }
    }
}

/* Sweeps have the sums of what couples processes on their diagonal. */
static void add_sums(spread_system *s)
{
    const uz_blocks *A = &s->level.A;
    const int b = s->b;
    const int64_t here = s->near.here, first = A->ptr[here], last = A->ptr[A->nodes];
    int32_t *place = new_zeros(here, sizeof *place);
    s->outside = new_zeros(here * b, sizeof *s->outside);
    s->face = new_zeros(here, sizeof *s->face);
    s->rim = new_zeros(last - first, sizeof *s->rim);
    for (int64_t e = first; e < last; e++) {
        place[A->idx[e]] = 1;
        for (int r = 0; r < b; r++)
            for (int c = 0; c < b; c++)
                s->outside[A->idx[e] * b + c] += fabsf(s->level.off[(e * b + r) * b + c]);
    }
    for (int64_t i = 0; i < here; i++) {
        for (int c = 0; c < b; c++) {
            float *own = &s->level.diag[(i * b + c) * b + c];
            *own += s->outside[i * b + c];
            s->level.inverse[i * b + c] = 1.0F / *own;
        }
        if (place[i]) {
            place[i] = (int32_t)s->faces;
            s->face[s->faces++] = (int32_t)i;
        }
    }
    for (int64_t e = first; e < last; e++)
        s->rim[e - first] = place[A->idx[e]];
    free(place);
}

/* of_row, of_column: sums of D^-1/2 L D^-1/2, of absolute values; inverse: D^-1/2. */
UZ_INLINE void add_sizes(double *of_row, double *of_column, const uz_blocks *A, int64_t nodes, const double *inverse,
                         int b)
{
    const int64_t size = (int64_t)b * b;
    for (int64_t i = 0; i < nodes; i++)
        for (int64_t e = A->ptr[i] - 1; e < A->ptr[i + 1]; e++) { /* the diagonal block first */
            const int64_t j = e < A->ptr[i] ? i : A->idx[e];
            const double *block = e < A->ptr[i] ? A->diag + i * size : A->off + e * size;
            for (int r = 0; r < b; r++)
                for (int c = 0; c < (j == i ? r : b); c++) {
                    const double scaled = fabs(block[r * b + c]) * inverse[i * b + r] * inverse[j * b + c];
                    of_row[i * b + r] += scaled;
                    of_column[j * b + c] += scaled;
                }
        }
}

/* The norm of D^-1/2 L D^-1/2 is at most the root of its largest row sum times its largest column sum. */
static void bound_by_diagonal(spread_system *s)
{
    const uz_blocks *A = &s->level.A;
    const int b = s->b;
    const int64_t here = s->near.here, size = (int64_t)b * b;
    double *row = new_zeros(here * b, sizeof *row), *column = new_zeros(here * b, sizeof *column);
    double *inverse = new_zeros(here * b, sizeof *inverse);
    double most[3] = {0.0, 0.0, 1.0}; /* of a row, of a column, of D'/D */
    for (int64_t i = 0; i < here * b; i++)
        inverse[i] = sqrt(1.0 / A->diag[i / b * size + i % b * b + i % b]); /* which is about 1 */
    if (b == 3)
        add_sizes(row, column, A, here, inverse, 3);
    else
        add_sizes(row, column, A, here, inverse, b);
    for (int64_t i = 0; i < here * b; i++) {
        const double own = A->diag[i / b * size + i % b * b + i % b];
        most[0] = fmax(most[0], row[i]);
        most[1] = fmax(most[1], column[i]);
        most[2] = fmax(most[2], (own + (double)s->outside[i]) / own);
    }
    free(row);
    free(column);
    free(inverse);
    combine_all(most, 3, MPI_DOUBLE, MPI_MAX);
    const double root = sqrt(most[2]) + sqrt(most[0] * most[1]);
    s->most = root * root;
}

/* What rows took is taken by what follows from them. */
static void free_blocks(spread_rows *rows)
{
    free(rows->column);
    free(rows->value);
    rows->column = NULL;
    rows->value = NULL;
}

/* Blocks as K's product has them from now on (amg/multigrid_private.h). Those of ghosts are to be halved and doubled
 * without loss, as single precision is: their rests are even. */
static void part_blocks(spread_system *s)
{
    const uz_blocks *A = &s->level.A;
    const int64_t size = (int64_t)s->b * s->b;
    uz_level_part_off(&s->level);
    for (int64_t e = A->ptr[s->near.here] * size; e < A->ptr[A->nodes] * size; e++)
        s->level.off_rest.value[e] &= ~1;
}

static void make_finest(spread_system *s, spread_rows *rows)
{
    uz_error err = {0};
    double *scale_of_ghosts = new_zeros(s->near.ghosts * s->b, sizeof *scale_of_ghosts);
    find_places(s, rows);
    find_scale(s, rows);
    neighbours_fetch(&s->near, scale_of_ghosts, s->scale, (size_t)s->b * sizeof *s->scale);
    fill_level(s, rows, scale_of_ghosts);
    free_blocks(rows);
    free(scale_of_ghosts);
    must(uz_level_round(&s->level, &err), &err);
    add_sums(s);
    bound_by_diagonal(s);
    part_blocks(s);
}

/* ---- the way to the next one */

/* of_level (here x b x k): the modes of S K S are S^-1 times K's, here times the least of S, so that none overflows. */
static float *scale_modes(const spread_system *s, spread_rows *rows)
{
    float *scaled = new_zeros(s->near.here * s->b * s->k, sizeof *scaled);
    double least = INFINITY;
    for (int64_t i = 0; i < s->near.here * s->b; i++)
        least = fmin(least, s->scale[i]);
    combine_all(&least, 1, MPI_DOUBLE, MPI_MIN);
    for (int64_t i = 0; i < s->near.here * s->b; i++)
        for (int c = 0; c < s->k; c++)
            scaled[i * s->k + c] = (float)(least / s->scale[i] * (double)rows->mode[i * s->k + c]);
    free(rows->mode);
    rows->mode = NULL;
    return scaled;
}

/* All processes' numbers one after the other. */
static void *gather(const void *own, int64_t count, size_t each, int64_t *total)
{
    int size, *counts, *firsts, mine = (int)((size_t)count * each);
    MPI_Request request;
    if ((size_t)count * each > INT32_MAX)
        end_group("the next matrix is too large: take fewer processes, or a smaller body");
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    counts = new_zeros(size, sizeof *counts);
    firsts = new_zeros(size, sizeof *firsts);
    MPI_Iallgather(&mine, 1, MPI_INT, counts, 1, MPI_INT, MPI_COMM_WORLD, &request);
    wait_for(1, &request);
    int64_t bytes = 0;
    for (int p = 0; p < size; bytes += counts[p++])
        firsts[p] = (int)bytes;
    if (bytes > INT32_MAX)
        end_group("the next matrix is too large for each process to have it");
    void *all = new_zeros(bytes, 1);
    MPI_Iallgatherv(own, mine, MPI_BYTE, all, counts, firsts, MPI_BYTE, MPI_COMM_WORLD, &request);
    wait_for(1, &request);
    free(counts);
    free(firsts);
    *total = bytes / (int64_t)each;
    return all;
}

/* aggregate, basis: of own nodes and ghosts, the former numbered over all processes. */
static void aggregate_nodes(spread_system *s, spread_rows *rows, int32_t *aggregate, float *basis)
{
    uz_error err = {0};
    uz_level own = s->level;
    uz_below below;
    const int64_t here = s->near.here, size = (int64_t)s->b * s->k;
    int64_t count = 0, before = 0, all = 0;
    MPI_Request request;
    float *modes = scale_modes(s, rows);
    own.A.nodes = here;
    if (!uz_below_init(&below, &own.A))
        end_group("no memory");
    must(uz_aggregate(aggregate, &count, &own, &below, s->strong, &err), &err);
    uz_below_clear(&below);
    float *coarse = new_zeros(count * s->k * s->k, sizeof *coarse);
    if (count > 0)
        must(uz_tentative(basis, coarse, modes, aggregate, here, s->b, count, s->k, &err), &err);
    free(modes);
    MPI_Iexscan(&count, &before, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD, &request);
    wait_for(1, &request);
    if (s->near.rank == 0)
        before = 0;
    for (int64_t i = 0; i < here; i++)
        aggregate[i] += aggregate[i] >= 0 ? (int32_t)before : 0;
    s->modes = gather(coarse, count * s->k * s->k, sizeof *coarse, &all);
    free(coarse);
    s->level.aggregates = all / (s->k * s->k);
    neighbours_fetch(&s->near, aggregate + here, aggregate, sizeof *aggregate);
    neighbours_fetch(&s->near, basis + here * size, basis, (size_t)size * sizeof *basis);
}

/* Rows of the prolongation of ghosts, from those who have them. */
static void fetch_prolongation(spread_system *s)
{
    neighbours *near = &s->near;
    uz_level *level = &s->level;
    const int64_t here = near->here, size = (int64_t)s->b * s->k;
    int64_t most = 0, *count = new_zeros(here + near->ghosts, sizeof *count);
    for (int64_t i = 0; i < here; i++) {
        count[i] = level->ptr[i + 1] - level->ptr[i];
        most = count[i] > most ? count[i] : most;
    }
    combine_all(&most, 1, MPI_INT64_T, MPI_MAX);
    neighbours_fetch(near, count + here, count, sizeof *count);
    /* as many as the longest, so that all are alike */
    const size_t each = (size_t)most * (sizeof(int32_t) + (size_t)size * sizeof(float));
    char *to = neighbours_room(near, each), *others = new_zeros(near->ghosts, each);
    for (int64_t k = 0; k < near->sent; k++, to += each) {
        const int64_t i = near->send[k];
        memset(to, 0, each);
        memcpy(to, level->block + level->ptr[i], (size_t)count[i] * sizeof(int32_t));
        memcpy(to + (size_t)most * sizeof(int32_t), level->value + level->ptr[i] * size,
               (size_t)(count[i] * size) * sizeof(float));
    }
    neighbours_exchange(near, others, each);
    int64_t total = level->ptr[here];
    for (int64_t g = 0; g < near->ghosts; g++)
        total += count[here + g];
    int32_t *block = realloc(level->block, ((size_t)total + 1) * sizeof *block);
    float *value = realloc(level->value, (size_t)(total * size + 8) * sizeof *value);
    if (!block || !value)
        end_group("no memory");
    level->block = block;
    level->value = value;
    for (int64_t g = 0; g < near->ghosts; g++) {
        const int64_t at = level->ptr[here + g];
        memcpy(block + at, others + (size_t)g * each, (size_t)count[here + g] * sizeof *block);
        memcpy(value + at * size, others + (size_t)g * each + (size_t)most * sizeof(int32_t),
               (size_t)(count[here + g] * size) * sizeof *value);
        level->ptr[here + g + 1] = at + count[here + g];
    }
    memset(value + total * size, 0, 8 * sizeof *value);
    free(others);
    free(count);
}

static void scale_ghosts(spread_system *s, double factor)
{
    const int64_t size = (int64_t)s->b * s->b;
    const uz_blocks *A = &s->level.A;
    for (int64_t e = A->ptr[s->near.here] * size; e < A->ptr[A->nodes] * size; e++) {
        s->level.off[e] *= (float)factor;
        s->level.off_rest.value[e] = (int32_t)(s->level.off_rest.value[e] * factor);
    }
}

/* ---- sums over processes */

/* Blocks of all processes, one after the other. */
typedef struct {
    int rank, size;
    int64_t *first; /* size + 1: of each process */
    int32_t *at;    /* first[size] x 2: row and column */
    double **own;   /* this process's: where their numbers are */
} block_list;

static bool is_zero(const double *block, int64_t size)
{
    int64_t c = 0;
    while (c < size && block[c] == 0.0)
        c++;
    return c == size;
}

/* zeros: those that are 0, too. */
static block_list list_blocks(const uz_blocks *part, bool zeros)
{
    const int64_t size = (int64_t)part->b * part->b, most = part->nodes + part->ptr[part->nodes];
    int32_t *at = new_zeros(2 * most, sizeof *at);
    int64_t count = 0, all;
    block_list list = {.own = new_zeros(most, sizeof *list.own)};
    MPI_Request request;
    for (int64_t a = 0; a < part->nodes; a++)
        for (int64_t e = part->ptr[a]; e <= part->ptr[a + 1]; e++) {
            const bool diagonal = e == part->ptr[a + 1];
            double *block = diagonal ? part->diag + a * size : part->off + e * size;
            if (!zeros && is_zero(block, size))
                continue;
            at[2 * count] = (int32_t)a;
            at[2 * count + 1] = diagonal ? (int32_t)a : part->idx[e];
            list.own[count++] = block;
        }
    MPI_Comm_rank(MPI_COMM_WORLD, &list.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &list.size);
    list.first = new_zeros(list.size + 1, sizeof *list.first);
    MPI_Iallgather(&count, 1, MPI_INT64_T, list.first + 1, 1, MPI_INT64_T, MPI_COMM_WORLD, &request);
    wait_for(1, &request);
    for (int p = 0; p < list.size; p++)
        list.first[p + 1] += list.first[p];
    list.at = gather(at, count, 2 * sizeof *at, &all);
    free(at);
    return list;
}

static void free_list(block_list *list)
{
    free(list->first);
    free(list->at);
    free(list->own);
}

/* Blocks of all processes that pass at once: all of them would need more room than their sum. */
enum { BLOCKS_AT_ONCE = 1 << 13 };

static void add_list(uz_blocks *to, const block_list *list)
{
    const int64_t size = (int64_t)to->b * to->b, some = list->size < BLOCKS_AT_ONCE ? BLOCKS_AT_ONCE / list->size : 1;
    int64_t most = 0;
    int *count = new_zeros(list->size, sizeof *count), *first = new_zeros(list->size, sizeof *first);
    for (int p = 0; p < list->size; p++)
        most = list->first[p + 1] - list->first[p] > most ? list->first[p + 1] - list->first[p] : most;
    double *value = new_zeros(list->size * (most < some ? most : some) * size, sizeof *value);
    for (int64_t from = 0; from < most; from += some) {
        MPI_Request request;
        for (int p = 0, at = 0; p < list->size; at += count[p++]) {
            const int64_t left = list->first[p + 1] - list->first[p] - from;
            count[p] = (int)((left < 0 ? 0 : left < some ? left : some) * size);
            first[p] = at;
        }
        for (int64_t q = 0; q * size < count[list->rank]; q++)
            memcpy(value + first[list->rank] + q * size, list->own[from + q], (size_t)size * sizeof *value);
        MPI_Iallgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, value, count, first, MPI_DOUBLE, MPI_COMM_WORLD, &request);
        wait_for(1, &request);
        for (int p = 0; p < list->size; p++)
            for (int64_t q = 0; q * size < count[p]; q++) {
                const int32_t *at = list->at + 2 * (list->first[p] + from + q);
                double *block =
                    at[0] == at[1] ? to->diag + at[0] * size : to->off + uz_blocks_find(to, at[0], at[1]) * size;
                for (int64_t c = 0; c < size; c++)
                    block[c] += value[first[p] + q * size + c];
            }
    }
    free(value);
    free(count);
    free(first);
}

static void sum_lists(uz_blocks *sum, const block_list *list, int64_t nodes, int k)
{
    const int64_t size = (int64_t)k * k, blocks = list->first[list->size];
    int64_t *start = new_zeros(nodes + 2, sizeof *start), count = 0;
    *sum = (uz_blocks){.nodes = nodes, .b = k, .ptr = new_zeros(nodes + 1, sizeof *sum->ptr)};
    for (int64_t q = 0; q < blocks; q++)
        start[list->at[2 * q] + 2] += list->at[2 * q] != list->at[2 * q + 1];
    for (int64_t a = 0; a < nodes; a++)
        start[a + 2] += start[a + 1];
    sum->idx = new_zeros(start[nodes + 1], sizeof *sum->idx);
    for (int64_t q = 0; q < blocks; q++)
        if (list->at[2 * q] != list->at[2 * q + 1])
            sum->idx[start[list->at[2 * q] + 1]++] = list->at[2 * q + 1];
    for (int64_t a = 0; a < nodes; a++) { /* sorted, each once */
        qsort(sum->idx + start[a], (size_t)(start[a + 1] - start[a]), sizeof *sum->idx, uz_ascending_32);
        for (int64_t e = start[a]; e < start[a + 1]; e++)
            if (e == start[a] || sum->idx[e] != sum->idx[e - 1])
                sum->idx[count++] = sum->idx[e];
        sum->ptr[a + 1] = count;
    }
    free(start);
    sum->off = new_zeros(count * size + 4, sizeof *sum->off);
    sum->diag = new_zeros(nodes * size + 4, sizeof *sum->diag);
    add_list(sum, list);
}

/* ---- what each process has whole */

/* Numbers of a sum that pass at once. */
enum { SUMMED_AT_ONCE = 1 << 20 };

/* Each process sums a share of them. Not MPI_Allreduce, which promises no process the bits of another: aggregates
 * follow from these numbers, and all have to have the same. Nor MPI_Ireduce: what that passes in small pieces waits
 * between them, ten times as long as it takes. */
static void sum_up(double *x, int64_t n)
{
    int rank, size;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    int *count = new_zeros(size, sizeof *count), *first = new_zeros(size + 1, sizeof *first);
    int *mine = new_zeros(size, sizeof *mine), *place = new_zeros(size, sizeof *place);
    double *parts = new_zeros((n < SUMMED_AT_ONCE ? n : SUMMED_AT_ONCE) + size, sizeof *parts);
    for (int64_t from = 0; from < n; from += SUMMED_AT_ONCE) {
        const int64_t all = n - from < SUMMED_AT_ONCE ? n - from : SUMMED_AT_ONCE;
        MPI_Request request;
        for (int p = 0; p < size; p++) {
            first[p + 1] = (int)(all * (p + 1) / size);
            count[p] = first[p + 1] - first[p];
        }
        for (int p = 0; p < size; p++) {
            mine[p] = count[rank];
            place[p] = p * count[rank];
        }
        double *own = x + from + first[rank];
        MPI_Ialltoallv(x + from, count, first, MPI_DOUBLE, parts, mine, place, MPI_DOUBLE, MPI_COMM_WORLD, &request);
        wait_for(1, &request);
        memcpy(own, parts, (size_t)count[rank] * sizeof *own);
        for (int p = 1; p < size; p++)
            for (int64_t q = 0; q < count[rank]; q++)
                own[q] += parts[place[p] + q];
        MPI_Iallgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, x + from, count, first, MPI_DOUBLE, MPI_COMM_WORLD,
                        &request);
        wait_for(1, &request);
    }
    uz_free_all(count, first, mine, place, parts);
}

static uz_team team_of(const spread_system *s)
{
    return (uz_team){s->near.rank, s->near.size, sum_up};
}

/* A function on held dofs but for so much of its energy is left out. */
#define LOST 1e-5

/* A small matrix, or one that can't be coarsened, keeps its numbers. */
static uz_status factor_whole(uz_multigrid **made, uz_blocks *A, const float *there, const uz_modes *modes,
                              const uz_team *team, uz_error *err)
{
    uz_csc columns = {0};
    must(uz_blocks_to_columns(&columns, A, there, err), err);
    const uz_status status = uz_multigrid_create(made, &columns, modes, team, 0, NULL, err);
    uz_csc_clear(&columns);
    return status;
}

/* Of the next matrix, or of what holding dofs leaves of it. NULL where rounding has made that indefinite. Numbers off
 * the diagonal are not A's any more, as level 0 has them, unless there is one level, which held dofs make anew. */
static uz_multigrid *make_coarse(const spread_system *s, uz_blocks *A)
{
    const int k = s->k;
    const int64_t n = A->nodes * k;
    float *there = new_zeros(n, sizeof *there);
    uz_modes modes = {.count = k, .n_nodes = A->nodes, .value = s->modes, .strong = 0.5 * s->strong};
    uz_multigrid *made = NULL;
    uz_error err = {0};
    modes.node = new_zeros(n, sizeof *modes.node);
    for (int64_t i = 0; i < n; i++) {
        const int64_t at = i / k * k * k + i % k * k + i % k;
        modes.node[i] = (int32_t)(i / k);
        there[i] = A->diag[at] > LOST * s->next.diag[at] ? 1.0F : 0.0F;
    }
    const uz_team team = team_of(s);
    uz_status status = uz_multigrid_of_blocks(&made, A, there, &modes, &team, &err);
    if (status == UZ_OK && !made)
        status = factor_whole(&made, A, there, &modes, &team, &err);
    if (status != UZ_OK && status != UZ_ERR_NOT_SPD)
        end_group(err.message);
    free(modes.node);
    free(there);
    return made;
}

static void set_coarse(variant *v, uz_multigrid *made, const neighbours *near)
{
    size_t bytes;
    v->base = made;
    v->room = made ? made->kind->room(made, &bytes) : NULL;
    if (made && !(v->room && uz_room_for_lanes(v->room, made)))
        end_group("no memory");
    if (made)
        shared_init(&v->shared, made, v->room, near, NULL, NULL);
}

/* HELD may share WHOLE's multigrid. */
static void free_variant(spread_system *s, int which)
{
    variant *v = &s->variant[which];
    free(v->inverse);
    shared_clear(&v->shared);
    if (v->base)
        v->base->kind->free_room(v->room);
    if (v->base && (which == VARIANT_WHOLE || v->base != s->variant[VARIANT_WHOLE].base))
        uz_multigrid_free(v->base);
    *v = (variant){0};
}

static void coarsen(spread_system *s, spread_rows *rows)
{
    uz_level *level = &s->level;
    uz_error err = {0};
    uz_below below;
    uz_blocks part; /* of the next matrix: this process's */
    const int64_t nodes = level->A.nodes, here = s->near.here;
    int32_t *aggregate = new_zeros(nodes, sizeof *aggregate);
    float *basis = new_zeros(nodes * s->b * s->k, sizeof *basis);
    double range;
    aggregate_nodes(s, rows, aggregate, basis);
    if (level->aggregates == 0) {
        free(aggregate);
        free(basis);
        return;
    }
    if (!uz_below_init(&below, &level->A))
        end_group("no memory");
    level->A.nodes = here;
    must(uz_level_range(&range, level, &err), &err);
    level->A.nodes = nodes;
    combine_all(&range, 1, MPI_DOUBLE, MPI_MAX);
    must(uz_prolong_smoothed(level, &below, basis, aggregate, 4.0 / 3.0 / range, s->k, NULL, &err), &err);
    free(aggregate);
    free(basis);
    fetch_prolongation(s);
    scale_ghosts(s, 0.5);
    must(uz_galerkin(&part, level, &below, s->k, NULL, NULL, &err), &err);
    scale_ghosts(s, 2.0);
    uz_below_clear(&below);
    block_list list = list_blocks(&part, true);
    sum_lists(&s->next, &list, level->aggregates, s->k);
    free_list(&list);
    uz_blocks_clear(&part);
}

static void make_room(spread_system *s)
{
    const int64_t size = 4 * LANES * s->level.A.nodes, coarse = s->next.nodes;
    double **vectors[] = {&s->u, &s->f, &s->r, &s->z, &s->p, &s->q};
    for (size_t v = 0; v < sizeof vectors / sizeof vectors[0]; v++)
        *vectors[v] = new_zeros(size, sizeof(double));
    s->rhs = new_zeros(size, sizeof *s->rhs);
    s->x = new_zeros(size, sizeof *s->x);
    s->t = new_zeros(size, sizeof *s->t);
    s->ghosts = new_zeros(4 * LANES * s->near.ghosts, sizeof *s->ghosts);
    s->brim = new_zeros(2 * 4 * LANES * s->faces, sizeof *s->brim);
    s->lanes = 1;
    s->single = true;
    s->diagonal = new_zeros(4 * s->near.here, sizeof *s->diagonal);
    s->coarse = new_zeros(coarse * LANES * uz_width(s->k), sizeof *s->coarse);
    s->coarse_r = new_zeros(coarse * s->k, sizeof *s->coarse_r);
    s->coarse_z = new_zeros(coarse * s->k, sizeof *s->coarse_z);
}

void system_create(spread_system *s, spread_rows *rows)
{
    *s = (spread_system){.b = rows->b, .k = rows->k, .strong = rows->strong};
    neighbours_init(&s->near, rows->first, rows->ptr, rows->column);
    make_finest(s, rows);
    coarsen(s, rows);
    const int64_t ghosts = s->near.here * s->b, end = s->level.A.nodes * s->b;
    for (int64_t i = ghosts; i < end; i++) /* they are there */
        s->level.inverse[i] = 1.0F;
    s->variant[VARIANT_WHOLE].inverse = new_zeros(end, sizeof(float));
    memcpy(s->variant[VARIANT_WHOLE].inverse, s->level.inverse, (size_t)end * sizeof(float));
    if (s->next.nodes > 0)
        set_coarse(&s->variant[VARIANT_WHOLE], make_coarse(s, &s->next), &s->near);
    make_room(s);
}

static uz_blocks zeros_like(const uz_blocks *A)
{
    const int64_t size = (int64_t)A->b * A->b;
    uz_blocks made = *A; /* little of it is touched as a rule: no page is taken before that */
    made.off = uz_alloc_zero(A->ptr[A->nodes] * size + 4, sizeof *made.off);
    made.diag = uz_alloc_zero(A->nodes * size + 4, sizeof *made.diag);
    if (!made.off || !made.diag)
        end_group("no memory");
    return made;
}

/* A, of which each process has its part in the places of all. any (nodes): rows that have something. */
static void sum_parts(uz_blocks *A, bool *any)
{
    const int64_t size = (int64_t)A->b * A->b;
    block_list list = list_blocks(A, false);
    const int64_t count = list.first[list.rank + 1] - list.first[list.rank];
    double *own = new_zeros(count * size, sizeof *own);
    for (int64_t q = 0; q < count; q++) {
        memcpy(own + q * size, list.own[q], (size_t)size * sizeof *own);
        memset(list.own[q], 0, (size_t)size * sizeof *own);
        list.own[q] = own + q * size;
    }
    add_list(A, &list);
    for (int64_t q = 0; q < list.first[list.size]; q++)
        any[list.at[2 * q]] = true;
    free(own);
    free_list(&list);
}

/* What is coarser than the finest level, less what holding dofs takes from the next matrix: s->loss, in these rows. One
 * level alone is factored anew. */
static void lose(spread_system *s, variant *v, const bool *lost)
{
    const variant *whole = &s->variant[VARIANT_WHOLE];
    uz_error err = {0};
    if (whole->base->levels > 1) {
        size_t bytes;
        v->room = whole->base->kind->room(whole->base, &bytes);
        if (!v->room)
            end_group("no memory");
        v->base = whole->base;
        const uz_team team = team_of(s);
        must(uz_hold_loss(v->room, v->base, &s->loss, lost, whole->shared.divided, &team, &err), &err);
        shared_init(&v->shared, v->base, v->room, &s->near, &s->loss, lost);
        return;
    }
    uz_blocks A = zeros_like(&s->next);
    const int64_t size = (int64_t)A.b * A.b;
    for (int64_t e = 0; e < A.ptr[A.nodes] * size; e++)
        A.off[e] = s->next.off[e] - s->loss.off[e];
    for (int64_t e = 0; e < A.nodes * size; e++)
        A.diag[e] = s->next.diag[e] - s->loss.diag[e];
    set_coarse(v, make_coarse(s, &A), &s->near);
    free(A.off);
    free(A.diag);
}

static void clear_rows(uz_blocks *A, const bool *any)
{
    const int64_t size = (int64_t)A->b * A->b;
    for (int64_t a = 0; a < A->nodes; a++)
        if (any[a]) {
            memset(A->off + A->ptr[a] * size, 0, (size_t)((A->ptr[a + 1] - A->ptr[a]) * size) * sizeof *A->off);
            memset(A->diag + a * size, 0, (size_t)size * sizeof *A->diag);
        }
}

void system_hold(spread_system *s, const char *held)
{
    variant *v = &s->variant[VARIANT_HELD];
    const int b = s->b;
    const int64_t here = s->near.here;
    char *all = new_zeros(s->level.A.nodes, (size_t)b);
    free_variant(s, VARIANT_HELD);
    v->inverse = new_zeros(s->level.A.nodes * b, sizeof *v->inverse);
    memcpy(all, held, (size_t)(here * b));
    neighbours_fetch(&s->near, all + here * b, all, (size_t)b);
    for (int64_t i = 0; i < s->level.A.nodes * b; i++)
        v->inverse[i] = all[i] ? 0.0F : s->level.inverse[i];
    free(all);
    if (!s->variant[VARIANT_WHOLE].base)
        return;
    bool *lost = new_zeros(s->next.nodes, sizeof *lost);
    if (!s->loss.ptr)
        s->loss = zeros_like(&s->next);
    scale_ghosts(s, 0.5);
    if (!uz_level_loss(&s->loss, &s->level, v->inverse))
        end_group("no memory");
    scale_ghosts(s, 2.0);
    sum_parts(&s->loss, lost);
    lose(s, v, lost);
    clear_rows(&s->loss, lost);
    free(lost);
}

static int64_t blocks_bytes(const uz_blocks *A)
{
    const int64_t size = (int64_t)A->b * A->b;
    return A->ptr ? A->ptr[A->nodes] * (4 + (A->off ? 8 * size : 0)) + A->nodes * (8 + 8 * size) : 0;
}

int64_t system_bytes(const spread_system *s, int which)
{
    const int64_t nodes = s->level.A.nodes, size = (int64_t)s->b * s->b;
    const uz_multigrid *base = s->variant[which].base;
    const int64_t coarse = base ? (int64_t)base->bytes : 0;
    if (which != VARIANT_WHOLE)
        return coarse;
    const int64_t prolongation = s->level.ptr ? s->level.ptr[nodes] * (4 + 4 * s->b * s->k) : 0;
    return coarse + blocks_bytes(&s->level.A) + blocks_bytes(&s->next) + prolongation +
           4 * size * (2 * s->level.A.ptr[nodes] + nodes) + nodes * (24 + 60 * LANES * 4);
}

int system_levels(const spread_system *s, int which)
{
    return 1 + (s->variant[which].base ? s->variant[which].base->levels : 0);
}

void system_free(spread_system *s)
{
    uz_level *level = &s->level;
    void *own[] = {s->scale,       level->off,  level->diag,
                   level->inverse, level->ptr,  level->block,
                   level->value,   s->face,     s->outside,
                   s->modes,       s->rhs,      s->x,
                   s->t,           s->coarse,   s->coarse_r,
                   s->coarse_z,    s->u,        s->f,
                   s->r,           s->z,        s->p,
                   s->q,           s->diagonal, s->rim,
                   s->ghosts,      s->brim,     level->off_rest.value};
    free_variant(s, VARIANT_HELD);
    free_variant(s, VARIANT_WHOLE);
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    free(s->loss.off); /* its places are those of next */
    free(s->loss.diag);
    uz_blocks_clear(&level->A);
    uz_blocks_clear(&s->next);
    neighbours_free(&s->near);
    memset(s, 0, sizeof *s);
}
