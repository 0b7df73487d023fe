/* conditioned.h: ill-conditioned problems of known kinds, problems at the ends of the range of double, and their
 * solutions in 100 digits.
 *
 * The condition of K, after scaling by its diagonal, goes from 1e8 to 1e17, where quadruple precision is no reference
 * any more and rounding alone may decide whether K is positive definite. GMP's floating-point numbers keep 384 bits:
 * of these at most 60 are lost to the condition. */
#ifndef TESTS_CONDITIONED_H
#define TESTS_CONDITIONED_H

#include "core/alloc.h"
#include "generated.h"

#include <gmp.h>

enum { BIG_BITS = 384, CONDITIONED_ROWS = 6 };

typedef __mpf_struct big;

static inline big *big_zeros(int64_t n)
{
    big *x = calloc((size_t)n + 1, sizeof *x);
    if (!x)
        abort();
    for (int64_t i = 0; i <= n; i++)
        mpf_init2(&x[i], BIG_BITS); /* one more: never empty, and room for a product */
    return x;
}

static inline void big_free(big *x, int64_t n)
{
    for (int64_t i = 0; x && i <= n; i++)
        mpf_clear(&x[i]);
    free(x);
}

/* sum -= a b; product is room. */
static inline void big_subtract(big *sum, const big *a, const big *b, big *product)
{
    mpf_mul(product, a, b);
    mpf_sub(sum, sum, product);
}

/* A (n x n row-major, lower triangle) = L L' in place; false: a pivot below 1e-90 of its diagonal entry. */
static inline bool big_cholesky(big *A, int64_t n)
{
    big *room = big_zeros(1), *least = &room[1];
    bool definite = true;
    for (int64_t j = 0; definite && j < n; j++) {
        mpf_set(least, &A[j * n + j]);
        mpf_div_2exp(least, least, 300);
        for (int64_t i = j; definite && i < n; i++) {
            for (int64_t k = 0; k < j; k++)
                big_subtract(&A[i * n + j], &A[i * n + k], &A[j * n + k], room);
            if (i > j) {
                mpf_div(&A[i * n + j], &A[i * n + j], &A[j * n + j]);
            } else {
                definite = mpf_sgn(&A[j * n + j]) > 0 && mpf_cmp(&A[j * n + j], least) > 0;
                if (definite)
                    mpf_sqrt(&A[j * n + j], &A[j * n + j]);
            }
        }
    }
    big_free(room, 1);
    return definite;
}

/* x = L^-1 x, or L'^-1 x. */
static inline void big_solve(big *x, const big *L, int64_t n, bool transposed)
{
    big *room = big_zeros(0);
    for (int64_t s = 0; s < n; s++) {
        const int64_t i = transposed ? n - 1 - s : s;
        for (int64_t t = 0; t < s; t++) {
            const int64_t k = transposed ? n - 1 - t : t;
            big_subtract(&x[i], transposed ? &L[k * n + i] : &L[i * n + k], &x[k], room);
        }
        mpf_div(&x[i], &x[i], &L[i * n + i]);
    }
    big_free(room, 0);
}

typedef struct {
    bool definite, solved;
    int64_t d;
    double condition; /* of diag(K)^-1/2 K diag(K)^-1/2, to a factor of about 2 */
    big *L, *u;       /* d x d, d */
    double norm;      /* ||u*||_K */
    big *error;       /* 3: ||u - u*||_K of the answer judged last, ||u*||_K, and what of both may be rounding */
} big_truth;

static inline void big_truth_clear(big_truth *t)
{
    big_free(t->L, t->d * t->d);
    big_free(t->u, t->d);
    big_free(t->error, 2);
    memset(t, 0, sizeof *t);
}

/* *norm = ||x||, and as a double, toward zero. */
static inline double big_norm(big *norm, const big *x, int64_t n)
{
    big *room = big_zeros(0);
    mpf_set_ui(norm, 0);
    for (int64_t i = 0; i < n; i++) {
        mpf_mul(room, &x[i], &x[i]);
        mpf_add(norm, norm, room);
    }
    mpf_sqrt(norm, norm);
    big_free(room, 0);
    return mpf_get_d(norm);
}

