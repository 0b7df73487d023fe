/* precision.c: work against precision: what each method on each form of the operator takes for each accuracy, and how
 * exact the answer then is, against a solution of some 30 digits. */
#include "figures/figures.h"

#include "harness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A run that takes longer of the processor than 15 cold solves by `auto`, within these, is told to stop. */
#define LIMIT_LEAST_S 0.4
#define LIMIT_MOST_S  1.6
#define MEMORY_LIMIT  ((size_t)1200 << 20)

typedef struct {
    const char *name;
    double relative_error;
    bool balanced;
} level;

static const level LEVELS[] = {{"quick", 1e-2, false}, {"balanced", 1e-2, true}, {"1e-4", 1e-4, false},
                               {"1e-6", 1e-6, false},  {"precise", 1e-8, false}, {"1e-10", 1e-10, false},
                               {"exact", 0, false}};
enum { N_LEVELS = sizeof LEVELS / sizeof LEVELS[0] };

typedef struct {
    uz_method method;
    uz_operator op;
} series;

static const series SERIES[] = {
    {UZ_METHOD_AUTO, UZ_OPERATOR_AUTO},
    {UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_CONDENSED},
    {UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_FACTORED},
    {UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_MATRIX_FREE},
    {UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED},
    {UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_FACTORED},
    {UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_MATRIX_FREE},
    {UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED},
    {UZ_METHOD_CONJUGATE, UZ_OPERATOR_FACTORED},
    {UZ_METHOD_CONJUGATE, UZ_OPERATOR_MATRIX_FREE},
    {UZ_METHOD_ACCELERATED, UZ_OPERATOR_CONDENSED},
    {UZ_METHOD_ACCELERATED, UZ_OPERATOR_FACTORED},
    {UZ_METHOD_ACCELERATED, UZ_OPERATOR_MATRIX_FREE},
    {UZ_METHOD_UZAWA, UZ_OPERATOR_CONDENSED},
    {UZ_METHOD_UZAWA, UZ_OPERATOR_FACTORED},
    {UZ_METHOD_UZAWA, UZ_OPERATOR_MATRIX_FREE},
};

static uz_settings settings_of(series s, const level *l)
{
    uz_settings settings = uz_settings_default();
    settings.method = s.method;
    settings.op = s.op;
    settings.relative_error = l->relative_error;
    settings.balanced = l->balanced;
    settings.max_iterations = 100000000;
    settings.memory_limit = MEMORY_LIMIT;
    return settings;
}

static void write_work(json *out, const figure_run *run)
{
    const uz_summary *s = &run->result->summary;
    const double passes = s->factor_nnz > 0 ? run->work.entries / (2.0 * (double)s->factor_nnz) : 0.0;
    json_number(out, "back_substitutions", passes + (double)run->work.solves);
    json_integer(out, "cycles", run->work.cycles);
    json_integer(out, "iterations", s->iterations);
}

static void write_errors(json *out, const figure_problem *problem, const reference *exact, const uz_result *result)
{
    double *u = figure_displacements(problem, result);
    const reference_error error = reference_compare(exact, u, result->r);
    json_number(out, "requested", result->summary.requested_error);
    json_number(out, "certified", result->summary.certificate.relative_error);
    json_number(out, "energy_error", error.energy);
    json_number(out, "reaction_error", error.reaction);
    json_integer(out, "mismatches", error.mismatches);
    free(u);
}

static void write_run(json *out, const figure_problem *problem, const reference *exact, series s, const level *l,
                      bool cached, const figure_run *run)
{
    json_open(out, NULL, '{');
    json_text(out, "method", uz_method_name(s.method));
    json_text(out, "operator", uz_choice_name(UZ_CHOICE_OPERATOR, s.op));
    json_text(out, "level", l->name);
    json_text(out, "start", cached ? "cached" : "cold");
    if (run->status != UZ_OK) {
        json_text(out, "outcome", run->limited ? "time_limit" : uz_status_name(run->status));
    } else {
        json_text(out, "outcome",
                  run->limited ? "time_limit" : uz_choice_name(UZ_CHOICE_OUTCOME, run->result->summary.outcome));
        json_text(out, "operator_used", uz_choice_name(UZ_CHOICE_OPERATOR, run->result->summary.op));
        figure_write_times(out, run);
        write_work(out, run);
        write_errors(out, problem, exact, run->result);
    }
    json_close(out, '}');
}

/* What the series is not asked for any more, and why. */
static void write_missing(json *out, series s, const level *l, bool cached)
{
    json_open(out, NULL, '{');
    json_text(out, "method", uz_method_name(s.method));
    json_text(out, "operator", uz_choice_name(UZ_CHOICE_OPERATOR, s.op));
    json_text(out, "level", l->name);
    json_text(out, "start", cached ? "cached" : "cold");
    json_text(out, "outcome", "not_run");
    json_close(out, '}');
}

