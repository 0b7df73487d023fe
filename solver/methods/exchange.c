#include "methods/exchange.h"

#include "certificate/infeasible.h"
#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "dual/ray.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A gap below this, relative to the terms that it is the difference of, is closed. */
#define NOISE (64.0 * DBL_EPSILON)

enum { FIRST_ROOM = 16, PASSES = 2, CIRCLES = 20 };

typedef struct {
    const uz_law *law;
    uz_dual_load *load;
    int64_t m, count, room;
    int64_t *rows;     /* room: the rows in contact, in the order of L */
    double **column;   /* room: their columns of D, m each */
    double *L;         /* room x room, the leading count x count block: D_AA = L L' */
    double *l, *w;     /* room: L^-1 D_Aq and D_AA^-1 D_Aq for the row q that is pressed */
    double *s, *g;     /* m, the caller's: the reactions are base + s, so that s has digits of its own */
    double *depth;     /* m: how far the rows penetrate */
    double *size;      /* m: what the rounding of g_i is in proportion to */
    double *open;      /* m: g for s = 0 */
    double *base;      /* m: 0 for rows not in contact */
    double *incoming;  /* m: D_q */
    double compliance; /* of q while the rows in contact are held */
    bool *barred;      /* m: in contact, or can't be */
    bool undecided;
    int64_t steps, most;
    const uz_stop *stop;
} exchange;

/* Columns of L moved between two questions: the pages of the new room are made on the way. */
enum { MOVED = 16 };

/* Twice the room. Where it had to stop the old one stays, and that is no error. */
static uz_status grow(exchange *x, uz_error *err)
{
    int64_t room = x->room ? 2 * x->room : FIRST_ROOM;
    int64_t *rows = uz_alloc(room, sizeof *rows);
    double **column = uz_alloc(room, sizeof *column), *L = uz_alloc(room * room, sizeof *L);
    double *l = uz_alloc(room, sizeof *l), *w = uz_alloc(room, sizeof *w);
    bool got = rows && column && L && l && w, ok = got;
    for (int64_t k = 0; ok && k < x->count; k++) {
        if (k % MOVED == MOVED - 1 && uz_stop_is_due(x->stop)) {
            ok = false;
            break;
        }
        rows[k] = x->rows[k];
        column[k] = x->column[k];
        l[k] = x->l[k];
        w[k] = x->w[k];
        memcpy(L + k * room, x->L + k * x->room, (size_t)x->count * sizeof *L);
    }
    void *unused[] = {ok ? (void *)x->rows : rows, ok ? (void *)x->column : column, ok ? x->L : L, ok ? x->l : l,
                      ok ? x->w : w};
    for (size_t k = 0; k < sizeof unused / sizeof unused[0]; k++)
        free(unused[k]);
    if (ok) {
        x->rows = rows;
        x->column = column;
        x->L = L;
        x->l = l;
        x->w = w;
        x->room = room;
    }
    return got ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows in contact", (long long)x->count);
}

static uz_status allocate(exchange *x, int64_t m, uz_error *err)
{
    x->m = m;
    x->depth = uz_alloc(m, sizeof *x->depth);
    x->size = uz_alloc(m, sizeof *x->size);
    x->incoming = uz_alloc(m, sizeof *x->incoming);
    x->open = uz_alloc(m, sizeof *x->open);
    x->base = uz_alloc_zero(m, sizeof *x->base);
    x->barred = uz_alloc_zero(m, sizeof *x->barred);
    if (x->depth && x->size && x->open && x->base && x->incoming && x->barred)
        return grow(x, err);
    return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to exchange %lld rows", (long long)m);
}

static void release(exchange *x)
{
    for (int64_t k = 0; k < x->count; k++)
        free(x->column[k]);
    free(x->rows);
    free(x->column);
    free(x->L);
    free(x->l);
    free(x->w);
    free(x->depth);
    free(x->size);
    free(x->open);
    free(x->base);
    free(x->incoming);
    free(x->barred);
}

