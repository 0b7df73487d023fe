#include "certificate/row_exact.h"

#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/row_factor.h"
#include "core/alloc.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Exchanges of all wrong rows; of them that may fail to bring their number down; solutions with one factor, each from
 * gaps taken anew; changed rows after which all are sorted again; single exchanges for each row. */
enum { MASS_ROUNDS = 40, PATIENCE = 3, PASSES = 2, MANY = 64, CIRCLES = 4 };

/* Multiplications that a bound is worth. */
#define MOST_WORK 2e9

/* A push this far below its bound, relative to the largest push, is rounding. It does no harm: the row is closed. */
#define PULL_NOISE 1e-13

typedef struct {
    const uz_row_exact *in;
    int64_t d, m;
    uz_row_factor f;
    double *least; /* m: bounds on the pushes */
    double *g;     /* m: gaps of u + c, less `room` times what the rounding of c may do to them */
    double *slack; /* m: a penetration of this much is none */
    double room;   /* 1; 0 where rows leave none between them */
    double *t;     /* m, work */
    int64_t *list; /* m, work */
    bool *barred;  /* m: depends on rows in contact that can't yield */
    bool failed;   /* no memory, or too much work */
} exact;

static void take_gaps(exact *x)
{
    const uz_csc *Nt = x->in->Nt;
    for (int64_t i = 0; i < x->m; i++) {
        double sum = 0.0;
        for (int64_t e = Nt->ptr[i]; e < Nt->ptr[i + 1]; e++)
            sum += fabs(Nt->val[e] * x->in->c[Nt->idx[e]]);
        const double rounding = 4.0 * DBL_EPSILON * x->room * sum;
        x->g[i] = uz_gap_of_row(Nt, i, x->in->h, x->in->u, x->in->c) - rounding;
        x->slack[i] = x->in->negligible * x->in->size[i] + 0.75 * rounding;
    }
    x->f.work += 16.0 * (double)Nt->ptr[x->m];
    x->failed = x->failed || x->f.work > MOST_WORK;
}

/* y_i += change, and c with it. */
static void push(exact *x, int64_t i, double change)
{
    const uz_csc *Nt = x->in->Nt;
    x->in->y[i] += change;
    for (int64_t e = Nt->ptr[i]; e < Nt->ptr[i + 1]; e++)
        x->in->c[Nt->idx[e]] -= change * x->in->weight[Nt->idx[e]] * Nt->val[e];
}

static bool penetrates(const exact *x, int64_t i)
{
    return !(x->g[i] >= -x->slack[i]);
}

/* Closes the gaps of the rows in contact. */
static void close_gaps(exact *x)
{
    for (int64_t k = 0; k < x->f.count; k++)
        x->t[k] = -x->g[x->f.row[k]];
    uz_row_factor_solve(&x->f, x->t);
    for (int64_t k = 0; k < x->f.count; k++)
        push(x, x->f.row[k], x->t[k]);
    take_gaps(x);
}

/* Does row i, in contact, pull u by more than its reaction is worth? */
static bool pulls(const exact *x, int64_t i, double largest)
{
    return x->in->y[i] < x->least[i] - PULL_NOISE * largest / sqrt(x->f.size[i]);
}

static double largest_push(const exact *x)
{
    double largest = 0.0;
    for (int64_t k = 0; k < x->f.count; k++)
        largest = fmax(largest, fabs(x->in->y[x->f.row[k]]) * sqrt(x->f.size[x->f.row[k]]));
    return largest;
}

/* The rows of the list (n) join, but for those that depend on others. */
static void join_all(exact *x, const int64_t *list, int64_t n)
{
    for (int64_t k = 0; k < n && !x->failed; k++) {
        uz_row_factor_press(&x->f, list[k], false);
        if (!x->f.dependent)
            x->failed = !uz_row_factor_join(&x->f, list[k]) || x->f.work > MOST_WORK;
    }
}

