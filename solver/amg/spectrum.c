/* spectrum.c: what multigrid and K know of each other: bounds on the spectrum of M^-1 K that hold except with a
 * probability below 1e-12, and what follows for e'K^-1 e.
 *
 * Conjugate gradients from a random residual r0 = D^1/2 s, s standard normal, know polynomials phi_k with phi_k(0) = 1
 * and r_k'M^-1 r_k = sum_i gamma_i^2 phi_k(lambda_i)^2, gamma_i = x_i'r0 for the eigenvectors x_i'M x_i = 1 of M^-1 K.
 * Of the smallest eigenvalue, gamma_1 is normal with the variance x_1'D x_1 >= 1 / lambda_max(D^-1 M), so that
 * gamma_1^2 >= t^2 / lambda_max(D^-1 M) but for a probability below 0.8 t; and phi_k falls on [0, theta], theta its
 * smallest zero. So lambda_1 is at least the lambda with phi_k(lambda)^2 t^2 / lambda_max(D^-1 M) = r_k'M^-1 r_k. The
 * argument is that of van Dorsselaer, Hochstenbach and van der Vorst, SIAM J. Matrix Anal. Appl. 22 (2000); the bound
 * is sharper than what is known beforehand (Kuczynski and Wozniakowski, same journal, 13 (1992)), as it sees the Ritz
 * values converge. That orthogonality is lost on the way does no harm: the coefficients are those of an exact process
 * on a matrix whose eigenvalues lie within rounding of those of this one (Greenbaum, Linear Algebra Appl. 113 (1989)).
 */
#include "amg/amg.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/random.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS_MOST = 3000, CHECK_EVERY = 4, POWERS = 8 };

/* 0.8 times this is 1e-12. */
#define LEAST_SHARE 1.25e-12

typedef struct {
    double alpha[STEPS_MOST], beta[STEPS_MOST];
    int count;
} coefficients;

/* phi_k(lambda), 0 where some phi_j before is not positive: lambda is then above a Ritz value. */
static double residual_polynomial(const coefficients *c, double lambda)
{
    double phi = 1.0, pi = 1.0;
    for (int j = 0; j < c->count; j++) {
        phi -= c->alpha[j] * lambda * pi;
        if (!(phi > 0.0))
            return 0.0;
        pi = phi + c->beta[j] * pi;
    }
    return phi;
}

/* The largest lambda that is surely below the spectrum, by bisection of its logarithm; 0: none is known. level: what
 * phi_k exceeds there. */
static double excluded(const coefficients *c, double level)
{
    double low = -60.0, high = 1.0; /* powers of e: the spectrum of M^-1 K ends at 1 */
    if (!(residual_polynomial(c, exp(low)) > level))
        return 0.0;
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        if (residual_polynomial(c, exp(middle)) > level)
            low = middle;
        else
            high = middle;
    }
    return exp(low);
}

static void random_residual(uz_cg *cg, const uz_csc *K)
{
    uint64_t state = 0x9E3779B97F4A7C15u;
    for (int64_t j = 0; j < cg->n; j++)
        cg->r[j] = sqrt(K->val[K->ptr[j]]) * uz_normal(&state);
}

/* M is K but for rounding where there is one level only, and steps are cheap. */
#define NEAR_ONE 0.9