/* incoming = D_q. */
static uz_status press(exchange *x, int64_t q, uz_error *err)
{
    return uz_dual_load_column(x->load, x->incoming, q, err);
}

/* With the rows in contact held: w, how they yield when q is pressed, and what compliance q has left. */
static void yield_to(exchange *x, int64_t q)
{
    for (int64_t k = 0; k < x->count; k++)
        x->l[k] = x->incoming[x->rows[k]];
    uz_trsv_leading(x->count, x->room, x->L, x->l, false);
    memcpy(x->w, x->l, (size_t)x->count * sizeof *x->w);
    uz_trsv_leading(x->count, x->room, x->L, x->w, true);
    x->compliance = x->incoming[q] - uz_dot(x->count, x->l, x->l);
}

/* What is left of the compliance is that of n_q - N_A'w: where rows in contact nearly depend on each other w is large,
 * and the rounding of D stands beside (sqrt(D_qq) + sum |w_k| sqrt(D_kk))^2. */
static bool depends(const exchange *x, int64_t q)
{
    double size = sqrt(x->incoming[q]);
    for (int64_t k = 0; k < x->count; k++)
        size += fabs(x->w[k]) * sqrt(x->column[k][x->rows[k]]);
    return !(x->compliance > fmax(UZ_DEPENDENT_ROW * x->incoming[q], 4.0 * DBL_EPSILON * size * size));
}

/* q, pressed last and independent, joins the rows in contact, unless it had to stop before there was room for it. */
static uz_status join(exchange *x, int64_t q, uz_error *err)
{
    uz_status status = x->count == x->room ? grow(x, err) : UZ_OK;
    if (status != UZ_OK || x->count == x->room)
        return status;
    double *column = uz_alloc(x->m, sizeof *column);
    if (!column)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows in contact", (long long)x->count);
    memcpy(column, x->incoming, (size_t)x->m * sizeof *column);
    for (int64_t k = 0; k < x->count; k++)
        x->L[x->count + k * x->room] = x->l[k];
    x->L[x->count + x->count * x->room] = sqrt(x->compliance);
    x->rows[x->count] = q;
    x->column[x->count++] = column;
    x->barred[q] = true;
    x->steps++;
    return UZ_OK;
}

/* Row i, with this column of D, has no reaction any more. */
static void forget_base(exchange *x, int64_t i, const double *column)
{
    if (x->base[i] != 0.0)
        for (int64_t k = 0; k < x->m; k++)
            x->open[k] += column[k] * x->base[i];
    x->base[i] = x->s[i] = 0.0;
}

/* The rows in contact but for the k-th: L without its row, and rotations that make it triangular again (Golub and Van
 * Loan, Matrix Computations, 6.5). */
static void let_go(exchange *x, int64_t k)
{
    int64_t last = x->count - 1, ld = x->room;
    x->barred[x->rows[k]] = false;
    forget_base(x, x->rows[k], x->column[k]);
    free(x->column[k]);
    for (int64_t i = k; i < last; i++) {
        x->rows[i] = x->rows[i + 1];
        x->column[i] = x->column[i + 1];
    }
    for (int64_t j = 0; j <= last; j++)
        for (int64_t i = j > k ? j - 1 : k; i < last; i++)
            x->L[i + j * ld] = x->L[i + 1 + j * ld];
    for (int64_t j = k; j < last; j++) {
        double *a = x->L + j * ld, *b = a + ld, length = hypot(a[j], b[j]), c = a[j] / length, s = b[j] / length;
        for (int64_t i = j; i < last; i++) {
            double t = c * a[i] + s * b[i];
            b[i] = c * b[i] - s * a[i];
            a[i] = t;
        }
    }
    x->count = last;
    x->steps++;
}

/* The reaction of the k-th row in contact. */
static double reaction(const exchange *x, int64_t k)
{
    return x->base[x->rows[k]] + x->s[x->rows[k]];
}

