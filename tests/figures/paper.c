/* paper.c: the paper's two figures of results, and how many iterations its methods take, by its own stopping rule and
 * to a certified error. */
#include "figures/figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPSILON   1e-6 /* the paper's: a force, in N here */
#define CERTIFIED 1e-6
/* A run that takes longer of the processor is told to stop. */
#define LIMIT_S 15.0

static void write_history(json *out, const uz_history *history)
{
    json_open(out, "rows", '[');
    for (int64_t k = 0; k < history->count; k++) {
        const uz_history_row *row = &history->rows[k];
        json_open(out, NULL, '[');
        json_integer(out, NULL, row->iteration);
        fprintf(out->file, ",%.17g", row->dual_objective);
        json_number(out, NULL, row->residual.total);
        json_close(out, ']');
    }
    json_close(out, ']');
}

/* The minimum, as the active set has it to rounding. */
static double minimum_of(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    figure_run run;
    settings.relative_error = 0;
    figure_solve(&run, problem, &settings, NULL, INFINITY, 1);
    const double minimum = run.result ? run.result->summary.certificate.energy_dual : NAN;
    uz_result_free(run.result);
    return minimum;
}

void figure_history(json *out)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART};
    json_open(out, "history", '[');
    for (int64_t nx = 30; nx <= 60; nx += 30) {
        uz_problem problem = figure_paper_matrices(nx);
        const double minimum = minimum_of(&problem);
        for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++) {
            uz_settings settings = uz_settings_default();
            figure_run run;
            settings.method = methods[k];
            settings.stopping = UZ_STOP_PAPER;
            settings.epsilon = EPSILON;
            settings.max_iterations = 10000000;
            figure_solve(&run, &problem, &settings, NULL, INFINITY, 1);
            json_open(out, NULL, '{');
            json_integer(out, "nx", nx);
            json_text(out, "method", uz_method_name(methods[k]));
            fprintf(out->file, ",\n\"minimum\": %.17g", minimum);
            json_integer(out, "iterations", run.result->summary.iterations);
            write_history(out, &run.result->history);
            json_close(out, '}');
            uz_result_free(run.result);
        }
        uz_problem_clear(&problem);
    }
    json_close(out, ']');
}

/* lambda_1(K) by inverse iteration: the paper's step size. */
static double smallest_eigenvalue(const uz_csc *K)
{
    const int64_t d = K->cols;
    uz_factor *factor = NULL;
    uz_factor_workspace *ws = uz_factor_workspace_new();
    uz_error err = {0};
    double *x = calloc((size_t)d, sizeof *x), *y = calloc((size_t)d, sizeof *y), value = NAN, before = 0;
    if (!ws || !x || !y || !reference_factor(&factor, K))
        exit(1);
    for (int64_t j = 0; j < d; j++)
        x[j] = 1 + 0.5 * sin((double)j); /* in the factor's order, in which all of this is done */
    for (int step = 0; step < 500 && !(fabs(value - before) <= 1e-13 * value); step++) {
        double xx = 0, xy = 0;
        memcpy(y, x, (size_t)d * sizeof *y);
        if (uz_factor_solve_one(factor, ws, y, true, &err) != UZ_OK ||
            uz_factor_solve_one(factor, ws, y, false, &err) != UZ_OK)
            exit(1);
        double largest = 0;
        for (int64_t j = 0; j < d; j++) {
            xx += x[j] * x[j];
            xy += x[j] * y[j];
            largest = fmax(largest, fabs(y[j]));
        }
        before = value;
        value = xx / xy;
        for (int64_t j = 0; j < d; j++)
            x[j] = y[j] / largest;
    }
    uz_factor_free(factor);
    uz_factor_workspace_free(ws);
    free(x);
    free(y);
    return value;
}

/* One way to solve. */
typedef struct {
    const char *name;
    uz_method method;
    uz_operator op;
    bool paper_step; /* alpha = lambda_1(K), not 1 / lambda_max(D) */
    bool paper_rule;
    bool cached;
    bool as_far; /* to what was certified of the answer of lambda_1(K) by the paper's rule */
} way;