/* Rows in contact that pull are let go. Returns how many. */
static int64_t let_go(exact *x)
{
    const double largest = largest_push(x);
    const int64_t count = x->f.count;
    int64_t first = count, stay = 0;
    for (int64_t k = 0; k < count; k++) {
        const int64_t i = x->f.row[k];
        if (pulls(x, i, largest)) {
            first = k < first ? k : first;
            push(x, i, x->least[i] - x->in->y[i]);
        } else if (k > first) {
            x->list[stay++] = i;
        }
    }
    if (first < count) {
        uz_row_factor_keep(&x->f, first);
        join_all(x, x->list, stay);
        memset(x->barred, 0, (size_t)x->m * sizeof *x->barred); /* what stood in their way may yield now */
        take_gaps(x);
    }
    return count - first - stay;
}

/* All wrong rows change places, until none is left or their number no longer comes down. */
static void exchange_many(exact *x)
{
    int64_t fewest = x->m + 1, patience = PATIENCE;
    for (int round = 0; round < MASS_ROUNDS && patience > 0 && !x->failed; round++) {
        for (int pass = 0; pass < PASSES; pass++)
            close_gaps(x);
        const double largest = largest_push(x);
        int64_t n = 0, wrong = 0;
        for (int64_t k = 0; k < x->f.count; k++) {
            const int64_t i = x->f.row[k];
            if (pulls(x, i, largest))
                push(x, i, x->least[i] - x->in->y[i]);
            else
                x->list[n++] = i;
        }
        wrong = x->f.count - n;
        for (int64_t i = 0; i < x->m; i++)
            if (x->f.place[i] < 0 && penetrates(x, i)) {
                x->list[n++] = i;
                wrong++;
            }
        if (wrong == 0)
            return;
        patience = wrong < fewest ? PATIENCE : patience - 1;
        fewest = wrong < fewest ? wrong : fewest;
        uz_row_factor_keep(&x->f, 0);
        uz_row_factor_order(&x->f, x->list, n);
        join_all(x, x->list, n);
        take_gaps(x);
    }
}

/* Presses q, or eases it where it is open, until it joins the rows in contact, is at its bound or can't be pressed. By
 * `step` that moves u along `left`, and the rows in contact push less by w step. */
static void admit(exact *x, int64_t q)
{
    const double sign = penetrates(x, q) ? 1.0 : -1.0;
    while (!x->failed) {
        uz_row_factor_press(&x->f, q, true);
        const double bound = sign > 0.0 ? INFINITY : x->in->y[q] - x->least[q];
        double step = fmin(x->f.dependent ? INFINITY : fmax(0.0, -sign * x->g[q]) / x->f.compliance, bound),
               noise = 0.0;
        bool bounded = step == bound;
        int64_t gone = -1;
        for (int64_t k = 0; x->f.dependent && k < x->f.count; k++)
            noise = fmax(noise, PULL_NOISE * fabs(x->f.w[k]) * sqrt(x->f.size[x->f.row[k]]));
        for (int64_t k = 0; k < x->f.count; k++) {
            const int64_t i = x->f.row[k];
            const double reach = fmax(0.0, x->in->y[i] - x->least[i]) / (sign * x->f.w[k]);
            if (sign * x->f.w[k] * sqrt(x->f.size[i]) > noise && reach < step) {
                step = reach;
                gone = k;
            }
        }
        if (!(step < INFINITY)) {
            x->barred[q] = true;
            return;
        }
        x->in->y[q] += sign * step;
        for (int64_t k = 0; k < x->f.count; k++)
            x->in->y[x->f.row[k]] -= sign * step * x->f.w[k];
        for (int64_t s = 0; !x->f.dependent && s < x->f.n_left; s++)
            x->in->c[x->f.at[s]] -= sign * step * x->in->weight[x->f.at[s]] * x->f.left[x->f.at[s]];
        x->g[q] += x->f.dependent ? 0.0 : sign * step * x->f.compliance;
        if (gone < 0) {
            x->failed = !bounded && !uz_row_factor_join(&x->f, q);
            return;
        }
        int64_t stay = 0;
        for (int64_t k = gone + 1; k < x->f.count; k++)
            x->list[stay++] = x->f.row[k];
        uz_row_factor_keep(&x->f, gone);
        join_all(x, x->list, stay);
        x->failed = x->failed || x->f.work > MOST_WORK;
    }
}