/* ||u - u*||_K = ||L'(u - u*)||, toward zero. */
static inline double big_error(const big_truth *t, const double *u)
{
    const int64_t d = t->d;
    big *e = big_zeros(d), *turned = big_zeros(d);
    for (int64_t j = 0; j < d; j++) {
        mpf_set_d(&e[j], u[j]);
        mpf_sub(&e[j], &t->u[j], &e[j]);
    }
    for (int64_t j = 0; j < d; j++)
        for (int64_t i = j; i < d; i++)
            big_subtract(&turned[j], &t->L[i * d + j], &e[i], &e[d]);
    const double error = big_norm(&t->error[0], turned, d);
    big_free(e, d);
    big_free(turned, d);
    return error;
}

/* The largest eigenvalue of the scaled K over its smallest, by the power method. */
static inline double big_condition(const big *L, const uz_csc *K, qp_random *rng)
{
    const int64_t d = K->cols;
    double most = 0, size = 1, *x = vector(d), *y = vector(d), *root = vector(d);
    big *z = big_zeros(d);
    for (int64_t j = 0; j < d; j++) {
        root[j] = sqrt(K->val[K->ptr[j]]);
        x[j] = random_signed(rng);
        mpf_set_d(&z[j], random_signed(rng));
    }
    for (int pass = 0; pass < 12; pass++) {
        for (int64_t j = 0; j < d; j++) {
            x[j] /= root[j];
            y[j] = 0;
        }
        uz_csc_symv(y, K, 1, x);
        for (int64_t j = 0; j < d; j++)
            y[j] /= root[j];
        double norm = 0;
        for (int64_t j = 0; j < d; j++)
            norm = hypot(norm, y[j]);
        for (int64_t j = 0; j < d; j++)
            x[j] = y[j] / norm;
        most = norm;
    }
    for (int pass = 0; pass < 4; pass++) {
        const double before = big_norm(&z[d], z, d);
        for (int64_t j = 0; j < d; j++) {
            mpf_set_d(&z[d], root[j]);
            mpf_mul(&z[j], &z[j], &z[d]);
        }
        big_solve(z, L, d, false);
        big_solve(z, L, d, true);
        for (int64_t j = 0; j < d; j++) {
            mpf_set_d(&z[d], root[j]);
            mpf_mul(&z[j], &z[j], &z[d]);
        }
        size = big_norm(&z[d], z, d) / before;
    }
    big_free(z, d);
    uz_free_all(x, y, root);
    return most * size;
}

/* Rows `active` as equations: r (m) from D_AA r_A = g0_A, g = g0 - D r. false: these rows depend on each other. */
static inline bool big_hold(big *r, big *g, const bool *active, const big *D, const big *g0, int64_t m)
{
    int64_t n = 0, rows[CONDITIONED_ROWS];
    for (int64_t i = 0; i < m; i++)
        if (active[i])
            rows[n++] = i;
    big *A = big_zeros(n * n), *x = big_zeros(n);
    for (int64_t a = 0; a < n; a++) {
        mpf_set(&x[a], &g0[rows[a]]);
        for (int64_t b = 0; b < n; b++)
            mpf_set(&A[a * n + b], &D[rows[a] * m + rows[b]]);
    }
    const bool independent = big_cholesky(A, n);
    if (independent) {
        big_solve(x, A, n, false);
        big_solve(x, A, n, true);
    }
    for (int64_t i = 0, a = 0; i < m; i++)
        if (active[i])
            mpf_set(&r[i], &x[a++]);
        else
            mpf_set_ui(&r[i], 0);
    for (int64_t i = 0; i < m; i++) {
        mpf_set(&g[i], &g0[i]);
        for (int64_t k = 0; k < m; k++)
            big_subtract(&g[i], &D[i * m + k], &r[k], &x[n]);
        if (active[i])
            mpf_set_ui(&g[i], 0);
    }
    big_free(A, n * n);
    big_free(x, n);
    return independent;
}

/* active (m): a guess, then the rows of the solution. Murty's rule: of the rows that are wrong the last changes sides,
 * which ends for a positive definite D. */
static inline bool big_contact(big *r, bool *active, const big *D, const big *g0, int64_t m)
{
    big *g = big_zeros(m);
    bool solved = false;
    for (int step = 0; !solved && step < 1000 && big_hold(r, g, active, D, g0, m); step++) {
        int64_t wrong = -1;
        for (int64_t i = 0; i < m; i++)
            if (active[i] ? mpf_sgn(&r[i]) > 0 : mpf_sgn(&g[i]) < 0)
                wrong = i;
        solved = wrong < 0;
        if (!solved)
            active[wrong] = !active[wrong];
    }
    big_free(g, m);
    return solved;
}

