#include "linalg/pieces.h"

#include "core/aside.h"
#include "linalg/blas.h"

#include <math.h>

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

/* A sum of which each piece has its own number. */
typedef struct {
    double (*of)(int64_t n, const double *x, const double *y);
    const double *x, *y;
    int64_t n, size; /* of a piece */
    double piece[PIECES_MOST];
} sum;

/* Of the pieces from `begin` to `end`. */
static void find_pieces(void *ctx, int64_t begin, int64_t end)
{
    sum *s = ctx;
    for (int64_t k = begin; k < end; k++) {
        const int64_t from = k * s->size, n = from + s->size < s->n ? s->size : s->n - from;
        s->piece[k] = s->of(n, s->x + from, s->y + from);
    }
}

/* Fills s; returns how many pieces there are. */
static int64_t find_all(sum *s, double (*of)(int64_t n, const double *x, const double *y), int64_t n, const double *x,
                        const double *y)
{
    s->of = of;
    s->x = x;
    s->y = y;
    s->n = n;
    s->size = s->n / PIECES_MOST < LEAST ? LEAST : s->n / PIECES_MOST + 1;
    const int64_t pieces = (s->n + s->size - 1) / s->size;
    divide(find_pieces, s, pieces, pieces);
    return pieces;
}

double uz_long_dot(int64_t n, const double *x, const double *y)
{
    sum s;
    const int64_t pieces = find_all(&s, uz_dot, n, x, y);
    double all = 0.0;
    for (int64_t k = 0; k < pieces; k++)
        all += s.piece[k];
    return all;
}

static double find_largest(int64_t n, const double *x, const double *y)
{
    double most = 0.0;
    (void)y;
    for (int64_t j = 0; j < n; j++)
        most = fabs(x[j]) > most ? fabs(x[j]) : most;
    return most;
}

double uz_long_max(int64_t n, const double *x)
{
    sum s;
    const int64_t pieces = find_all(&s, find_largest, n, x, x);
    double most = 0.0;
    for (int64_t k = 0; k < pieces; k++)
        most = fmax(most, s.piece[k]);
    return most;
}