/* All levels, the loosest first; once one could not be met in time the rest is not tried. */
static void measure_series(json *out, const figure_problem *problem, const reference *exact, series s, bool cached,
                           double limit)
{
    uz_cache *cache = cached ? uz_cache_new((size_t)2 << 30) : NULL;
    bool going = true;
    for (int k = 0; k < N_LEVELS; k++) {
        if (LEVELS[k].balanced && problem->problem.kind != UZ_PROBLEM_SCENE)
            continue;
        const uz_settings settings = settings_of(s, &LEVELS[k]);
        figure_run run;
        if (!going) {
            write_missing(out, s, &LEVELS[k], cached);
            continue;
        }
        if (k == 0) /* touches the memory, and leaves in the cache what only a body that is used again is worth */
            figure_solve(&run, &problem->problem, &settings, cache, limit, cached ? 2 : 1);
        if (k > 0 || (run.status == UZ_OK && !run.limited)) {
            if (k == 0)
                uz_result_free(run.result);
            figure_solve(&run, &problem->problem, &settings, cache, limit, 0);
        }
        write_run(out, problem, exact, s, &LEVELS[k], cached, &run);
        going = run.status == UZ_OK && !run.limited;
        uz_result_free(run.result);
    }
    uz_cache_free(cache);
}

/* The rows that touch, as an exact active set has them. */
static bool find_reference(reference *exact, const figure_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    bool ok = false;
    settings.relative_error = 0;
    *exact = (reference){0};
    if (uz_solve(&result, &problem->problem, &settings, NULL, NULL, &err) == UZ_OK) {
        bool *start = calloc((size_t)result->m + 1, sizeof *start);
        if (!start)
            abort();
        for (int64_t i = 0; i < result->m; i++)
            start[i] = result->r[i] < 0;
        ok = reference_solve(exact, &problem->qp, start);
        free(start);
    }
    uz_result_free(result);
    return ok;
}

static double limit_for(const figure_problem *problem)
{
    const uz_settings settings = uz_settings_default();
    figure_run run;
    figure_solve(&run, &problem->problem, &settings, NULL, INFINITY, 2);
    uz_result_free(run.result);
    return fmin(fmax(LIMIT_LEAST_S, 15 * run.cpu.min), LIMIT_MOST_S);
}

static void write_problem(json *out, const figure_problem *problem, const reference *exact, double limit)
{
    json_text(out, "name", problem->name);
    json_text(out, "title", problem->title);
    json_text(out, "kind", problem->problem.kind == UZ_PROBLEM_SCENE ? "scene" : "matrices");
    json_integer(out, "d", exact->d);
    json_integer(out, "m", exact->m);
    json_integer(out, "active", exact->active);
    json_number(out, "mesh_error", problem->mesh_error);
    json_text(out, "mesh_how", problem->mesh_how);
    json_number(out, "reference_change", exact->change);
    json_number(out, "reference_margin", exact->margin);
    json_integer(out, "reference_rounds", exact->rounds);
    json_number(out, "limit_s", limit);
    json_number(out, "memory_limit_bytes", (double)MEMORY_LIMIT);
}

static void measure_problem(json *out, const figure_problem *problem)
{
    reference exact;
    if (!find_reference(&exact, problem)) {
        fprintf(stderr, "%s: no reference\n", problem->name);
        exit(1);
    }
    fprintf(stderr, "precision: %s (d = %lld)\n", problem->name, (long long)exact.d);
    const double limit = limit_for(problem);
    json_open(out, NULL, '{');
    write_problem(out, problem, &exact, limit);
    json_open(out, "runs", '[');
    for (size_t k = 0; k < (problem->whole ? sizeof SERIES / sizeof SERIES[0] : 1); k++)
        for (int cached = 0; cached < 2; cached++)
            measure_series(out, problem, &exact, SERIES[k], cached != 0, limit);
    json_close(out, ']');
    json_close(out, '}');
    reference_free(&exact);
}

void figure_precision(json *out, const char *filter)
{
    bool any = false;
    json_open(out, "precision", '[');
    for (int k = 0; k < FIGURE_PROBLEMS; k++) {
        figure_problem problem;
        const char *why;
        if (filter && strcmp(filter, figure_problem_name(k)) != 0)
            continue;
        any = true;
        if (figure_problem_make(&problem, k, &why))
            measure_problem(out, &problem);
        else
            fprintf(stderr, "precision: %s left out: %s\n", problem.name, why);
        figure_problem_clear(&problem);
    }
    json_close(out, ']');
    if (!any)
        test_fail(__FILE__, __LINE__, "precision: there is no problem '%s'", filter);
}
