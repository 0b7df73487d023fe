/* run.c: from a problem to a certified answer, read from top to bottom as the paper does.
 *
 *     scene -> K, N        assembly          (cached with the factor)
 *     K -> L, D            factor, condense  (cached)
 *     p, h -> y, g0        one forward substitution
 *     r                    iterations on D
 *     u                    one backward substitution
 *     (u, r) -> bound      certificate, from the original data */
#include "run/setup.h"
#include "certificate/certificate.h"
#include "certificate/infeasible.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/method.h"
#include "run/rows.h"
#include "run/run.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* p and h: the case's or the problem's own, or assembled from the loads of the scene. */
static uz_status make_load(uz_run *run, uz_error *err)
{
    const uz_setup *setup = run->setup;
    const uz_load_case *load_case = run->load_case;
    if (!setup->is_scene) {
        run->p = load_case && load_case->p ? load_case->p : run->problem->qp.p;
        run->h = load_case && load_case->h ? load_case->h : run->problem->qp.h;
        run->h_all = run->h;
        return UZ_OK;
    }
    uz_scene scene = uz_scene_of_case(run->problem, run->index);
    int64_t kept = setup->rows.in ? run->m : 0, n_fixed = setup->model.n_fixed;
    run->owned = uz_alloc_zero(run->d + run->all + n_fixed + kept, sizeof(double));
    if (!run->owned)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)run->d);
    double *h = run->owned + run->d;
    run->p = run->owned;
    run->h = run->h_all = h;
    run->prescribed = h + run->all;
    uz_status status = uz_body_model_load(run->owned, h, run->prescribed, &setup->model, &scene, err);
    run->moved = status == UZ_OK && uz_is_moved(&setup->model, run->prescribed);
    if (status == UZ_OK && setup->rows.in) {
        uz_candidates_gather(run->prescribed + n_fixed, h, &setup->rows);
        run->h = run->prescribed + n_fixed;
    }
    return status;
}

uz_status uz_run_make_load(uz_run *run, uz_error *err)
{
    double start = uz_seconds();
    uz_status status = make_load(run, err);
    run->result->summary.timings.assemble += uz_seconds() - start;
    return status;
}

static void tell_begin(const uz_run *run)
{
    if (run->hooks && run->hooks->begins)
        run->hooks->begins(run->hooks->ctx, run->index);
}

static uz_method_options method_options(const uz_run *run)
{
    const uz_settings *s = run->settings;
    uz_method_options options = {
        .method = s->method,
        .stopping = s->stopping,
        .target = run->target,
        .epsilon = s->epsilon,
        .max_iterations = s->max_iterations,
        .deadline = run->deadline,
        .again = run->again,
        .hooks = run->hooks,
    };
    return options;
}

static uz_status iterate(uz_run *run, uz_error *err)
{
    uz_method_options options = method_options(run);
    const uz_stop stop = {run->hooks, run->deadline};
    double start = uz_seconds();
    uz_status status = uz_dual_load_aim(run->load, run->target, &stop, err);
    if (status == UZ_OK)
        status = uz_method_run(&run->end, &run->it, run->load, &options, &run->result->history, err);
    run->result->summary.timings.iterate += uz_seconds() - start;
    return status;
}

/* Room for linear solves, made when the first is needed: cases of a block may need none. */
static uz_status need_workspace(uz_run *run, uz_error *err)
{
    if (!run->ws)
        run->ws = uz_factor_workspace_new();
    if (!run->work)
        run->work = uz_alloc(run->d, sizeof(double));
    if (run->ws && run->work)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer on %lld dofs", (long long)run->d);
}

/* e'K^-1 e = ||L^-1 P e||^2: half a linear solve; the other half makes e K^-1 e. */
static uz_status inverse_norm(void *ctx, double *value, double *e, bool solve, uz_error *err)
{
    uz_run *run = ctx;
    const uz_factor *factor = run->setup->factor;
    if (!factor)
        return uz_dual_load_inverse_norm(run->load, value, e, err);
    uz_status status = need_workspace(run, err);
    if (status != UZ_OK)
        return status;
    uz_factor_permute(factor, run->work, e);
    status = uz_factor_forward(factor, run->ws, run->work, 1, err);
    double sum = 0.0;
    for (int64_t j = 0; j < run->d; j++)
        sum += run->work[j] * run->work[j];
    *value = sum;
    if (status != UZ_OK || !solve)
        return status;
    status = uz_factor_backward(factor, run->ws, run->work, 1, err);
    uz_factor_unpermute(factor, e, run->work);
    return status;
}

