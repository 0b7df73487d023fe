#include "run/semicoercive.h"
#include "dual/form.h"

#include "run/setup_cache.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "semicoercive/contact_proof.h"
#include "semicoercive/null_space.h"
#include "run/semicoercive_private.h"
#include "run/settings.h"
#include "run/solve.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Springs of phase 1 beside the rows' own stiffness: soft ones let a round move the body far, and leave K + N'R N
 * digits enough. A power of two. */
#define SOFT 0x1p-14

/* Accuracy of a round: it only has to find which rows press. */
#define ROUND_ERROR 1e-6

enum { ROUNDS = 60, EXACT_TRIES = 4, IMPATIENCE = 8 };

/* Rows that press at least this hard, beside the hardest, are augmented: few and safe ones first. */
static const double HARD[] = {0.25, 1e-2, 1e-4};

/* A pivot this many d eps large may be what rounding left of a zero. */
static const double DOUBTFUL = 1e3;

static bool is_doubtful(const uz_result *result)
{
    return result->summary.rcond < DOUBTFUL * DBL_EPSILON * (double)result->d;
}

bool uz_may_be_semicoercive(uz_status refused, const uz_result *result, const uz_problem *problem,
                            const uz_settings *settings)
{
    if (problem->kind == UZ_PROBLEM_SCENE)
        return refused == UZ_ERR_FREE_BODY;
    if (!settings->semidefinite)
        return false;
    if (problem->qp.N.rows < 1 || refused != UZ_OK)
        return refused == UZ_ERR_NOT_SPD && problem->qp.N.rows > 0;
    return result->summary.outcome == UZ_PRECISION_LIMIT && is_doubtful(result);
}

static uz_status build_scene(uz_semi *s, uz_error *err)
{
    uz_status status = uz_body_model_build(&s->model, &s->problem->scene, UZ_BODY_HELD, err);
    if (status != UZ_OK)
        return status;
    s->load = uz_alloc_zero(s->model.d + s->model.m, sizeof(double));
    s->prescribed = uz_alloc_zero(s->model.n_fixed, sizeof(double));
    if (!s->load || !s->prescribed)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)s->model.d);
    double *h = s->load + s->model.d;
    status = uz_body_model_load(s->load, h, s->prescribed, &s->model, &s->problem->scene, err);
    s->of = (uz_singular){&s->model.K, &s->model.N, s->load, h};
    s->Z = s->model.modes;
    s->k = s->model.n_modes;
    return status;
}

static uz_status prepare(uz_semi *s, uz_error *err)
{
    const uz_qp *qp = &s->problem->qp;
    uz_status status = UZ_OK;
    s->of = (uz_singular){&qp->K, &qp->N, qp->p, qp->h};
    if (s->is_scene)
        status = build_scene(s, err);
    if (status != UZ_OK)
        return status;
    s->d = s->of.K->cols;
    s->m = s->of.N->rows;
    if (s->with_factor.op == UZ_OPERATOR_AUTO || !uz_dual_form_of(s->with_factor.op)->can.needs_factor) {
        /* null spaces and the noise of augmented matrices are bounded with a factor: nothing else will do */
        int64_t *dofs = NULL, n_b = 0;
        status = uz_dual_contact_dofs(&dofs, &n_b, s->of.N, err);
        if (status != UZ_OK)
            return status;
        s->with_factor.op = uz_dual_choose(s->of.N, n_b, UZ_OPERATOR_AUTO);
        free(dofs);
    }
    double **room[] = {&s->stiffness, &s->soft, &s->weight, &s->target};
    bool ok = (s->inverse = uz_alloc_zero(s->d, sizeof(double))) != NULL;
    for (int i = 0; i < 4; i++)
        ok = (*room[i] = uz_alloc_zero(s->m, sizeof(double))) && ok;
    s->active = uz_alloc_zero(s->m, sizeof(bool));
    s->provable = uz_alloc_zero(s->m, sizeof(bool));
    if (!ok || !s->active || !s->provable)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)s->m);
    status = uz_csc_transpose(&s->Nt, s->of.N, err);
    if (status != UZ_OK)
        return status;
    uz_row_stiffness(s->stiffness, s->inverse, s->of.K, &s->Nt);
    for (int64_t i = 0; i < s->m; i++) {
        s->soft[i] = SOFT * s->stiffness[i];
        s->provable[i] = true;
    }
    memcpy(s->target, s->of.h, (size_t)s->m * sizeof *s->target);
    if (!s->cache && !(s->cache = s->own_cache = uz_cache_new(SIZE_MAX)))
        return uz_no_memory(err, "a cache");
    return UZ_OK;
}

