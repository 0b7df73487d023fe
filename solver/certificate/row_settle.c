#include "certificate/row_settle.h"

#include "certificate/residual.h"
#include "certificate/row_move.h"
#include "core/alloc.h"

#include <float.h>
#include <gmp.h>
#include <limits.h>
#include <math.h>

/* Rows that are moved together, and words multiplied in all: about a second. */
enum { MOST_TOGETHER = 32 };
static const double MOST_WORK = 2e7;

/* What a sum or product of rationals with as many words takes: it ends in a greatest common divisor. */
static double work_of(size_t words)
{
    return 20.0 + (double)words + 0.1 * (double)words * (double)words;
}

/* Upper bounds from sums of doubles. */
#define SURELY (1.0 + 0x1p-40)

typedef struct {
    uz_row_settle *in;
    int64_t d, m;
    uz_csc N;       /* m x d */
    double *sure;   /* m: u + c leaves at least this gap */
    mpq_t *delta;   /* d */
    double *moved;  /* d: >= |delta_j| */
    bool *near;     /* m: shares a dof with a row that is moved now */
    int64_t *list;  /* m: these */
    int64_t n_near; /* how many */
    /* the rows that are moved now, and how much each is pressed */
    int64_t count, row[MOST_TOGETHER];
    mpq_t y[MOST_TOGETHER], w[MOST_TOGETHER], A[MOST_TOGETHER][MOST_TOGETHER + 1];
    mpq_t a, b, gap, step, part, own; /* work */
    mpz_t sum, term;
    double work; /* left to spend */
} settle;

/* The gap of row i at the given point, without delta. */
static void take_gap_at(mpq_t gap, mpq_t term, const uz_row_settle *in, int64_t i)
{
    mpq_set_d(gap, in->h[i]);
    for (int64_t k = in->Nt->ptr[i]; k < in->Nt->ptr[i + 1]; k++) {
        mpq_set_d(term, in->Nt->val[k]);
        mpq_mul(term, term, in->at[in->Nt->idx[k]]);
        mpq_sub(gap, gap, term);
    }
}

/* N (u + c) - h of row i, without delta: a sum of integers times powers of two, which is an integer times the power of
 * two that is returned. */
static int add_up(mpz_t sum, mpz_t term, const uz_row_settle *in, int64_t i)
{
    const uz_csc *Nt = in->Nt;
    const int64_t first = Nt->ptr[i], n = 2 * (Nt->ptr[i + 1] - first) + 1;
    int least = INT_MAX;
    mpz_set_ui(sum, 0);
    for (int pass = 0; pass < 2; pass++)
        for (int64_t k = 0; k < n; k++) {
            int of_x, of_y;
            const double value = k == n - 1 ? -1.0 : Nt->val[first + k / 2];
            const double at = k == n - 1 ? in->h[i] : (k % 2 ? in->c : in->u)[Nt->idx[first + k / 2]];
            const double x = frexp(value, &of_x), y = frexp(at, &of_y);
            if (x == 0.0 || y == 0.0)
                continue;
            if (pass == 0) {
                least = of_x + of_y < least ? of_x + of_y : least;
                continue;
            }
            mpz_set_d(term, ldexp(x, DBL_MANT_DIG));
            mpz_mul_2exp(term, term, (mp_bitcnt_t)(of_x + of_y - least));
            const double digits = ldexp(y, DBL_MANT_DIG);
            if (digits < 0.0)
                mpz_submul_ui(sum, term, (unsigned long)-digits);
            else
                mpz_addmul_ui(sum, term, (unsigned long)digits);
        }
    return least < INT_MAX ? least - 2 * DBL_MANT_DIG : 0;
}

/* Is u + c, without delta, open at row i? */
static bool is_open(const uz_row_settle *in, int64_t i)
{
    if (in->at) {
        mpq_t gap, room;
        mpq_inits(gap, room, NULL);
        take_gap_at(gap, room, in, i);
        const bool open = mpq_sgn(gap) >= 0;
        mpq_clears(gap, room, NULL);
        return open;
    }
    mpz_t sum, term;
    mpz_inits(sum, term, NULL);
    add_up(sum, term, in, i);
    const bool open = mpz_sgn(sum) <= 0;
    mpz_clears(sum, term, NULL);
    return open;
}