/* The solution of the problem in exactly these doubles. active (m): a guess, overwritten. */
static inline big_truth find_big_truth(const uz_qp *qp, bool *active)
{
    const int64_t d = qp->K.cols, m = qp->N.rows;
    big_truth t = {.d = d, .L = big_zeros(d * d), .u = big_zeros(d), .error = big_zeros(2)};
    big *Z = big_zeros(m * d), *D = big_zeros(m * m), *g0 = big_zeros(m), *r = big_zeros(m), *room = &t.u[d];
    qp_random rng = {1};
    for (int64_t j = 0; j < d; j++) {
        mpf_set_d(&t.u[j], qp->p[j]);
        for (int64_t k = qp->K.ptr[j]; k < qp->K.ptr[j + 1]; k++)
            mpf_set_d(&t.L[qp->K.idx[k] * d + j], qp->K.val[k]);
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            mpf_set_d(&Z[qp->N.idx[k] * d + j], qp->N.val[k]);
    }
    t.definite = big_cholesky(t.L, d);
    if (t.definite) {
        t.condition = big_condition(t.L, &qp->K, &rng);
        big_solve(t.u, t.L, d, false);
        for (int64_t i = 0; i < m; i++)
            big_solve(&Z[i * d], t.L, d, false);
        for (int64_t i = 0; i < m; i++) {
            mpf_set_d(&g0[i], qp->h[i]);
            for (int64_t j = 0; j < d; j++)
                big_subtract(&g0[i], &Z[i * d + j], &t.u[j], room);
            for (int64_t k = 0; k < m; k++) {
                for (int64_t j = 0; j < d; j++)
                    big_subtract(&D[i * m + k], &Z[i * d + j], &Z[k * d + j], room);
                mpf_neg(&D[i * m + k], &D[i * m + k]);
            }
        }
        big_norm(&t.error[2], t.u, d);
        mpf_div_2exp(&t.error[2], &t.error[2], 300);
        t.solved = big_contact(r, active, D, g0, m);
        for (int64_t i = 0; i < m; i++) {
            mpf_neg(&r[i], &r[i]);
            for (int64_t j = 0; j < d; j++)
                big_subtract(&t.u[j], &Z[i * d + j], &r[i], room);
        }
        t.norm = big_norm(&t.error[1], t.u, d);
        big_solve(t.u, t.L, d, true);
    }
    big_free(Z, m * d);
    big_free(D, m * m);
    big_free(g0, m);
    big_free(r, m);
    return t;
}

/* ---- the kinds */

/* K = scale of (R'R) for an n x d array R. */
static inline double *gram(const double *R, int64_t n, int64_t d)
{
    double *K = vector(d * d);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j <= i; j++) {
            double sum = 0;
            for (int64_t k = 0; k < n; k++)
                sum += R[k * d + i] * R[k * d + j];
            K[i * d + j] = K[j * d + i] = sum;
        }
    return K;
}

/* Lauchli 1961: nearly equal columns. Some of them with other signs and sizes. */
static inline double *lauchli(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 2, 41);
    const double e = random_power(rng, -8.6, -4), mixed = random_unit(rng);
    double *s = vector(*d), *K = vector(*d * *d);
    for (int64_t i = 0; i < *d; i++)
        s[i] = random_chance(rng, mixed) ? random_signed(rng) : 1;
    for (int64_t i = 0; i < *d; i++)
        for (int64_t j = 0; j <= i; j++)
            K[i * *d + j] = K[j * *d + i] = i == j ? s[i] * s[i] * (1 + e * e) : s[i] * s[j];
    free(s);
    return K;
}

/* Moler's matrix U'U, U a unit upper triangle with `a` above its diagonal, in all places or in some; Kahan's, whose
 * rows shrink. The pivots of neither show how near to singular it is. */
static inline double *triangular(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 6, 47);
    const double a = -0.4 - 1.5 * random_unit(rng), share = random_chance(rng, 0.5) ? 1 : random_unit(rng),
                 shrink = random_chance(rng, 0.5) ? 1 : 1 - 0.5 * random_unit(rng);
    double *U = vector(*d * *d);
    for (int64_t i = 0; i < *d; i++) {
        const double size = pow(shrink, (double)i);
        U[i * *d + i] = size;
        for (int64_t j = i + 1; j < *d; j++)
            U[i * *d + j] = random_chance(rng, share) ? a * size : 0;
    }
    double *K = gram(U, *d, *d);
    free(U);
    return K;
}

