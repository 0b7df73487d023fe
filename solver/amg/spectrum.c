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
 *
 * Where the multigrid takes two residuals at once (both.c) each has a variance of x_1'r0 of 1 at least, as it is drawn,
 * and fails with the root of that probability. */
#include "amg/amg.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "linalg/pieces.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/random.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS_MOST = 3000, CHECK_EVERY = 4, POWERS = 3 };

/* 0.8 times this is 1e-12, and 0.8 times the other its root: of two residuals, drawn apart, both have so little of the
 * smallest eigenvalue with the square of what one has it with. The lesser of their bounds holds otherwise, and
 * residuals that have to fall by six digits less, and by what diag(K) and M differ, do so in less than three fifths of
 * the steps. */
#define LEAST_SHARE      1.25e-12
#define LEAST_SHARE_BOTH 1.25e-6
#define BOTH_STEPS       0.58

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

/* Vectors of dofs beside the diagonal of K, in pieces that threads share. */
typedef struct {
    const uz_csc *K;
    double *to;
    const double *from;
    double norm;
} by_diagonal;

static const uint64_t SEED[2] = {0x9E3779B97F4A7C15u, 0xD1B54A32D192ED03u};

static void draw_residual(void *ctx, int64_t begin, int64_t end)
{
    const by_diagonal *x = ctx;
    uint64_t state = uz_random_after(SEED[0], 2 * (uint64_t)begin);
    for (int64_t j = begin; j < end; j++)
        x->to[j] = sqrt(x->K->val[x->K->ptr[j]]) * uz_normal(&state);
}

/* The bound is sharp enough where it is this share of the least Ritz value, as the least eigenvalue is no larger than
 * that, and where as many steps as between two checks make it sharper by less than the factor. Tolerances go by its
 * root: further steps would not spare each solve a tenth of one. */
#define NEAR_RITZ 0.4
#define ENOUGH    1.5
/* Where as many steps as this times those that are allowed would not do, at the rate so far. */
#define HOPELESS 1.5
/* M is K but for rounding where there is one level only, and steps are cheap. */
#define NEAR_ONE 0.9

static void multiply_by_diagonal(void *ctx, int64_t begin, int64_t end)
{
    const by_diagonal *x = ctx;
    for (int64_t j = begin; j < end; j++)
        x->to[j] = x->K->val[x->K->ptr[j]] * x->from[j];
}

static void divide_by_norm(void *ctx, int64_t begin, int64_t end)
{
    const by_diagonal *x = ctx;
    for (int64_t j = begin; j < end; j++)
        x->to[j] /= x->norm;
}

/* power = D z / ||D^1/2 z||, D = diag(K). Returns that norm. */
static double begin_power(double *power, const double *z, const uz_csc *K)
{
    by_diagonal x = {.K = K, .to = power, .from = z};
    uz_by_pieces(multiply_by_diagonal, &x, K->cols);
    x.norm = sqrt(uz_long_dot(K->cols, power, z));
    uz_by_pieces(divide_by_norm, &x, K->cols);
    return x.norm;
}

/* Will so many steps not do? A residual that has fallen by `fallen` has to fall by `needed`, logarithms both. In the
 * first third it falls no faster than later, but for what rounds off. */
static bool are_hopeless(int count, int most, double fallen, double needed)
{
    return 3 * count >= most && fallen * HOPELESS * (double)most < needed * (double)count;
}

/* What the steps tell, and what they are asked for. */
typedef struct {
    coefficients *c;
    int most;             /* steps; patience: uz_amg_of */
    double share;         /* sqrt(r_k'M^-1 r_k) over this is a level of excluded() */
    double first, before; /* r_0'M^-1 r_0; the bound at the last check */
    double square;        /* r_k'M^-1 r_k */
    double lambda;        /* the bound so far, 0: there is none */
    double least;         /* a smaller one is not wanted */
    bool enough, hopeless, too_small;
    const uz_hooks *hooks;
} bounding;