/* s->gap: of row i at u + c + delta. A sum of rationals takes a greatest common divisor, which is left to those rows
 * and dofs that were moved. */
static void take_gap(settle *s, int64_t i)
{
    const uz_row_settle *in = s->in;
    if (in->at) {
        take_gap_at(s->gap, s->a, in, i);
    } else {
        const int exponent = add_up(s->sum, s->term, in, i);
        mpq_set_z(s->gap, s->sum);
        mpq_neg(s->gap, s->gap);
        if (exponent < 0)
            mpq_div_2exp(s->gap, s->gap, (mp_bitcnt_t)-exponent);
        else
            mpq_mul_2exp(s->gap, s->gap, (mp_bitcnt_t)exponent);
    }
    for (int64_t k = in->Nt->ptr[i]; k < in->Nt->ptr[i + 1]; k++) {
        const int64_t j = in->Nt->idx[k];
        if (mpq_sgn(s->delta[j]) != 0) {
            mpq_set_d(s->b, -in->Nt->val[k]);
            mpq_mul(s->b, s->b, s->delta[j]);
            mpq_add(s->gap, s->gap, s->b);
        }
        s->work -= work_of(mpz_size(mpq_denref(s->gap)));
    }
}

/* sum = n_i'W n_k */
static void couple(settle *s, mpq_t sum, int64_t i, int64_t k)
{
    const uz_csc *Nt = s->in->Nt;
    mpq_set_ui(sum, 0, 1);
    for (int64_t p = Nt->ptr[i], q = Nt->ptr[k]; p < Nt->ptr[i + 1] && q < Nt->ptr[k + 1];) {
        const int64_t j = Nt->idx[p], l = Nt->idx[q];
        if (j == l) {
            mpq_set_d(s->a, Nt->val[p]);
            mpq_set_d(s->b, Nt->val[q]);
            mpq_mul(s->a, s->a, s->b);
            mpq_set_d(s->b, s->in->weight[j]);
            mpq_mul(s->a, s->a, s->b);
            mpq_add(sum, sum, s->a);
            s->work -= 30.0;
        }
        p += j <= l;
        q += l <= j;
    }
}

/* delta += step W n_i, and the rows that this may reach. */
static void push(settle *s, int64_t i, const mpq_t step)
{
    const uz_csc *Nt = s->in->Nt;
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++) {
        const int64_t j = Nt->idx[k];
        mpq_set_d(s->a, Nt->val[k]);
        mpq_set_d(s->b, s->in->weight[j]);
        mpq_mul(s->a, s->a, s->b);
        mpq_mul(s->a, s->a, step);
        mpq_sub(s->delta[j], s->delta[j], s->a);
        s->moved[j] = SURELY * fabs(mpq_get_d(s->delta[j])) + DBL_MIN;
        s->work -= 10.0 + work_of(mpz_size(mpq_denref(s->delta[j])));
        for (int64_t q = s->N.ptr[j]; q < s->N.ptr[j + 1]; q++)
            if (!s->near[s->N.idx[q]]) {
                s->near[s->N.idx[q]] = true;
                s->list[s->n_near++] = s->N.idx[q];
            }
    }
}

/* w = (N_A W N_A')^-1 N_A W n_q for the rows A that are moved now, s->own = what q has left of its compliance. */
static void press(settle *s, int64_t q)
{
    const int64_t n = s->count;
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = 0; k < n; k++)
            couple(s, s->A[i][k], s->row[i], s->row[k]);
        couple(s, s->A[i][n], s->row[i], q);
    }
    couple(s, s->own, q, q);
    for (int64_t c = 0; c < n; c++) /* definite: the rows that are moved don't depend on each other */
        for (int64_t i = c + 1; i < n; i++) {
            mpq_div(s->part, s->A[i][c], s->A[c][c]);
            for (int64_t k = c; k <= n && mpq_sgn(s->part) != 0; k++) {
                mpq_mul(s->a, s->part, s->A[c][k]);
                mpq_sub(s->A[i][k], s->A[i][k], s->a);
                s->work -= work_of(mpz_size(mpq_numref(s->A[i][k])));
            }
        }
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t k = i + 1; k < n; k++) {
            mpq_mul(s->a, s->A[i][k], s->w[k]);
            mpq_sub(s->A[i][n], s->A[i][n], s->a);
        }
        mpq_div(s->w[i], s->A[i][n], s->A[i][i]);
    }
    for (int64_t i = 0; i < n; i++) {
        couple(s, s->part, s->row[i], q);
        mpq_mul(s->part, s->part, s->w[i]);
        mpq_sub(s->own, s->own, s->part);
    }
}

