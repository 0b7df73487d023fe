/* guarantee.c: a guaranteed bound on the whole error of answers on a mesh, where it is asked for: the dual problem is
 * one in matrices, which is solved as any other, and so is the norm of what its stress lacks of equilibrium. */
#include "run/guarantee.h"

#include "run/solve.h"
#include "bound/interval.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uz_settings uz_guarantee_settings(const uz_guaranteed *g, double now)
{
    uz_settings settings = uz_settings_default();
    settings.memory_limit = g->settings->memory_limit;
    settings.time_limit_s = fmax(0.0, g->stop.deadline - now);
    return settings;
}

/* The dual problem, or the residual's: the library's own solve, with what is left of the time. */
static uz_status solve(uz_result **out, const uz_guaranteed *g, const uz_qp *qp, uz_error *err)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    const double started = uz_seconds();
    const uz_settings settings = uz_guarantee_settings(g, started);
    *out = NULL;
    uz_status status = uz_solve_rounds(out, &problem, &settings, NULL, NULL, g->cache, &g->hooks, err);
    status = uz_settle_cases(out, status, &problem, &settings, NULL, g->cache, &g->hooks, started, err);
    if (status != UZ_OK) {
        uz_result_free(*out);
        *out = NULL;
    }
    return status;
}

uz_status uz_measure_residual(double *norm, const uz_guaranteed *g, double *residual, uz_error *err)
{
    uz_qp qp = {.K = g->qp.K, .p = residual};
    uz_result *result = NULL;
    double largest = 0, no_gaps = 0;
    *norm = 0;
    for (int64_t i = 0; i < qp.K.cols; i++)
        largest = fmax(largest, fabs(qp.p[i]));
    if (!(largest > 0))
        return UZ_OK;
    *norm = INFINITY;
    qp.h = &no_gaps;
    uz_status status = uz_csc_init(&qp.N, 0, qp.K.cols, 0, err);
    if (status == UZ_OK)
        status = solve(&result, g, &qp, err);
    if (status == UZ_OK && isfinite(result->summary.certificate.absolute_error))
        *norm = result->summary.certificate.energy_norm + result->summary.certificate.absolute_error;
    uz_result_free(result);
    uz_csc_clear(&qp.N);
    return status;
}

/* A body that only obstacles hold, where its answer presses on them. */
static uz_status hold(uz_guaranteed *g, const uz_result *result, uz_error *err)
{
    const uz_mesh_info *mesh = &result->mesh;
    double *pressure = uz_alloc_zero(result->n_nodes, sizeof *pressure);
    if (!pressure)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld nodes", (long long)result->n_nodes);
    for (int64_t i = 0; i < result->m; i++)
        if (mesh->contact_area[i] > 0)
            pressure[mesh->contact_node[i]] =
                fmax(pressure[mesh->contact_node[i]], -result->r[i] / mesh->contact_area[i]);
    uz_bound_hold(&g->body, pressure);
    free(pressure);
    return UZ_OK;
}

/* With what takes the answer out of obstacles, and without it, as the check finds something by itself, too: what proves
 * most. */
static uz_status check(uz_guaranteed *g, const double *u, const uz_scene *scene, uz_error *err)
{
    const double *lifts[] = {NULL, g->lift, g->cheap};
    uz_status status = UZ_OK;
    for (size_t k = 0; k < sizeof lifts / sizeof lifts[0] && status == UZ_OK; k++) {
        uz_bound_check_result with;
        if (k > 0 && !lifts[k])
            continue;
        status = uz_bound_check(&with, &g->body, scene, g->dof, g->qp.K.cols, u, lifts[k], g->stress, err);
        if (status == UZ_OK && (k == 0 || uz_bound_error(&with, 0) < uz_bound_error(&g->checked, 0))) {
            uz_bound_check_clear(&g->checked);
            g->checked = with;
        } else {
            uz_bound_check_clear(&with);
        }
    }
    return status;
}

/* The displacement of least energy, where that proves more of quantities: its errors are smaller than those of the
 * answer and of what takes it out of obstacles. */
