/* results.c: what is left of a solve: its message, sums of times, and the end of it. */
#include "run/results.h"

#include "core/alloc.h"
#include "core/error.h"
#include "post/balance.h"
#include "post/evaluate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void blank(double *x, int64_t n)
{
    for (int64_t i = 0; x && i < n; i++)
        x[i] = NAN;
}

void uz_blank_answer(uz_result *result)
{
    uz_summary *s = &result->summary;
    int64_t n_u = result->mesh.dim > 0 ? result->n_nodes * result->mesh.dim : result->d;
    blank(result->u, n_u);
    blank(result->r, result->m);
    blank(result->g, result->m);
    blank(result->pressure, result->m);
    uz_evaluation_free(result->evaluation);
    result->evaluation = NULL;
    s->evaluation = NULL;
    blank(s->force, 3);
    s->reaction_sum = s->max_penetration = s->max_pressure = NAN;
    s->active = 0;
    s->discretization_error = NAN;
    memset(&s->certificate, 0xff, sizeof s->certificate); /* every byte set is a NaN */
}

uz_status uz_describe_scene(uz_result *result, const uz_body_model *model, const uz_scene *scene, const double *u,
                            const double *prescribed, int64_t m, uz_ahead *ahead, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    double *nodal = uz_alloc(mesh->n_nodes * mesh->dim, sizeof *nodal);
    if (!nodal)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacements of %lld nodes",
                       (long long)mesh->n_nodes);
    uz_recover_nodal(nodal, model, u, prescribed);
    free(result->u);
    result->u = nodal;
    result->n_nodes = mesh->n_nodes;
    uz_status status = uz_mesh_info_copy(&result->mesh, &model->info, m, err);
    return status == UZ_OK ? uz_evaluate(result, model, scene, ahead, err) : status;
}

double uz_total_error(double *equations, const uz_summary *s)
{
    const bool scene = s->stress_share > 0.0;
    const bool large = s->geometry.kind == UZ_KINEMATICS_FINITE;
    const double certified = large   ? s->finite.residual
                             : scene ? s->certificate.relative_error / s->stress_share
                                     : s->certificate.relative_error;
    const double left = isnan(s->geometry.left) ? 0.0 : s->geometry.left;
    const double total = s->guarantee.proved ? s->guarantee.relative
                                             : hypot(hypot(certified, left), scene ? s->discretization_error : 0.0);
    if (equations)
        *equations = certified;
    return isnan(total) ? (double)INFINITY : total;
}

double uz_asked_error(const uz_summary *s)
{
    const uz_evaluation *e = s->evaluation;
    if (!e || !(e->asked > 0.0) || e->n_quantities == 0)
        return uz_total_error(NULL, s);
    const uz_quantity_found *q = &e->quantities[0];
    const double half = 0.5 * (q->high - q->low);
    return half <= 0.0 ? 0.0 : isfinite(half) && q->value != 0.0 ? half / fabs(q->value) : (double)INFINITY;
}

bool uz_is_unproved(const uz_summary *s)
{
    const uz_evaluation *e = s->evaluation;
    const bool quantity = e && e->asked > 0.0 && e->n_quantities > 0;
    return s->guarantee.asked && !(quantity ? e->quantities[0].guaranteed : s->guarantee.proved);
}

void uz_pass_unheld(uz_status *status, int64_t *unheld, uz_error *first, const uz_result *result, int64_t n,
                    uz_error *err)
{
    if (*status != UZ_ERR_FREE_BODY || !result || result->summary.outcome != UZ_UNHELD)
        return;
    if ((*unheld)++ == 0 && err)
        *first = *err;
    if (*unheld < n) {
        uz_error_reset(err);
        *status = UZ_OK;
    } else if (err) {
        *err = *first;
    }
}

bool uz_is_pressed_apart(const uz_summary *s)
{
    return uz_is_warned(s->evaluation, UZ_WARN_APART);
}

void uz_judge_contact(uz_result *result)
{
    uz_summary *s = &result->summary;
    if (s->outcome != UZ_CONVERGED || !uz_is_pressed_apart(s))
        return;
    s->outcome = UZ_MESH_LIMIT;
    snprintf(s->message, sizeof s->message,
             "A contact presses where the body does not touch the obstacle (%s). Use a finer mesh along it, or "
             "\"refine\": \"auto\" in it",
             UZ_WARN_APART);
}