/* 1 / (x_i + x_j), Hilbert's among them. */
static inline double *cauchy(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 4, 15);
    const bool even = random_chance(rng, 0.5);
    double *x = vector(*d), *K = vector(*d * *d), start = 0.2 + 2 * random_unit(rng);
    for (int64_t i = 0; i < *d; i++)
        x[i] = even ? start + (double)i : random_power(rng, -2, 2);
    for (int64_t i = 0; i < *d; i++)
        for (int64_t j = 0; j < *d; j++)
            K[i * *d + j] = 1 / (x[i] + x[j]);
    free(x);
    return K;
}

/* Normal equations of a polynomial, or of fewer measurements than unknowns with a little added to the diagonal. */
static inline double *normal_equations(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 4, 21);
    const bool polynomial = random_chance(rng, 0.5);
    const int64_t n = polynomial ? 2 * *d : random_int(rng, 1, *d);
    double *R = vector(n * *d);
    for (int64_t k = 0; k < n; k++) {
        const double x = random_signed(rng);
        for (int64_t j = 0; j < *d; j++)
            R[k * *d + j] = polynomial ? pow(x, (double)j) : random_signed(rng);
    }
    double *K = gram(R, n, *d), least = random_power(rng, -17, -8);
    for (int64_t j = 0; !polynomial && j < *d; j++)
        K[j * *d + j] += least;
    free(R);
    return K;
}

/* A random basis; the logarithms of the eigenvalues even, at both ends, or but one at the top. */
static inline double *spectrum(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 2, 41);
    const double condition = random_power(rng, 8, 16.5);
    double *K = random_spd(rng, *d, random_chance(rng, 0.5) ? condition : 10, 1), *v = vector(*d), square = 0;
    for (int64_t j = 0; j < *d; j++) {
        v[j] = random_signed(rng);
        square += v[j] * v[j];
    }
    if (random_chance(rng, 0.3)) /* one stiff direction, as a penalty makes it */
        for (int64_t i = 0; i < *d; i++)
            for (int64_t j = 0; j < *d; j++)
                K[i * *d + j] += condition * v[i] * v[j] / square;
    free(v);
    return K;
}

/* A clamped bar or beam of n elements whose stiffnesses differ, on a weak foundation or on none. */
static inline double *structure(qp_random *rng, int64_t *d)
{
    const bool beam = random_chance(rng, 0.6);
    const int64_t n = random_int(rng, 2, 21);
    const double decades = random_unit(rng) * (beam ? 6 : 12), length = random_power(rng, -2, 2);
    *d = beam ? 2 * n : n;
    double *K = vector(*d * *d);
    for (int64_t e = 0; e < n; e++) {
        const double stiffness = random_power(rng, -decades, 0), l = length, k = stiffness / (l * l * l);
        const double bending[4][4] = {{12 * k, 6 * k * l, -12 * k, 6 * k * l},
                                      {6 * k * l, 4 * k * l * l, -6 * k * l, 2 * k * l * l},
                                      {-12 * k, -6 * k * l, 12 * k, -6 * k * l},
                                      {6 * k * l, 2 * k * l * l, -6 * k * l, 4 * k * l * l}};
        const double stretching[2][2] = {{stiffness, -stiffness}, {-stiffness, stiffness}};
        const int own = beam ? 2 : 1;
        for (int a = 0; a < 2 * own; a++)
            for (int b = 0; b < 2 * own; b++) {
                const int64_t i = own * (e - 1) + a, j = own * (e - 1) + b;
                if (i >= 0 && j >= 0)
                    K[i * *d + j] += beam ? bending[a][b] : stretching[a][b];
            }
    }
    return K;
}

/* Free in one motion but for a weak spring: what holds it is as large as the rounding of the rest. */
static inline double *weakly_held_body(qp_random *rng, int64_t *d)
{
    *d = random_int(rng, 3, 31);
    double *K = vector(*d * *d);
    for (int64_t i = 0; i < *d; i++)
        for (int64_t j = 0; j < i; j++) {
            const double spring = i == j + 1 || random_chance(rng, 0.2) ? 0.1 + random_unit(rng) : 0;
            K[i * *d + j] = K[j * *d + i] = -spring;
            K[i * *d + i] += spring;
            K[j * *d + j] += spring;
        }
    const int64_t at = random_int(rng, 0, *d);
    K[at * *d + at] += random_power(rng, -16, -8);
    return K;
}