static bool is_admissible(const exchange *x, double reaction_of_row)
{
    return x->law->kind->admissible(x->law, &reaction_of_row, 1);
}

/* How far row q penetrates. */
static double penetration(const exchange *x, int64_t q)
{
    double depth;
    x->law->kind->penetration(x->law, &depth, &x->g[q], 1);
    return depth;
}

/* g = open - D s, and its size. */
static void measure(exchange *x)
{
    const double *h = x->load->h;
    for (int64_t i = 0; i < x->m; i++) {
        x->g[i] = x->open[i];
        x->size[i] = fabs(h[i]) + fabs(x->open[i]);
    }
    for (int64_t k = 0; k < x->count; k++) {
        double s = x->s[x->rows[k]];
        for (int64_t i = 0; i < x->m; i++) {
            double term = x->column[k][i] * s;
            x->g[i] -= term;
            x->size[i] += fabs(term);
        }
    }
}

/* s_A += D_AA^-1 g_A, which closes the gaps of the rows in contact. */
static void close_gaps(exchange *x)
{
    for (int64_t k = 0; k < x->count; k++)
        x->w[k] = x->g[x->rows[k]];
    uz_potrs_leading(x->count, x->room, x->L, x->w);
    for (int64_t k = 0; k < x->count; k++)
        x->s[x->rows[k]] += x->w[k];
    measure(x);
}

/* s for the rows in contact, without those that pull. */
static void settle(exchange *x)
{
    for (bool pulls = true; pulls && !uz_stop_is_due(x->stop);) {
        pulls = false;
        measure(x);
        for (int pass = 0; pass < PASSES && !uz_stop_is_due(x->stop); pass++)
            close_gaps(x);
        for (int64_t k = x->count - 1; k >= 0 && !uz_stop_is_due(x->stop); k--)
            if (!is_admissible(x, reaction(x, k))) {
                let_go(x, k);
                pulls = true;
            }
    }
}

/* From the rows asked for: an independent part of them. Where it had to stop, what has come together. */
static uz_status begin(exchange *x, const bool *active, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; status == UZ_OK && i < x->m; i++) {
        if (!active[i] && x->base[i] == 0.0)
            continue;
        if (uz_stop_is_due(x->stop))
            break;
        status = press(x, i, err);
        if (status != UZ_OK)
            return status;
        if (active[i])
            yield_to(x, i);
        if (active[i] && !depends(x, i))
            status = join(x, i, err);
        else
            forget_base(x, i, x->incoming);
    }
    x->steps = 0;
    return status;
}

/* The row that penetrates most, -1: none. Rows of N have a norm of about 1: gaps compare. */
static int64_t choose(const exchange *x)
{
    int64_t q = -1;
    x->law->kind->penetration(x->law, x->depth, x->g, x->m);
    for (int64_t i = 0; i < x->m; i++)
        if (!x->barred[i] && x->depth[i] > NOISE * x->size[i] && (q < 0 || x->depth[i] > x->depth[q]))
            q = i;
    return q;
}

/* Where q depends on rows in contact, N'w = n_q: what rounding leaves of a w_k that is zero is no way out. */
#define PULL_NOISE 1e-10

/* Of the rows in contact the one whose reaction vanishes first, after a push of *step; -1: none does. */
static int64_t first_to_go(const exchange *x, bool dependent, double *step)
{
    int64_t first = -1;
    double least = 0.0;
    for (int64_t k = 0; dependent && k < x->count; k++)
        least = fmax(least, PULL_NOISE * fabs(x->w[k]));
    for (int64_t k = 0; k < x->count; k++) {
        double reach = INFINITY, r = reaction(x, k);
        if (x->w[k] > least)
            x->law->kind->reach(x->law, &reach, &r, &x->w[k], 1);
        if (reach < *step || (first < 0 && isfinite(reach) && reach <= *step)) {
            *step = reach;
            first = k;
        }
    }
    return first;
}