static uz_status take_out(uz_guaranteed *g, const double *u, const uz_scene *scene, uz_error *err)
{
    const int64_t n = 2 * g->body.model->mesh.n_nodes;
    g->shown = &g->checked;
    if (!g->cheap)
        return UZ_OK;
    double *out = uz_alloc(n, sizeof *out);
    if (!out)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacement of %lld nodes", (long long)n / 2);
    for (int64_t i = 0; i < n; i++)
        out[i] = u[i] + g->cheap[i];
    uz_status status = uz_bound_check(&g->out_of_it, &g->body, scene, g->dof, g->qp.K.cols, out, NULL, g->stress, err);
    const bool better = status == UZ_OK && !*g->out_of_it.fault &&
                        uz_bound_ball(&g->out_of_it, g->rho) < uz_bound_ball(&g->checked, g->rho);
    if (better) {
        g->admissible = out;
        g->shown = &g->out_of_it;
    } else {
        free(out);
    }
    return status;
}

/* -> summary.guarantee, but for its time and reasons that are errors. */
static uz_status prove(uz_result *result, uz_guaranteed *g, const uz_body_model *model, const uz_scene *scene,
                       uz_error *err)
{
    uz_guarantee *out = &result->summary.guarantee;
    uz_result *dual = NULL;
    uz_status status = uz_bound_body_make(&g->body, model, scene, err);
    for (int64_t k = 0; k < scene->n_contacts && result->place && status == UZ_OK && !*g->body.why; k++)
        if (scene->contacts[k].kind != UZ_OBSTACLE_PLANE)
            snprintf(g->body.why, sizeof g->body.why,
                     "gaps of the answer are those where the body has gone; they are proved with fixed kinematics");
    if (status == UZ_OK && g->body.n_loose > 0)
        status = hold(g, result, err);
    if (status != UZ_OK || *g->body.why) {
        snprintf(out->why, sizeof out->why, "%s", g->body.why);
        return status;
    }
    status = uz_bound_dual_problem(&g->qp, &g->dof, &g->body, &g->stop, err);
    if (status == UZ_OK)
        status = solve(&dual, g, &g->qp, err);
    if (status == UZ_OK && !isfinite(dual->summary.certificate.absolute_error)) {
        snprintf(out->why, sizeof out->why, "the dual problem could not be solved: %.100s", dual->summary.message);
        uz_result_free(dual);
        return UZ_OK;
    }
    if (status == UZ_OK) {
        out->unknowns = g->qp.K.cols;
        g->stress = uz_alloc(model->mesh.n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, sizeof *g->stress);
        status = g->stress ? uz_bound_stress(g->stress, &g->body, g->dof, dual->u, &g->stop, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stress of %lld elements",
                                     (long long)model->mesh.n_elements);
    }
    uz_result_free(dual);
    if (status == UZ_OK)
        status = uz_lift_out(g, result, err);
    if (status == UZ_OK)
        status = check(g, result->u, scene, err);
    if (status == UZ_OK)
        status = uz_measure_residual(&g->rho, g, g->checked.residual, err);
    if (status != UZ_OK)
        return status;
    const uz_bound_check_result *c = &g->checked;
    const double bound = uz_bound_error(c, g->rho);
    if (!isfinite(bound)) {
        snprintf(out->why, sizeof out->why, "%s",
                 *c->fault ? c->fault : "what the stress lacks of equilibrium could not be bounded");
        return UZ_OK;
    }
    out->proved = true;
    out->bound = bound;
    out->relative = !(bound > 0) ? 0 : c->norm > bound ? bound / (c->norm - bound) : (double)INFINITY;
    status = take_out(g, result->u, scene, err);
    out->primal = g->admissible ? fmin(c->primal, g->out_of_it.primal) : c->primal;
    out->dual = c->dual - fabs(c->defect) - uz_bound_lacking(c, g->rho) * bound;
    return status;
}

void uz_add_share(uz_evaluation *evaluation, int64_t n, const double *of)
{
    double sum = 0;
    for (int64_t i = 0; i < n; i++)
        sum += of[i];
    for (int64_t i = 0; i < n && evaluation->share && sum > 0; i++)
        evaluation->share[i] += of[i] / sum;
}

/* For the next mesh: which elements have what of the gap. */
static uz_status share_gap(uz_result *result, const uz_guaranteed *g, uz_error *err)
{
    const int64_t n = g->body.model->mesh.n_elements;
    free(result->evaluation->share);
    result->evaluation->share = uz_alloc_zero(n, sizeof(double));
    if (!result->evaluation->share)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the errors of %lld elements", (long long)n);
    uz_add_share(result->evaluation, n, g->shown->local);
    return UZ_OK;
}