/* Solves with the weights and targets that stand in s, in the time that is left; the result takes the place of s->last.
 * exact: by the method that was asked for. */
static uz_status solve_augmented(uz_semi *s, bool exact, double relative_error, const uz_hooks *hooks, uz_error *err)
{
    uz_problem augmented;
    uz_result *result = NULL;
    uz_settings settings = *s->settings;
    settings.balanced = false;
    settings.relative_error = relative_error;
    settings.time_limit_s = fmax(0.0, s->deadline - uz_seconds());
    if (!exact) {
        settings.method = UZ_METHOD_AUTO;
        settings.stopping = UZ_STOP_CERTIFIED;
        settings.alpha = 0.0;
    }
    uz_status status = uz_augment(&augmented, &s->of, &s->Nt, s->weight, s->target, err);
    if (status == UZ_OK)
        status = uz_solve_rounds(&result, &augmented, &settings, NULL, NULL, s->cache, hooks, err);
    uz_augmented_clear(&augmented);
    if (status != UZ_OK) {
        uz_result_free(result);
        return status;
    }
    if (s->last)
        uz_timings_add(&result->summary.timings, &s->last->summary.timings);
    uz_result_free(s->last);
    s->last = result;
    return UZ_OK;
}

/* The null space of K in matrices, from the factor of the first round's problem. K + N'R N that can't be factored, or
 * K that is not semidefinite, is the ordinary refusal: UZ_ERR_NOT_SPD. */
static uz_status find_null_space(uz_semi *s, uz_error *err)
{
    uz_problem augmented;
    uz_setup *setup = NULL;
    uz_reuse reused;
    uz_status status = uz_check_semidefinite(s->of.K, s->settings, s->hooks, err);
    if (status != UZ_OK)
        return status;
    status = uz_augment(&augmented, &s->of, &s->Nt, s->soft, s->target, err);
    if (status == UZ_OK)
        status = uz_setup_acquire(&setup, &reused, s->cache, &augmented, NULL, s->settings, s->hooks, err);
    if (status == UZ_OK)
        status = uz_null_space(&s->null_space, &s->k, s->of.K, &augmented.qp.K, s->of.N, &s->Nt, s->soft, setup->factor,
                               s->hooks, err);
    s->Z = s->null_space;
    uz_setup_release(s->cache, setup);
    uz_augmented_clear(&augmented);
    if (status == UZ_OK && s->k == 0)
        status = uz_fail(err, UZ_ERR_NOT_SPD, "K", "K is singular to working precision");
    return status;
}

/* How the last solve ended leaves nothing more to do. */
static bool is_over(const uz_semi *s)
{
    uz_outcome outcome = s->last->summary.outcome;
    return outcome == UZ_INFEASIBLE || outcome == UZ_OUT_OF_REACH || outcome == UZ_TIME_LIMIT ||
           outcome == UZ_DISMISSED || outcome == UZ_ITERATION_LIMIT;
}

/* A bound on what the rounding of K_R and p_R does to u, in the norm of K_R. A force N'f on rows alone is at most
 * sqrt(sum f_i^2 / R_i), as N K_R^-1 N' <= R^-1; other forces need the norm of K_R^-1. */