/* Are further steps worth making? */
static bool take_in(void *ctx, double along, double last, double square)
{
    bounding *x = ctx;
    coefficients *c = x->c;
    x->first = c->count == 0 ? last : x->first;
    x->square = square;
    c->alpha[c->count] = along;
    c->beta[c->count++] = square / last;
    x->hopeless = x->most < STEPS_MOST &&
                  are_hopeless(c->count, x->most, log(x->first / square), log(x->first) - 2.0 * log(x->share));
    if (!x->hopeless && sqrt(square) < x->share) {
        x->lambda = excluded(c, sqrt(square) / x->share);
        const bool checked = c->count % CHECK_EVERY == 0 && x->lambda > 0.0 && x->lambda < ENOUGH * x->before;
        x->enough = x->lambda > NEAR_ONE || x->lambda >= NEAR_RITZ * excluded(c, 0.0) || checked;
        x->before = c->count % CHECK_EVERY == 0 ? x->lambda : x->before;
    }
    /* Ritz values come down, and the bound ends near that share of the least */
    x->too_small = x->least > 0.0 && NEAR_RITZ * excluded(c, 0.0) < x->least;
    return !x->enough && !x->hopeless && !x->too_small && c->count < x->most && square > 0.0 && !uz_cancelled(x->hooks);
}

/* A step of so much along the direction, in pieces that threads share. */
typedef struct {
    uz_cg *cg;
    double alpha;
} step;

static void reduce_residual(void *ctx, int64_t begin, int64_t end)
{
    const step *s = ctx;
    const double alpha = s->alpha, *restrict q = s->cg->z;
    double *restrict r = s->cg->r;
    for (int64_t j = begin; j < end; j++)
        r[j] -= alpha * q[j];
}

/* Steps of conjugate gradients without the solution, from the residual r. */
static uz_status take_steps(bounding *x, uz_cg *cg, const uz_csc *K, uz_error *err)
{
    uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
    double square = x->square = uz_long_dot(cg->n, cg->r, cg->z);
    memcpy(cg->p, cg->z, (size_t)cg->n * sizeof *cg->p);
    for (bool go_on = square > 0.0 && !uz_cancelled(x->hooks); status == UZ_OK && go_on;) {
        cg->mg->kind->multiply(cg->mg, K, cg->room, cg->z, cg->p);
        const double curvature = uz_long_dot(cg->n, cg->p, cg->z), last = square;
        if (!(curvature > 0.0))
            return uz_cg_fail_direction(err);
        const double alpha = square / curvature;
        uz_by_pieces(reduce_residual, &(step){cg, alpha}, cg->n);
        status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
        square = uz_long_dot(cg->n, cg->r, cg->z);
        uz_cg_turn(cg, square / last);
        go_on = status == UZ_OK && take_in(x, alpha, last, square);
    }
    return status;
}

/* The same of two residuals that the multigrid draws; c: of both. *told: as the lesser bound has it. */
static uz_status take_both(bounding *told, coefficients *c, uz_cg *cg, uz_error *err)
{
    bounding x[2] = {*told, *told};
    for (int l = 0; l < 2; l++) {
        x[l].c = c + l;
        x[l].c->count = 0;
        x[l].share = LEAST_SHARE_BOTH;
        x[l].most = x[l].most < STEPS_MOST ? (int)(BOTH_STEPS * (double)x[l].most) : STEPS_MOST;
    }
    const uz_status status = cg->mg->kind->step_both(cg->mg, cg->room, SEED, take_in, (void *[2]){&x[0], &x[1]}, err);
    for (int l = 0; l < 2; l++)
        if (!(x[l].lambda > 0.0))
            x[l].lambda = excluded(x[l].c, sqrt(x[l].square) / x[l].share);
    *told = x[x[1].lambda < x[0].lambda ? 1 : 0];
    told->enough = x[0].enough && x[1].enough;
    told->square = fmax(x[0].square, x[1].square);
    return status;
}

/* K >= A - slack M for A as steps in single precision have it, by mg->rough. lambda_max(M^-1 D) is known by a few
 * powers, which were up to 2.3 times too small of 123 bodies. Where slack is more than ROUGH_MOST, half of what bounds
 * of hard bodies are, or is seen to take more than half of this one, steps are in double precision.
 */
#define ROUGH_MOST  0.03
#define POWERS_MISS 3

/* c: two of them. info->lambda: the bound, 0 where STEPS_MOST steps do not give one. most: lambda_max(M^-1 D) by
 * find_most. */