uz_status uz_run_whole_norm(double *norm, const uz_run *run, const double *u, uz_error *err)
{
    *norm = 0.0;
    return run->moved ? uz_whole_norm(norm, &run->setup->model, u, run->prescribed, err) : UZ_OK;
}

uz_status uz_run_certify_input(uz_certify_input *input, uz_run *run, const double *u, uz_error *err)
{
    const uz_csc *K = uz_setup_K(run->setup, run->problem);
    const uz_stop stop = {run->hooks, run->deadline};
    double whole_norm = 0.0;
    uz_status status = need_workspace(run, err);
    if (status == UZ_OK)
        status = uz_run_whole_norm(&whole_norm, run, u, err);
    if (status != UZ_OK)
        return status;
    *input = (uz_certify_input){
        .K = K,
        .N = run->wide ? uz_setup_all_rows(run->setup, run->problem) : uz_setup_N(run->setup, run->problem),
        .p = run->p,
        .h = run->wide ? run->h_all : run->h,
        .inverse_norm = inverse_norm,
        .ctx = run,
        .rcond = run->result->summary.rcond,
        .inverse_bound =
            run->serves_many && run->setup->factor ? uz_setup_inverse_bound(run->setup, K, run->ws, &stop) : INFINITY,
        .moved = run->moved,
        .whole_norm = whole_norm,
        .sharp = 0.5 * run->requested,
    };
    return UZ_OK;
}

uz_status uz_run_certify_answer(uz_run *run, uz_answer *answer, uz_error *err)
{
    uz_certify_input input;
    uz_status status = uz_run_certify_input(&input, run, answer->u, err);
    if (status == UZ_OK)
        status = uz_certify(&answer->certificate, answer->r, answer->g, answer->u, &input, err);
    return status;
}

/* The answer that r (m, scaled rows) gives, with the kept correction or without, and its certificate. */
static uz_status certify_reactions(uz_run *run, uz_answer *answer, const double *r, bool corrected, uz_error *err)
{
    const double *scale = run->load->dual->row_scale;
    uz_status status = uz_dual_load_recover(run->load, answer->u, r, corrected, err);
    for (int64_t i = 0; i < run->m; i++)
        answer->r[i] = scale[i] * r[i];
    return status == UZ_OK ? uz_run_certify_answer(run, answer, err) : status;
}

/* A method keeps the answer that it could bound best. Where rows nearly depend on each other its own bounds fail
 * although its last r is right: when it ends short of the request, the last r is certified too and the better answer
 * kept. */
static uz_status try_last_reactions(uz_run *run, uz_error *err)
{
    uz_answer last = {0};
    uz_status status = uz_answer_allocate(&last, run->d, run->m, err);
    if (status == UZ_OK)
        status = certify_reactions(run, &last, run->it.r, false, err);
    bool exact = run->end == UZ_END_SOLVED && isinf(run->answer.certificate.relative_error);
    if (status == UZ_OK && (exact || last.certificate.relative_error < run->answer.certificate.relative_error)) {
        uz_answer swap = run->answer;
        run->answer = last;
        last = swap;
    }
    uz_answer_clear(&last);
    return status;
}

uz_status uz_run_certify(uz_run *run, uz_error *err)
{
    double start = uz_seconds();
    uz_status status = certify_reactions(run, &run->answer, run->it.best_r, isfinite(run->it.best_bound), err);
    run->result->summary.timings.certify += uz_seconds() - start;
    return status;
}

