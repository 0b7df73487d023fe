#include "certificate/certificate.h"

#include "certificate/residual.h"
#include "certificate/row_move.h"
#include "certificate/row_relax.h"
#include "certificate/twofold.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_ROUNDS = 2, CLOSING_ROUNDS = 8, MAX_ROUNDS = 40 };

/* Twofold arithmetic carries about 100 bits: a violation of the constraints by 2^-80 of their size is rounding. */
#define NEGLIGIBLE       0x1p-80
#define TWOFOLD_ROUNDING 0x1p-98

/* Corrections up to this many times as large, squared, as the moves of single rows are taken. */
#define STRETCH 64.0

typedef struct {
    const uz_certify_input *in;
    const double *u;    /* d: the answer */
    uz_csc Nt;          /* d x m */
    double *weight;     /* d: W = diag(K)^-1 */
    double *size;       /* m: see size_rows */
    double *correction; /* d: v = u + correction */
    uz_row_move move;   /* m each */
    uz_residuals res;   /* d each */
    int64_t d, m;
} certifier;

static double norm2(const double *x, int64_t n)
{
    double scale = 0.0, sum = 0.0;
    for (int64_t i = 0; i < n; i++)
        scale = fmax(scale, fabs(x[i]));
    for (int64_t i = 0; scale > 0.0 && i < n; i++)
        sum += (x[i] / scale) * (x[i] / scale);
    return scale * sqrt(sum);
}

static uz_status prepare(certifier *c, const uz_certify_input *in, uz_error *err)
{
    memset(c, 0, sizeof *c);
    c->in = in;
    c->d = in->K->rows;
    c->m = in->N->rows;
    c->weight = uz_alloc(c->d, sizeof(double));
    c->size = uz_alloc_zero(c->m, sizeof(double));
    c->correction = uz_alloc_zero(c->d, sizeof(double));
    double **room[] = {&c->res.e, &c->res.e_u, &c->res.Ku, &c->res.Kc};
    bool ok = true;
    for (int k = 0; k < 4; k++)
        ok = (*room[k] = uz_alloc(c->d, sizeof(double))) && ok;
    ok = uz_row_move_init(&c->move, c->d, c->m) && ok;
    if (!ok || !c->weight || !c->size || !c->correction)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)c->d);
    for (int64_t j = 0; j < c->d; j++) {
        int64_t first = in->K->ptr[j];
        bool diagonal = first < in->K->ptr[j + 1] && in->K->idx[first] == j && in->K->val[first] > 0.0;
        c->weight[j] = diagonal ? 1.0 / in->K->val[first] : 1.0;
    }
    return uz_csc_transpose(&c->Nt, in->N, err);
}

static void release(certifier *c)
{
    uz_csc_clear(&c->Nt);
    free(c->weight);
    free(c->size);
    free(c->correction);
    uz_row_move_clear(&c->move);
    free(c->res.e);
    free(c->res.e_u);
    free(c->res.Ku);
    free(c->res.Kc);
}

/* g_i(u + c) */
static double corrected_gap(const certifier *c, int64_t i)
{
    return uz_gap_of_row(&c->Nt, i, c->in->h, c->u, c->correction);
}

/* Closing a gap of g costs about g^2 / compliance in the bound, leaving it open costs -2 r g. */
static bool worth_closing(const certifier *c, const double *r, int64_t i, double gap)
{
    return r[i] < 0.0 && gap <= -2.0 * r[i] * uz_row_compliance(&c->Nt, i, c->weight);
}

/* What the rounding of a gap is relative to: the terms that it is the difference of. Row by row: a wide gap, or a row
 * of large coefficients, must not excuse the penetration of another row. */
static void size_rows(const certifier *c, const double *u)
{
    for (int64_t i = 0; i < c->m; i++) {
        c->size[i] = fabs(c->in->h[i]);
        for (int64_t k = c->Nt.ptr[i]; k < c->Nt.ptr[i + 1]; k++)
            c->size[i] += fabs(c->Nt.val[k] * u[c->Nt.idx[k]]);
    }
}

