/* probe.c: how near to 0 an eigenvalue of diag(K)^-1 K can be, by solves that nobody vouches for.
 *
 * With D = diag(K), A = D^1/2 K^-1 D^1/2 and a standard normal s, ||A s|| >= ||A|| |gamma|, where gamma, the share of s
 * in the direction that A stretches most, is standard normal as well: below t in each of k trials only with the
 * probability (0.8 t)^k. Any y, however it was found, has a residual q = D^1/2 s - K y that is computed here, and
 *
 *     A s = D^1/2 y + D^1/2 K^-1 q,   so   ||A|| t <= max ||D^1/2 y|| + ||A|| max ||D^-1/2 q||,
 *
 * which bounds ||A|| = 1 / min |lambda(D^-1 K)| where the residuals are below t. It is the bound by a random start of
 * Kuczynski and Wozniakowski, SIAM J. Matrix Anal. Appl. 13 (1992), after one step of inverse iteration, for inexact
 * solves. Good solves need two trials, rougher ones more: 0.8 t is the k-th root of the chance that is taken, t 1e-6
 * for two, 0.1 for twelve.
 *
 * No probability is spent on how M came to be: a solve that misses a dof leaves what s has there as its residual, and
 * one of another matrix leaves its difference. */
#include "amg/amg.h"

#include "core/aside.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/alloc.h"
#include "core/hooks.h"
#include "core/random.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In pairs, which are solved at once. */
enum { PAIR = 2, PROBES_MOST = 12, STEPS_MOST = 1000 };

/* Of what is claimed after the fewest trials, and after each more of them: 1e-12 in all. */
#define CHANCE      8e-13
#define CHANCE_MORE 1e-14
/* What a share of t may be left by residuals, */
#define LEFT 0.5
/* and is asked of solves, whose norm is another one: by M, as a rule somewhat larger than that by diag(K). */
#define ASKED 0.25

static double threshold(int trials)
{
    return pow(trials > PAIR ? CHANCE_MORE : CHANCE, 1.0 / trials) / 0.8;
}

/* The norm of D^-1/2 |K| D^-1/2, at most: its largest sum of a row; times what summing the longest row rounds. */
uz_status uz_amg_rounding(double *rounding, const uz_csc *K, uz_error *err)
{
    double *sum = uz_alloc_zero(K->cols, sizeof *sum), *root = uz_alloc(K->cols, sizeof *root), most = 0.0;
    int64_t *count = uz_alloc_zero(K->cols, sizeof *count), longest = 0;
    const bool ok = sum && root && count;
    for (int64_t j = 0; ok && j < K->cols; j++)
        root[j] = sqrt(1.0 / K->val[K->ptr[j]]);
    for (int64_t j = 0; ok && j < K->cols; j++) {
        double own = sum[j] + K->val[K->ptr[j]] * root[j] * root[j]; /* the diagonal entry stands first */
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            const int64_t i = K->idx[k];
            const double scaled = fabs(K->val[k]) * root[i] * root[j];
            own += scaled;
            sum[i] += scaled;
            count[i]++;
        }
        sum[j] = own;
        count[j] += K->ptr[j + 1] - K->ptr[j];
    }
    for (int64_t j = 0; ok && j < K->cols; j++) {
        most = fmax(most, sum[j]);
        longest = count[j] > longest ? count[j] : longest;
    }
    *rounding = DBL_EPSILON * (double)(longest + 1) * most;
    uz_free_all(sum, root, count);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to check solves of %lld dofs", (long long)K->cols);
}

/* By the rate q of a solve, of which the bound is (1 - sqrt(lambda)) / (1 + sqrt(lambda)) where 1 is the largest
 * eigenvalue: (1 - q)^2 / (1 + q)^2. */
static double guess_lambda(const uz_cg_info *info)
{
    if (info->iterations == 0 || !(info->last > 0.0) || !(info->last < info->first))
        return 1.0;
    const double rate = pow(info->last / info->first, 1.0 / (double)info->iterations);
    const double root = (1.0 - rate) / (1.0 + rate);
    return root * root;
}

enum { TIGHTENED_MOST = 3 };

/* What a pair of trials needs, n numbers for each of them, and what came of each. A trial's own numbers are found by a
 * thread: who solves waits meanwhile. */
struct uz_amg_trials {
    double *y, *b, *q;
    const uz_multigrid *mg;
    uz_multigrid_room *room;
    const uz_csc *K;
    double rounding; /* of uz_amg_info */
    bool drawn;      /* b and y of the next pair */
    uint64_t state[PAIR];
    double reach[PAIR];  /* ||D^1/2 y|| */
    double missed[PAIR]; /* >= ||D^-1/2 q|| */
    double work[PAIR];   /* b'K^-1 b, but for q'K^-1 q */
};

/* b = D^1/2 s, y = 0. */
static void draw(void *ctx, int trial)
{
    uz_amg_trials *x = ctx;
    const uz_csc *K = x->K;
    double *b = x->b + trial * K->cols;
    uint64_t state = x->state[trial]; /* the other thread's stands beside it */
    for (int64_t j = 0; j < K->cols; j++)
        b[j] = sqrt(K->val[K->ptr[j]]) * uz_normal(&state);
    x->state[trial] = state;
    memset(x->y + trial * K->cols, 0, (size_t)K->cols * sizeof *x->y);
}