/* A tenth of what the mesh itself loses: digits beyond that describe the mesh, not the body. */
void uz_run_balance_request(uz_run *run)
{
    uz_summary *summary = &run->result->summary;
    double *nodal = uz_alloc(run->setup->model.mesh.n_nodes * run->setup->model.mesh.dim, sizeof *nodal);
    if (!nodal)
        return; /* the request stays at what it was, which is stricter */
    uz_recover_nodal(nodal, &run->setup->model, run->answer.u, run->prescribed);
    const uz_scene scene = uz_scene_of_case(run->problem, run->index);
    summary->discretization_error = uz_estimate_mesh_error(&run->setup->model, &scene, nodal);
    free(nodal);
    if (summary->discretization_error > 0.0)
        run->requested = fmin(1.0, fmax(UZ_EXACT_RELATIVE_ERROR, 0.1 * summary->discretization_error));
}

/* The rows that contradict each other, checked by the certificate's code on the original data. */
static uz_status prove_infeasible(uz_run *run, uz_error *err)
{
    uz_result *result = run->result;
    const uz_csc *N = uz_setup_N(run->setup, run->problem);
    const double *scale = run->load->dual->row_scale, *g0 = run->load->g0;
    for (int64_t i = 0; i < run->m; i++) {
        run->it.ray[i] *= scale[i];
        run->it.r_next[i] = g0[i] / scale[i];
    }
    double length = uz_gap_length(N, run->h, run->it.r_next, run->it.gamma);
    double radius;
    if (!uz_ray_proves(&radius, run->it.ray, N, run->h, length)) {
        run->end = UZ_END_BLURRED;
        return UZ_OK;
    }
    result->ray = uz_alloc(run->m, sizeof *result->ray);
    if (!result->ray)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for the proof of infeasibility");
    memcpy(result->ray, run->it.ray, (size_t)run->m * sizeof *result->ray);
    result->summary.infeasible_radius = radius;
    return UZ_OK;
}

/* What the certificate says of the bounds so far. */
static void note_certificate(uz_run *run)
{
    uz_decades_resume(&run->decades, uz_run_time(run));
    uz_decades_certify(&run->decades, run->answer.certificate.relative_error, run->it.iteration,
                       run->load->applications);
}

uz_status uz_run_iterate(uz_run *run, uz_error *err)
{
    uz_decades_resume(&run->decades, uz_run_time(run));
    uz_status status = iterate(run, err);
    uz_decades_pause(&run->decades);
    return status == UZ_OK && run->end == UZ_END_RAY ? prove_infeasible(run, err) : status;
}

/* Where the method can't do better, but the request is missed. A run that was told to stop has an answer with a bound:
 * another certificate would cost as much again. */
static uz_status improve(uz_run *run, uz_error *err)
{
    bool told = run->end == UZ_END_CANCELLED || run->end == UZ_END_TIME,
         missed = run->answer.certificate.relative_error > (told ? DBL_MAX : run->requested);
    double start = uz_seconds();
    uz_status status = UZ_OK;
    if (missed && run->end != UZ_END_TARGET && run->end != UZ_END_PAPER)
        status = try_last_reactions(run, err);
    if (status == UZ_OK)
        status = uz_run_refine(run, err);
    run->result->summary.timings.certify += uz_seconds() - start;
    bool found_ray = run->end == UZ_END_RAY && !run->result->ray;
    return status == UZ_OK && found_ray ? prove_infeasible(run, err) : status;
}

/* By how much the bound of iterations, which is relative to another norm than the certificate where supports move the
 * body, has to fall. */
static double share_of_request(const uz_run *run)
{
    const uz_certificate *c = &run->answer.certificate;
    double share = isfinite(c->relative_error) ? run->requested / c->relative_error
                                               : run->requested * c->energy_norm / c->absolute_error;
    return share > 0.0 ? fmin(0.25, 0.5 * share) : 0.25;
}

/* Is the certified answer the one to give? Otherwise the target of the next round is set. */
static uz_status judge(bool *done, uz_run *run, uz_error *err)
{
    const uz_certificate *certificate = &run->answer.certificate;
    if (run->settings->balanced && run->setup->is_scene && !run->again) {
        uz_run_balance_request(run);
        run->target = run->requested;
    }
    uz_status status = improve(run, err);
    *done = run->result->ray || certificate->relative_error <= run->requested || run->end != UZ_END_TARGET;
    run->again = true;
    if (!*done && run->it.best_relative <= run->target)
        run->target = share_of_request(run) * run->it.best_relative;
    return status;
}