static inline double *conditioned_stiffness(qp_random *rng, int64_t *d)
{
    static double *(*const kinds[])(qp_random *, int64_t *) = {
        lauchli, triangular, triangular, cauchy, normal_equations, spectrum, structure, weakly_held_body};
    double *K = kinds[random_int(rng, 0, sizeof kinds / sizeof kinds[0])](rng, d);
    if (random_chance(rng, 0.3))
        grade(rng, K, *d, 1 + 3 * random_unit(rng));
    return K;
}

/* A power of ten from all that double has, or 1. */
static inline double random_range(qp_random *rng)
{
    return random_chance(rng, 0.3)   ? 1
           : random_chance(rng, 0.5) ? random_power(rng, -200, 0)
                                     : random_power(rng, -323, 300);
}

/* The same problem for the same seed; the rows do not depend on each other, and something meets them all. ranged: the
 * condition is moderate, but sizes are from the whole range of double. */
static inline uz_qp conditioned_qp(uint64_t seed, bool ranged)
{
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 5};
    int64_t d = 1 + (int64_t)(seed % 9);
    double *K = ranged
                    ? random_spd(&rng, d, random_power(&rng, 0, 8), random_chance(&rng, 0.8) ? 1 : random_range(&rng))
                    : conditioned_stiffness(&rng, &d);
    if (ranged && random_chance(&rng, 0.4)) /* dofs that nothing couples may have answers of any size */
        for (int64_t k = 0; k < d * d; k++)
            K[k] = k % (d + 1) == 0 ? floor(1 + 20 * random_unit(&rng)) : 0;
    int64_t m = random_int(&rng, 0, CONDITIONED_ROWS + 1);
    m = m > d ? d : m;
    double *N = vector(m * d);
    const int pattern = (int)random_int(&rng, 0, 3);
    for (int64_t i = 0; i < m; i++) {
        generated_row(&rng, N, i, d, pattern, 0);
        N[i * d + i] += N[i * d + i] < 0 ? -1.5 : 1.5;
    }
    uz_qp qp = {.K = csc_from_dense(K, d, d, true), .N = csc_from_dense(N, m, d, false), vector(d), vector(m)};
    const bool smooth = random_chance(&rng, 0.5);
    double *u = vector(d);
    for (int64_t j = 0; j < d; j++) {
        u[j] = random_signed(&rng);
        qp.p[j] = smooth ? 0 : random_signed(&rng);
    }
    if (smooth)
        uz_csc_symv(qp.p, &qp.K, 1, u);
    for (int64_t i = 0; i < m; i++)
        qp.h[i] = random_chance(&rng, 0.3) ? 0 : random_signed(&rng) * (smooth ? 1 : random_power(&rng, 0, 4));
    const double force = ranged ? random_range(&rng) : 1, length = ranged ? random_range(&rng) : 1;
    const bool apart = ranged && random_chance(&rng, 0.5);
    for (int64_t j = 0; j < d; j++)
        qp.p[j] = fmax(-1e300, fmin(1e300, qp.p[j] * (apart ? random_range(&rng) : force)));
    for (int64_t i = 0; i < m; i++)
        qp.h[i] = fmax(-1e300, fmin(1e300, qp.h[i] * (apart                      ? random_range(&rng)
                                                      : random_chance(&rng, 0.7) ? force
                                                                                 : length)));
    uz_free_all(u, K, N);
    return qp;
}

/* ---- the claims */

typedef struct {
    int64_t problems, solves, converged, certified, refused, indefinite, unsolved, wrong;
    double least_ratio;       /* bound / true error */
    int64_t by_decade[24][2]; /* problems by the condition's power of ten: solves, certified to 1 % */
} conditioned_tally;