/* *lambda: the bound, 0 where STEPS_MOST steps do not give one. */
static uz_status bound_below(double *lambda, coefficients *c, uz_cg *cg, const uz_csc *K, const uz_hooks *hooks,
                             uz_error *err)
{
    double share = LEAST_SHARE / sqrt(uz_multigrid_describe(cg->mg).most), before = 0.0;
    random_residual(cg, K);
    uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
    double square = uz_dot(cg->n, cg->r, cg->z);
    memcpy(cg->p, cg->z, (size_t)cg->n * sizeof *cg->p);
    while (status == UZ_OK && c->count < STEPS_MOST && square > 0.0) {
        if (uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
        /* a step of conjugate gradients without the solution */
        memset(cg->q, 0, (size_t)cg->n * sizeof *cg->q);
        uz_csc_symv(cg->q, K, 1.0, cg->p);
        const double curvature = uz_dot(cg->n, cg->p, cg->q), last = square;
        if (!(curvature > 0.0))
            return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                           "K is not positive definite: conjugate gradients met a direction that it does not resist. "
                           "Support the body so that it can't move freely, or check the signs of K.");
        const double alpha = square / curvature;
        uz_axpy(cg->n, -alpha, cg->q, cg->r);
        status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
        square = uz_dot(cg->n, cg->r, cg->z);
        const double beta = square / last;
        for (int64_t j = 0; j < cg->n; j++)
            cg->p[j] = cg->z[j] + beta * cg->p[j];
        c->alpha[c->count] = alpha;
        c->beta[c->count++] = beta;
        if (status != UZ_OK || c->count % CHECK_EVERY != 0 || sqrt(square) >= share)
            continue;
        *lambda = excluded(c, sqrt(square) / share);
        if (*lambda > NEAR_ONE || (*lambda > 0.0 && *lambda < 1.1 * before))
            return status;
        before = *lambda;
    }
    if (status == UZ_OK && *lambda == 0.0) /* the residual may have vanished, too */
        *lambda = excluded(c, sqrt(square) / share);
    return status;
}

/* Below this rounding of the entries of K alone makes or unmakes a digit of lambda_min(D^-1 K). */
#define RCOND_LEAST DBL_EPSILON

static uz_status try_threshold(uz_amg *amg, const uz_csc *K, double strong, size_t memory_limit, const uz_hooks *hooks,
                               uz_error *err)
{
    double start = uz_seconds();
    uz_amg_info *info = &amg->info;
    uz_stop stop = {hooks, INFINITY};
    uz_cg cg = {0};
    size_t n = (size_t)K->cols;
    amg->modes.strong = strong;
    uz_status status = uz_multigrid_create(&amg->mg, K, &amg->modes, NULL, memory_limit, &stop, err);
    info->create_s += uz_seconds() - start;
    if (status != UZ_OK)
        return status;
    const uz_multigrid_info made = uz_multigrid_describe(amg->mg);
    info->levels = made.levels;
    info->bytes = made.bytes + n * (4 + 4 * (size_t)amg->modes.count);
    start = uz_seconds();
    coefficients *c = uz_alloc_zero(1, sizeof *c);
    double most = INFINITY;
    status =
        c ? uz_cg_init(&cg, amg->mg, NULL, K->cols, err) : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a spectrum");
    if (status == UZ_OK) {
        info->lambda = 0.0;
        status = bound_below(&info->lambda, c, &cg, K, hooks, err);
        info->iterations = c->count;
    }
    free(c);
    /* lambda_max(D^1/2 M^-1 D^1/2), D = diag(K), by powers: some per cent too small. */
    if (status == UZ_OK)
        random_residual(&cg, K);
    for (int power = 0; status == UZ_OK && power < POWERS; power++) {
        status = uz_multigrid_apply(cg.mg, K, cg.room, cg.z, cg.r, err);
        double square = 0.0;
        for (int64_t j = 0; j < cg.n; j++) {
            double scaled = sqrt(K->val[K->ptr[j]]) * cg.z[j];
            square += scaled * scaled;
        }
        most = sqrt(square);
        for (int64_t j = 0; j < cg.n; j++)
            cg.r[j] = K->val[K->ptr[j]] * cg.z[j] / most;
    }
    if (status == UZ_OK)
        info->rcond = info->lambda / most;
    if (status == UZ_OK && !(info->rcond >= RCOND_LEAST))
        status = uz_fail(err, UZ_ERR_NOT_SPD, "K",
                         "K is singular to working precision, or too ill-conditioned for conjugate gradients "
                         "(reciprocal condition %.2g after %lld iterations): the body can move without resistance, or "
                         "its stiffnesses differ by too much",
                         info->rcond, (long long)info->iterations);
    uz_cg_clear(&cg);
    info->spectrum_s += uz_seconds() - start;
    return status;
}

/* Bilinear elements of aspect 10 to 1 couple as strongly along their long sides, in absolute value, as square ones do
 * across a corner: a threshold that sees the difference makes coarse levels fuller, so it is tried only where the usual
 * one does badly. Measured at aspect 15 to 1: lambda 0.29 instead of 0.02, for 4 times the bytes. */