static uz_status bound_noise(const uz_semi *s, double *bound, uz_error *err)
{
    uz_problem augmented;
    uz_setup *setup = NULL;
    uz_reuse reused;
    bool single = true;
    double sum = 0.0, rows = 0.0, *noise = uz_alloc_zero(s->d, sizeof *noise);
    uz_status status = uz_augment(&augmented, &s->of, &s->Nt, s->weight, s->target, err);
    if (status == UZ_OK && !noise)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)s->d);
    if (status == UZ_OK)
        uz_augmented_noise(noise, &augmented, &s->Nt, s->weight, s->target, s->last->u);
    for (int64_t i = 0; status == UZ_OK && i < s->m; i++) {
        int64_t q = s->Nt.ptr[i], j = q < s->Nt.ptr[i + 1] ? s->Nt.idx[q] : 0;
        if (!(s->weight[i] > 0.0))
            continue;
        single = single && s->Nt.ptr[i + 1] == q + 1 && s->of.N->ptr[j + 1] == s->of.N->ptr[j] + 1;
        rows += single ? pow(noise[j] / s->Nt.val[q], 2) / s->weight[i] : 0.0;
    }
    if (status == UZ_OK && !single)
        status = uz_setup_acquire(&setup, &reused, s->cache, &augmented, NULL, s->settings, s->hooks, err);
    if (setup) {
        for (int64_t j = 0; j < s->d; j++)
            sum += noise[j] > 0.0 ? noise[j] / augmented.qp.K.val[augmented.qp.K.ptr[j]] * noise[j] : 0.0;
        rows = sum > 0.0 ? uz_setup_inverse_bound(setup, &augmented.qp.K) * sum : 0.0;
    }
    *bound = sqrt(rows);
    uz_setup_release(s->cache, setup);
    uz_augmented_clear(&augmented);
    free(noise);
    return status;
}

/* Is the answer of the augmented problem one of the problem itself, and how far is it from the exact one? */
static uz_status judge_exact(uz_semi *s, uz_contact_verdict *verdict, double *relative, uz_error *err)
{
    double norm, augmented, noise = INFINITY;
    s->proved = false;
    *relative = INFINITY;
    *verdict = UZ_CONTACT_TOO_COARSE;
    if (s->last->ray || !isfinite(s->last->summary.certificate.absolute_error))
        return UZ_OK;
    uz_status status = bound_noise(s, &noise, err);
    if (status != UZ_OK)
        return status;
    s->absolute = s->last->summary.certificate.absolute_error * (1.0 + 1e-9) + noise;
    uz_contact_claim claim = {&s->of, &s->Nt, s->inverse, s->weight, s->last->u, s->last->r, s->absolute, INFINITY};
    status = uz_prove_contact(verdict, s->provable, &claim, err);
    if (status == UZ_OK && *verdict == UZ_CONTACT_NO_WITNESS) {
        /* Rows that share dofs with others need to know which of these are surely open: only then a bound is made on
         * W^1/2 K_R^-1 W^-1/2's norm for the last augmented problem, W as in uz_row_stiffness: K_R's diagonal is at
         * least that of K. */
        uz_problem problem;
        uz_setup *setup = NULL;
        uz_reuse reused;
        double most = 1.0;
        status = uz_augment(&problem, &s->of, &s->Nt, s->weight, s->target, err);
        if (status == UZ_OK)
            status = uz_setup_acquire(&setup, &reused, s->cache, &problem, NULL, s->settings, s->hooks, err);
        const uz_csc *K = &problem.qp.K;
        for (int64_t j = 0; status == UZ_OK && j < s->d; j++)
            most = fmax(most, 1.0 / (s->inverse[j] * K->val[K->ptr[j]]));
        if (status == UZ_OK)
            claim.inverse_bound = most * uz_setup_inverse_bound(setup, K);
        uz_setup_release(s->cache, setup);
        uz_augmented_clear(&problem);
        if (status == UZ_OK)
            status = uz_prove_contact(verdict, s->provable, &claim, err);
    }
    s->proved = status == UZ_OK && *verdict == UZ_CONTACT_PROVED;
    if (status == UZ_OK)
        status = uz_semi_norms(&norm, &augmented, s, s->absolute, err);
    if (status != UZ_OK)
        return status;
    *relative = s->absolute < norm ? s->absolute / (norm - s->absolute) : INFINITY;
    return status;
}

