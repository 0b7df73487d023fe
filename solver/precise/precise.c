#include "precise/precise.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS_PER_ROW = 20 };

bool uz_precise_is_small(int64_t d, int64_t m, int bits, double seconds)
{
    const double n = (double)d, k = (double)m, longer = (double)bits / UZ_PRECISE_BITS;
    return (n * n * n / 6.0 + 0.5 * n * k * (n + k) + 4.0 * k * k * k) * pow(longer, 1.6) <= 1e7 * seconds;
}

typedef struct {
    int64_t d, m;
    int bits;
    mp_bitcnt_t sure; /* bits that rounding leaves alone: what is 2^-sure of what it is the difference of is zero */
    mpf_t *L;         /* d x d, by columns, lower triangle */
    mpf_t *B;         /* d x m, by columns */
    mpf_t *y0;        /* d: L^-1 p */
    mpf_t *T;         /* m x m: basic = ... + T nonbasic, of the pairs (gap, -reaction); at first D */
    mpf_t *value;     /* m: the basic variable of the pair: -reaction in contact, else the gap */
    mpf_t *size;      /* m: sqrt(D_ii) */
    bool *contact;    /* m */
    mpf_t a, b, sum, length;
} tableau;

mpf_t *uz_precise_numbers(int64_t n, int bits)
{
    mpf_t *x = uz_alloc(n, sizeof *x);
    for (int64_t i = 0; x && i < n; i++)
        mpf_init2(x[i], (mp_bitcnt_t)bits);
    return x;
}

void uz_precise_free(mpf_t *x, int64_t n)
{
    for (int64_t i = 0; x && i < n; i++)
        mpf_clear(x[i]);
    free(x);
}

/* sum -= x_i y_i, n of them */
static void subtract_products(tableau *t, mpf_t sum, const mpf_t *x, int64_t step_x, const mpf_t *y, int64_t step_y,
                              int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (mpf_sgn(x[i * step_x]) != 0 && mpf_sgn(y[i * step_y]) != 0) {
            mpf_mul(t->a, x[i * step_x], y[i * step_y]);
            mpf_sub(sum, sum, t->a);
        }
}

/* x = L^-1 x */
static void forward(tableau *t, mpf_t *x)
{
    for (int64_t i = 0; i < t->d; i++) {
        subtract_products(t, x[i], t->L + i, t->d, x, 1, i);
        mpf_div(x[i], x[i], t->L[i + i * t->d]);
    }
}

/* L, B, y0, D and the gaps without contact; false where K is not positive definite or it had to stop. */
static bool condense(tableau *t, const uz_csc *K, const uz_csc *N, const double *p, const double *h,
                     const uz_stop *stop)
{
    const int64_t d = t->d, m = t->m;
    for (int64_t j = 0; j < d; j++) {
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            mpf_set_d(t->L[K->idx[q] + j * d], K->val[q]);
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            mpf_set_d(t->B[j + N->idx[q] * d], N->val[q]);
        mpf_set_d(t->y0[j], p[j]);
    }
    for (int64_t j = 0; j < d; j++) {
        for (int64_t i = j; i < d; i++)
            subtract_products(t, t->L[i + j * d], t->L + i, d, t->L + j, d, j);
        if (mpf_sgn(t->L[j + j * d]) <= 0 || uz_stop_is_due(stop))
            return false;
        mpf_sqrt(t->L[j + j * d], t->L[j + j * d]);
        for (int64_t i = j + 1; i < d; i++)
            mpf_div(t->L[i + j * d], t->L[i + j * d], t->L[j + j * d]);
    }
    forward(t, t->y0);
    for (int64_t i = 0; i < m; i++) {
        if (uz_stop_is_due(stop))
            return false;
        forward(t, t->B + i * d);
        for (int64_t k = 0; k <= i; k++) {
            subtract_products(t, t->T[i + k * m], t->B + i * d, 1, t->B + k * d, 1, d);
            mpf_neg(t->T[i + k * m], t->T[i + k * m]);
            mpf_set(t->T[k + i * m], t->T[i + k * m]);
        }
        mpf_sqrt(t->size[i], t->T[i + i * m]);
        mpf_set_d(t->value[i], h[i]);
        subtract_products(t, t->value[i], t->B + i * d, 1, t->y0, 1, d);
        /* the problem's length, in the energy norm */
        mpf_set_d(t->b, h[i]);
        mpf_abs(t->b, t->b);
        mpf_abs(t->sum, t->value[i]);
        mpf_add(t->sum, t->sum, t->b);
        if (mpf_sgn(t->size[i]) > 0) {
            mpf_div(t->sum, t->sum, t->size[i]);
            if (mpf_cmp(t->sum, t->length) > 0)
                mpf_set(t->length, t->sum);
        }
    }
    return true;
}