/* Presses q until its gap is closed; rows whose push vanishes on the way are let go. false: for ever, or too long. */
static bool admit(settle *s, int64_t q)
{
    mpq_t pressed;
    bool closed = false, fails = false;
    mpq_init(pressed);
    while (!closed && !fails) {
        int64_t gone = -1;
        press(s, q);
        take_gap(s, q);
        closed = mpq_sgn(s->own) > 0;
        if (closed) {
            mpq_div(s->step, s->gap, s->own);
            mpq_neg(s->step, s->step);
        }
        for (int64_t k = 0; k < s->count; k++) {
            if (mpq_sgn(s->w[k]) <= 0)
                continue;
            mpq_div(s->part, s->y[k], s->w[k]);
            if ((closed || gone >= 0) && mpq_cmp(s->part, s->step) >= 0)
                continue;
            mpq_set(s->step, s->part);
            gone = k;
            closed = false;
        }
        fails = (!closed && gone < 0) || s->count == MOST_TOGETHER || !(s->work > 0.0);
        if (fails) { /* also where the gap would close: there is no place for another row */
            closed = false;
            break;
        }
        mpq_add(pressed, pressed, s->step);
        push(s, q, s->step);
        for (int64_t k = 0; k < s->count; k++) {
            mpq_mul(s->part, s->step, s->w[k]);
            mpq_sub(s->y[k], s->y[k], s->part);
            mpq_neg(s->part, s->part);
            push(s, s->row[k], s->part);
        }
        if (gone >= 0) {
            s->count--;
            s->row[gone] = s->row[s->count];
            mpq_swap(s->y[gone], s->y[s->count]);
        }
    }
    if (closed) {
        s->row[s->count] = q;
        mpq_set(s->y[s->count++], pressed);
    }
    mpq_clear(pressed);
    return closed;
}

/* Of the rows around those that are moved one that penetrates most, as far as doubles tell; -1: none. */
static int64_t choose(settle *s)
{
    int64_t q = -1;
    double deepest = 0.0;
    for (int64_t n = 0; n < s->n_near && s->work > 0.0; n++) {
        const int64_t i = s->list[n];
        double reach = DBL_MIN;
        for (int64_t k = s->in->Nt->ptr[i]; k < s->in->Nt->ptr[i + 1]; k++)
            reach += fabs(s->in->Nt->val[k]) * s->moved[s->in->Nt->idx[k]];
        if (s->sure[i] >= SURELY * reach)
            continue;
        take_gap(s, i);
        if (mpq_sgn(s->gap) >= 0)
            continue;
        const double depth = -mpq_get_d(s->gap) / sqrt(uz_row_compliance(s->in->Nt, i, s->in->weight));
        if (q < 0 || depth > deepest) {
            deepest = depth;
            q = i;
        }
    }
    return q;
}