static uz_status bound_below(uz_amg_info *info, coefficients *c, uz_cg *cg, const uz_csc *K, double most, int patience,
                             const uz_hooks *hooks, uz_error *err)
{
    const double slack = POWERS_MISS * cg->mg->rough * most;
    const bounding begun = {.c = c,
                            .most = patience > 0 && patience < STEPS_MOST ? patience : STEPS_MOST,
                            .share = LEAST_SHARE / sqrt(cg->mg->most),
                            .hooks = hooks};
    bounding x = begun;
    uz_status status = UZ_OK;
    x.least = 2.0 * slack;
    if (cg->mg->kind->step_roughly && slack <= ROUGH_MOST)
        status = cg->mg->kind->step_roughly(cg->mg, cg->room, cg->r, take_in, &x, err);
    if (status == UZ_OK && x.enough && x.lambda > x.least) {
        info->iterations = c->count;
        info->lambda = x.lambda - slack;
        return UZ_OK;
    }
    if (status == UZ_OK && !x.hopeless) {
        c->count = 0;
        x = begun;
        status = cg->mg->kind->step_both && cg->mg->levels > 1 ? take_both(&x, c, cg, err) : take_steps(&x, cg, K, err);
    }
    info->iterations = x.c->count;
    if (status == UZ_OK && uz_cancelled(hooks))
        return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    if (status == UZ_OK && !x.enough && x.most < STEPS_MOST && x.square > 0.0)
        return uz_fail(err, UZ_ERR_LIMIT, "K", "conjugate gradients would take too many iterations, as %d have shown",
                       x.c->count);
    /* the residual may have vanished, too */
    info->lambda = x.lambda > 0.0 ? x.lambda : excluded(x.c, sqrt(x.square) / x.share);
    return status;
}

/* Below this rounding of the entries of K alone makes or unmakes a digit of lambda_min(D^-1 K). */
#define RCOND_LEAST DBL_EPSILON

/* *most: lambda_max(D^1/2 M^-1 D^1/2), D = diag(K), which so few powers find too small, mostly by a tenth.
 * power: room, n. */
static uz_status find_most(double *most, double *power, uz_cg *cg, const uz_csc *K, uz_error *err)
{
    uz_status status = UZ_OK;
    *most = INFINITY;
    uz_long_copy(cg->n, power, cg->r);
    for (int k = 0; status == UZ_OK && k < POWERS; k++) {
        status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, power, err);
        *most = begin_power(power, cg->z, K);
    }
    return status;
}

static uz_status check_rcond(const uz_amg_info *info, uz_error *err)
{
    if (info->rcond >= RCOND_LEAST)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is singular to working precision, or too ill-conditioned for conjugate gradients (reciprocal "
                   "condition %.2g after %lld iterations): the body can move without resistance, or its stiffnesses "
                   "differ by too much",
                   info->rcond, (long long)info->iterations);
}

uz_status uz_amg_of(uz_amg **out, uz_multigrid *mg, const uz_csc *K, int patience, const uz_hooks *hooks, uz_error *err)
{
    const double start = uz_seconds();
    uz_amg *amg = uz_alloc_zero(1, sizeof *amg);
    coefficients *c = uz_alloc_zero(2, sizeof *c);
    double *power = uz_alloc(mg->n, sizeof *power), most = INFINITY;
    uz_cg cg = {0};
    *out = NULL;
    uz_status status =
        amg && c && power ? uz_cg_init(&cg, mg, err) : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid");
    if (status == UZ_OK) {
        amg->info.levels = mg->levels;
        amg->info.bytes = mg->bytes;
        uz_by_pieces(draw_residual, &(by_diagonal){.K = K, .to = cg.r}, cg.n);
        status = find_most(&most, power, &cg, K, err);
    }
    if (status == UZ_OK)
        status = bound_below(&amg->info, c, &cg, K, most, patience, hooks, err);
    if (status == UZ_OK) {
        amg->info.rcond = amg->info.lambda / most;
        status = check_rcond(&amg->info, err);
    }
    uz_cg_clear(&cg);
    free(c);
    free(power);
    if (status == UZ_OK) {
        mg->drift = FLT_EPSILON / sqrt(amg->info.rcond);
        amg->mg = mg;
        amg->info.spectrum_s = uz_seconds() - start;
        *out = amg;
        return UZ_OK;
    }
    uz_multigrid_free(mg);
    free(amg);
    return status;
}

uz_status uz_amg_of_definite(uz_amg **out, uz_multigrid *mg, uz_error *err)
{
    *out = uz_alloc_zero(1, sizeof **out);
    if (!*out) {
        uz_multigrid_free(mg);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid");
    }
    (*out)->mg = mg;
    (*out)->info = (uz_amg_info){.levels = mg->levels, .bytes = mg->bytes, .rcond = INFINITY};
    return UZ_OK;
}