void uz_judge_quantity(uz_result *result)
{
    uz_summary *s = &result->summary;
    const uz_evaluation *e = s->evaluation;
    const double error = uz_asked_error(s);
    if (!e || !(e->asked > 0.0) || e->n_quantities == 0 || s->outcome != UZ_CONVERGED ||
        (error <= e->asked && !uz_is_unproved(s)))
        return;
    const uz_quantity_found *q = &e->quantities[0];
    s->outcome = UZ_MESH_LIMIT;
    if (error <= e->asked)
        snprintf(s->message, sizeof s->message,
                 "%.40s, known within %.3g of itself by estimate, is not guaranteed: %s.", q->name, error, q->unproved);
    else
        snprintf(s->message, sizeof s->message,
                 "%.40s is known within %.3g of itself on this mesh, asked for %.3g%s%.60s. %s.", q->name, error,
                 e->asked, q->why[0] ? ": " : "", q->why, "Use a finer mesh, or \"refine\": \"auto\" in it");
}

/* The rows with a share in the contradiction: exactly, or by more than a ray's rounding. */
static void explain_ray(const uz_result *result, char *text, size_t size)
{
    int64_t named = 0, count = 0;
    double most = 0.0;
    size_t at = 0;
    if (result->summary.outcome == UZ_INFEASIBLE)
        at = (size_t)snprintf(text, size, "no displacement meets all contact conditions: these rows contradict:");
    else
        at = (size_t)snprintf(text, size,
                              "a displacement that meets all contact conditions, if there is one, has a component of "
                              "at least %.3g: these rows all but contradict:",
                              result->summary.infeasible_radius);
    for (int64_t i = 0; i < result->m && result->summary.outcome == UZ_OUT_OF_REACH; i++)
        most = fmin(most, result->ray[i]);
    for (int64_t i = 0; i < result->m; i++) {
        if (!(result->ray[i] < 1e-9 * most))
            continue;
        count++;
        if (named < 8 && at < size) {
            at += (size_t)snprintf(text + at, size - at, "%s %lld", named ? "," : "", (long long)i);
            named++;
        }
    }
    if (count > named && at < size)
        snprintf(text + at, size - at, " and %lld more", (long long)(count - named));
}

void uz_explain_outcome(uz_result *result, uz_end end)
{
    uz_summary *s = &result->summary;
    const char *why = "";
    switch (s->outcome) {
    case UZ_INFEASIBLE:
    case UZ_OUT_OF_REACH:
        explain_ray(result, s->message, sizeof s->message);
        return;
    case UZ_ITERATION_LIMIT:
        why = "the iterations allowed were used up: raise max_iterations";
        break;
    case UZ_TIME_LIMIT:
        why = "the time allowed was used up: raise time_limit_s";
        break;
    case UZ_PRECISION_LIMIT:
        why = end == UZ_END_UNSOLVED
                  ? "active_set solves on the condensed operator, with one entry in each row, or with few rows"
              : end == UZ_END_UNDECIDED ? "rows contradict each other by less than rounding can tell from touching"
                                        : "double precision holds no more digits for this method and problem";
        break;
    case UZ_PAPER_RULE:
        why = "the paper's stopping rule was met; it bounds a force, not an error";
        break;
    case UZ_NOT_VERIFIED:
        why = "the bound on the error of this answer is larger than asked for";
        break;
    case UZ_DISMISSED:
        why = "stopped by request";
        break;
    default:
        return;
    }
    const uz_certificate *c = &s->certificate;
    if (isfinite(c->relative_error))
        snprintf(s->message, sizeof s->message, "%s. Certified: relative error at most %.3g, asked for %.3g.", why,
                 c->relative_error, s->requested_error);
    else if (isfinite(c->absolute_error))
        snprintf(
            s->message, sizeof s->message,
            "%s. Certified: error at most %.3g in the energy norm, which is too much to bound a relative error; asked "
            "for %.3g.",
            why, c->absolute_error, s->requested_error);
    else
        snprintf(s->message, sizeof s->message, "%s. Nothing could be certified; asked for a relative error of %.3g.",
                 why, s->requested_error);
}

void uz_timings_add(uz_timings *sum, const uz_timings *t)
{
    sum->assemble += t->assemble;
    sum->order += t->order;
    sum->factor += t->factor;
    sum->condense += t->condense;
    sum->iterate += t->iterate;
    sum->certify += t->certify;
    sum->total += t->total;
}

void uz_result_free(uz_result *result)
{
    if (!result)
        return;
    uz_free_all(result->ray, result->u, result->r, result->g, result->pressure, result->place, result->free_strain);
    uz_evaluation_free(result->evaluation);
    free(result->history.rows);
    uz_state_free(result->state);
    uz_mesh_info_clear(&result->mesh);
    if (result->grids)
        free(result->grids->bisected);
    uz_free_all(result->grids, result);
}

void uz_results_free(uz_result **results, int64_t n)
{
    for (int64_t i = 0; results && i < n; i++)
        uz_result_free(results[i]);
    free(results);
}
