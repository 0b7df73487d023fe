#include "certificate/exact.h"

#include "certificate/bound.h"
#include "certificate/residual.h"
#include "certificate/row_settle.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Bits of roots and of what is added to them, and what more than covers their rounding. */
enum { BITS = 256 };
#define SURELY (1.0 + 0x1p-40)

typedef struct {
    const uz_certify_input *in;
    int64_t d, m;
    uz_csc Nt;                /* d x m */
    mpq_t *v, *Kv, *w, *Kw;   /* d: v, then u, and K times it; w = u - v */
    mpq_t *s, *g;             /* m: reactions, gaps of v */
    double *weight, *gap, *e; /* d, m, d */
    mpq_t energy, load;       /* v'Kv, v'p */
    mpq_t norm, apart, open;  /* u'Ku, ||u - v||_K^2, -s'g */
    mpq_t a, b;               /* work */
} exact;

static mpq_t *zeros(int64_t n)
{
    mpq_t *x = uz_alloc(n, sizeof *x);
    for (int64_t i = 0; x && i < n; i++)
        mpq_init(x[i]);
    return x;
}

static void clear(mpq_t *x, int64_t n)
{
    for (int64_t i = 0; x && i < n; i++)
        mpq_clear(x[i]);
    free(x);
}

/* y = K x; square = x'K x */
static void multiply(exact *c, mpq_t square, mpq_t *y, const mpq_t *x)
{
    const uz_csc *K = c->in->K;
    for (int64_t j = 0; j < c->d; j++)
        mpq_set_ui(y[j], 0, 1);
    for (int64_t j = 0; j < c->d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            const int64_t i = K->idx[k];
            mpq_set_d(c->a, K->val[k]);
            mpq_mul(c->b, c->a, x[j]);
            mpq_add(y[i], y[i], c->b);
            if (i == j)
                continue;
            mpq_mul(c->b, c->a, x[i]);
            mpq_add(y[j], y[j], c->b);
        }
    mpq_set_ui(square, 0, 1);
    for (int64_t j = 0; j < c->d; j++) {
        mpq_mul(c->b, x[j], y[j]);
        mpq_add(square, square, c->b);
    }
}

/* Gaps of v + delta in gap, those of v in g; false: no such delta is known. *length >= ||delta||_K. */
static bool settle(exact *c, double *length)
{
    uz_row_settle problem = {
        .Nt = &c->Nt, .weight = c->weight, .h = c->in->h, .at = (const mpq_t *)c->v, .gap = c->gap};
    if (!uz_row_settle_solve(&problem) || !isfinite(problem.length))
        return false;
    *length = problem.length;
    for (int64_t i = 0; i < c->m; i++) {
        if (*length > 0.0 && !isfinite(c->gap[i]))
            return false;
        mpq_set_d(c->g[i], c->in->h[i]);
        for (int64_t k = c->Nt.ptr[i]; k < c->Nt.ptr[i + 1]; k++) {
            mpq_set_d(c->a, c->Nt.val[k]);
            mpq_mul(c->a, c->a, c->v[c->Nt.idx[k]]);
            mpq_sub(c->g[i], c->g[i], c->a);
        }
    }
    return true;
}

