/* report.c: what is told of the solve of one load. */
#include "run/run.h"

#include "core/aside.h"
#include "core/clock.h"
#include "linalg/linalg.h"
#include "run/quantities.h"
#include "run/results.h"

#include <float.h>
#include <math.h>

void uz_report_setup(uz_run *run)
{
    const uz_setup *setup = run->asked->setup;
    const uz_reuse reused = run->asked->reused;
    uz_summary *summary = &run->result->summary;
    uz_factor_info factor;
    if (setup->factor) {
        factor = uz_factor_describe(setup->factor);
    } else { /* what stands in its place has no entries of L, but bytes and a condition */
        const uz_amg_info amg = setup->amg->info;
        factor = (uz_factor_info){.bytes = amg.bytes, .rcond = amg.rcond, .factor_s = amg.create_s + amg.spectrum_s};
    }
    summary->discretization_error = NAN;
    summary->max_pressure = NAN;
    summary->row_scaling = UZ_ROW_SCALING_NONE;
    summary->d = run->result->d = run->d;
    summary->m = run->result->m = run->all;
    summary->kept = run->m;
    summary->rounds = 1;
    summary->op = setup->dual->can->op;
    summary->ordering = factor.ordering;
    summary->factor_cached = reused.op;
    summary->reused = reused;
    summary->contact_last = factor.contact_last;
    summary->factor_flops = factor.flops;
    summary->factor_nnz = factor.nnz;
    summary->factor_bytes = factor.bytes;
    summary->rcond = factor.rcond;
    if (reused.op)
        return;
    summary->timings.assemble = setup->assemble_s;
    summary->timings.order = reused.ordering ? 0.0 : factor.order_s;
    summary->timings.factor = reused.factor ? 0.0 : factor.factor_s;
    summary->timings.condense = setup->condense_s;
}

/* Of length d: p, u, the room of the certificate, which also transposes N; with a factor the run has room of its own.
 */
#define RUN_VECTORS 8.0

/* A cached setup is spared, of prediction and of what is measured alike. */
static void report_cost(uz_run *run)
{
    const uz_cost_plan *plan = &run->asked->setup->plan;
    const uz_timings *t = &run->result->summary.timings;
    uz_cost *cost = &run->result->summary.cost;
    cost->n_considered = plan->count;
    for (int k = 0; k < plan->count; k++) {
        const uz_cost_estimate *form = &plan->form[k];
        const double load = run->asked->index > 0 ? form->next_s : form->case_s,
                     body = run->asked->reused.op ? 0.0 : form->setup_s;
        const double seconds = uz_cost_shared(body, load, form->op, run->asked->setup->model.brick, uz_aside_threads());
        cost->considered[k] = (uz_cost_option){form->op, seconds, form->bytes, form->fits};
        if (k != plan->chosen)
            continue;
        cost->seconds = seconds;
        cost->bytes = form->bytes;
        cost->flops = form->flops;
    }
    cost->actual_seconds = t->order + t->factor + t->condense + t->iterate + t->certify;
    cost->actual_threads = uz_aside_used();
    const uz_setup *setup = run->asked->setup;
    const bool shared = setup->factor && setup->shared.item; /* setup->bytes has no factor then */
    const uz_csc *K = uz_setup_K(setup, run->asked->problem);
    const uz_factor_info factor = setup->factor ? uz_factor_describe(setup->factor) : (uz_factor_info){.bytes = 0};
    const uz_dual_load *load = run->work.dual;
    const double made =
        setup->factor && !run->asked->reused.factor ? (double)uz_csc_bytes(K) + (double)factor.room : 0.0;
    const double vectors = RUN_VECTORS + (setup->factor ? 1.0 : 0.0),
                 solved = 8.0 * vectors * (double)run->d + (load ? (double)load->bytes + (double)load->most : 0.0);
    cost->actual_bytes =
        (double)setup->bytes + (shared ? (double)factor.bytes : 0.0) +
        (run->asked->setup->is_scene
             ? 0.0
             : (double)(uz_csc_bytes(&run->asked->problem->qp.K) + uz_csc_bytes(&run->asked->problem->qp.N))) +
        fmax(made, solved);
}

/* Displacements are told along x, y and z: where a node's dofs are not, turning them rounds by delta, and the error by
 * ||delta||_K, over supported dofs too, as theirs are told as well. The bound is on what is told. */