/* The row that penetrates most by the energy that lifts it; -1: none. A row of zeros comes first. */
static int64_t choose(tableau *t)
{
    int64_t q = -1;
    mpf_div_2exp(t->sum, t->length, t->sure);
    for (int64_t i = 0; i < t->m; i++) {
        if (t->contact[i] || mpf_sgn(t->value[i]) >= 0)
            continue;
        if (mpf_sgn(t->size[i]) == 0)
            return i;
        mpf_div(t->a, t->value[i], t->size[i]);
        mpf_neg(t->a, t->a);
        if (mpf_cmp(t->a, t->sum) > 0) {
            mpf_set(t->sum, t->a);
            q = i;
        }
    }
    return q;
}

/* Pair s changes sides: its basic variable becomes the other one. */
static void pivot(tableau *t, int64_t s)
{
    const int64_t m = t->m;
    mpf_ui_div(t->b, 1, t->T[s + s * m]);
    for (int64_t j = 0; j < m; j++) {
        if (j == s)
            continue;
        mpf_mul(t->sum, t->T[s + j * m], t->b);
        for (int64_t i = 0; i < m && mpf_sgn(t->sum) != 0; i++)
            if (i != s && mpf_sgn(t->T[i + s * m]) != 0) {
                mpf_mul(t->a, t->T[i + s * m], t->sum);
                mpf_sub(t->T[i + j * m], t->T[i + j * m], t->a);
            }
        mpf_neg(t->T[s + j * m], t->sum);
    }
    for (int64_t i = 0; i < m; i++)
        if (i != s)
            mpf_mul(t->T[i + s * m], t->T[i + s * m], t->b);
    mpf_set(t->T[s + s * m], t->b);
    t->contact[s] = !t->contact[s];
}

/* Of the rows in contact the one whose reaction vanishes first while q is pressed, -1: none does; `step`: how far. */
static int64_t first_to_go(tableau *t, mpf_t step, int64_t q)
{
    const int64_t m = t->m;
    int64_t first = -1;
    mpf_set_ui(t->sum, 0);
    for (int64_t k = 0; k < m; k++) { /* what of a rate is rounding, by the energy */
        mpf_mul(t->a, t->T[k + q * m], t->size[k]);
        mpf_abs(t->a, t->a);
        if (t->contact[k] && mpf_cmp(t->a, t->sum) > 0)
            mpf_set(t->sum, t->a);
    }
    mpf_div_2exp(t->sum, t->sum, t->sure);
    for (int64_t k = 0; k < m; k++) {
        mpf_mul(t->a, t->T[k + q * m], t->size[k]);
        mpf_neg(t->a, t->a);
        if (!t->contact[k] || mpf_cmp(t->a, t->sum) <= 0)
            continue;
        mpf_div(t->a, t->value[k], t->T[k + q * m]);
        mpf_neg(t->a, t->a);
        if (first < 0 || mpf_cmp(t->a, step) < 0) {
            mpf_set(step, t->a);
            first = k;
        }
    }
    return first;
}

/* Presses row q until its gap is closed. false: for ever, along the ray of its column of T. */
static bool admit(tableau *t, int64_t q, int64_t *steps)
{
    const int64_t m = t->m;
    mpf_t step, pressed;
    bool closed = false, ray = false;
    mpf_init2(step, (mp_bitcnt_t)t->bits);
    mpf_init2(pressed, (mp_bitcnt_t)t->bits);
    while (!closed && !ray && (*steps)-- > 0) {
        int64_t gone = first_to_go(t, step, q);
        mpf_mul(t->a, t->size[q], t->size[q]);
        mpf_div_2exp(t->a, t->a, t->sure);
        const bool stiff = mpf_cmp(t->T[q + q * m], t->a) > 0;
        if (stiff) {
            mpf_div(t->b, t->value[q], t->T[q + q * m]);
            mpf_neg(t->b, t->b);
            closed = gone < 0 || mpf_cmp(t->b, step) <= 0;
            if (closed)
                mpf_set(step, t->b);
        }
        ray = !stiff && gone < 0;
        if (ray)
            break;
        for (int64_t i = 0; i < m; i++) {
            mpf_mul(t->a, t->T[i + q * m], step);
            mpf_add(t->value[i], t->value[i], t->a);
        }
        mpf_add(pressed, pressed, step);
        const int64_t changes = closed ? q : gone;
        pivot(t, changes);
        mpf_set_ui(t->value[changes], 0);
    }
    if (closed)
        mpf_set(t->value[q], pressed);
    mpf_clear(step);
    mpf_clear(pressed);
    return !ray;
}

