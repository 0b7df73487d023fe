/* run.c: from one load to a certified answer.
 *
 *     p, h                 the load case's vectors, or assembled from the scene's loads
 *     p, h -> y, g0        one forward substitution
 *     r                    iterations on D
 *     u                    one backward substitution
 *     (u, r) -> bound      certificate, from the original data
 *
 * The methods stop at their own estimate; only the certificate decides. While it is missed although the estimate was
 * met, the estimate is asked for more. */
#include "run/run.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/steps.h"
#include "methods/turns.h"
#include "run/settings.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_run_begin(uz_run *run, const uz_request *asked, uz_error *err)
{
    const uz_settings *settings = asked->settings;
    const uz_setup *setup = asked->setup;
    const uz_dual *dual = setup->dual;
    memset(run, 0, sizeof *run);
    run->asked = asked;
    run->d = dual->d;
    run->m = dual->m;
    run->all = setup->rows.in ? setup->rows.m : dual->m;
    run->work.requested = uz_requested_error(settings);
    run->work.target = settings->balanced ? 1e-2 : run->work.requested;
    uz_milestones_init(&run->work.milestones, setup->rows.in != NULL);
    run->result = uz_alloc_zero(1, sizeof *run->result);
    if (!run->result)
        return uz_no_memory(err, "a result");
    uz_report_setup(run);
    return UZ_OK;
}

uz_status uz_run_load(uz_run *run, uz_error *err)
{
    const uz_setup *setup = run->asked->setup;
    const uz_problem *problem = run->asked->problem;
    uz_load_vectors *load = &run->load;
    double start = uz_seconds();
    uz_status status = UZ_OK;
    if (setup->is_scene) { /* the vectors of all rows, and h of those that the setup has */
        const uz_scene scene = uz_scene_of_case(problem, run->asked->index);
        const int64_t n_fixed = setup->model.n_fixed;
        load->n_owned = run->d + run->all + n_fixed + (setup->rows.in ? run->m : 0);
        load->owned = uz_alloc_zero(load->n_owned, sizeof(double));
        if (!load->owned)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)run->d);
        double *h = load->owned + run->d;
        load->p = load->owned;
        load->h = load->h_all = h;
        load->prescribed = h + run->all;
        status = uz_body_model_load(load->owned, h, load->prescribed, &setup->model, &scene, err);
        load->moved = status == UZ_OK && uz_is_moved(&setup->model, load->prescribed);
        load->loaded = load->moved && status == UZ_OK && uz_is_loaded(&setup->model, &scene);
        if (status == UZ_OK && setup->rows.in) {
            uz_candidates_gather(load->prescribed + n_fixed, h, &setup->rows);
            load->h = load->prescribed + n_fixed;
        }
    } else {
        const uz_load_case *own = problem->n_cases > 0 ? &problem->cases[run->asked->index] : NULL;
        load->p = own && own->p ? own->p : problem->qp.p;
        load->h = load->h_all = own && own->h ? own->h : problem->qp.h;
    }
    if (status == UZ_OK)
        status = uz_run_scale_load(run, err);
    run->result->summary.timings.assemble += uz_seconds() - start;
    return status;
}

static void tell_begin(const uz_request *asked)
{
    if (asked->hooks && asked->hooks->begins)
        asked->hooks->begins(asked->hooks->ctx, asked->index);
}