/* What the rounding of the correction, a vector of doubles, may do to the gap of row i. */
static double gap_rounding(const certifier *c, int64_t i)
{
    double sum = 0.0;
    for (int64_t k = c->Nt.ptr[i]; k < c->Nt.ptr[i + 1]; k++)
        sum += fabs(c->Nt.val[k] * c->correction[c->Nt.idx[k]]);
    return 4.0 * DBL_EPSILON * sum;
}

/* The rows to move in this round and by how much: target_i is the gap to take away and a little more, so that the
 * correction's own rounding leaves the gap open; 0 for rows left alone. Returns the worst violation, relative to the
 * size of its row. */
static double choose_rows(const certifier *c, const double *r, bool closing)
{
    double worst = 0.0;
    for (int64_t i = 0; i < c->m; i++) {
        double gap = corrected_gap(c, i);
        bool close = closing && worth_closing(c, r, i, fabs(gap));
        c->move.in[i] = close || gap < 0.0;
        c->move.target[i] = c->move.in[i] ? gap - gap_rounding(c, i) : 0.0;
        worst = isnan(gap) ? INFINITY : gap < 0.0 ? fmax(worst, -gap / c->size[i]) : worst;
    }
    return worst;
}

/* Rounds of equations from round `first` on: until CLOSING_ROUNDS gaps are closed, later penetrating rows are only
 * lifted. Each round starts from gaps in twofold precision, so what rounding left is moved by the next. True when no
 * gap of u + c is negative by more than the rounding of twofold arithmetic. */
static bool move_rows(certifier *c, const double *r, int first, int last)
{
    for (int round = first; round < last; round++) {
        double worst = choose_rows(c, r, round < CLOSING_ROUNDS);
        if (round >= LEAST_ROUNDS && worst <= NEGLIGIBLE)
            return true;
        uz_row_move_solve(&c->move, c->correction, &c->Nt, c->weight);
    }
    return choose_rows(c, r, false) <= NEGLIGIBLE;
}

/* Squared in the norm of W^-1: the moves that would close the chosen rows one by one, added up. */
static double sum_of_moves(const certifier *c)
{
    double sum = 0.0;
    for (int64_t i = 0; i < c->m; i++)
        if (c->move.in[i] && c->move.target[i] != 0.0)
            sum += c->move.target[i] / uz_row_compliance(&c->Nt, i, c->weight) * c->move.target[i];
    return sum;
}

static double correction_size(const certifier *c)
{
    double sum = 0.0;
    for (int64_t j = 0; j < c->d; j++)
        sum += c->correction[j] / c->weight[j] * c->correction[j];
    return sum;
}

/* Fills the correction. Rows that nearly depend on each other can't all be closed as equations, or only by a correction
 * far larger than the gaps: then they are relaxed one by one, which is slower where rows share dofs. */
static bool make_feasible(certifier *c, const double *r)
{
    uz_row_relax relax = {&c->Nt, c->weight, r, c->in->h, c->u, c->move.x, c->correction};
    size_rows(c, c->u);
    choose_rows(c, r, true);
    double expected = STRETCH * sum_of_moves(c);
    bool feasible = move_rows(c, r, 0, CLOSING_ROUNDS);
    if (feasible && correction_size(c) <= expected)
        return true;
    uz_row_relax_solve(&relax);
    if (move_rows(c, r, CLOSING_ROUNDS, MAX_ROUNDS))
        return true;
    memset(c->correction, 0, (size_t)c->d * sizeof *c->correction);
    return feasible && move_rows(c, r, 0, CLOSING_ROUNDS);
}

/* Paper, section 4. */
static void residuals(const certifier *c, uz_certificate *out, const double *r, const double *g, double positive_part)
{
    double e2 = 0.0, e4 = 0.0;
    for (int64_t i = 0; i < c->m; i++) {
        e2 = hypot(e2, fmin(g[i], 0.0));
        e4 = hypot(e4, g[i] * r[i]);
    }
    uz_residual *a = &out->residual;
    a->e1 = norm2(c->res.e_u, c->d);
    a->e2 = e2;
    a->e3 = positive_part;
    a->e4 = e4;
    a->total = hypot(hypot(a->e1, a->e2), hypot(a->e3, a->e4));
}

