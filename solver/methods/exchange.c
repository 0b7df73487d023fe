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

/* Gaps are made again from s after each row that joins, which is exact to rounding where rows nearly depend on each
 * other. Where that takes more than so many entries they are carried along for some rows, as long as what is pressed
 * penetrates by so many times more than what counts as closed. */
enum { CARRIED = 16, FEW_ENTRIES = 1 << 15 };
#define CLEARLY 1e6

enum { FIRST_ROOM = 16, PASSES = 2, CIRCLES = 20, CHUNK = 64, ABREAST = 4 };

struct uz_exchange {
    const uz_law *law;
    uz_dual_load *load;
    const uz_stop *stop;
    uz_exchange_side side;
    int64_t m, count, room;
    int64_t *rows;       /* room: the rows in contact, in the order of L */
    int64_t *place;      /* room: where their columns of M stand, a permutation of 0 .. count - 1 */
    double **chunk;      /* room / CHUNK + 1: columns, CHUNK of them together, m each; NULL: not needed yet */
    double *L;           /* room x room, the leading count x count block: M_AA = L L' */
    double *l, *w;       /* room: L^-1 M_Aq and M_AA^-1 M_Aq for the row q that is pressed */
    double *by_place;    /* room: weights of columns, each at its place */
    double *s, *g;       /* m: the reactions are base + s, so that s has digits of its own; gaps */
    double *depth;       /* m: how far the rows penetrate */
    double *size;        /* m: what the rounding of g_i is in proportion to */
    double *open;        /* m: g for s = 0 */
    double *base;        /* m: 0 for rows not in contact */
    const double *given; /* m: the caller's base, or NULL */
    double *incoming;    /* m: M_q */
    double compliance;   /* of q while the rows in contact are held */
    bool *barred;        /* m: in contact, or can't be */
    bool *asked;         /* m: rows to begin with */
    int64_t taken;       /* of these the first so many have been looked at */
    bool undecided;
    int64_t steps, carried;
    double work; /* entries of matrices passed so far */
};

static bool is_small(const uz_exchange *x)
{
    return x->count * x->m < FEW_ENTRIES;
}

static double *column(const uz_exchange *x, int64_t k)
{
    return x->chunk[x->place[k] / CHUNK] + x->place[k] % CHUNK * x->m;
}

/* Columns of L moved between two questions: the pages of the new room are made on the way. */
enum { MOVED = 16 };

/* Twice the room. Where it had to stop the old one stays, and that is no error. */
static uz_status grow(uz_exchange *x, uz_error *err)
{
    int64_t room = x->room ? 2 * x->room : FIRST_ROOM;
    int64_t *rows = uz_alloc(room, sizeof *rows), *place = uz_alloc(room, sizeof *place);
    double **chunk = uz_alloc_zero(room / CHUNK + 1, sizeof *chunk), *L = uz_alloc(room * room, sizeof *L);
    double *l = uz_alloc(room, sizeof *l), *w = uz_alloc(room, sizeof *w), *by_place = uz_alloc(room, sizeof *by_place);
    bool got = rows && place && chunk && L && l && w && by_place, ok = got;
    for (int64_t k = 0; ok && k < x->count; k++) {
        if (k % MOVED == MOVED - 1 && uz_stop_is_due(x->stop)) {
            ok = false;
            break;
        }
        memcpy(L + k * room, x->L + k * x->room, (size_t)x->count * sizeof *L);
    }
    if (ok && x->room > 0) {
        const size_t n = (size_t)x->count;
        memcpy(rows, x->rows, n * sizeof *rows);
        memcpy(place, x->place, n * sizeof *place);
        memcpy(l, x->l, n * sizeof *l);
        memcpy(w, x->w, n * sizeof *w);
        memcpy(chunk, x->chunk, (size_t)(x->room / CHUNK + 1) * sizeof *chunk);
    }
    uz_free_all(ok ? (void *)x->rows : rows, ok ? (void *)x->place : place, ok ? x->L : L, ok ? x->l : l,
                ok ? (void *)x->chunk : chunk, ok ? x->by_place : by_place, ok ? x->w : w);
    if (ok) {
        x->rows = rows;
        x->place = place;
        x->chunk = chunk;
        x->L = L;
        x->l = l;
        x->w = w;
        x->by_place = by_place;
        x->room = room;
    }
    return got ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows in contact", (long long)x->count);
}