uz_status uz_run_start(uz_run *run, uz_error *err)
{
    const uz_request *asked = run->asked;
    const uz_settings *settings = asked->settings;
    const uz_method_kind *method = uz_method_kind_of(settings->method);
    uz_work *work = &run->work;
    /* steps that others published, an alpha and a rule that were told belong to the rows as the caller wrote them */
    const bool as_given =
        settings->row_scaling != UZ_ROW_SCALING_AUTO
            ? settings->row_scaling == UZ_ROW_SCALING_NONE
            : settings->alpha > 0.0 || settings->stopping == UZ_STOP_PAPER || (method && method->as_given);
    double start = uz_seconds();
    uz_status status = UZ_OK;
    if (!work->dual)
        status = uz_dual_load_near(&work->dual, asked->setup->dual, uz_setup_K(asked->setup, asked->problem),
                                   run->load.p, run->load.h, run->near, run->near ? run->near + run->d : NULL, err);
    free(run->near);
    run->near = NULL;
    if (status == UZ_OK)
        status = uz_answer_allocate(&run->answer, run->d, run->m, err);
    if (status == UZ_OK)
        status = uz_iterate_init(&work->it, asked->setup->law, asked->setup->dual, as_given, settings->alpha, err);
    /* bounds of iterations are relative to another norm where supports move the body */
    work->it.milestones = run->load.moved ? NULL : &work->milestones;
    uz_milestones_resume(&work->milestones, uz_run_time(run));
    if (status == UZ_OK && asked->start) {
        const uz_candidates *rows = &asked->setup->rows;
        uz_state *own = NULL; /* what the rows of the setup have of it */
        status = uz_state_check(asked->start, run->all, err);
        if (status == UZ_OK && (rows->in || work->exponent != 0))
            status = uz_state_copy(&own, asked->start, rows->in ? rows : NULL, true, work->exponent, err);
        if (status == UZ_OK)
            status = uz_iterate_start(&work->it, work->dual, own ? own : asked->start, err);
        uz_state_free(own);
    }
    work->it.guessed = asked->guessed;
    if (status == UZ_OK)
        tell_begin(asked);
    run->result->summary.timings.iterate += uz_seconds() - start;
    return status;
}

uz_status uz_run_iterate(uz_run *run, uz_error *err)
{
    const uz_request *asked = run->asked;
    uz_work *work = &run->work;
    uz_scaled_hooks room;
    const uz_method_options options = {
        .method = asked->settings->method,
        .stopping = asked->settings->stopping,
        .target = work->target,
        .epsilon = ldexp(asked->settings->epsilon, work->exponent),
        .max_iterations = asked->settings->max_iterations,
        .deadline = asked->deadline,
        .again = work->again,
        .hooks = uz_run_hooks(&room, run),
    };
    const uz_stop stop = {asked->hooks, asked->deadline};
    uz_milestones_resume(&work->milestones, uz_run_time(run));
    double start = uz_seconds();
    const uz_method_kind *method;
    uz_method_turn turn = {.kind = NULL};
    /* The counts of the paper's rule are those of the exact operator. */
    const double aim = options.stopping == UZ_STOP_PAPER ? 0.0 : work->target;
    uz_status status = uz_dual_load_aim(work->dual, aim, &stop, err);
    if (status == UZ_OK)
        status = uz_method_find(&method, options.method, work->it.law, err);
    while (status == UZ_OK && uz_method_next(&turn, &work->end, &work->it, work->dual, method, &options)) {
        if (turn.kind->steps)
            status = uz_steps_begin(&work->it, work->dual, &turn.options, &run->result->history, err);
        if (status == UZ_OK)
            status = turn.kind->run(&work->end, &work->it, work->dual, &turn.options, &run->result->history, err);
    }
    run->result->summary.timings.iterate += uz_seconds() - start;
    uz_milestones_pause(&work->milestones);
    return status == UZ_OK && work->end == UZ_END_RAY ? uz_run_check_ray(run, err) : status;
}

uz_status uz_run_certify(uz_run *run, uz_error *err)
{
    const uz_iterate *it = &run->work.it;
    uz_answer *answer = &run->answer;
    uz_certify_input input;
    double start = uz_seconds();
    uz_status status = uz_run_recover(run, answer, it->best_r, isfinite(it->best_bound), err);
    if (status == UZ_OK)
        status = uz_run_certify_input(&input, run, answer, err);
    if (status == UZ_OK)
        status = uz_certify(&answer->certificate, answer->r, answer->g, answer->u, &input, err);
    run->result->summary.timings.certify += uz_seconds() - start;
    return status;
}