/* What is wrong with an answer, or NULL. */
static inline const char *judge_conditioned(conditioned_tally *t, const big_truth *exact, const uz_result *result)
{
    const uz_summary *s = &result->summary;
    const uz_certificate *c = &s->certificate;
    const bool claims = s->outcome == UZ_CONVERGED || isfinite(c->relative_error) || isfinite(c->absolute_error);
    t->converged += s->outcome == UZ_CONVERGED;
    t->certified += isfinite(c->relative_error);
    if (s->outcome == UZ_INFEASIBLE)
        return "infeasible, but it is not";
    if (!exact->definite)
        return claims ? "certified, but K is not positive definite" : NULL;
    for (int64_t j = 0; j < exact->d; j++)
        if (!isfinite(result->u[j]))
            return claims ? "certified, but not a number" : NULL;
    big_error(exact, result->u);
    big *relative = big_zeros(0);
    const bool off = mpf_cmp(&exact->error[0], &exact->error[2]) > 0,
               zero = mpf_cmp(&exact->error[1], &exact->error[2]) <= 0;
    if (off && !zero)
        mpf_div(relative, &exact->error[0], &exact->error[1]);
    const double ratio = off && !zero ? mpf_get_d(relative) : off ? INFINITY : 0;
    if (off && isfinite(c->relative_error) && ratio > 0)
        t->least_ratio = fmin(t->least_ratio, c->relative_error / ratio);
    const bool low = isfinite(c->relative_error) && off && (zero || mpf_cmp_d(relative, c->relative_error) > 0),
               low_absolute = isfinite(c->absolute_error) && off && mpf_cmp_d(&exact->error[0], c->absolute_error) > 0;
    big_free(relative, 0);
    if (s->outcome == UZ_CONVERGED && !(ratio <= s->requested_error))
        return "converged, but the true error is above the request";
    if (off && (c->relative_error == 0 || c->absolute_error == 0 || c->gap == 0))
        return "a bound is zero, but the answer is not exact";
    if (low || low_absolute)
        return "a bound is below the true error";
    return NULL;
}

/* Several requests on the problem of a seed: cold, or twice with a cache. None where its condition is not meant. */
static inline void run_conditioned(conditioned_tally *t, uint64_t seed, bool ranged,
                                   void (*fail)(void *ctx, uint64_t seed, const big_truth *exact,
                                                const uz_result *result, const char *why),
                                   void *ctx)
{
    static const double errors[] = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 0};
    static const uz_operator forms[] = {UZ_OPERATOR_AUTO, UZ_OPERATOR_AUTO, UZ_OPERATOR_CONDENSED,
                                        UZ_OPERATOR_FACTORED};
    qp_random rng = {seed + 3};
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = conditioned_qp(seed, ranged)};
    bool active[CONDITIONED_ROWS] = {false}, known = false;
    big_truth exact = {0};
    uz_cache *cache = random_chance(&rng, 0.3) ? uz_cache_new((size_t)1 << 24) : NULL;
    uz_settings settings = uz_settings_default();
    settings.relative_error = errors[random_int(&rng, 0, 6)];
    settings.op = forms[random_int(&rng, 0, 4)];
    settings.max_iterations = 1000;
    if (random_chance(&rng, 0.2))
        settings.method = random_chance(&rng, 0.5) ? UZ_METHOD_ACTIVE_SET : UZ_METHOD_CONJUGATE;
    for (int turn = 0; turn < (cache ? 2 : 1); turn++) {
        uz_result *result = NULL;
        uz_error err = {0};
        const uz_status status = uz_solve(&result, &problem, &settings, cache, NULL, &err);
        for (int64_t i = 0; !known && status == UZ_OK && i < problem.qp.N.rows; i++)
            active[i] = result->r[i] < 0;
        if (!known)
            exact = find_big_truth(&problem.qp, active);
        known = true;
        if (!ranged && exact.definite && !(exact.condition >= 1e8 && exact.condition <= 1e17)) {
            uz_result_free(result);
            break;
        }
        t->problems += turn == 0;
        t->indefinite += turn == 0 && !exact.definite;
        t->unsolved += turn == 0 && exact.definite && !exact.solved;
        t->solves++;
        t->refused += status != UZ_OK;
        const char *why = NULL;
        if (exact.definite && strstr(err.message, "u'K u < 0"))
            why = "K is said not to be positive definite, but it is";
        const int decade = exact.definite ? (int)fmin(19, fmax(0, log10(exact.condition))) : 20;
        t->by_decade[decade][0]++;
        if (status == UZ_OK) {
            t->by_decade[decade][1] += result->summary.certificate.relative_error <= 1e-2;
            why = exact.definite && !exact.solved ? NULL : judge_conditioned(t, &exact, result);
        }
        if (status == UZ_ERR_INTERNAL)
            why = "a fault";
        t->wrong += why != NULL;
        if (why)
            fail(ctx, seed, &exact, result, why);
        uz_result_free(result);
    }
    uz_cache_free(cache);
    big_truth_clear(&exact);
    uz_problem_clear(&problem);
}

#endif