/* s_q -= step, and the rows in contact yield. */
static void advance(exchange *x, int64_t q, double step)
{
    x->s[q] -= step;
    for (int64_t k = 0; k < x->count; k++)
        x->s[x->rows[k]] += step * x->w[k];
    x->g[q] += step * fmax(0.0, x->compliance);
}

/* The direction in which q is pressed for ever: are the rows likely to contradict along it? */
static uz_status look_at_ray(bool *likely, double *ray, exchange *x, int64_t q, uz_error *err)
{
    const uz_csc *N = &x->load->dual->N;
    const double *h = x->load->h;
    memset(ray, 0, (size_t)x->m * sizeof *ray);
    ray[q] = -1.0;
    for (int64_t k = 0; k < x->count; k++)
        ray[x->rows[k]] = x->w[k];
    x->law->kind->project(x->law, ray, x->m);
    uz_status status = uz_ray_project(ray, &x->load->dual->N, err);
    double length = status == UZ_OK ? uz_gap_length(N, h, x->load->g0, x->size) : 0.0;
    *likely = status == UZ_OK && uz_ray_is_likely(ray, N, h, length);
    return status;
}

/* Presses q until it joins the rows in contact, or can't. */
static uz_status admit(exchange *x, int64_t q, bool *likely, double *ray, uz_error *err)
{
    uz_status status = press(x, q, err);
    while (status == UZ_OK && !uz_stop_is_due(x->stop)) {
        yield_to(x, q);
        bool dependent = depends(x, q);
        double step = dependent ? INFINITY : penetration(x, q) / x->compliance;
        int64_t gone = first_to_go(x, dependent, &step);
        if (gone < 0 && !dependent) {
            advance(x, q, step);
            return join(x, q, err);
        }
        if (gone < 0) {
            x->s[q] = 0.0;
            x->barred[q] = x->undecided = true;
            return look_at_ray(likely, ray, x, q, err);
        }
        advance(x, q, step);
        let_go(x, gone);
    }
    return status;
}

static uz_status run(exchange *x, uz_exchange_end *end, double *ray, uz_error *err)
{
    bool likely = false;
    for (int64_t k = 0; x->steps < x->most && k < CIRCLES * (x->m + 1); k++) {
        settle(x);
        if (uz_stop_is_due(x->stop))
            return UZ_OK;
        int64_t q = choose(x);
        if (q < 0) {
            *end = x->undecided ? UZ_EXCHANGE_UNDECIDED : UZ_EXCHANGE_SOLVED;
            return UZ_OK;
        }
        uz_status status = admit(x, q, &likely, ray, err);
        if (likely)
            *end = UZ_EXCHANGE_RAY;
        if (status != UZ_OK || likely || uz_stop_is_due(x->stop))
            return status;
    }
    return UZ_OK;
}

uz_status uz_exchange_run(uz_exchange_end *end, int64_t *steps, double *s, double *g, double *ray, bool *active,
                          const double *base, const uz_law *law, uz_dual_load *load, const uz_stop *stop, uz_error *err)
{
    int64_t m = load->dual->N.rows;
    exchange x = {.law = law, .load = load, .s = s, .g = g, .stop = stop, .most = *steps};
    *end = UZ_EXCHANGE_STOPPED;
    uz_status status = allocate(&x, m, err);
    if (status == UZ_OK) {
        memcpy(x.open, load->g0, (size_t)m * sizeof *x.open);
        if (base)
            memcpy(x.base, base, (size_t)m * sizeof *x.base);
        memset(s, 0, (size_t)m * sizeof *s);
    }
    if (status == UZ_OK)
        status = begin(&x, active, err);
    if (status == UZ_OK)
        status = run(&x, end, ray, err);
    *steps = x.steps;
    memset(active, 0, (size_t)m * sizeof *active);
    if (status == UZ_OK)
        measure(&x);
    for (int64_t k = 0; status == UZ_OK && k < x.count; k++)
        active[x.rows[k]] = true;
    for (int64_t i = 0; base && i < m; i++)
        s[i] = active[i] ? s[i] : -base[i];
    release(&x);
    return status;
}
