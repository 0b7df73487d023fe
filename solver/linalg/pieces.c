#include "linalg/pieces.h"

#include "core/aside.h"
#include "core/cpu.h"
#include "linalg/blas.h"

#include <math.h>
#include <string.h>

/* Numbers of a piece at least, some 5 microseconds; pieces of a sum at most. */
enum { LEAST = 16384, PIECES_MOST = 512 };

/* A loop over 0..n, in so many parts. */
typedef struct {
    void (*run)(void *ctx, int64_t begin, int64_t end);
    void *ctx;
    int64_t n;
    int parts;
} loop;

static void run_part(void *ctx, int part)
{
    const loop *l = ctx;
    l->run(l->ctx, l->n * part / l->parts, l->n * (part + 1) / l->parts);
}

/* By as many threads as there are, but in no more than `most` parts. */
static void divide(void (*run)(void *ctx, int64_t begin, int64_t end), void *ctx, int64_t n, int64_t most)
{
    const int threads = most < 2 ? 1 : uz_aside_threads();
    loop l = {run, ctx, n, most < threads ? (int)most : threads};
    if (threads < 2)
        run(ctx, 0, n);
    else
        uz_aside_share(run_part, &l, l.parts);
}

void uz_by_pieces(void (*run)(void *ctx, int64_t begin, int64_t end), void *ctx, int64_t n)
{
    divide(run, ctx, n, n / LEAST);
}

typedef struct {
    double *to;
    const double *from;
} copying;

static void copy(void *ctx, int64_t begin, int64_t end)
{
    const copying *x = ctx;
    memcpy(x->to + begin, x->from + begin, (size_t)(end - begin) * sizeof *x->to);
}

void uz_long_copy(int64_t n, double *to, const double *from)
{
    uz_by_pieces(copy, &(copying){to, from}, n);
}

/* -------------------------------------------------------------------- columns */

/* Parts that columns are in, where there are so many; columns that are looked at, then run. */
enum { COLUMN_PARTS = 4, COLUMNS_LEAST = 32768, COLUMNS_AT_ONCE = 512 };

typedef struct {
    void (*run)(void *ctx, int64_t begin, int64_t end);
    void *ctx;
    const uz_csc *A;
    int64_t first[COLUMN_PARTS]; /* of a part, column that has rows beyond it */
} column_loop;

static int64_t begin_of(const column_loop *l, int part)
{
    return l->A->cols * part / COLUMN_PARTS;
}

/* From `begin` on runs the columns that have rows from `border` on, or those that have none; returns the first of the
 * others. */
static int64_t run_columns(const column_loop *l, int64_t begin, int64_t end, int64_t border, bool beyond)
{
    const int64_t *ptr = l->A->ptr;
    const int32_t *idx = l->A->idx;
    int64_t from = begin, other = end;
    for (int64_t j = begin; j < end; j++) {
        if ((ptr[j + 1] > ptr[j] && idx[ptr[j + 1] - 1] >= border) == beyond)
            continue;
        if (j > from)
            l->run(l->ctx, from, j);
        from = j + 1;
        other = j < other ? j : other;
    }
    if (end > from)
        l->run(l->ctx, from, end);
    return other;
}

static void run_column_part(void *ctx, int part)
{
    column_loop *l = ctx;
    const int64_t end = begin_of(l, part + 1);
    l->first[part] = end;
    for (int64_t j = begin_of(l, part); j < end; j += COLUMNS_AT_ONCE) {
        const int64_t stop = end - j < COLUMNS_AT_ONCE ? end : j + COLUMNS_AT_ONCE,
                      beyond = run_columns(l, j, stop, end, false);
        l->first[part] = beyond < stop && beyond < l->first[part] ? beyond : l->first[part];
    }
}

void uz_by_columns(void (*run)(void *ctx, int64_t begin, int64_t end), void *ctx, const uz_csc *A)
{
    column_loop l = {.run = run, .ctx = ctx, .A = A};
    if (A->cols < COLUMNS_LEAST) {
        run(ctx, 0, A->cols);
        return;
    }
    uz_aside_share(run_column_part, &l, COLUMN_PARTS);
    for (int part = 0; part < COLUMN_PARTS; part++) {
        const int64_t end = begin_of(&l, part + 1);
        (void)run_columns(&l, l.first[part], end, end, true);
    }
}

/* ----------------------------------------------------------------------- sums */

/* What numbers from `begin` to `end` have. */
typedef double (*of_piece)(void *ctx, int64_t begin, int64_t end);