static void guarantee_answer(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                             const uz_hooks *hooks, double started)
{
    const double began = uz_seconds();
    uz_summary *s = &result->summary;
    uz_guarantee *out = &s->guarantee;
    uz_body_model model = {.d = 0};
    uz_error err = {0};
    uz_guaranteed g = {.problem = problem, .settings = settings, .cache = cache, .rho = INFINITY};
    g.hooks.ctx = hooks ? hooks->ctx : NULL;
    g.hooks.cancelled = hooks ? hooks->cancelled : NULL;
    g.stop = (uz_stop){&g.hooks, started + settings->time_limit_s};
    *out = (uz_guarantee){.asked = true, .bound = INFINITY, .relative = INFINITY, .primal = NAN, .dual = NAN};
    if (!result->evaluation) {
        snprintf(out->why, sizeof out->why, "there is no answer to bound the error of");
        return;
    }
    uz_cache *own_cache = cache ? NULL : uz_cache_new(SIZE_MAX); /* both of its problems have one K */
    g.cache = cache ? cache : own_cache;
    uz_status status = uz_body_model_build(&model, &problem->scene, UZ_BODY_OUTLINE, &err);
    if (status == UZ_OK)
        status = prove(result, &g, &model, &problem->scene, &err);
    if (status == UZ_OK && out->proved && problem->scene.refine)
        status = share_gap(result, &g, &err);
    if (status == UZ_OK && out->proved && result->evaluation->n_quantities > 0)
        status = uz_bound_keep_maps(&g.body, &g.stop, &err);
    if (status == UZ_OK && out->proved)
        status = uz_prove_quantities(result, &g, &err);
    uz_bound_body_clear(&g.body);
    uz_body_model_clear(&model);
    uz_qp_clear(&g.qp);
    uz_cache_free(own_cache);
    free(g.dof);
    free(g.stress);
    free(g.lift);
    free(g.cheap);
    free(g.admissible);
    uz_bound_check_clear(&g.checked);
    uz_bound_check_clear(&g.out_of_it);
    if (status != UZ_OK) /* the answer is there, and stays */
        snprintf(out->why, sizeof out->why, "%.150s",
                 uz_stop_is_due(&g.stop) ? "it was stopped before the bound was made" : err.message);
    for (int64_t i = 0; i < result->evaluation->n_quantities; i++) {
        uz_quantity_found *q = &result->evaluation->quantities[i];
        if (!q->guaranteed && !*q->unproved)
            snprintf(q->unproved, sizeof q->unproved, "%s",
                     out->proved ? "there was no time for it, or no memory"
                                 : "the whole error is not guaranteed (error.why)");
    }
    out->seconds = uz_seconds() - began;
    s->timings.total += out->seconds;
    s->timings.certify += out->seconds;
}

void uz_judge_whole_error(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started)
{
    uz_summary *s = &result->summary;
    if (problem->kind != UZ_PROBLEM_SCENE)
        return;
    if (settings->guaranteed)
        guarantee_answer(result, problem, settings, cache, hooks, started);
    const double total = uz_total_error(NULL, s);
    const bool unproved = s->guarantee.asked && !s->guarantee.proved;
    if (!(settings->total_error > 0) || s->outcome != UZ_CONVERGED || (total <= settings->total_error && !unproved))
        return;
    s->outcome = UZ_MESH_LIMIT;
    s->requested_error = settings->total_error;
    if (unproved)
        snprintf(s->message, sizeof s->message, "the whole error, about %.3g, is not guaranteed: %s", total,
                 s->guarantee.why);
    else if (s->guarantee.proved && !isfinite(total))
        snprintf(s->message, sizeof s->message,
                 "on this mesh the whole error, at most %.3g in the energy norm, may be all of the answer; asked for "
                 "%.3g of it: refine it, or let the cells be chosen",
                 s->guarantee.bound, settings->total_error);
    else
        snprintf(s->message, sizeof s->message,
                 "on this mesh the whole error is %s %.3g, asked for %.3g: refine it, or let the cells be chosen",
                 s->guarantee.proved ? "at most" : "about", total, settings->total_error);
}
