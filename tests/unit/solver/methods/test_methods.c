/* The methods through uz_solve: limits, hooks, histories, and problems at the edges. */
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"

#define COUNT(list) (sizeof(list) / sizeof((list)[0]))

static const uz_method all_methods[] = {UZ_METHOD_AUTO,        UZ_METHOD_UZAWA,
                                        UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE,   UZ_METHOD_ACTIVE_SET};
static const uz_operator both_operators[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};

static uz_settings settings_for(uz_method method, uz_operator op)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.op = op;
    return settings;
}

/* The active set needs the condensed form. */
static bool can_run(uz_method method, uz_operator op)
{
    return method != UZ_METHOD_ACTIVE_SET || op == UZ_OPERATOR_CONDENSED;
}

static void check_bounds(const uz_result *result, const quad_exact *exact, const char *what)
{
    const uz_summary *s = &result->summary;
    double error = fmax(quad_error(exact, result->u), quad_error_of_reactions(exact, result->r));
    double noise = 1e-30 * (double)quad_sqrt(exact->norm2); /* of the truth itself */
    CHECK_MSG(s->certificate.absolute_error >= error - noise, "%s: bound %g, error %g", what,
              s->certificate.absolute_error, error);
    CHECK((s->outcome == UZ_CONVERGED) == (s->certificate.relative_error <= s->requested_error));
}

static void check_result(const uz_result *result, const quad_exact *exact, const char *what)
{
    const uz_summary *s = &result->summary;
    CHECK_MSG(s->outcome == UZ_CONVERGED, "%s, %s, %s: %s, %g after %lld", what, uz_method_name(s->method),
              uz_choice_name(UZ_CHOICE_OPERATOR, s->op), uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome),
              s->certificate.relative_error, (long long)s->iterations);
    check_bounds(result, exact, what);
}

/* Solves by every method and operator and compares with the exact solution. Takes the problem over. */
static void check_every_way(uz_qp qp, const char *what, int64_t most_iterations)
{
    quad_exact exact;
    uz_problem problem = problem_of(qp);
    CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
    CHECK(exact.violation < (quad)1e-22);
    for (size_t k = 0; k < COUNT(all_methods) * COUNT(both_operators); k++) {
        uz_method method = all_methods[k / 2];
        uz_operator op = both_operators[k % 2];
        uz_settings settings = settings_for(method, op);
        if (!can_run(method, op))
            continue;
        uz_result *result = solve_problem(&problem, &settings);
        if (!result)
            continue;
        check_result(result, &exact, what);
        CHECK_MSG(result->summary.iterations <= most_iterations, "%s, %s: %lld iterations", what,
                  uz_method_name(method), (long long)result->summary.iterations);
        uz_result_free(result);
    }
    quad_exact_free(&exact);
    uz_problem_clear(&problem);
}

/* A string of springs pressed by a load against bounds at height `gap`. */
static uz_qp loaded_string(int64_t d, double load, double gap)
{
    qp_random rng = {1};
    uz_qp qp = random_obstacle(&rng, d, 1);
    for (int64_t j = 0; j < d; j++) {
        qp.p[j] = load;
        qp.h[j] = gap;
    }
    return qp;
}

static uz_qp without_rows(uz_qp qp)
{
    uz_error err = {0};
    uz_csc_clear(&qp.N);
    CHECK(uz_csc_init(&qp.N, 0, qp.K.cols, 0, &err) == UZ_OK);
    return qp;
}

TEST(no_rows_is_a_linear_solve)
{
    check_every_way(without_rows(loaded_string(20, 1, 0)), "no rows", 0);
}

/* uz_qp_check allows a zeroed N where there are no contacts. */
TEST(zeroed_matrix_of_no_rows)
{
    uz_problem problem = problem_of(loaded_string(12, 1, 0));
    uz_csc_clear(&problem.qp.N);
    for (size_t k = 0; k < COUNT(both_operators); k++) {
        uz_settings settings = settings_for(UZ_METHOD_AUTO, both_operators[k]);
        uz_cache *cache = uz_cache_new(1 << 20);
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK);
        if (result) {
            CHECK_INT(result->d, 12);
            CHECK_INT(result->m, 0);
            CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        }
        uz_result_free(result);
        uz_cache_free(cache);
    }
    uz_problem_clear(&problem);
}