/* One row after the other. Is none left that penetrates? */
static bool exchange_single(exact *x)
{
    for (int64_t changed = 1; !x->failed && changed < CIRCLES * (x->m + MANY); changed++) {
        do {
            for (int pass = 0; pass < PASSES; pass++)
                close_gaps(x);
        } while (let_go(x) > 0 && !x->failed);
        /* the row that penetrates most, by the displacement that would lift it; where none does, an open one that
         * pushes more than its bound */
        int64_t deep = -1, wide = -1;
        double deepest = 0.0, widest = 0.0;
        const double noise = PULL_NOISE * largest_push(x);
        for (int64_t i = 0; i < x->m; i++) {
            const double size = sqrt(x->f.size[i]), depth = -x->g[i] / size;
            if (x->f.place[i] >= 0 || !(size > 0.0))
                continue;
            if (!x->barred[i] && penetrates(x, i) && !(depth <= deepest)) {
                deepest = depth;
                deep = i;
            }
            if (x->g[i] > x->slack[i] && x->in->y[i] > x->least[i] + noise / size && -depth > widest) {
                widest = -depth;
                wide = i;
            }
        }
        const int64_t q = deep >= 0 ? deep : wide;
        if (q < 0) {
            bool open = !x->failed;
            for (int64_t i = 0; open && i < x->m; i++)
                open = !penetrates(x, i);
            return open;
        }
        if (changed % MANY == 0) {
            const int64_t n = x->f.count;
            memcpy(x->list, x->f.row, (size_t)n * sizeof *x->list);
            uz_row_factor_keep(&x->f, 0);
            uz_row_factor_order(&x->f, x->list, n);
            join_all(x, x->list, n);
        }
        admit(x, q);
    }
    return false;
}

bool uz_row_exact_solve(const uz_row_exact *problem)
{
    const uz_csc *Nt = problem->Nt;
    exact x = {.in = problem, .d = Nt->rows, .m = Nt->cols, .room = 1.0};
    bool found = false;
    x.least = uz_alloc_zero(x.m, sizeof *x.least);
    x.g = uz_alloc(x.m, sizeof *x.g);
    x.slack = uz_alloc(x.m, sizeof *x.slack);
    x.t = uz_alloc(x.m, sizeof *x.t);
    x.list = uz_alloc(x.m, sizeof *x.list);
    x.barred = uz_alloc_zero(x.m, sizeof *x.barred);
    if (uz_row_factor_init(&x.f, Nt, problem->weight) && x.least && x.g && x.slack && x.t && x.list && x.barred) {
        memset(problem->c, 0, (size_t)x.d * sizeof *problem->c);
        memset(problem->y, 0, (size_t)x.m * sizeof *problem->y);
        take_gaps(&x);
        int64_t n = 0;
        for (int64_t i = 0; i < x.m; i++) {
            /* closing a gap costs about its square over the compliance, leaving it open costs -2 r g */
            const bool close = uz_row_presses(problem->r[i]) && fabs(x.g[i]) <= -2.0 * problem->r[i] * x.f.size[i];
            x.least[i] = close ? problem->r[i] : 0.0;
            if (x.f.size[i] > 0.0 && (close || penetrates(&x, i)))
                x.list[n++] = i;
        }
        uz_row_factor_order(&x.f, x.list, n);
        join_all(&x, x.list, n);
        exchange_many(&x);
        found = exchange_single(&x);
        if (!found && !x.failed) { /* rows that leave no room between them */
            x.room = 0.0;
            memset(x.barred, 0, (size_t)x.m * sizeof *x.barred);
            take_gaps(&x);
            found = exchange_single(&x);
        }
    }
    uz_row_factor_clear(&x.f);
    uz_free_all(x.least, x.g, x.slack, x.t, x.list, x.barred);
    return found;
}
