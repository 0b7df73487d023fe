/* grid_sequence.c: grid after grid until the total error is what was asked for.
 *
 *     grid n -> solve, started from the contact pressure of the best grid so far
 *            -> estimated discretization error and certified algebraic error: the total error
 *            -> the next n, from the rate at which the error was seen to fall
 *
 * The algebraic part is asked for a tenth of the total, so that it takes half a percent of it and the estimate, which
 * needs an answer to look at, is one of the mesh alone. */
#include "scene/grids.h"
#include "run/transfer.h"
#include "assembly/assembly.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/decades.h"
#include "run/problem.h"
#include "run/settings.h"
#include "run/solve.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ALGEBRAIC_SHARE 0.1

/* Beyond these unknowns a solve takes minutes, and estimates of where it ends are worth little. */
#define MOST_DOFS 4e6

/* Why no further grid was tried. */
typedef enum {
    STOP_NOT,
    STOP_MET,
    STOP_GRID, /* a finer grid is not allowed, or could not be solved: `reason` */
    STOP_TIME,
    STOP_CANCELLED,
    STOP_ALGEBRA /* the equations of the grid could not be solved well enough: a finer one would be no better */
} stop_kind;

/* The answers of one grid. */
typedef struct {
    uz_result **results; /* n_cases; NULL: none */
    uz_box box;
    int64_t n;
    double error; /* the largest total error of all cases that have an answer */
} rung;

typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    uz_cache *cache;
    const uz_hooks *hooks;
    int64_t n_cases;
    double requested, deadline;
    uz_grids grids;
    rung best;
    uz_tried tried[UZ_LADDER_RUNGS];
    uz_ladder ladder;
    uz_timings *spent; /* n_cases: of the answers that are dropped */
    stop_kind stop;
    char reason[160];
} climb;

/* ---- the error of a grid */

/* Has the body only been pushed aside? Then no element is strained, and there is nothing to estimate. */
static bool is_translation(const uz_result *result)
{
    const int dim = result->mesh.dim;
    for (int64_t i = dim; i < result->n_nodes * dim; i++)
        if (result->u[i] < result->u[i % dim] || result->u[i] > result->u[i % dim])
            return false;
    return true;
}

static uz_status estimate_case(uz_result *result, const uz_body_model *outline, const uz_scene *scene, uz_error *err)
{
    uz_summary *s = &result->summary;
    s->total_error = INFINITY;
    if (s->outcome == UZ_INFEASIBLE)
        return UZ_OK;
    const double mesh = is_translation(result) ? 0.0 : uz_estimate_mesh_error(outline, scene, result->u);
    if (isnan(mesh))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to estimate the error of the mesh");
    s->discretization_error = mesh;
    s->total_error = hypot(mesh, s->certificate.relative_error);
    if (isnan(s->total_error))
        s->total_error = INFINITY;
    return UZ_OK;
}

/* Every case's error; the largest ones go to the rung of the ladder. */
static uz_status estimate(rung *x, uz_rung *row, const uz_problem *problem, int64_t n_cases,
                          const uz_body_model *outline, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; status == UZ_OK && i < n_cases; i++) {
        const uz_scene scene = uz_scene_of_case(problem, i);
        const uz_summary *s = &x->results[i]->summary;
        status = estimate_case(x->results[i], outline, &scene, err);
        row->iterations += s->iterations;
        row->d = s->d;
        if (status != UZ_OK || s->outcome == UZ_INFEASIBLE)
            continue;
        x->error = fmax(x->error, s->total_error);
        row->discretization_error = fmax(row->discretization_error, s->discretization_error);
        row->certified_error = fmax(row->certified_error, s->certificate.relative_error);
    }
    return status;
}

/* ---- one grid */

static void free_starts(uz_state **starts, int64_t n)
{
    for (int64_t i = 0; starts && i < n; i++)
        uz_state_free(starts[i]);
    free(starts);
}