void uz_exchange_free(uz_exchange *x)
{
    if (!x)
        return;
    for (int64_t k = 0; x->chunk && k <= x->room / CHUNK; k++)
        free(x->chunk[k]);
    uz_free_all(x->rows, x->place, x->chunk, x->L, x->l, x->w, x->by_place, x->s, x->g, x->depth, x->size, x->open,
                x->incoming, x->base, x->barred, x->asked);
    free(x);
}

/* incoming = M_q. */
static uz_status press(uz_exchange *x, int64_t q, uz_error *err)
{
    bool can;
    x->work += uz_dual_load_column_work(x->load);
    return x->side == UZ_EXCHANGE_GAPS ? uz_dual_load_inverse_column(x->load, &can, x->incoming, q, err)
                                       : uz_dual_load_column(x->load, x->incoming, q, err);
}

/* With the rows in contact held: w, how they yield when q is pressed, and what compliance q has left. */
static void yield_to(uz_exchange *x, int64_t q)
{
    for (int64_t k = 0; k < x->count; k++)
        x->l[k] = x->incoming[x->rows[k]];
    uz_trsv_lower(x->count, x->L, x->room, x->l, false);
    memcpy(x->w, x->l, (size_t)x->count * sizeof *x->w);
    uz_trsv_lower(x->count, x->L, x->room, x->w, true);
    x->compliance = x->incoming[q] - uz_dot(x->count, x->l, x->l);
    x->work += (double)x->count * (double)x->count;
}

/* What is left of the compliance is that of n_q - N_A'w: where rows in contact nearly depend on each other w is large,
 * and the rounding of D stands beside (sqrt(D_qq) + sum |w_k| sqrt(D_kk))^2. */
static bool depends(const uz_exchange *x, int64_t q)
{
    double size = sqrt(x->incoming[q]);
    for (int64_t k = 0; k < x->count; k++)
        size += fabs(x->w[k]) * sqrt(column(x, k)[x->rows[k]]);
    return !(x->compliance > fmax(UZ_DEPENDENT_ROW * x->incoming[q], 4.0 * DBL_EPSILON * size * size));
}

/* q, pressed last and independent, joins the rows in contact, unless it had to stop before there was room for it. */
static uz_status join(uz_exchange *x, int64_t q, uz_error *err)
{
    uz_status status = x->count == x->room ? grow(x, err) : UZ_OK;
    if (status != UZ_OK || x->count == x->room)
        return status;
    double **chunk = &x->chunk[x->count / CHUNK];
    if (!*chunk && !(*chunk = uz_alloc(CHUNK * x->m, sizeof **chunk)))
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows in contact", (long long)x->count);
    for (int64_t k = 0; k < x->count; k++)
        x->L[x->count + k * x->room] = x->l[k];
    x->L[x->count + x->count * x->room] = sqrt(x->compliance);
    x->rows[x->count] = q;
    x->place[x->count] = x->count;
    memcpy(column(x, x->count), x->incoming, (size_t)x->m * sizeof(double));
    x->count++;
    x->barred[q] = true;
    x->steps++;
    return UZ_OK;
}

/* Row i, with this column of M, has no reaction any more. */
static void forget_base(uz_exchange *x, int64_t i, const double *of_i)
{
    if (x->base[i] != 0.0)
        for (int64_t k = 0; k < x->m; k++)
            x->open[k] += of_i[k] * x->base[i];
    x->base[i] = x->s[i] = 0.0;
}

/* The rows in contact but for the k-th: L without its row, and rotations that make it triangular again (Golub and Van
 * Loan, Matrix Computations, 6.5). */