/* Phase 2 on the rows that stand in s->weight. *done: s->last is what there is to tell. UZ_ERR_NOT_SPD: these rows
 * don't hold the body. */
static uz_status solve_exact(uz_semi *s, bool *done, uz_contact_verdict *verdict, uz_error *err)
{
    double norm, augmented, relative = INFINITY;
    uz_status first = uz_semi_norms(&norm, &augmented, s, 0.0, err);
    if (first != UZ_OK)
        return first;
    /* the norm of the augmented problem counts the springs, and motions of the supports, too */
    double request = fmin(1.0, fmax(1e-15, 0.5 * s->requested * (norm / fmax(augmented, DBL_MIN))));
    for (int attempt = 0; attempt < EXACT_TRIES; attempt++) {
        uz_status status = solve_augmented(s, true, request, s->hooks, err);
        if (status == UZ_OK)
            status = judge_exact(s, verdict, &relative, err);
        if (status != UZ_OK)
            return status;
        bool met = s->last->summary.outcome == UZ_CONVERGED;
        *done = (s->proved && (relative <= s->requested || !met)) || is_over(s);
        if (*done || *verdict >= UZ_CONTACT_DENIED || !met)
            return UZ_OK;
        request = fmax(1e-15, request * fmin(1e-2, 0.5 * s->requested / relative));
    }
    *done = s->proved;
    return UZ_OK;
}

/* Phase 2, with more rows until they hold the body and are proved to be in contact. */
static uz_status try_exact(uz_semi *s, bool *done, uz_error *err)
{
    const size_t levels = sizeof HARD / sizeof HARD[0];
    int64_t before = 0, most = 0;
    double hardest = 0.0;
    bool held = false;
    double *press = uz_alloc_zero(s->m, sizeof *press);
    uz_status status = press ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)s->m);
    /* the energy that a row's force has in a spring of its own stiffness: comparable between rows in any scaling */
    for (int64_t i = 0; status == UZ_OK && i < s->m; i++)
        if (s->active[i] && s->provable[i] && s->stiffness[i] > 0.0)
            press[i] = -s->last->r[i] / sqrt(s->stiffness[i]);
    for (int64_t i = 0; status == UZ_OK && i < s->m; i++)
        hardest = fmax(hardest, press[i]);
    for (int64_t i = 0; i < s->m && status == UZ_OK; i++)
        most += press[i] > 0.0 && press[i] >= HARD[levels - 1] * hardest;
    for (size_t level = 0; level < levels && status == UZ_OK && !*done; level++) {
        uz_contact_verdict verdict = UZ_CONTACT_DENIED;
        uz_error refusal = {0};
        int64_t count = 0;
        for (int64_t i = 0; i < s->m; i++) {
            const bool chosen = press[i] > 0.0 && press[i] >= HARD[level] * hardest;
            s->weight[i] = chosen ? s->stiffness[i] : 0.0;
            s->target[i] = s->of.h[i];
            count += chosen;
        }
        if (count == before)
            continue;
        before = count;
        uz_status tried = solve_exact(s, done, &verdict, &refusal);
        if (tried == UZ_OK) {
            held = true;
            if (is_doubtful(s->last) && count < most && !is_over(s))
                *done = false; /* rounding left a pivot of what these rows do not hold */
            else if (verdict >= UZ_CONTACT_DENIED)
                break;
        } else if (tried != UZ_ERR_NOT_SPD) {
            status = uz_fail(err, tried, refusal.where, "%s", refusal.message);
        }
    }
    free(press);
    if (status == UZ_OK && !held)
        status = uz_semi_check_pressed(s, true, err);
    return status;
}