static double ratio(double value, double scale)
{
    if (value == 0.0)
        return 0.0;
    return scale > 0.0 ? value / scale : INFINITY;
}

/* Force by ||p|| (by the reactions where there is no load), length by the size of h and N u, energy by |psi|. */
static void scale_residuals(const certifier *c, uz_certificate *out, const double *r, const double *g)
{
    double h = norm2(c->in->h, c->m), Nu = 0.0, force = norm2(c->in->p, c->d);
    for (int64_t i = 0; i < c->m; i++)
        Nu = hypot(Nu, c->in->h[i] - g[i]);
    if (force == 0.0)
        force = norm2(r, c->m);
    const uz_residual *a = &out->residual;
    uz_residual *b = &out->relative_residual;
    b->e1 = ratio(a->e1, force);
    b->e2 = ratio(a->e2, fmax(h, Nu));
    b->e3 = ratio(a->e3, force);
    b->e4 = ratio(a->e4, fabs(out->energy_dual));
    b->total = hypot(hypot(b->e1, b->e2), hypot(b->e3, b->e4));
}

/* e'K^-1 e from the norm of K^-1 where that is good enough. */
static bool bound_cheaply(const certifier *c, double *square, const double *u)
{
    double weighted = 0.0, energy = 0.0;
    if (!isfinite(c->in->inverse_bound))
        return false;
    for (int64_t j = 0; j < c->d; j++) {
        weighted += c->res.e[j] * c->weight[j] * c->res.e[j];
        energy += u[j] * c->res.Ku[j];
    }
    *square = c->in->inverse_bound * weighted;
    return *square <= c->in->sharp * c->in->sharp * energy;
}

/* How much the factor's rounding may falsify e'K^-1 e, relative. The factor is that of K + E with |E_ij| within d eps,
 * in practice sqrt(d) eps, of the root of K_ii K_jj; so with w = K^-1 e the error is w'E w to first order, against e'w:
 * sqrt(d) eps times the `spread` sum K_ii w_i^2 / e'w. Measured on random matrices conditioned up to 1e14: at most half
 * of that, where an estimate of the condition from the factor's diagonal is short by up to 3e5. */
static double doubt(const certifier *c, double spread)
{
    return DBL_EPSILON * sqrt((double)c->d) * (8.0 * spread + 1.0 / fmax(c->in->rcond, DBL_MIN));
}

/* The spread is at most the largest eigenvalue of diag(K)^1/2 K^-1 diag(K)^1/2, for which the factor's diagonal gives 1
 * / rcond: short by up to 3e5 where it was measured. Good enough wherever the doubt that follows is harmless, which
 * saves half a solve. */
#define HARMLESS 1e-2

static double assumed_spread(const certifier *c)
{
    return 1e6 / fmax(c->in->rcond, DBL_MIN);
}

/* From w = K^-1 e, which took the place of e. */
static double spread_of_solution(const certifier *c, double square)
{
    double weighted = 0.0;
    for (int64_t j = 0; j < c->d; j++)
        weighted += c->res.e[j] / c->weight[j] * c->res.e[j];
    return square > 0.0 ? weighted / square : 0.0;
}

/* What the rounding of twofold sums may hide of e, in the norm of K^-1: it matters only where rounding hit u* by
 * chance. */
static double twofold_noise(const certifier *c, const double *u, double spread)
{
    double sum = 0.0;
    for (int64_t j = 0; j < c->d; j++) {
        double force = fabs(c->res.Ku[j]) + fabs(c->in->p[j]);
        sum += u[j] / c->weight[j] * u[j] + force * c->weight[j] * force;
    }
    return TWOFOLD_ROUNDING * sqrt((1.0 + spread) * sum);
}