/* square = e'K^-1 e for e = K v - p - N's. It is brought to where squares of doubles neither over- nor underflow. */
static uz_status take_distance(exact *c, mpf_t square, uz_error *err)
{
    const uz_csc *N = c->in->N;
    int64_t most = INT64_MIN;
    for (int64_t j = 0; j < c->d; j++) {
        mpq_set_d(c->b, c->in->p[j]);
        mpq_sub(c->Kv[j], c->Kv[j], c->b);
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            mpq_set_d(c->a, N->val[k]);
            mpq_mul(c->a, c->a, c->s[N->idx[k]]);
            mpq_sub(c->Kv[j], c->Kv[j], c->a);
        }
        const int64_t bits = (int64_t)mpz_sizeinbase(mpq_numref(c->Kv[j]), 2) -
                             (int64_t)mpz_sizeinbase(mpq_denref(c->Kv[j]), 2) + ilogb(c->weight[j]) / 2;
        most = mpq_sgn(c->Kv[j]) != 0 && bits > most ? bits : most;
    }
    mpf_set_ui(square, 0);
    if (most == INT64_MIN)
        return UZ_OK;
    double weighted = 0.0, value;
    for (int64_t j = 0; j < c->d; j++) {
        if (most > 0)
            mpq_div_2exp(c->Kv[j], c->Kv[j], (mp_bitcnt_t)most);
        else
            mpq_mul_2exp(c->Kv[j], c->Kv[j], (mp_bitcnt_t)-most);
        c->e[j] = mpq_get_d(c->Kv[j]);
        weighted += c->e[j] * c->weight[j] * c->e[j];
    }
    mpf_set_q(square, c->energy);
    if (most > 0)
        mpf_div_2exp(square, square, 2 * (mp_bitcnt_t)most);
    else
        mpf_mul_2exp(square, square, 2 * (mp_bitcnt_t)-most);
    const double energy = mpf_get_d(square);
    /* the noise is what the rounding of e to doubles may hide: 2^-52 of each entry */
    uz_status status =
        uz_certify_distance(&value, c->in, c->e, c->d, weighted, fmin(energy, DBL_MAX), 0x1p92 * weighted, err);
    if (status != UZ_OK || !(value <= DBL_MAX)) {
        mpf_set_si(square, -1);
        return status;
    }
    mpf_set_d(square, value);
    if (most > 0)
        mpf_mul_2exp(square, square, 2 * (mp_bitcnt_t)most);
    else
        mpf_div_2exp(square, square, 2 * (mp_bitcnt_t)-most);
    return UZ_OK;
}

/* x to doubles, not below it (side 1) or not above it (side -1). */
static double outward(const mpf_t x, double side)
{
    signed long exponent;
    const double digits = mpf_get_d_2exp(&exponent, x); /* cut */
    const double near =
        exponent > DBL_MAX_EXP ? copysign(INFINITY, digits) : ldexp(digits, (int)fmax(-2000.0, (double)exponent));
    if (digits == 0.0 || (isinf(near) && (near > 0.0) == (side > 0.0)))
        return near;
    /* cutting took less than one unit of the last place, and rounding to a denormal at most half of one */
    return nextafter(nextafter(near, copysign(INFINITY, side)), copysign(INFINITY, side));
}

/* From the terms to the bounds, in BITS: the formulas of uz_bound_conclude. */
static void conclude(exact *c, uz_certificate *better, const mpf_t square, double settled)
{
    mpf_t root, gap, far, error, energy, term, unsure;
    mpf_t *all[] = {&root, &gap, &far, &error, &energy, &term, &unsure};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        mpf_init2(*all[k], BITS);
    mpq_set_ui(c->open, 0, 1);
    mpq_set_ui(c->b, 0, 1);
    for (int64_t i = 0; i < c->m; i++) {
        mpq_mul(c->a, c->s[i], c->g[i]);
        mpq_abs(c->a, c->a);
        mpq_add(c->b, c->b, c->a); /* of v */
        if (settled > 0.0) {
            mpq_set_d(c->a, c->gap[i]);
            mpq_mul(c->a, c->a, c->s[i]);
        }
        mpq_abs(c->a, c->a);
        mpq_add(c->open, c->open, c->a); /* of v + delta */
    }
    mpf_sqrt(root, square);
    mpf_set_d(far, settled);
    mpf_add(gap, root, far); /* ||v + delta - u_s||_K */
    mpf_mul(gap, gap, gap);
    mpf_set_q(term, c->open);
    mpf_mul_ui(term, term, 2);
    mpf_add(gap, gap, term); /* twice the gap */
    mpf_sqrt(error, gap);
    mpf_set_q(term, c->apart);
    mpf_sqrt(term, term);
    mpf_add(error, error, term);
    mpf_add(error, error, far);
    mpf_set_d(term, SURELY);
    mpf_mul(error, error, term);
    mpf_mul(gap, gap, term);
    mpf_div_ui(gap, gap, 2);
    better->absolute_error = outward(error, 1.0);
    better->gap = fmax(outward(gap, 1.0), better->absolute_error > 0.0 ? DBL_TRUE_MIN : 0.0);
    /* pi(v + delta) - pi(v) = e'delta + s'N delta + 1/2 ||delta||_K^2 */
    if (settled > 0.0) {
        mpf_div_ui(term, far, 2);
        mpf_add(term, term, root);
        mpf_mul(unsure, term, far);
        mpf_set_q(term, c->open);
        mpf_add(unsure, unsure, term);
        mpf_set_q(term, c->b);
        mpf_add(unsure, unsure, term);
        mpf_set_d(term, SURELY);
        mpf_mul(unsure, unsure, term);
    }
    mpq_div_2exp(c->a, c->energy, 1);
    mpq_sub(c->a, c->a, c->load);
    mpf_set_q(energy, c->a); /* cut at BITS, and so are the sums: less than a unit in the last place of a double */
    mpf_add(term, energy, unsure);
    better->energy_primal = outward(term, 1.0);
    mpf_sub(term, energy, unsure);
    mpf_sub(term, term, gap);
    better->energy_dual = outward(term, -1.0);
    if (c->in->moved) {
        mpf_set_d(term, uz_bound_reference(c->in->whole_norm, better->energy_norm, better->absolute_error));
    } else {
        mpf_set_q(term, c->norm);
        mpf_sqrt(term, term);
    }
    better->energy_norm = mpf_get_d(term);
    mpf_sub(term, term, error); /* the least that ||u*||_K can be */
    better->relative_error = mpf_sgn(error) == 0 ? 0.0 : INFINITY;
    if (mpf_sgn(error) > 0 && mpf_sgn(term) > 0) {
        mpf_div(term, error, term);
        better->relative_error = outward(term, 1.0);
    }
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        mpf_clear(*all[k]);
}