static uz_status make_starts(uz_state ***out, const climb *c, const uz_body_model *outline, uz_error *err)
{
    *out = NULL;
    if (!c->best.results)
        return UZ_OK;
    uz_state **starts = uz_alloc_zero(c->n_cases, sizeof *starts);
    uz_status status = UZ_OK;
    if (!starts)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from the coarser grid");
    for (int64_t i = 0; status == UZ_OK && i < c->n_cases; i++)
        status = uz_transfer_start(&starts[i], c->best.results[i], &c->best.box, &outline->info, outline->m, err);
    if (status == UZ_OK)
        *out = starts;
    else
        free_starts(starts, c->n_cases);
    return status;
}

static uz_status solve_started(rung *x, const climb *c, const uz_problem *problem, const uz_body_model *outline,
                               uz_error *err)
{
    uz_state **starts = NULL;
    uz_settings settings = *c->settings;
    settings.balanced = false;
    settings.relative_error = ALGEBRAIC_SHARE * c->requested;
    settings.time_limit_s = fmax(0.0, c->deadline - uz_seconds());
    uz_status status = make_starts(&starts, c, outline, err);
    if (status == UZ_OK)
        status =
            uz_solve_on_mesh(&x->results, problem, &settings, (const uz_state *const *)starts, c->cache, c->hooks, err);
    free_starts(starts, c->n_cases);
    return status;
}

/* Solves on grid n. On failure x has no results. */
static uz_status solve_rung(rung *x, uz_rung *row, climb *c, int64_t n, uz_error *err)
{
    uz_problem problem = *c->problem;
    uz_body_model outline;
    const double start = uz_seconds();
    *x = (rung){.box = uz_grid(&c->grids, n), .n = n};
    *row = (uz_rung){.d = 0};
    memcpy(row->cells, x->box.cells, sizeof row->cells);
    problem.scene.box = x->box;
    uz_status status = uz_body_model_outline(&outline, &problem.scene, err);
    if (status != UZ_OK)
        return status;
    status = solve_started(x, c, &problem, &outline, err);
    if (status == UZ_OK)
        status = estimate(x, row, &problem, c->n_cases, &outline, err);
    uz_body_model_clear(&outline);
    row->seconds = uz_seconds() - start;
    if (status == UZ_OK)
        return UZ_OK;
    uz_results_free(x->results, c->n_cases);
    x->results = NULL;
    return status;
}

/* ---- which answers are kept */

static void drop(climb *c, rung *x)
{
    for (int64_t i = 0; x->results && i < c->n_cases; i++)
        uz_timings_add(&c->spent[i], &x->results[i]->summary.timings);
    uz_results_free(x->results, x->results ? c->n_cases : 0);
    x->results = NULL;
}

/* The coarsest grid that meets the request; until there is one, that of the smallest error. */
static void keep_better(climb *c, rung *x)
{
    const bool meets = x->error <= c->requested, met = c->best.results && c->best.error <= c->requested;
    const bool better = !c->best.results || (met ? meets && x->n < c->best.n : meets || x->error < c->best.error);
    rung *worse = better ? &c->best : x;
    drop(c, worse);
    if (better) {
        c->best = *x;
        memcpy(c->ladder.cells, x->box.cells, sizeof c->ladder.cells);
    }
}

/* What the ends of the cases' solves say about going on. */
static stop_kind judge(const climb *c, const rung *x)
{
    stop_kind stop = x->error <= c->requested ? STOP_MET : STOP_NOT;
    for (int64_t i = 0; stop != STOP_MET && i < c->n_cases; i++) {
        const uz_summary *s = &x->results[i]->summary;
        if (s->outcome == UZ_DISMISSED)
            return STOP_CANCELLED;
        if (s->outcome == UZ_TIME_LIMIT)
            stop = STOP_TIME;
        else if (s->outcome != UZ_INFEASIBLE && !(s->certificate.relative_error < c->requested) && stop == STOP_NOT)
            stop = STOP_ALGEBRA;
    }
    return stop;
}