static const way WAYS[] = {
    {"uzawa", UZ_METHOD_UZAWA, UZ_OPERATOR_CONDENSED, false, true, false, false},
    {"accelerated", UZ_METHOD_ACCELERATED, UZ_OPERATOR_CONDENSED, false, true, false, false},
    {"restart", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, false, true, false, false},
    {"restart_paper_step", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, true, true, false, false},
    {"conjugate", UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED, false, true, false, false},
    {"restart_factored", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_FACTORED, false, true, false, false},
    {"uzawa", UZ_METHOD_UZAWA, UZ_OPERATOR_CONDENSED, false, false, false, false},
    {"accelerated", UZ_METHOD_ACCELERATED, UZ_OPERATOR_CONDENSED, false, false, false, false},
    {"restart", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, false, false, false, false},
    {"restart_paper_step", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, true, false, false, false},
    {"restart_as_far", UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, false, false, false, true},
    {"conjugate", UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED, false, false, false, false},
    {"conjugate_as_far", UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED, false, false, false, true},
    {"auto", UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, false, false, false, false},
    {"auto_cached", UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, false, false, true, false},
};

static void write_way(json *out, const way *w, double alpha, const figure_run *run)
{
    json_open(out, NULL, '{');
    json_text(out, "name", w->name);
    json_text(out, "rule", w->paper_rule ? "paper" : "certified");
    if (run->result) {
        const uz_summary *s = &run->result->summary;
        json_text(out, "outcome", run->limited ? "time_limit" : uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome));
        json_number(out, "alpha", alpha > 0 ? alpha : s->alpha);
        json_integer(out, "iterations", s->iterations);
        json_integer(out, "restarts", s->restarts);
        json_number(out, "residual", s->certificate.residual.total);
        json_number(out, "certified", s->certificate.relative_error);
        figure_write_times(out, run);
    } else {
        json_text(out, "outcome", run->limited ? "time_limit" : uz_status_name(run->status));
    }
    json_close(out, '}');
}

/* *reached: what was certified of lambda_1(K) by the paper's rule: set by that way, read by the one that goes as far.
 */
static void measure_way(json *out, const way *w, const uz_problem *problem, double lambda_1, double *reached)
{
    const double alpha = w->paper_step ? lambda_1 : 0;
    uz_cache *cache = w->cached ? uz_cache_new((size_t)2 << 30) : NULL;
    uz_settings settings = uz_settings_default();
    figure_run run;
    settings.method = w->method;
    settings.op = w->op;
    settings.alpha = alpha;
    settings.stopping = w->paper_rule ? UZ_STOP_PAPER : UZ_STOP_CERTIFIED;
    settings.epsilon = EPSILON;
    settings.relative_error = w->paper_rule ? 1e-2 : w->as_far ? *reached : CERTIFIED;
    settings.max_iterations = 1000000000;
    if (w->cached) {
        figure_solve(&run, problem, &settings, cache, LIMIT_S, 2);
        uz_result_free(run.result);
    }
    figure_solve(&run, problem, &settings, cache, LIMIT_S, 0);
    write_way(out, w, alpha, &run);
    if (w->paper_step && w->paper_rule && run.result)
        *reached = run.result->summary.certificate.relative_error;
    uz_result_free(run.result);
    uz_cache_free(cache);
}

void figure_sizes(json *out)
{
    static const int64_t sizes[] = {30, 60, 120, 180, 240, 300, 480, 600};
    json_open(out, "sizes", '[');
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        uz_problem problem = figure_paper_matrices(sizes[k]);
        const double lambda_1 = smallest_eigenvalue(&problem.qp.K);
        fprintf(stderr, "sizes: NX = %lld\n", (long long)sizes[k]);
        json_open(out, NULL, '{');
        json_integer(out, "nx", sizes[k]);
        json_integer(out, "d", problem.qp.K.cols);
        json_integer(out, "m", problem.qp.N.rows);
        json_number(out, "lambda_1", lambda_1);
        json_number(out, "limit_s", LIMIT_S);
        double reached = CERTIFIED;
        json_open(out, "ways", '[');
        for (size_t i = 0; i < sizeof WAYS / sizeof WAYS[0]; i++)
            measure_way(out, &WAYS[i], &problem, lambda_1, &reached);
        json_close(out, ']');
        json_close(out, '}');
        uz_problem_clear(&problem);
    }
    json_close(out, ']');
}