/* What the certificate says of the bounds so far. */
static void note_certificate(uz_run *run)
{
    uz_milestones_resume(&run->work.milestones, uz_run_time(run));
    uz_milestones_note(&run->work.milestones, UZ_MILESTONE_OF_CERTIFICATE, run->answer.certificate.relative_error,
                       run->work.it.iteration, run->work.dual->applications);
}

/* Where the method can't do better, but the request is missed. A run that was told to stop has an answer with a bound:
 * another certificate would cost as much again. */
static uz_status improve(uz_run *run, uz_error *err)
{
    const uz_end end = run->work.end;
    bool told = end == UZ_END_CANCELLED || end == UZ_END_TIME,
         missed = run->answer.certificate.relative_error > (told ? DBL_MAX : run->work.requested);
    double start = uz_seconds();
    uz_status status = UZ_OK;
    if (missed && end != UZ_END_TARGET && end != UZ_END_PAPER) {
        /* A method keeps the answer that it could bound best. Where rows nearly depend on each other its own bounds
         * fail although its last r is right: that is certified too, and the better answer kept. */
        uz_answer last = {0};
        status = uz_answer_allocate(&last, run->d, run->m, err);
        if (status == UZ_OK)
            status = uz_run_recover(run, &last, run->work.it.r, false, err);
        if (status == UZ_OK)
            status = uz_run_certify_answer(run, &last, err);
        const bool exact =
            (end == UZ_END_SOLVED || end == UZ_END_UNDECIDED) && isinf(run->answer.certificate.relative_error);
        if (status == UZ_OK && (exact || last.certificate.relative_error < run->answer.certificate.relative_error)) {
            const uz_answer swap = run->answer;
            run->answer = last;
            last = swap;
        }
        uz_answer_clear(&last);
    }
    if (status == UZ_OK)
        status = uz_run_refine(run, err);
    run->result->summary.timings.certify += uz_seconds() - start;
    bool found_ray = run->work.end == UZ_END_RAY && !run->result->ray;
    return status == UZ_OK && found_ray ? uz_run_check_ray(run, err) : status;
}

/* Is the certified answer the one to give? Otherwise the target of the next round is set: by how much the bound of
 * iterations, which is relative to another norm than the certificate where supports move the body, has to fall. */
static uz_status judge(bool *done, uz_run *run, uz_error *err)
{
    const uz_certificate *c = &run->answer.certificate;
    uz_work *work = &run->work;
    const bool next = work->end == UZ_END_NEXT;
    uz_status status = UZ_OK;
    if (run->asked->settings->balanced && run->asked->setup->is_scene && !work->again && !next) {
        const uz_scene scene = uz_scene_of_case(run->asked->problem, run->asked->index);
        status = uz_balance_request(&work->requested, &run->asked->setup->model, &scene, run->answer.u,
                                    run->load.prescribed, run->load.exponent, err);
        work->target = work->requested;
    }
    if (status == UZ_OK)
        status = improve(run, err);
    *done = run->result->ray || c->relative_error <= work->requested || (work->end != UZ_END_TARGET && !next);
    work->again = !next;
    if (*done || next || !(work->it.best_relative <= work->target))
        return status;
    double share = isfinite(c->relative_error) ? work->requested / c->relative_error
                                               : work->requested * c->energy_norm / c->absolute_error;
    work->target = (share > 0.0 ? fmin(0.25, 0.5 * share) : 0.25) * work->it.best_relative;
    return status;
}

static uz_outcome conclude(const uz_run *run)
{
    if (run->result->ray)
        return isinf(run->result->summary.infeasible_radius) ? UZ_INFEASIBLE : UZ_OUT_OF_REACH;
    if (run->result->summary.certificate.relative_error <= run->work.requested)
        return UZ_CONVERGED;
    switch (run->work.end) {
    case UZ_END_ITERATIONS:
        return UZ_ITERATION_LIMIT;
    case UZ_END_TIME:
        return UZ_TIME_LIMIT;
    case UZ_END_CANCELLED:
        return UZ_DISMISSED;
    case UZ_END_PAPER:
        return UZ_PAPER_RULE;
    default: /* the certificate or the refinement may have been cut short */
        return uz_cancelled(run->asked->hooks)        ? UZ_DISMISSED
               : uz_seconds() >= run->asked->deadline ? UZ_TIME_LIMIT
                                                      : UZ_PRECISION_LIMIT;
    }
}