/* ||v - u_r||_K^2 = e'K^-1 e, enlarged by what the factor's own rounding may hide; and ||c||_K. e is lost. */
static uz_status distances(certifier *c, double *square, double *correction_norm, const double *u, uz_error *err)
{
    double energy = 0.0, spread = c->in->inverse_bound;
    bool measured = !bound_cheaply(c, square, u), exact = doubt(c, assumed_spread(c)) > HARMLESS;
    for (int64_t j = 0; j < c->d; j++)
        energy += c->correction[j] * c->res.Kc[j];
    uz_status status = UZ_OK;
    if (measured) {
        status = c->in->inverse_norm(c->in->ctx, square, c->res.e, exact, err);
        spread = exact ? spread_of_solution(c, *square) : assumed_spread(c);
    }
    double falsified = doubt(c, spread);
    double norm = sqrt(*square);
    if (norm > 0.0)
        norm = falsified < 0.5 ? norm / (1.0 - falsified) + twofold_noise(c, u, spread) : INFINITY;
    *square = norm * norm;
    *correction_norm = isnan(energy) ? INFINITY : sqrt(fmax(0.0, energy));
    return status;
}

/* pi(v) = pi(u) + c'(K u - p) + 1/2 c'K c: that of the feasible v, so that it is an upper bound on the minimum. */
static void energies(const certifier *c, uz_certificate *out, const double *u)
{
    double stiffness = 0.0, load = 0.0, change = 0.0;
    for (int64_t j = 0; j < c->d; j++) {
        stiffness += u[j] * c->res.Ku[j];
        load += u[j] * c->in->p[j];
        change += c->correction[j] * (c->res.Ku[j] - c->in->p[j] + 0.5 * c->res.Kc[j]);
    }
    out->energy_norm = sqrt(fmax(0.0, stiffness));
    out->energy_primal = 0.5 * stiffness - load + change;
}

/* The error over ||u*||_K, which is at least ||v||_K minus the error. */
static double relative_to_exact(double error, double norm)
{
    if (error == 0.0)
        return 0.0;
    return norm > error ? error / (norm - error) : INFINITY;
}

/* Below this energy the squares of its rounding errors leave the range of double, and a bound would be zero for
 * nothing. Above it they keep all of the digits that matter. */
#define ENERGY_LEAST 0x1p-850

static bool has_underflown(const certifier *c, const uz_certificate *out, const double *u, double square)
{
    bool anything = false;
    for (int64_t j = 0; j < c->d && !anything; j++)
        anything = u[j] != 0.0 || c->correction[j] != 0.0 || c->res.e_u[j] != 0.0;
    return anything && fmax(out->energy_norm * out->energy_norm, 0x1p106 * square) < ENERGY_LEAST;
}

static uz_status measure(certifier *c, uz_certificate *out, const double *u, const double *r, double *g,
                         double positive_part, uz_error *err)
{
    double square = INFINITY, correction_norm = INFINITY, complementarity = 0.0;
    for (int64_t i = 0; i < c->m; i++)
        g[i] = uz_gap_of_row(&c->Nt, i, c->in->h, u, NULL);
    c->u = u;
    bool feasible = make_feasible(c, r);
    uz_status status = uz_equilibrium_residual(&c->res, c->in->K, c->in->N, c->in->p, u, c->correction, r, err);
    if (status == UZ_OK && feasible)
        status = distances(c, &square, &correction_norm, u, err);
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < c->m; i++)
        complementarity -= r[i] * fabs(corrected_gap(c, i));
    energies(c, out, u);
    out->gap = feasible && !has_underflown(c, out, u, square) ? 0.5 * square + complementarity : INFINITY;
    if (isnan(out->gap)) /* overflow on the way */
        out->gap = INFINITY;
    out->energy_dual = out->energy_primal - out->gap;
    out->absolute_error = sqrt(2.0 * out->gap) + correction_norm;
    out->relative_error = relative_to_exact(out->absolute_error, out->energy_norm);
    residuals(c, out, r, g, positive_part);
    scale_residuals(c, out, r, g);
    return UZ_OK;
}

uz_status uz_certify(uz_certificate *out, double *r, double *g, const double *u, const uz_certify_input *input,
                     uz_error *err)
{
    certifier c;
    double positive_part = 0.0;
    memset(out, 0, sizeof *out);
    uz_status status = prepare(&c, input, err);
    for (int64_t i = 0; status == UZ_OK && i < c.m; i++) {
        positive_part = hypot(positive_part, fmax(r[i], 0.0));
        r[i] = fmin(r[i], 0.0);
    }
    if (status == UZ_OK)
        status = measure(&c, out, u, r, g, positive_part, err);
    release(&c);
    return status;
}