TEST(nothing_touches)
{
    check_every_way(loaded_string(20, -1, 1), "no contact", 1);
}

TEST(everything_touches)
{
    check_every_way(loaded_string(8, 10, 0.1), "all in contact", 3000);
}

TEST(one_row_and_one_dof)
{
    double one[] = {2.5}, row[] = {-0.7};
    for (int touching = 0; touching < 2; touching++) {
        uz_qp qp = {csc_from_dense(one, 1, 1, true), csc_from_dense(row, 1, 1, false), vector(1), vector(1)};
        qp.p[0] = touching ? -3 : 3;
        qp.h[0] = 0.2;
        check_every_way(qp, "d = 1", 2);
    }
    for (int64_t d = 2; d < 6; d++) {
        qp_random rng = {(uint64_t)d};
        qp_kind kind = {.d = d, .m = 1, .condition = 10};
        check_every_way(random_qp(&rng, &kind), "m = 1", 50);
    }
}

TEST(one_dof_without_rows)
{
    double one[] = {3};
    uz_qp qp = {csc_from_dense(one, 1, 1, true), {0}, vector(1), vector(0)};
    uz_error err = {0};
    qp.p[0] = 6;
    CHECK(uz_csc_init(&qp.N, 0, 1, 0, &err) == UZ_OK);
    check_every_way(qp, "d = 1, m = 0", 0);
}

TEST(no_load)
{
    uz_qp qp = loaded_string(10, 0, 0.5);
    check_every_way(qp, "no load", 1);
    check_every_way(loaded_string(10, 0, 0), "no load, no gap", 1);
    check_every_way(loaded_string(6, 0, -0.5), "no load, pushed by the obstacle", 3000);
}

/* Rows that just touch, with no reaction: every second bound is where the free body is. */
TEST(weakly_active_rows)
{
    for (uint64_t seed = 0; seed < 8; seed++) {
        qp_random rng = {seed};
        uz_qp qp = random_obstacle(&rng, 12, 1);
        for (int64_t j = 0; j < 12; j++)
            qp.h[j] = 100;
        quad_exact exact;
        CHECK(quad_exact_solve(&exact, &qp, NULL));
        for (int64_t j = 0; j < 12; j += 2)
            qp.h[j] = (double)exact.u[j];
        quad_exact_free(&exact);
        check_every_way(qp, "weakly active", 3000);
    }
}

/* Rows of any kind, some of them dependent. What can't be bounded must say so; that has to be rare. */
TEST(random_problems)
{
    int solved = 0, missed = 0;
    for (uint64_t seed = 0; seed < 100; seed++) {
        qp_random rng = {seed + 100};
        qp_kind kind = {.d = random_int(&rng, 2, 15), .m = random_int(&rng, 1, 8), .condition = 20};
        kind.m = kind.m < kind.d ? kind.m : kind.d;
        uz_problem problem = problem_of(random_qp(&rng, &kind));
        quad_exact exact;
        CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
        for (size_t k = 0; k < COUNT(all_methods) * COUNT(both_operators); k++) {
            uz_settings settings = settings_for(all_methods[k / 2], both_operators[k % 2]);
            uz_result *result = can_run(settings.method, settings.op) ? solve_problem(&problem, &settings) : NULL;
            if (!result)
                continue;
            if (result->summary.outcome == UZ_CONVERGED)
                solved++;
            else
                missed++;
            check_bounds(result, &exact, "random");
            uz_result_free(result);
        }
        quad_exact_free(&exact);
        uz_problem_clear(&problem);
    }
    printf("# %d converged, %d did not\n", solved, missed);
    CHECK(missed <= solved / 100);
}

TEST(long_steps_are_shortened)
{
    static const double factors[] = {1.5, 3, 100, 1e6, 1e12};
    qp_random rng = {21};
    uz_problem problem = problem_of(random_obstacle(&rng, 20, 2));
    quad_exact exact;
    CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
    for (size_t k = 0; k < COUNT(factors) * 3 * 2; k++) {
        uz_settings settings = settings_for(all_methods[1 + k % 3], both_operators[k / 3 % 2]);
        uz_result *first = solve_problem(&problem, &settings);
        settings.alpha = factors[k / 6] * (first ? first->summary.alpha : NAN);
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            check_result(result, &exact, "long step");
            CHECK_MSG(factors[k / 6] < 100 || result->summary.alpha < settings.alpha, "%g stayed", settings.alpha);
        }
        uz_result_free(result);
        uz_result_free(first);
    }
    quad_exact_free(&exact);
    uz_problem_clear(&problem);
}