/* A sum of which each piece has its own number. */
typedef struct {
    of_piece of;
    void *ctx;
    int64_t n, size; /* of a piece */
    double piece[PIECES_MOST];
} sum;

/* Of the pieces from `begin` to `end`. */
static void find_pieces(void *ctx, int64_t begin, int64_t end)
{
    sum *s = ctx;
    for (int64_t k = begin; k < end; k++)
        s->piece[k] = s->of(s->ctx, k * s->size, (k + 1) * s->size < s->n ? (k + 1) * s->size : s->n);
}

/* Fills s; returns how many pieces there are. */
static int64_t find_all(sum *s, of_piece of, void *ctx, int64_t n)
{
    s->of = of;
    s->ctx = ctx;
    s->n = n;
    s->size = s->n / PIECES_MOST < LEAST ? LEAST : s->n / PIECES_MOST + 1;
    const int64_t pieces = (s->n + s->size - 1) / s->size;
    divide(find_pieces, s, pieces, pieces);
    return pieces;
}

double uz_sum_by_pieces(double (*of)(void *ctx, int64_t begin, int64_t end), void *ctx, int64_t n)
{
    sum s;
    const int64_t pieces = find_all(&s, of, ctx, n);
    double all = 0.0;
    for (int64_t k = 0; k < pieces; k++)
        all += s.piece[k];
    return all;
}

typedef struct {
    const double *x, *y;
} vectors;

static double find_dot(void *ctx, int64_t begin, int64_t end)
{
    const vectors *v = ctx;
    return uz_dot(end - begin, v->x + begin, v->y + begin);
}

double uz_long_dot(int64_t n, const double *x, const double *y)
{
    return uz_sum_by_pieces(find_dot, &(vectors){x, y}, n);
}

typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four __attribute__((vector_size(32)));
enum { SUMS = 4 };

typedef struct {
    const float *x, *y;
} single_vectors;

static double find_dot_single(void *ctx, int64_t begin, int64_t end)
{
    const single_vectors *v = ctx;
    const float *a = v->x, *b = v->y;
    four lanes[SUMS] = {{0.0}}; /* that wait for no other */
    int64_t j = begin;
    for (; j + 4 * SUMS <= end; j += 4 * SUMS)
        for (int s = 0; s < SUMS; s++)
            lanes[s] += __builtin_convertvector(*(const four_floats *)(a + j + 4 * s), four) *
                        __builtin_convertvector(*(const four_floats *)(b + j + 4 * s), four);
    const four all_lanes = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
    double all = (all_lanes[0] + all_lanes[1]) + (all_lanes[2] + all_lanes[3]);
    for (; j < end; j++)
        all += (double)a[j] * (double)b[j];
    return all;
}

double uz_long_dot_single(int64_t n, const float *x, const float *y)
{
    return uz_sum_by_pieces(find_dot_single, &(single_vectors){x, y}, n);
}

/* The largest |x_j|, or |x_j y_j|: comparisons that do not wait for the one before. */
UZ_INLINE double largest(const double *x, const double *y, int64_t n)
{
    enum { APART = 8 };
    double most[APART] = {0.0}, all = 0.0;
    int64_t j = 0;
    for (; j + APART <= n; j += APART)
#pragma GCC unroll 8
        for (int k = 0; k < APART; k++) {
            const double size = fabs(y ? x[j + k] * y[j + k] : x[j + k]);
            most[k] = size > most[k] ? size : most[k];
        }
    for (; j < n; j++) {
        const double size = fabs(y ? x[j] * y[j] : x[j]);
        all = size > all ? size : all;
    }
    for (int k = 0; k < APART; k++)
        all = most[k] > all ? most[k] : all;
    return all;
}

static double find_largest(void *ctx, int64_t begin, int64_t end)
{
    const vectors *v = ctx;
    return largest(v->x + begin, NULL, end - begin);
}

static double find_largest_product(void *ctx, int64_t begin, int64_t end)
{
    const vectors *v = ctx;
    return largest(v->x + begin, v->y + begin, end - begin);
}

static double find_most(of_piece of, int64_t n, const double *x, const double *y)
{
    sum s;
    const int64_t pieces = find_all(&s, of, &(vectors){x, y}, n);
    double most = 0.0;
    for (int64_t k = 0; k < pieces; k++)
        most = fmax(most, s.piece[k]);
    return most;
}

double uz_long_max(int64_t n, const double *x)
{
    return find_most(find_largest, n, x, x);
}

double uz_long_max_product(int64_t n, const double *x, const double *y)
{
    return find_most(find_largest_product, n, x, y);
}