/* A grid that could not be solved ends the ladder where another one was; only lasting faults end the call. */
static uz_status survive(climb *c, uz_status status, const uz_error *failure, uz_error *err)
{
    const bool lasting = status == UZ_ERR_MEMORY || status == UZ_ERR_ARGUMENT || status == UZ_ERR_INTERNAL;
    if (c->best.results && !lasting) {
        c->stop = status == UZ_ERR_CANCELLED ? STOP_CANCELLED : STOP_GRID;
        snprintf(c->reason, sizeof c->reason, "the next grid was refused: %.120s", failure->message);
        return UZ_OK;
    }
    if (err)
        *err = *failure;
    return status;
}

static uz_status try_grid(climb *c, int64_t n, uz_error *err)
{
    rung x;
    uz_error failure = {0};
    uz_rung *row = &c->ladder.rung[c->ladder.count];
    uz_status status = solve_rung(&x, row, c, n, &failure);
    if (status != UZ_OK)
        return survive(c, status, &failure, err);
    c->tried[c->ladder.count++] = (uz_tried){n, x.error};
    c->stop = judge(c, &x);
    keep_better(c, &x);
    return UZ_OK;
}

/* ---- the ladder */

/* Where on the way from the first grid's error to the one asked for. */
static double share_done(const climb *c, double error)
{
    const double whole = c->ladder.count > 0 ? log(c->tried[0].error / c->requested) : 0.0;
    return whole > 0.0 && error > 0.0 ? fmin(1.0, fmax(0.0, log(c->tried[0].error / error) / whole)) : 0.0;
}

static void tell(const climb *c, int64_t next)
{
    const int count = c->ladder.count;
    double from = 0.0, to = 0.2;
    if (!c->hooks || !c->hooks->grid)
        return;
    if (count > 0) {
        const uz_tried *last = &c->tried[count - 1];
        const double rate = count > 1 ? uz_observed_rate(last - 1, last, c->grids.order) : c->grids.order;
        from = share_done(c, last->error);
        to = share_done(c, last->error * pow((double)last->n / (double)next, rate));
    }
    c->hooks->grid(c->hooks->ctx, from, fmax(from, to));
}

/* Factoring takes d^1.5 operations in the plane and d^2 in space (George and Liu, Computer Solution of Large Sparse
 * Positive Definite Systems, 1981, chapter 8). */
static bool has_time(const climb *c, int64_t n)
{
    const int last = c->ladder.count - 1;
    const double growth = uz_grid_dofs(&c->grids, n) / uz_grid_dofs(&c->grids, c->tried[last].n);
    const double expected = c->ladder.rung[last].seconds * pow(growth, c->grids.box.dim == 3 ? 2.0 : 1.5);
    return uz_seconds() + expected <= c->deadline;
}

/* The next grid to try, or a reason to stop. */
static int64_t choose_next(climb *c)
{
    const int count = c->ladder.count;
    const int64_t n = count < UZ_LADDER_RUNGS ? uz_next_grid(&c->grids, c->tried, count, c->requested) : 0;
    if (n == 0) {
        c->stop = STOP_GRID;
        if (count < UZ_LADDER_RUNGS)
            snprintf(c->reason, sizeof c->reason, "a grid that meets it is expected to have more than %.0f unknowns",
                     c->grids.most_dofs);
        else
            snprintf(c->reason, sizeof c->reason, "%d grids were tried", count);
    } else if (uz_cancelled(c->hooks)) {
        c->stop = STOP_CANCELLED;
    } else if (!has_time(c, n)) {
        c->stop = STOP_TIME;
    }
    return n;
}

/* One grid between the last that failed and the first that met the request, where that is expected to pay. */
static uz_status step_back(climb *c, uz_error *err)
{
    const int count = c->ladder.count;
    if (c->stop != STOP_MET || count < 2 || count >= UZ_LADDER_RUNGS)
        return UZ_OK;
    const int64_t n = uz_grid_between(&c->grids, &c->tried[count - 2], &c->tried[count - 1], c->requested);
    if (n == 0 || uz_cancelled(c->hooks) || !has_time(c, n))
        return UZ_OK;
    tell(c, n);
    uz_status status = try_grid(c, n, err);
    c->stop = STOP_MET; /* whatever became of it */
    return status;
}