/* Bilinear elements of aspect 10 to 1 couple as strongly along their long sides, in absolute value, as square ones do
 * across a corner: a threshold that sees the difference, larger by a factor, makes coarse levels fuller, so it is tried
 * only where the usual one does badly, and left where it sees none: they are then as full as they were. Measured at
 * aspect 15 to 1 in the plane: lambda 0.29 instead of 0.02, for 4 times the bytes; at 10 to 1 on tet4 0.07 instead of
 * 0.005. On solids a factor of 15 takes more time than it spares. */
#define SECOND_STRONG 4.0
#define SEES_MORE     1.1
#define BAD_LAMBDA    0.02
/* The same for who has another way, and takes it where the bound is not much better than this. */
#define WORST_LAMBDA 0.002
#define WORTH_LAMBDA 3.0

/* A multigrid at one threshold, or why there is none. */
typedef struct {
    uz_amg *amg;
    uz_status end;
    uz_error failure;
    int levels; /* also where K is refused for what iterations showed; 0: no multigrid was made */
    size_t bytes;
    double create_s;
} attempt;

/* least: bytes that its levels have to take, or UZ_ERR_UNSUPPORTED. */
static void try_threshold(attempt *a, const uz_csc *K, const uz_modes *modes, size_t memory_limit, size_t least,
                          int patience, const uz_hooks *hooks)
{
    const uz_stop stop = {hooks, INFINITY};
    const double start = uz_seconds();
    uz_multigrid *mg = NULL;
    a->end = uz_multigrid_create(&mg, K, modes, NULL, memory_limit, &stop, &a->failure);
    a->create_s = uz_seconds() - start;
    if (a->end != UZ_OK)
        return;
    a->levels = mg->levels;
    a->bytes = mg->bytes;
    if (mg->bytes < least) {
        uz_multigrid_free(mg);
        a->end = UZ_ERR_UNSUPPORTED;
        return;
    }
    a->end = uz_amg_of(&a->amg, mg, K, patience, hooks, &a->failure);
    if (a->amg)
        a->amg->info.create_s = a->create_s;
}

static bool does_badly(const attempt *a, int patience)
{
    if (a->levels < 2)
        return false;
    return a->end == UZ_OK ? a->amg->info.lambda < (patience == 0 ? BAD_LAMBDA : WORST_LAMBDA)
                           : a->end == (patience == 0 ? UZ_ERR_NOT_SPD : UZ_ERR_LIMIT);
}

/* The better of two thresholds; the first one's failure stands where the second fails too. */
uz_status uz_amg_create(uz_amg **out, const uz_csc *K, uz_modes *modes, size_t memory_limit, int patience,
                        const uz_hooks *hooks, uz_error *err)
{
    attempt tried[2] = {{.end = UZ_OK}, {.end = UZ_ERR_UNSUPPORTED}};
    attempt *first = &tried[0], *second = &tried[1];
    try_threshold(first, K, modes, memory_limit, 0, patience, hooks);
    if (does_badly(first, patience)) {
        modes->strong *= SECOND_STRONG;
        try_threshold(second, K, modes, memory_limit, (size_t)(SEES_MORE * (double)first->bytes), patience, hooks);
    }
    uz_modes_clear(modes);
    const bool better = second->end == UZ_OK &&
                        (first->end != UZ_OK || second->amg->info.lambda > WORTH_LAMBDA * first->amg->info.lambda);
    const bool ended = second->end == UZ_ERR_CANCELLED || (second->end == UZ_ERR_MEMORY && first->end != UZ_OK);
    attempt *told = better || ended ? second : first, *other = told == first ? second : first;
    *out = told->amg;
    if (*out) {
        (*out)->info.create_s += other->create_s;
        (*out)->info.spectrum_s += other->amg ? other->amg->info.spectrum_s : 0.0;
    } else if (err) {
        *err = told->failure;
    }
    uz_amg_free(other->amg);
    return told->end;
}

void uz_amg_free(uz_amg *amg)
{
    if (!amg)
        return;
    uz_multigrid_free(amg->mg);
    free(amg);
}

/* K in blocks takes 8 bytes an entry, in two parts; the rest is the prolongation, some four blocks a node, the coarse
 * levels, and the last of them, dense, of up to 500 rows. Measured on plane and solid bodies: 0.95 to 1.15 times what
 * it is, of small ones more. */
double uz_amg_predict_bytes(int64_t n, int64_t nnz, int modes)
{
    return 7.8 * (double)nnz + (double)n * (40.0 + 50.0 * modes) + 4.0 * 500.0 * 500.0;
}