/* The numbers that are certified, as rational ones. false: u is not finite, or a weight leaves the range of double. */
static bool take(exact *c, const double *u, const mpf_t *v, const mpf_t *s)
{
    for (int64_t j = 0; j < c->d; j++) {
        if (!isfinite(u[j]) || !isnormal(c->weight[j]))
            return false;
        mpq_set_f(c->v[j], v[j]);
        mpq_set_d(c->w[j], u[j]);
    }
    for (int64_t i = 0; i < c->m; i++)
        if (mpf_sgn(s[i]) < 0)
            mpq_set_f(c->s[i], s[i]);
    multiply(c, c->norm, c->Kw, (const mpq_t *)c->w);
    for (int64_t j = 0; j < c->d; j++)
        mpq_sub(c->w[j], c->w[j], c->v[j]);
    multiply(c, c->apart, c->Kw, (const mpq_t *)c->w);
    multiply(c, c->energy, c->Kv, (const mpq_t *)c->v);
    for (int64_t j = 0; j < c->d; j++) {
        mpq_set_d(c->a, c->in->p[j]);
        mpq_mul(c->a, c->a, c->v[j]);
        mpq_add(c->load, c->load, c->a);
    }
    return true;
}

uz_status uz_certify_exact(uz_certificate *out, const double *u, const mpf_t *v, const mpf_t *s,
                           const uz_certify_input *input, uz_error *err)
{
    exact c = {.in = input, .d = input->K->cols, .m = input->N->rows};
    uz_certificate better = *out;
    double settled = 0.0;
    mpf_t square;
    mpf_init2(square, BITS);
    mpq_inits(c.energy, c.load, c.norm, c.apart, c.open, c.a, c.b, NULL);
    mpq_t **of_d[] = {&c.v, &c.Kv, &c.w, &c.Kw}, **of_m[] = {&c.s, &c.g};
    bool ok = (c.weight = uz_alloc(c.d, sizeof(double))) && (c.e = uz_alloc(c.d, sizeof(double))) &&
              (c.gap = uz_alloc(c.m, sizeof(double)));
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = ok && (*of_d[k] = zeros(c.d));
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        ok = ok && (*of_m[k] = zeros(c.m));
    uz_status status = ok ? uz_csc_transpose(&c.Nt, input->N, err)
                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)c.d);
    bool feasible = false;
    if (status == UZ_OK) {
        uz_certify_weights(c.weight, input->K);
        feasible = isfinite(input->whole_norm) && take(&c, u, v, s) && settle(&c, &settled);
    }
    if (feasible)
        status = take_distance(&c, square, err);
    if (status == UZ_OK && feasible && mpf_sgn(square) >= 0) {
        conclude(&c, &better, square, settled);
        if (better.absolute_error < out->absolute_error)
            *out = better;
    }
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        clear(*of_d[k], c.d);
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        clear(*of_m[k], c.m);
    mpq_clears(c.energy, c.load, c.norm, c.apart, c.open, c.a, c.b, NULL);
    mpf_clear(square);
    free(c.weight);
    free(c.e);
    free(c.gap);
    uz_csc_clear(&c.Nt);
    return status;
}