uz_amg_trials *uz_amg_draw(const uz_csc *K)
{
    const int64_t n = K->cols;
    uz_amg_trials *x = uz_alloc_zero(1, sizeof *x);
    if (!x)
        return NULL;
    *x = (uz_amg_trials){.y = uz_alloc(PAIR * n, sizeof *x->y),
                         .b = uz_alloc(PAIR * n, sizeof *x->b),
                         .q = uz_alloc(PAIR * n, sizeof *x->q),
                         .K = K,
                         .drawn = true,
                         .state = {0xD1B54A32D192ED03u, 0x8CB92BA72F3D8DD6u}};
    if (!x->y || !x->b || !x->q) {
        uz_amg_trials_free(x);
        return NULL;
    }
    uz_aside_share(draw, x, PAIR);
    return x;
}

void uz_amg_trials_free(uz_amg_trials *x)
{
    if (x)
        uz_free_all(x->y, x->b, x->q);
    free(x);
}

static void measure(void *ctx, int trial)
{
    uz_amg_trials *x = ctx;
    const uz_csc *K = x->K;
    const double *y = x->y + trial * K->cols, *b = x->b + trial * K->cols, *q = x->q + trial * K->cols;
    double wide = 0.0, left = 0.0, size = 0.0, work = 0.0;
    for (int64_t j = 0; j < K->cols; j++) {
        const double own = K->val[K->ptr[j]];
        wide += own * y[j] * y[j];
        left += q[j] * q[j] / own;
        size += b[j] * b[j] / own;
        work += y[j] * (b[j] + q[j]);
    }
    const double reach = isnan(wide) ? INFINITY : sqrt(wide);
    x->reach[trial] = reach;
    x->missed[trial] = (isnan(left) ? INFINITY : sqrt(left)) + x->rounding * reach + DBL_EPSILON * sqrt(size);
    x->work[trial] = work;
}

/* Two, of which the residuals are to be below `most`. */
static uz_status try_both(uz_amg_info *amg, double *reach, double *missed, uz_amg_trials *x, double most,
                          const uz_hooks *hooks, uz_error *err)
{
    uz_cg_stop stop = {
        .absolute = ASKED / LEFT * most, .max_iterations = STEPS_MOST, .hooks = hooks, .deadline = INFINITY};
    double before = INFINITY;
    bool negative = false;
    if (!x->drawn)
        uz_aside_share(draw, x, PAIR);
    x->drawn = false;
    for (int k = 0; k < TIGHTENED_MOST; k++) {
        uz_cg_info info = {0};
        const uz_status status = x->mg->kind->solve(x->mg, x->K, x->room, &info, x->y, x->q, x->b, PAIR, &stop, err);
        if (status != UZ_OK)
            return status;
        if (!(amg->lambda > 0.0))
            amg->lambda = guess_lambda(&info);
        *reach = *missed = 0.0;
        negative = false;
        uz_aside_share(measure, x, PAIR);
        for (int trial = 0; trial < PAIR; trial++) {
            *reach = fmax(*reach, x->reach[trial]);
            *missed = fmax(*missed, x->missed[trial]);
            negative = negative || (x->missed[trial] < 1.0 && !(x->work[trial] > 0.0));
        }
        if (*missed <= most || !(*missed < 0.5 * before) || !info.met)
            break;
        before = *missed;
        stop.absolute *= 0.5 * most / *missed;
    }
    if (negative)
        return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                       "K is not positive definite: a force does negative work on the displacement that it causes. "
                       "Check the signs of K.");
    return UZ_OK;
}

static uz_status fail_probes(double missed, uz_error *err)
{
    return uz_fail(err, UZ_ERR_UNSUPPORTED, "operator",
                   "operator distributed: solves by the group of processes leave too much of random loads (%.1g of "
                   "each dof's) to certify anything by them: K is too ill-conditioned for it, or they are wrong. Use "
                   "condensed or factored",
                   missed);
}

uz_status uz_amg_probe(uz_amg *amg, uz_amg_trials *x, double rounding, const uz_hooks *hooks, uz_error *err)
{
    const double start = uz_seconds();
    double reach = 0.0, missed = 0.0;
    size_t bytes;
    uz_status status = UZ_OK;
    x->mg = amg->mg;
    x->room = amg->mg->kind->room(amg->mg, &bytes);
    x->rounding = rounding;
    if (!x->room)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to check solves of %lld dofs", (long long)x->K->cols);
    amg->info.least = 0.0;
    amg->info.rounding = rounding;
    for (int k = PAIR; status == UZ_OK && k <= PROBES_MOST && !(amg->info.least > 0.0); k += PAIR) {
        const double t = threshold(k);
        double wide = INFINITY, left = INFINITY;
        if (uz_cancelled(hooks)) {
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
            break;
        }
        status = try_both(&amg->info, &wide, &left, x, LEFT * t, hooks, err);
        reach = fmax(reach, wide);
        missed = fmax(missed, left);
        if (status == UZ_OK && missed <= LEFT * t)
            amg->info.least = (t - missed) / reach;
    }
    if (status == UZ_OK && !(amg->info.least > 0.0))
        status = fail_probes(missed, err);
    if (status == UZ_OK) {
        amg->info.rcond = fmin(amg->info.rcond, 1.0 / reach);
        amg->mg->drift = FLT_EPSILON / sqrt(amg->info.rcond);
    }
    if (x->room)
        amg->mg->kind->free_room(x->room);
    amg->info.spectrum_s += uz_seconds() - start;
    return status;
}
