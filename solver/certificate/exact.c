#include "certificate/exact.h"

#include "certificate/bound.h"
#include "certificate/residual.h"
#include "certificate/row_settle.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Bits of roots and of what is added to them, and what more than covers their rounding, which is below 2^-PLACES. */
enum { BITS = 256, PLACES = 44 };
#define SURELY (1.0 + 0x1p-40)

typedef struct {
    const uz_certify_input *in;
    int64_t d, m;
    uz_csc Nt;               /* d x m */
    mpq_t *v, *Kv, *w, *Kw;  /* d: v, then u, and K times it; w = u - v */
    mpq_t *s, *g;            /* m: reactions, gaps of v */
    double *weight;          /* d */
    mpq_t energy, load;      /* v'Kv, v'p */
    mpq_t norm, apart, open; /* u'Ku, ||u - v||_K^2, -s'g */
    mpq_t a, b;              /* work */
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

/* sum -= x'y */
static void subtract_products(mpf_t sum, mpf_t term, const mpf_t *x, const mpf_t *y, int64_t n)
{
    for (int64_t k = 0; k < n; k++)
        if (mpf_sgn(x[k]) != 0 && mpf_sgn(y[k]) != 0) {
            mpf_mul(term, x[k], y[k]);
            mpf_sub(sum, sum, term);
        }
}

/* K ~ L L' in L's bits (L: d x d by rows, 0 before). inverse: the trace of the inverse of H = G G', G = diag(K)^-1/2 L,
 * the sum of X_ij^2 K_jj with X = L^-1, made column by column in x (d). false: a pivot is not positive. */
static bool factor(mpf_t *L, mpf_t inverse, const uz_csc *K, mpf_t *x, mpf_t term)
{
    const int64_t d = K->cols;
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            mpf_set_d(L[K->idx[k] * d + j], K->val[k]);
    for (int64_t j = 0; j < d; j++) {
        mpf_t *row = L + j * d;
        for (int64_t k = 0; k <= j; k++) {
            subtract_products(row[k], term, row, L + k * d, k);
            if (k < j)
                mpf_div(row[k], row[k], L[k * d + k]);
        }
        if (mpf_sgn(row[j]) <= 0)
            return false;
        mpf_sqrt(row[j], row[j]);
    }
    mpf_set_ui(inverse, 0);
    for (int64_t j = 0; j < d; j++)
        for (int64_t i = j; i < d; i++) {
            mpf_set_ui(x[i], i == j);
            subtract_products(x[i], term, L + i * d + j, x + j, i - j);
            mpf_div(x[i], x[i], L[i * d + i]);
            mpf_set_d(term, K->val[K->ptr[j]]);
            mpf_mul(term, term, x[i]);
            mpf_mul(term, term, x[i]);
            mpf_add(inverse, inverse, term);
        }
    return true;
}

/* square = e'K^-1 e for e = K v - p - N's, not below it and sharp to 2^-40; negative: nothing is known.
 *
 * By K ~ L L' in as many bits as v has. Rounding leaves |K - L L'|_ij <= 2 (d + 2) u (K_ii K_jj)^1/2 (Higham 2002,
 * theorem 10.3), with a limb more than 2^-bits for u, as GMP cuts differences where their terms end. So K is L L' but
 * for a part of 2 d (d + 2) u T, T bounding the norm of H^-1, and if that is small K is positive definite.
 * Substitutions, that for e and those for T, leave residuals of at most (d + 2) u |G| |X|, which the root of d T
 * bounds: no more than that again. */
static uz_status take_distance(exact *c, mpf_t square, mp_bitcnt_t bits, uz_error *err)
{
    const uz_csc *N = c->in->N;
    const int64_t d = c->d;
    mpf_t term, inverse, *L = uz_alloc(d * (d + 1), sizeof *L), *x = L ? L + d * d : NULL;
    mpf_set_si(square, -1);
    if (!L)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)d);
    mpf_init2(term, bits);
    mpf_init2(inverse, bits);
    for (int64_t k = 0; k < d * (d + 1); k++)
        mpf_init2(L[k], bits);
    bool known = bits > GMP_LIMB_BITS + PLACES && factor(L, inverse, c->in->K, x, term);
    if (known) {
        mpf_set_d(term, 6.0 * (double)d * (double)(d + 2));
        mpf_mul(inverse, inverse, term);
        mpf_div_2exp(inverse, inverse, bits - GMP_LIMB_BITS - PLACES); /* all of that is to be below 2^-PLACES */
        known = mpf_cmp_ui(inverse, 1) < 0;
    }
    for (int64_t j = 0; known && j < d; j++) {
        mpq_set_d(c->b, c->in->p[j]);
        mpq_sub(c->Kv[j], c->Kv[j], c->b);
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            mpq_set_d(c->a, N->val[k]);
            mpq_mul(c->a, c->a, c->s[N->idx[k]]);
            mpq_sub(c->Kv[j], c->Kv[j], c->a);
        }
        mpf_set_q(x[j], c->Kv[j]);
        subtract_products(x[j], term, L + j * d, x, j); /* x = L^-1 e */
        mpf_div(x[j], x[j], L[j * d + j]);
        mpf_mul(term, x[j], x[j]);
        if (j > 0)
            mpf_add(square, square, term);
        else
            mpf_set(square, term);
    }
    if (known) {
        mpf_set_d(term, SURELY);
        mpf_mul(square, square, term);
    }
    mpf_clears(term, inverse, NULL);
    for (int64_t k = 0; k < d * (d + 1); k++)
        mpf_clear(L[k]);
    free(L);
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
static void conclude(exact *c, uz_certificate *better, const mpf_t square)
{
    mpf_t gap, error, energy, term;
    mpf_t *all[] = {&gap, &error, &energy, &term};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        mpf_init2(*all[k], BITS);
    mpq_set_ui(c->open, 0, 1);
    for (int64_t i = 0; i < c->m; i++) {
        mpq_mul(c->a, c->s[i], c->g[i]);
        mpq_sub(c->open, c->open, c->a);
    }
    mpf_set_q(gap, c->open);
    mpf_mul_ui(gap, gap, 2);
    mpf_add(gap, gap, square); /* twice the gap */
    mpf_sqrt(error, gap);
    mpf_set_q(term, c->apart);
    mpf_sqrt(term, term);
    mpf_add(error, error, term);
    mpf_set_d(term, SURELY);
    mpf_mul(error, error, term);
    mpf_mul(gap, gap, term);
    mpf_div_ui(gap, gap, 2);
    better->absolute_error = outward(error, 1.0);
    better->gap = fmax(outward(gap, 1.0), better->absolute_error > 0.0 ? DBL_TRUE_MIN : 0.0);
    mpq_div_2exp(c->a, c->energy, 1);
    mpq_sub(c->a, c->a, c->load);
    mpf_set_q(energy, c->a); /* cut at BITS, and so are the sums: less than a unit in the last place of a double */
    better->energy_primal = outward(energy, 1.0);
    mpf_sub(term, energy, gap);
    better->energy_dual = outward(term, -1.0);
    if (c->in->moved) {
        mpf_set_d(term,
                  uz_bound_reference(c->in->whole_norm, better->energy_norm, better->absolute_error, c->in->acting));
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

/* The numbers that are certified, as rational ones. false: u is not finite, a weight leaves the range of double, or v
 * can't be made feasible. */
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
    /* v moves to where no row penetrates, if such a place is known; g: its gaps */
    uz_row_settle problem = {.Nt = &c->Nt, .weight = c->weight, .h = c->in->h, .at = c->v};
    bool open = uz_row_settle_solve(&problem);
    for (int64_t i = 0; open && i < c->m; i++) {
        mpq_set_d(c->g[i], c->in->h[i]);
        for (int64_t k = c->Nt.ptr[i]; k < c->Nt.ptr[i + 1]; k++) {
            mpq_set_d(c->a, c->Nt.val[k]);
            mpq_mul(c->a, c->a, c->v[c->Nt.idx[k]]);
            mpq_sub(c->g[i], c->g[i], c->a);
        }
        open = mpq_sgn(c->g[i]) >= 0;
    }
    if (!open)
        return false;
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
    mpf_t square;
    mpf_init2(square, BITS);
    mpq_inits(c.energy, c.load, c.norm, c.apart, c.open, c.a, c.b, NULL);
    mpq_t **of_d[] = {&c.v, &c.Kv, &c.w, &c.Kw}, **of_m[] = {&c.s, &c.g};
    bool ok = (c.weight = uz_alloc(c.d, sizeof(double))) != NULL;
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = ok && (*of_d[k] = zeros(c.d));
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        ok = ok && (*of_m[k] = zeros(c.m));
    uz_status status = ok ? uz_csc_transpose(&c.Nt, input->N, err)
                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)c.d);
    bool feasible = false;
    if (status == UZ_OK) {
        for (int64_t j = 0; j < c.d; j++)
            c.weight[j] = uz_dof_weight(input->K, j);
        feasible = isfinite(input->whole_norm) && take(&c, u, v, s);
    }
    if (feasible)
        status = take_distance(&c, square, mpf_get_prec(v[0]), err);
    if (status == UZ_OK && feasible && mpf_sgn(square) >= 0) {
        conclude(&c, &better, square);
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
    uz_csc_clear(&c.Nt);
    return status;
}