#define SECOND_STRONG 0.3
#define BAD_LAMBDA    0.02
#define WORTH_LAMBDA  3.0

/* The better of two thresholds; the first one's failure stands where the second fails too. */
uz_status uz_amg_create(uz_amg **out, const uz_csc *K, uz_modes *modes, size_t memory_limit, const uz_hooks *hooks,
                        uz_error *err)
{
    uz_error ignored = {0}, failure = {0}, *into = err ? err : &ignored;
    *out = NULL;
    uz_amg *amg = uz_alloc_zero(1, sizeof *amg);
    if (!amg) {
        uz_modes_clear(modes);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid");
    }
    amg->modes = *modes;
    memset(modes, 0, sizeof *modes);
    uz_status status = try_threshold(amg, K, amg->modes.strong, memory_limit, hooks, into);
    const bool may_improve = status == UZ_OK ? amg->info.levels > 1 && amg->info.lambda < BAD_LAMBDA
                                             : status == UZ_ERR_NOT_SPD && amg->mg && amg->info.iterations > 0;
    if (may_improve) {
        uz_amg second = {.modes = amg->modes, .info = amg->info};
        second.info.lambda = 0.0;
        const uz_status other = try_threshold(&second, K, SECOND_STRONG, memory_limit, hooks, &failure);
        const bool better = other == UZ_OK && (status != UZ_OK || second.info.lambda > WORTH_LAMBDA * amg->info.lambda);
        uz_multigrid_free(better ? amg->mg : second.mg);
        if (better) {
            *amg = second;
            uz_error_reset(into);
            status = UZ_OK;
        } else if (other == UZ_ERR_CANCELLED || (other == UZ_ERR_MEMORY && status != UZ_OK)) {
            *into = failure;
            status = other;
        }
    }
    if (status == UZ_OK)
        *out = amg;
    else
        uz_amg_free(amg);
    return status;
}

void uz_amg_free(uz_amg *amg)
{
    if (!amg)
        return;
    uz_modes_clear(&amg->modes);
    uz_multigrid_free(amg->mg);
    free(amg);
}

/* The residual's share of the value that is sharp enough, as a share of its root. */
#define SHARP 0.1
enum { NORM_STEPS_MOST = 400 };

uz_status uz_amg_inverse_norm(double *value, double *e, const uz_amg *amg, uz_cg *cg, const uz_csc *K,
                              const uz_hooks *hooks, double deadline, uz_error *err)
{
    int64_t n = cg->n;
    double *w = uz_alloc_zero(n, sizeof *w), sum = 0.0, largest = 0.0;
    uz_cg_stop stop = {.relative = SHARP * sqrt(amg->info.lambda),
                       .max_iterations = NORM_STEPS_MOST,
                       .hooks = hooks,
                       .deadline = deadline};
    uz_cg_info info;
    *value = INFINITY;
    if (!w)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)n);
    for (int64_t j = 0; j < n; j++)
        largest = fmax(largest, fabs(e[j]));
    /* By the power of two below the largest: squares of forces stay in range; what is left is exact. */
    const double unit = largest > 0.0 && !isinf(largest) ? ldexp(1.0, ilogb(largest)) : 1.0;
    for (int64_t j = 0; j < n; j++)
        e[j] /= unit;
    uz_status status = uz_cg_solve(&info, w, cg, K, e, &stop, err);
    for (int64_t j = 0; j < n; j++)
        sum += w[j] * (e[j] + cg->r[j]);
    if (status == UZ_OK) {
        double scaled = (isnan(sum) ? INFINITY : fmax(0.0, sum)) + info.last * info.last / amg->info.lambda;
        *value = scaled * unit * unit;
        for (int64_t j = 0; j < n; j++)
            e[j] = unit * w[j];
    }
    free(w);
    return status;
}

/* Measured on plane and solid bodies: coarse levels take less than four tenths of K, the prolongation 4 + 4 k bytes for
 * each of some four blocks a row. */
double uz_amg_predict_bytes(int64_t n, int64_t nnz, int modes)
{
    return (double)n * (4.0 * (4.0 + 4.0 * modes) + 4.0 * modes + 20.0) + 0.4 * 16.0 * (double)nnz;
}