/* The rows of the list (n) penetrate. */
static bool move_rows(settle *s, const int64_t *wrong, int64_t n)
{
    bool settled = uz_csc_transpose(&s->N, s->in->Nt, NULL) == UZ_OK;
    s->delta = uz_alloc(s->d, sizeof *s->delta);
    s->moved = uz_alloc_zero(s->d, sizeof *s->moved);
    s->near = uz_alloc_zero(s->m, sizeof *s->near);
    s->list = uz_alloc(s->m, sizeof *s->list);
    settled = settled && s->delta && s->moved && s->near && s->list;
    for (int64_t j = 0; settled && j < s->d; j++)
        mpq_init(s->delta[j]);
    const bool made = settled;
    for (int k = 0; k < MOST_TOGETHER; k++) {
        mpq_inits(s->y[k], s->w[k], NULL);
        for (int l = 0; l <= MOST_TOGETHER; l++)
            mpq_init(s->A[k][l]);
    }
    mpq_inits(s->a, s->b, s->gap, s->step, s->part, s->own, NULL);
    mpz_inits(s->sum, s->term, NULL);
    /* with each row what that takes along; the rows moved before are like any other */
    for (int64_t k = 0; settled && k < n; k++) {
        s->count = s->n_near = 0;
        take_gap(s, wrong[k]);
        for (int64_t q = mpq_sgn(s->gap) < 0 ? wrong[k] : -1; q >= 0 && settled; q = settled ? choose(s) : -1)
            settled = admit(s, q);
        settled = settled && s->work > 0.0;
        for (int64_t i = 0; i < s->n_near; i++)
            s->near[s->list[i]] = false;
    }
    double length = 0.0;
    for (int64_t j = 0; settled && j < s->d; j++) {
        length += s->moved[j] / sqrt(s->in->weight[j]);
        if (s->in->at)
            mpq_add(s->in->at[j], s->in->at[j], s->delta[j]);
    }
    for (int64_t i = 0; settled && !s->in->at && i < s->m; i++) {
        take_gap(s, i);
        s->in->gap[i] = mpq_sgn(s->gap) > 0 ? SURELY * mpq_get_d(s->gap) + DBL_MIN : 0.0;
    }
    s->in->length = SURELY * length;
    for (int64_t j = 0; made && j < s->d; j++)
        mpq_clear(s->delta[j]);
    for (int k = 0; k < MOST_TOGETHER; k++) {
        mpq_clears(s->y[k], s->w[k], NULL);
        for (int l = 0; l <= MOST_TOGETHER; l++)
            mpq_clear(s->A[k][l]);
    }
    mpq_clears(s->a, s->b, s->gap, s->step, s->part, s->own, NULL);
    mpz_clears(s->sum, s->term, NULL);
    return settled;
}

bool uz_row_settle_solve(uz_row_settle *problem)
{
    settle s = {.in = problem,
                .d = problem->Nt->rows,
                .m = problem->Nt->cols,
                .work = problem->work > 0 ? problem->work : MOST_WORK};
    int64_t *wrong = uz_alloc(s.m, sizeof *wrong), n = 0;
    s.sure = uz_alloc(s.m, sizeof *s.sure);
    bool settled = wrong && s.sure;
    problem->length = 0.0;
    for (int64_t i = 0; settled && i < s.m; i++) {
        /* What is surely left of the gap of row i at u + c: Ogita, Rump and Oishi's bound on Dot2, and what underflow
         * may take. */
        double size = fabs(problem->h[i]), terms = 1.0;
        for (int64_t k = problem->Nt->ptr[i]; !problem->at && k < problem->Nt->ptr[i + 1]; k++) {
            const int64_t j = problem->Nt->idx[k];
            size += fabs(problem->Nt->val[k] * problem->u[j]) + fabs(problem->Nt->val[k] * problem->c[j]);
            terms += 2.0;
        }
        const double gap = problem->at ? -INFINITY : uz_gap_of_row(problem->Nt, i, problem->h, problem->u, problem->c);
        s.sure[i] = gap - (0x1p-51 * fabs(gap) + terms * (0x1p-104 * terms * size + 0x1p-1066));
        if (s.sure[i] >= 0.0)
            continue;
        settled = isfinite(problem->h[i]);
        for (int64_t k = problem->Nt->ptr[i]; settled && k < problem->Nt->ptr[i + 1]; k++) {
            const int64_t j = problem->Nt->idx[k];
            settled = (problem->at || (isfinite(problem->u[j]) && isfinite(problem->c[j]))) &&
                      isfinite(problem->weight[j]) && problem->weight[j] > 0.0;
        }
        if (settled && !is_open(problem, i))
            wrong[n++] = i;
    }
    if (settled && n > 0)
        settled = move_rows(&s, wrong, n);
    uz_free_all(wrong, s.sure, s.delta, s.moved, s.near, s.list);
    uz_csc_clear(&s.N);
    return settled;
}