enum { MAX_ROUNDS = 8 };

uz_status uz_run_finish(uz_run *run, uz_error *err)
{
    uz_answer before = {0}; /* what was handed over, as long as nothing better follows */
    bool done = false;
    uz_status status = UZ_OK;
    for (int round = 0; status == UZ_OK && !done && round < MAX_ROUNDS; round++) {
        if (round > 0) {
            if (run->asked->in_block)
                tell_begin(run->asked);
            if (run->work.end == UZ_END_NEXT) {
                before = run->answer;
                run->answer = (uz_answer){0};
                status = uz_answer_allocate(&run->answer, run->d, run->m, err);
            }
            if (status == UZ_OK)
                status = uz_run_iterate(run, err);
            if (status == UZ_OK)
                status = uz_run_certify(run, err);
        }
        note_certificate(run);
        if (status == UZ_OK)
            status = judge(&done, run, err);
        note_certificate(run);
    }
    if (status == UZ_OK && before.u && before.certificate.relative_error < run->answer.certificate.relative_error) {
        const uz_answer swap = run->answer;
        run->answer = before;
        before = swap;
    }
    uz_answer_clear(&before);
    if (!done)
        run->work.end = UZ_END_STALLED;
    if (status == UZ_OK)
        status = uz_run_decide(run, err);
    if (!run->result->ray && run->work.far && isinf(run->answer.certificate.absolute_error)) {
        run->result->ray = run->work.far;
        run->result->summary.infeasible_radius = run->work.reach;
        run->work.far = NULL;
    }
    run->result->summary.certificate = run->answer.certificate;
    if (status == UZ_OK)
        status = uz_run_certify_all_rows(run, err);
    if (status == UZ_OK)
        status = uz_run_round_to_units(run, err);
    uz_run_restore_units(run);
    run->result->summary.certificate = run->answer.certificate;
    if (status != UZ_OK)
        return status;
    run->result->summary.outcome = conclude(run);
    return uz_report_run(run, err);
}

uz_status uz_run_hand_over(uz_run *run, bool *solved, uz_error *err)
{
    const uz_iterate *it = &run->work.it;
    const uz_dual_load *load = run->work.dual;
    uz_answer *answer = &run->answer;
    uz_summary *summary = &run->result->summary;
    uz_status status = UZ_OK;
    for (int round = 1; status == UZ_OK && run->work.end == UZ_END_NEXT && round < MAX_ROUNDS; round++)
        status = uz_run_iterate(run, err);
    *solved = run->asked->setup->factor && (run->work.end == UZ_END_SOLVED || run->m == 0);
    if (status == UZ_OK && *solved)
        status = uz_run_recover(run, answer, it->r, false, err);
    if (status != UZ_OK || !*solved)
        return status;
    for (int64_t i = 0; i < run->m; i++)
        answer->g[i] = (load->g0[i] - it->Dr[i]) / load->dual->row_scale[i];
    memset(&answer->certificate, 0xff, sizeof answer->certificate); /* every byte set is a NaN */
    uz_run_restore_units(run);
    summary->certificate = answer->certificate;
    summary->outcome = UZ_CONVERGED;
    return uz_report_run(run, err);
}

void uz_run_end(uz_run *run)
{
    uz_ahead_free(run->work.ahead);
    uz_dual_load_free(run->work.dual);
    uz_iterate_clear(&run->work.it);
    uz_factor_workspace_free(run->work.ws);
    uz_free_all(run->work.scratch, run->work.far, run->load.owned, run->near);
    uz_answer_clear(&run->answer);
    uz_candidates_clear(&run->wants);
    uz_result_free(run->result);
}