/* A problem that first-order steps need a while for. */
static uz_problem slow_problem(void)
{
    qp_random rng = {33};
    return problem_of(random_obstacle(&rng, 60, 1));
}

TEST(iteration_limit)
{
    static const int64_t limits[] = {0, 1, 2, 5, 17};
    uz_problem problem = slow_problem();
    for (size_t k = 0; k < COUNT(limits) * COUNT(all_methods); k++) {
        uz_settings settings = settings_for(all_methods[k % COUNT(all_methods)], UZ_OPERATOR_CONDENSED);
        settings.max_iterations = limits[k / COUNT(all_methods)];
        uz_result *result = solve_problem(&problem, &settings);
        if (!result)
            continue;
        const uz_summary *s = &result->summary;
        CHECK(s->iterations <= settings.max_iterations);
        CHECK(s->outcome == UZ_ITERATION_LIMIT || s->outcome == UZ_CONVERGED);
        CHECK(s->outcome == UZ_ITERATION_LIMIT || settings.max_iterations > 0);
        CHECK_MSG(isfinite(s->certificate.absolute_error), "%s after %lld", uz_method_name(settings.method),
                  (long long)s->iterations);
        CHECK(s->outcome == UZ_CONVERGED || strstr(s->message, "max_iterations"));
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

TEST(time_limit)
{
    uz_problem problem = slow_problem();
    for (size_t k = 0; k < COUNT(all_methods); k++) {
        uz_settings settings = settings_for(all_methods[k], UZ_OPERATOR_CONDENSED);
        settings.time_limit_s = 0;
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "time_limit");
            CHECK_INT(result->summary.iterations, 0);
            CHECK(isfinite(result->summary.certificate.absolute_error));
        }
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

/* What the hooks saw. */
typedef struct {
    int64_t asked, refuse_after, rows, last;
    bool ascending;
} watcher;

static bool watch_cancel(void *ctx)
{
    watcher *w = ctx;
    return w->asked++ >= w->refuse_after;
}

static void watch_progress(void *ctx, const uz_history_row *row)
{
    watcher *w = ctx;
    w->ascending = w->ascending && (w->rows == 0 || row->iteration > w->last);
    w->last = row->iteration;
    w->rows++;
}

TEST(progress_is_told_once_per_row)
{
    uz_problem problem = slow_problem();
    for (size_t k = 0; k < COUNT(all_methods); k++) {
        watcher w = {.refuse_after = INT64_MAX, .ascending = true};
        uz_hooks hooks = {.ctx = &w, .cancelled = watch_cancel, .progress = watch_progress};
        uz_settings settings = settings_for(all_methods[k], UZ_OPERATOR_CONDENSED);
        settings.max_iterations = 300;
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK(uz_solve(&result, &problem, &settings, NULL, &hooks, &err) == UZ_OK);
        if (result) {
            CHECK_INT(w.rows, result->history.count);
            CHECK_INT(w.last, result->summary.iterations);
        }
        CHECK(w.ascending);
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

/* Cancelled before there is an answer: an error. Later: dismissed, with the best answer and its bound. */
TEST(cancel)
{
    uz_problem problem = slow_problem();
    int64_t errors = 0, dismissed = 0;
    for (int64_t after = 0; after < 30; after++) {
        watcher w = {.refuse_after = after, .ascending = true};
        uz_hooks hooks = {.ctx = &w, .cancelled = watch_cancel, .progress = watch_progress};
        uz_settings settings = settings_for(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED);
        uz_result *result = NULL;
        uz_error err = {0};
        uz_status status = uz_solve(&result, &problem, &settings, NULL, &hooks, &err);
        CHECK((status == UZ_OK) == (result != NULL));
        if (result) {
            dismissed++;
            CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "dismissed");
            CHECK(isfinite(result->summary.certificate.absolute_error));
        } else {
            errors++;
            CHECK_INT(status, UZ_ERR_CANCELLED);
            CHECK_INT(dismissed, 0);
        }
        uz_result_free(result);
    }
    CHECK(errors >= 2 && dismissed >= 20);
    uz_problem_clear(&problem);
}