static uz_status go_up(climb *c, uz_error *err)
{
    int64_t n = c->grids.first;
    uz_status status = UZ_OK;
    while (status == UZ_OK && c->stop == STOP_NOT) {
        tell(c, n);
        status = try_grid(c, n, err);
        if (status == UZ_OK && c->stop == STOP_NOT)
            n = choose_next(c);
    }
    return status == UZ_OK ? step_back(c, err) : status;
}

/* ---- what is told of it */

static void explain(climb *c, uz_summary *s)
{
    const char *why = s->outcome == UZ_MESH_LIMIT   ? c->reason
                      : s->outcome == UZ_TIME_LIMIT ? "the time allowed was used up: raise time_limit_s"
                      : s->outcome == UZ_DISMISSED  ? "stopped by request"
                                                    : "the equations of this grid could not be solved better";
    snprintf(s->message, sizeof s->message, "%s. Total error about %.3g (mesh %.3g, certified %.3g), asked for %.3g.",
             why, s->total_error, s->discretization_error, s->certificate.relative_error, c->requested);
}

static void conclude(climb *c, uz_summary *s)
{
    s->requested_error = c->requested;
    if (s->outcome == UZ_INFEASIBLE)
        return;
    if (s->total_error <= c->requested) {
        s->outcome = UZ_CONVERGED;
        s->message[0] = '\0';
        return;
    }
    if (c->stop == STOP_TIME)
        s->outcome = UZ_TIME_LIMIT;
    else if (c->stop == STOP_CANCELLED)
        s->outcome = UZ_DISMISSED;
    else if (c->stop == STOP_GRID || s->outcome == UZ_CONVERGED)
        s->outcome = UZ_MESH_LIMIT;
    explain(c, s);
}

static uz_status publish(climb *c, uz_error *err)
{
    for (int64_t i = 0; i < c->n_cases; i++) {
        uz_result *result = c->best.results[i];
        result->ladder = uz_alloc(1, sizeof *result->ladder);
        if (!result->ladder)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the grids that were tried");
        *result->ladder = c->ladder;
        result->summary.ladder = result->ladder;
        uz_timings_add(&result->summary.timings, &c->spent[i]);
        uz_trade_shift(&result->trade, c->spent[i].total);
        conclude(c, &result->summary);
    }
    return UZ_OK;
}

static uz_status check(const climb *c, const uz_state *const *starts, uz_error *err)
{
    uz_status status = uz_check_settings(c->settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(c->problem, err);
    if (status == UZ_OK && c->settings->stopping == UZ_STOP_PAPER)
        status = uz_fail(err, UZ_ERR_ARGUMENT, "", "the paper's rule bounds no error that cells could be chosen by");
    for (int64_t i = 0; status == UZ_OK && starts && i < c->n_cases; i++)
        if (starts[i])
            status = uz_fail(err, UZ_ERR_ARGUMENT, "start", "a start belongs to a mesh, and the cells are not chosen");
    return status;
}

uz_status uz_solve_grid_sequence(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                                 const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    climb c = {.problem = problem,
               .settings = settings,
               .cache = cache,
               .hooks = hooks,
               .n_cases = problem->n_cases > 0 ? problem->n_cases : 1,
               .requested = settings->balanced ? UZ_BALANCED_TOTAL_ERROR : uz_requested_error(settings),
               .deadline = uz_seconds() + settings->time_limit_s,
               .grids = uz_grids_of_box(&problem->scene.box, MOST_DOFS),
               .ladder = {.dim = problem->scene.box.dim}};
    *out = NULL;
    uz_error_reset(err);
    uz_status status = check(&c, starts, err);
    if (status == UZ_OK && !(c.spent = uz_alloc_zero(c.n_cases, sizeof *c.spent)))
        status = uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for the results of %lld cases", (long long)c.n_cases);
    if (status == UZ_OK)
        status = go_up(&c, err);
    if (status == UZ_OK)
        status = publish(&c, err);
    free(c.spent);
    if (status == UZ_OK)
        *out = c.best.results;
    else
        uz_results_free(c.best.results, c.best.results ? c.n_cases : 0);
    return status;
}