static uz_status report_displacements(uz_run *run, uz_error *err)
{
    const uz_body_model *model = &run->asked->setup->model;
    uz_result *result = run->result;
    uz_certificate *c = &result->summary.certificate;
    double energy;
    if (!run->asked->setup->is_scene) {
        result->u = run->answer.u;
        run->answer.u = NULL;
        return UZ_OK;
    }
    const uz_scene scene = uz_scene_of_case(run->asked->problem, run->asked->index);
    uz_status status =
        uz_describe_scene(result, model, &scene, run->answer.u, run->load.prescribed, run->all, run->work.ahead, err);
    if (status == UZ_OK && run->asked->problem->n_quantities > 0 && !result->ray) {
        const uz_setup *setup = run->asked->setup;
        const uz_stop stop = {run->asked->hooks, run->asked->deadline};
        const double start = uz_seconds();
        status = uz_find_quantities(result,
                                    &(uz_quantity_work){.problem = run->asked->problem,
                                                        .settings = run->asked->settings,
                                                        .scene = &scene,
                                                        .model = model,
                                                        .K = &model->K,
                                                        .dual = setup->dual,
                                                        .rows = &setup->rows,
                                                        .h = run->load.h_all,
                                                        .prescribed = run->load.prescribed,
                                                        .stop = &stop},
                                    err);
        result->summary.timings.certify += uz_seconds() - start;
    }
    if (status != UZ_OK || model->info.n_rotated == 0)
        return status;
    status = uz_turning_energy(&energy, model, result->u, err);
    if (status != UZ_OK)
        return status;
    c->absolute_error += sqrt(energy);
    c->relative_error += c->energy_norm > 0.0 ? sqrt(energy) / c->energy_norm : 0.0;
    uz_outcome *outcome = &result->summary.outcome;
    if (c->relative_error > run->work.requested && *outcome == UZ_CONVERGED)
        *outcome = UZ_PRECISION_LIMIT;
    if (c->relative_error > run->work.requested && *outcome == UZ_VERIFIED)
        *outcome = UZ_NOT_VERIFIED;
    return UZ_OK;
}

double uz_run_time(const uz_run *run)
{
    const uz_timings *t = &run->result->summary.timings;
    if (run->asked->in_block)
        return t->assemble + t->order + t->factor + t->condense + t->iterate + t->certify;
    return uz_seconds() - run->asked->started;
}

uz_status uz_report_answer(uz_run *run, uz_error *err)
{
    uz_result *result = run->result;
    uz_summary *summary = &result->summary;
    summary->requested_error = run->work.requested;
    summary->geometry = (uz_geometry){.kind = UZ_KINEMATICS_FIXED, .passes = 1, .change = NAN, .sliding = NAN};
    result->r = run->answer.r;
    result->g = run->answer.g;
    run->answer.r = run->answer.g = NULL;
    const uz_law *law = run->asked->setup->law;
    summary->active += law->kind->active(law, NULL, result->r, run->answer.m);
    for (int64_t i = 0; i < run->answer.m; i++) {
        summary->reaction_sum += result->r[i];
        double depth;
        law->kind->penetration(law, &depth, &result->g[i], 1);
        summary->max_penetration = fmax(summary->max_penetration, depth);
    }
    uz_status status = report_displacements(run, err);
    if (result->ray)
        uz_blank_answer(result);
    uz_explain_outcome(result, run->work.end);
    report_cost(run);
    /* in a rotated frame displacements have a larger bound, and a problem without an answer has none */
    uz_milestones_drop(&run->work.milestones, summary->certificate.relative_error);
    /* the methods' own bounds leave out what their rounding may hide: no row claims more than the certificate */
    for (int64_t k = 0; k < result->history.count && isfinite(summary->certificate.absolute_error); k++)
        result->history.rows[k].error_bound =
            fmax(result->history.rows[k].error_bound, summary->certificate.absolute_error);
    result->trade = run->work.milestones.trade;
    result->trade.total_s = uz_run_time(run);
    summary->timings.total = uz_run_time(run);
    return status;
}

uz_status uz_report_run(uz_run *run, uz_error *err)
{
    const uz_request *asked = run->asked;
    const uz_iterate *it = &run->work.it;
    const uz_candidates *rows = &asked->setup->rows;
    uz_result *result = run->result;
    uz_summary *summary = &result->summary;
    uz_state *state = NULL;
    summary->method = asked->settings->method == UZ_METHOD_AUTO ? it->made_by : asked->settings->method;
    if (run->all == 0)
        summary->method = UZ_METHOD_LINEAR;
    summary->origin = it->origin;
    summary->iterations = it->iteration;
    summary->restarts = it->restarts;
    summary->row_scaling = it->weight || !asked->setup->dual->row_weight ? UZ_ROW_SCALING_NONE : UZ_ROW_SCALING_UNIT;
    const double alpha = uz_iterate_alpha(it);
    summary->alpha = alpha > DBL_MIN && alpha < DBL_MAX ? alpha : NAN;
    summary->lambda_max = run->work.dual->asked_lambda_max ? uz_dual_lambda_max_as_given(asked->setup->dual) : NAN;
    uz_status status = UZ_OK;
    if (!result->ray)
        status = uz_iterate_state(&state, it, run->work.dual, asked->settings->method, err);
    if (status == UZ_OK && state && rows->in) {
        status = uz_state_copy(&result->state, state, rows, false, 0, err);
        uz_state_free(state);
    } else {
        result->state = state;
    }
    if (status == UZ_OK)
        status = uz_run_unscale_history(run, err);
    return status == UZ_OK ? uz_report_answer(run, err) : status;
}