static void let_go(uz_exchange *x, int64_t k)
{
    int64_t last = x->count - 1, ld = x->room;
    x->barred[x->rows[k]] = false;
    forget_base(x, x->rows[k], column(x, k));
    /* the column at the last place moves to the place that is free */
    for (int64_t i = 0; i <= last; i++)
        if (x->place[i] == last && i != k) {
            memcpy(column(x, k), column(x, i), (size_t)x->m * sizeof(double));
            x->place[i] = x->place[k];
        }
    for (int64_t i = k; i < last; i++) {
        x->rows[i] = x->rows[i + 1];
        x->place[i] = x->place[i + 1];
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
static double reaction(const uz_exchange *x, int64_t k)
{
    return x->base[x->rows[k]] + x->s[x->rows[k]];
}

/* g -= M w for weights w (count) by place; size (m, NULL: not wanted) += |M| |w|. Several columns in one pass of g: the
 * columns come from memory, once. */
static void subtract_columns(uz_exchange *x, double *g, double *size, const double *w)
{
    const int64_t m = x->m;
    for (int64_t at = 0; at < x->count; at += ABREAST) {
        const double *c = x->chunk[at / CHUNK] + at % CHUNK * m;
        double v[ABREAST];
        for (int64_t k = 0; k < ABREAST; k++)
            v[k] = at + k < x->count ? w[at + k] : 0.0;
        const double *a[ABREAST];
        for (int64_t k = 0; k < ABREAST; k++)
            a[k] = at + k < x->count ? c + k * m : c;
        for (int64_t i = 0; i < m; i++)
            g[i] -= (a[0][i] * v[0] + a[1][i] * v[1]) + (a[2][i] * v[2] + a[3][i] * v[3]);
        for (int64_t i = 0; size && i < m; i++)
            size[i] += (fabs(a[0][i] * v[0]) + fabs(a[1][i] * v[1])) + (fabs(a[2][i] * v[2]) + fabs(a[3][i] * v[3]));
    }
    x->work += (double)x->count * (double)m;
}

/* g = open - M s, and its size. */
static void measure(uz_exchange *x)
{
    const double *h = x->load->h;
    for (int64_t i = 0; i < x->m; i++) {
        x->g[i] = x->open[i];
        x->size[i] = (x->side == UZ_EXCHANGE_GAPS ? 0.0 : fabs(h[i])) + fabs(x->open[i]);
    }
    for (int64_t k = 0; is_small(x) && k < x->count; k++) {
        const double s = x->s[x->rows[k]], *of_k = column(x, k);
        for (int64_t i = 0; i < x->m; i++) {
            const double term = of_k[i] * s;
            x->g[i] -= term;
            x->size[i] += fabs(term);
        }
    }
    if (is_small(x))
        return;
    for (int64_t k = 0; k < x->count; k++)
        x->by_place[x->place[k]] = x->s[x->rows[k]];
    subtract_columns(x, x->g, x->size, x->by_place);
}

/* s for the rows in contact, without those that pull. */
static void settle(uz_exchange *x)
{
    for (bool pulls = true; pulls && !uz_stop_is_due(x->stop);) {
        pulls = false;
        measure(x);
        for (int pass = 0; pass < PASSES && !uz_stop_is_due(x->stop); pass++) {
            /* s_A += M_AA^-1 g_A closes the gaps of the rows in contact. */
            for (int64_t k = 0; k < x->count; k++)
                x->w[k] = x->g[x->rows[k]];
            uz_potrs_lower(x->count, x->L, x->room, x->w);
            for (int64_t k = 0; k < x->count; k++)
                x->s[x->rows[k]] += x->w[k];
            measure(x);
        }
        for (int64_t k = x->count - 1; k >= 0 && !uz_stop_is_due(x->stop); k--) {
            const double of_row = reaction(x, k);
            if (!x->law->kind->admissible(x->law, &of_row, 1)) {
                let_go(x, k);
                pulls = true;
            }
        }
    }
}

/* Where q depends on rows in contact, N'w = n_q: what rounding leaves of a w_k that is zero is no way out. */
#define PULL_NOISE 1e-10

/* s_q -= step, and the rows in contact yield. */
static void advance(uz_exchange *x, int64_t q, double step)
{
    const double own = x->g[q] + step * fmax(0.0, x->compliance);
    x->s[q] -= step;
    for (int64_t k = 0; k < x->count; k++) {
        x->s[x->rows[k]] += step * x->w[k];
        x->by_place[x->place[k]] = step * x->w[k];
    }
    if (!is_small(x)) {
        uz_axpy(x->m, step, x->incoming, x->g);
        subtract_columns(x, x->g, NULL, x->by_place);
    }
    x->g[q] = own;
}

/* Presses q until it joins the rows in contact, or can't. */
static uz_status admit(uz_exchange *x, int64_t q, bool *likely, double *ray, uz_error *err)
{
    const uz_csc *N = &x->load->dual->N;
    uz_status status = press(x, q, err);
    while (status == UZ_OK && !uz_stop_is_due(x->stop)) {
        yield_to(x, q);
        bool dependent = depends(x, q);
        double step = INFINITY;
        x->law->kind->penetration(x->law, &x->depth[q], &x->g[q], 1);
        if (!dependent)
            step = x->depth[q] / x->compliance;
        /* the row in contact whose reaction vanishes first, after a push of `step`; -1: none does */
        int64_t gone = -1;
        double least = 0.0;
        for (int64_t k = 0; dependent && k < x->count; k++)
            least = fmax(least, PULL_NOISE * fabs(x->w[k]));
        for (int64_t k = 0; k < x->count; k++) {
            double reach = INFINITY, r = reaction(x, k);
            if (x->w[k] > least)
                x->law->kind->reach(x->law, &reach, &r, &x->w[k], 1);
            if (reach < step || (gone < 0 && isfinite(reach) && reach <= step)) {
                step = reach;
                gone = k;
            }
        }
        if (gone < 0 && !dependent) {
            advance(x, q, step);
            return join(x, q, err);
        }
        if (gone < 0) {
            x->s[q] = 0.0;
            x->barred[q] = x->undecided = true;
            x->carried = CARRIED; /* the rows in contact have moved for it */
            if (x->side == UZ_EXCHANGE_GAPS)
                return UZ_OK;
            /* the direction in which q is pressed for ever: are the rows likely to contradict along it? */
            memset(ray, 0, (size_t)x->m * sizeof *ray);
            ray[q] = -1.0;
            for (int64_t k = 0; k < x->count; k++)
                ray[x->rows[k]] = x->w[k];
            x->law->kind->project(x->law, ray, x->m);
            status = uz_ray_project(ray, N, err);
            *likely = status == UZ_OK && uz_ray_is_likely(ray, N, x->load->h, x->load->g0, x->size);
            return status;
        }
        advance(x, q, step);
        let_go(x, gone);
    }
    return status;
}

uz_status uz_exchange_create(uz_exchange **out, uz_exchange_side side, const bool *active, const double *base,
                             const uz_law *law, uz_dual_load *load, const uz_stop *stop, uz_error *err)
{
    const int64_t m = load->dual->m;
    uz_exchange *x = uz_alloc_zero(1, sizeof *x);
    *out = NULL;
    if (!x)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to exchange %lld rows", (long long)m);
    *x = (uz_exchange){.law = law, .load = load, .stop = stop, .side = side, .m = m, .given = base, .carried = CARRIED};
    double **vectors[] = {&x->depth, &x->size, &x->incoming, &x->open, &x->base, &x->s, &x->g};
    bool ok = (x->barred = uz_alloc_zero(m, sizeof(bool))) && (x->asked = uz_alloc_zero(m, sizeof(bool))), can = true;
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
        ok = (*vectors[k] = uz_alloc_zero(m, sizeof(double))) && ok;
    uz_status status =
        ok ? grow(x, err) : uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to exchange %lld rows", (long long)m);
    if (status == UZ_OK && active)
        memcpy(x->asked, active, (size_t)m * sizeof *active);
    if (status == UZ_OK && base)
        memcpy(x->base, base, (size_t)m * sizeof *base);
    if (status == UZ_OK && side == UZ_EXCHANGE_GAPS) {
        /* All rows held: what holds them is what a row that is let go pulls with. */
        uz_active_end end = UZ_ACTIVE_UNSOLVED;
        status = m > 0 ? uz_dual_load_inverse_column(load, &can, x->incoming, 0, err) : UZ_OK;
        for (int64_t i = 0; i < m; i++)
            x->barred[i] = true;
        if (status == UZ_OK && can)
            status = uz_dual_load_solve_active(load, &end, x->open, x->g, x->barred, err);
        can = can && end == UZ_ACTIVE_SOLVED;
        for (int64_t i = 0; i < m; i++) {
            can = can && x->barred[i];
            x->barred[i] = false;
            x->open[i] = -x->open[i];
        }
    } else if (status == UZ_OK) {
        memcpy(x->open, load->g0, (size_t)m * sizeof *x->open);
    }
    if (status == UZ_OK && can)
        *out = x;
    else
        uz_exchange_free(x);
    return status;
}

uz_status uz_exchange_continue(uz_exchange_end *end, uz_exchange *x, int64_t most_steps, double most_work, double *ray,
                               uz_error *err)
{
    bool likely = false;
    *end = UZ_EXCHANGE_STOPPED;
    uz_status status = UZ_OK;
    /* From the rows asked for: an independent part of them. Where it had to stop, or has done its work for now, what
     * has come together. */
    for (; status == UZ_OK && x->taken < x->m && x->work < most_work && !uz_stop_is_due(x->stop); x->taken++) {
        const int64_t i = x->taken;
        if (!x->asked[i] && x->base[i] == 0.0)
            continue;
        status = press(x, i, err);
        if (status != UZ_OK)
            break;
        if (x->asked[i])
            yield_to(x, i);
        if (x->asked[i] && !depends(x, i))
            status = join(x, i, err);
        else
            forget_base(x, i, x->incoming);
        x->steps = 0;
    }
    for (int64_t k = 0; status == UZ_OK && x->taken == x->m && x->steps < most_steps && x->work < most_work &&
                        k < CIRCLES * (x->m + 1);
         k++) {
        const bool made = x->carried >= CARRIED || is_small(x);
        if (made) {
            settle(x);
            x->carried = is_small(x) ? CARRIED : 0; /* the next row may make it large */
        }
        if (uz_stop_is_due(x->stop))
            break;
        /* the row that penetrates most, -1: none. Rows of N have a norm of about 1: gaps compare */
        int64_t q = -1;
        x->law->kind->penetration(x->law, x->depth, x->g, x->m);
        for (int64_t i = 0; i < x->m; i++)
            if (!x->barred[i] && x->depth[i] > NOISE * x->size[i] && (q < 0 || x->depth[i] > x->depth[q]))
                q = i;
        if (q < 0 && made) {
            *end = x->undecided ? UZ_EXCHANGE_UNDECIDED : UZ_EXCHANGE_SOLVED;
            break;
        }
        if (!made && (q < 0 || !(x->depth[q] > CLEARLY * NOISE * x->size[q]))) {
            x->carried = CARRIED;
            continue;
        }
        x->carried++;
        status = admit(x, q, &likely, ray, err);
        if (likely)
            *end = UZ_EXCHANGE_RAY;
        if (likely || uz_stop_is_due(x->stop))
            break;
    }
    return status;
}

double uz_exchange_work(const uz_exchange *x, int64_t *steps)
{
    *steps = x->steps;
    return x->work;
}

void uz_exchange_read(double *s, double *g, bool *active, uz_exchange *x)
{
    const bool gaps = x->side == UZ_EXCHANGE_GAPS;
    for (int64_t i = 0; i < x->m; i++)
        active[i] = gaps;
    for (int64_t k = 0; k < x->count; k++)
        active[x->rows[k]] = !gaps;
    if (gaps)
        return;
    measure(x);
    memcpy(g, x->g, (size_t)x->m * sizeof *g);
    for (int64_t i = 0; i < x->m; i++) { /* a row that was let go and joined again has all of its reaction in s */
        const double given = x->given ? x->given[i] : 0.0;
        s[i] = active[i] ? x->s[i] + (x->base[i] - given) : -given;
    }
}

uz_status uz_exchange_run(uz_exchange_end *end, int64_t *steps, double *s, double *g, double *ray, bool *active,
                          const double *base, const uz_law *law, uz_dual_load *load, const uz_stop *stop, uz_error *err)
{
    uz_exchange *x = NULL;
    const int64_t most = *steps;
    *end = UZ_EXCHANGE_STOPPED;
    *steps = 0;
    uz_status status = uz_exchange_create(&x, UZ_EXCHANGE_REACTIONS, active, base, law, load, stop, err);
    if (status == UZ_OK)
        status = uz_exchange_continue(end, x, most, INFINITY, ray, err);
    if (status == UZ_OK) {
        uz_exchange_read(s, g, active, x);
        *steps = x->steps;
    }
    uz_exchange_free(x);
    return status;
}