/* Steps of the proximal point method, and phase 2 whenever the rows that press are those of the step before. */
static uz_status run_rounds(uz_semi *s, uz_error *err)
{
    const uz_law *law = s->is_scene ? s->model.law : &uz_law_frictionless;
    uz_hooks quiet = {0};
    bool done = false;
    uz_status status = UZ_OK;
    if (s->hooks) {
        quiet.ctx = s->hooks->ctx;
        quiet.cancelled = s->hooks->cancelled;
        quiet.group = s->hooks->group;
    }
    while (status == UZ_OK && !done && s->rounds < ROUNDS) {
        memcpy(s->weight, s->soft, (size_t)s->m * sizeof *s->weight);
        status = solve_augmented(s, false, ROUND_ERROR, &quiet, err);
        if (status != UZ_OK || is_over(s))
            return status;
        bool settled = s->rounds++ > 0;
        for (int64_t i = 0; i < s->m; i++) {
            const bool active = law->kind->active(law, NULL, &s->last->r[i], 1) > 0;
            settled = settled && active == s->active[i];
            s->active[i] = active;
            s->target[i] = s->of.h[i] - s->last->g[i];
        }
        if (!settled && s->rounds % IMPATIENCE != 0)
            continue;
        if (s->settings->balanced && s->is_scene)
            status =
                uz_balance_request(&s->requested, &s->model, &s->problem->scene, s->last->u, s->prescribed, 0, err);
        if (status == UZ_OK)
            status = try_exact(s, &done, err);
        for (int64_t i = 0; status == UZ_OK && !done && i < s->m; i++)
            s->target[i] = s->of.h[i] - s->last->g[i];
    }
    return status;
}

static void clear(uz_semi *s)
{
    uz_free_all(s->load, s->prescribed, s->inverse, s->stiffness, s->soft, s->weight, s->target, s->active, s->provable,
                s->null_space);
    uz_csc_clear(&s->Nt);
    if (s->is_scene)
        uz_body_model_clear(&s->model);
    uz_result_free(s->last);
    uz_cache_free(s->own_cache);
}

uz_status uz_tell_unheld(uz_result **out, const uz_problem *problem, const uz_settings *settings, const uz_error *why,
                         double started, uz_error *err)
{
    uz_semi s = {.problem = problem, .with_factor = *settings, .is_scene = true, .started = started};
    s.settings = &s.with_factor;
    s.requested = uz_requested_error(settings);
    uz_status status = prepare(&s, err);
    if (status == UZ_OK)
        status = uz_semi_refuse(out, &s, why, err);
    clear(&s);
    return status;
}

uz_status uz_solve_semicoercive(uz_result **out, const uz_problem *problem, const uz_settings *settings,
                                uz_cache *cache, const uz_hooks *hooks, uz_status refused, double started,
                                uz_error *err)
{
    uz_semi s = {.problem = problem, .with_factor = *settings, .hooks = hooks, .cache = cache};
    s.settings = &s.with_factor;
    uz_error own = {0};
    s.is_scene = problem->kind == UZ_PROBLEM_SCENE;
    s.started = started;
    s.deadline = s.started + settings->time_limit_s;
    s.requested = uz_requested_error(settings);
    double start = uz_seconds();
    uz_status status = prepare(&s, &own);
    s.assemble_s = uz_seconds() - start;
    if (status == UZ_OK && !s.is_scene)
        status = find_null_space(&s, &own);
    if (status == UZ_OK)
        status = uz_semi_check_pressed(&s, s.is_scene, &own);
    if (status == UZ_OK)
        status = run_rounds(&s, &own);
    if (status == UZ_OK)
        status = uz_semi_conclude(&s, &own);
    if (status == UZ_ERR_FREE_BODY && !*out && s.m > 0) {
        uz_error why = own;
        const uz_status refused_with = uz_semi_refuse(out, &s, &why, &own);
        if (refused_with == UZ_OK)
            own = why;
        else
            status = refused_with;
    }
    bool better =
        !*out || (s.last && s.last->summary.certificate.relative_error < (*out)->summary.certificate.relative_error);
    if (status == UZ_OK && better) {
        uz_result_free(*out);
        *out = s.last;
        s.last = NULL;
        uz_error_reset(err);
    } else if (refused == UZ_OK) {
        status = UZ_OK;
    } else if (err && !(status == UZ_ERR_NOT_SPD && refused == UZ_ERR_NOT_SPD)) {
        *err = own;
    }
    clear(&s);
    return status;
}