double uz_precise_round(const mpf_t x)
{
    double high = mpf_get_d(x); /* cut */
    if (!isfinite(high))        /* GMP takes no such double */
        return high;
    mpf_t rest;
    mpf_init2(rest, mpf_get_prec(x));
    mpf_set_d(rest, high);
    mpf_sub(rest, x, rest);
    high += mpf_get_d(rest);
    mpf_clear(rest);
    return high;
}

uz_status uz_precise_solve(uz_precise_end *end, mpf_t *u, mpf_t *r, const uz_csc *K, const uz_csc *N, const double *p,
                           const double *h, int bits, const uz_stop *stop, uz_error *err)
{
    const int64_t d = K->cols, m = N->rows;
    tableau t = {.d = d, .m = m, .bits = bits, .sure = (mp_bitcnt_t)(bits / 5 * 3)};
    uz_status status = UZ_OK;
    mpf_t **room[] = {&t.L, &t.B, &t.y0, &t.T, &t.value, &t.size};
    const int64_t count[] = {d * d, d * m, d, m * m, m, m};
    bool ok = (t.contact = uz_alloc_zero(m, sizeof *t.contact)) != NULL;
    *end = UZ_PRECISE_LEFT;
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        ok = ok && (*room[k] = uz_precise_numbers(count[k], bits));
    mpf_init2(t.a, (mp_bitcnt_t)bits);
    mpf_init2(t.b, (mp_bitcnt_t)bits);
    mpf_init2(t.sum, (mp_bitcnt_t)bits);
    mpf_init2(t.length, (mp_bitcnt_t)bits);
    if (!ok) {
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows in %d bits", (long long)m, bits);
    } else if (condense(&t, K, N, p, h, stop)) {
        int64_t steps = STEPS_PER_ROW * (m + 1), q = choose(&t);
        bool ray = false;
        while (q >= 0 && steps > 0 && !uz_stop_is_due(stop)) {
            ray = !admit(&t, q, &steps);
            if (ray)
                break;
            q = choose(&t);
        }
        *end = ray ? UZ_PRECISE_RAY : q < 0 ? UZ_PRECISE_SOLVED : UZ_PRECISE_LEFT;
        for (int64_t i = 0; q < 0 && i < m; i++) { /* r = -lambda, y0 -= B lambda */
            mpf_set_ui(r[i], 0);
            if (t.contact[i])
                mpf_neg(r[i], t.value[i]);
            for (int64_t j = 0; t.contact[i] && j < d; j++) {
                mpf_mul(t.a, t.B[j + i * d], t.value[i]);
                mpf_sub(t.y0[j], t.y0[j], t.a);
            }
        }
        for (int64_t j = d - 1; q < 0 && j >= 0; j--) { /* u = L^-T y0 */
            subtract_products(&t, t.y0[j], t.L + j + 1 + j * d, 1, t.y0 + j + 1, 1, d - j - 1);
            mpf_div(t.y0[j], t.y0[j], t.L[j + j * d]);
            mpf_set(u[j], t.y0[j]);
        }
        for (int64_t i = 0; ray && i < m; i++) {
            mpf_mul(t.sum, t.T[i + q * m], t.size[i]);
            mpf_div_2exp(t.b, t.size[q], t.sure);
            const bool shares = t.contact[i] && mpf_cmp(t.sum, t.b) > 0;
            mpf_set_si(r[i], i == q ? -1 : 0);
            if (i != q && shares)
                mpf_neg(r[i], t.T[i + q * m]);
        }
    }
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        uz_precise_free(*room[k], count[k]);
    mpf_clears(t.a, t.b, t.sum, t.length, NULL);
    free(t.contact);
    return status;
}