enum { MAX_ROUNDS = 8 };

/* The methods stop at their own estimate; only the certificate decides. While it is missed although the estimate was
 * met, the estimate is asked for more. */
static uz_status iterate_until_certified(uz_run *run, uz_error *err)
{
    bool done = false;
    note_certificate(run);
    uz_status status = judge(&done, run, err);
    note_certificate(run);
    for (int round = 1; status == UZ_OK && !done && round < MAX_ROUNDS; round++) {
        if (run->in_block)
            tell_begin(run);
        status = uz_run_iterate(run, err);
        if (status == UZ_OK)
            status = uz_run_certify(run, err);
        note_certificate(run);
        if (status == UZ_OK)
            status = judge(&done, run, err);
        note_certificate(run);
    }
    if (!done)
        run->end = UZ_END_STALLED;
    run->result->summary.certificate = run->answer.certificate;
    return status;
}

static uz_outcome conclude(const uz_run *run)
{
    if (run->result->ray)
        return UZ_INFEASIBLE;
    if (run->result->summary.certificate.relative_error <= run->requested)
        return UZ_CONVERGED;
    switch (run->end) {
    case UZ_END_ITERATIONS:
        return UZ_ITERATION_LIMIT;
    case UZ_END_TIME:
        return UZ_TIME_LIMIT;
    case UZ_END_CANCELLED:
        return UZ_DISMISSED;
    case UZ_END_PAPER:
        return UZ_PAPER_RULE;
    default: /* the certificate or the refinement may have been cut short */
        return uz_cancelled(run->hooks)        ? UZ_DISMISSED
               : uz_seconds() >= run->deadline ? UZ_TIME_LIMIT
                                               : UZ_PRECISION_LIMIT;
    }
}

/* What the rows that the body is solved with have of the start. */
static uz_status take_start(uz_run *run, uz_error *err)
{
    uz_state *part = NULL;
    if (!run->setup->rows.in)
        return uz_iterate_start(&run->it, run->load, run->start, err);
    uz_status status = uz_state_check(run->start, run->all, err);
    if (status == UZ_OK)
        status = uz_state_gather(&part, run->start, &run->setup->rows, err);
    if (status == UZ_OK)
        status = uz_iterate_start(&run->it, run->load, part, err);
    uz_state_free(part);
    return status;
}

uz_status uz_run_start(uz_run *run, uz_error *err)
{
    uz_status status = uz_answer_allocate(&run->answer, run->d, run->m, err);
    if (status == UZ_OK)
        status = uz_iterate_init(&run->it, uz_setup_law(run->setup), run->m, run->settings->alpha, err);
    run->it.decades = run->moved ? NULL : &run->decades; /* bounds of iterations are relative to another norm */
    uz_decades_resume(&run->decades, uz_run_time(run));
    if (status == UZ_OK && run->start)
        status = take_start(run, err);
    if (status == UZ_OK)
        tell_begin(run);
    return status;
}

uz_status uz_run_finish(uz_run *run, uz_error *err)
{
    uz_status status = iterate_until_certified(run, err);
    if (status == UZ_OK)
        status = uz_run_widen(run, err);
    if (status != UZ_OK)
        return status;
    run->result->summary.outcome = conclude(run);
    return uz_run_report(run, err);
}

uz_status uz_run_solve(uz_run *run, uz_error *err)
{
    uz_status status = uz_run_make_load(run, err);
    double start = uz_seconds();
    if (status == UZ_OK)
        status = uz_dual_load_create(&run->load, run->setup->dual, uz_setup_K(run->setup, run->problem), run->p, run->h,
                                     err);
    if (status == UZ_OK)
        status = uz_run_start(run, err);
    run->result->summary.timings.iterate += uz_seconds() - start;
    if (status == UZ_OK)
        status = uz_run_iterate(run, err);
    if (status == UZ_OK)
        status = uz_run_certify(run, err);
    return status == UZ_OK ? uz_run_finish(run, err) : status;
}
