/* Histories, the active set, exact answers, and what uz_solve refuses. */
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

#define COUNT(list) (sizeof(list) / sizeof((list)[0]))

static const uz_method all_methods[] = {UZ_METHOD_AUTO,        UZ_METHOD_UZAWA,
                                        UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE,   UZ_METHOD_ACTIVE_SET};

static uz_result *solve_for(const uz_problem *problem, uz_method method, uz_operator op, double relative_error,
                            int64_t iterations)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.op = op;
    settings.relative_error = relative_error;
    settings.max_iterations = iterations;
    return solve_problem(problem, &settings);
}

/* Columns against each other and against the truth. */
static void check_history(const uz_result *result, const quad_exact *exact)
{
    const uz_history *history = &result->history;
    double best = INFINITY, optimum = (double)exact->energy, size = fabs(optimum) + (double)exact->norm2;
    int64_t restarts = 0;
    for (int64_t k = 0; k < history->count; k++) {
        const uz_history_row *row = &history->rows[k];
        const uz_residual *e = &row->residual;
        CHECK_INT(row->iteration, k);
        CHECK(row->error_bound <= best);
        CHECK(row->error_bound >= result->summary.certificate.absolute_error);
        best = row->error_bound;
        CHECK(row->dual_objective <= optimum + 1e-13 * size);
        CHECK(row->contacts >= 0 && row->contacts <= result->m);
        CHECK(row->seconds >= 0 && (k == 0 || row->seconds >= history->rows[k - 1].seconds));
        CHECK(k > 0 || (row->step_norm == 0 && !row->restart));
        CHECK(e->e3 == 0);
        CHECK_REL(e->total, hypot(e->e1, hypot(e->e2, e->e4)), 1e-13);
        restarts += row->restart;
    }
    CHECK_INT(restarts, result->summary.restarts);
    CHECK_INT(history->count, result->summary.iterations + 1);
    CHECK_INT(history->stride, 1);
}

TEST(histories_are_consistent)
{
    for (uint64_t seed = 0; seed < 10; seed++) {
        qp_random rng = {seed};
        uz_problem problem = problem_of(random_obstacle(&rng, random_int(&rng, 5, 30), 1 + (int64_t)(seed % 3)));
        quad_exact exact;
        CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
        for (size_t k = 0; k < COUNT(all_methods); k++) {
            uz_result *result = solve_for(&problem, all_methods[k], UZ_OPERATOR_CONDENSED, 1e-8, 2000);
            if (result)
                check_history(result, &exact);
            uz_result_free(result);
        }
        quad_exact_free(&exact);
        uz_problem_clear(&problem);
    }
}

/* The bound in row k is one on the answer that a run of k iterations returns. */
static void check_bounds_of_rows(const uz_problem *problem, uz_method method, uz_operator op)
{
    quad_exact exact;
    CHECK(quad_exact_solve(&exact, &problem->qp, NULL));
    for (int64_t limit = 0; limit < 40; limit++) {
        uz_result *result = solve_for(problem, method, op, 1e-12, limit);
        if (!result)
            continue;
        double bound = result->history.rows[result->history.count - 1].error_bound;
        double error = fmax(quad_error(&exact, result->u), quad_error_of_reactions(&exact, result->r));
        CHECK_MSG(bound * (1 + 1e-9) >= error * (1 - 1e-9) - 1e-13, "%s, %s, after %lld: bound %g, error %g",
                  uz_method_name(method), uz_choice_name(UZ_CHOICE_OPERATOR, op), (long long)limit, bound, error);
        CHECK(result->summary.certificate.absolute_error >= error * (1 - 1e-12));
        uz_result_free(result);
    }
    quad_exact_free(&exact);
}

TEST(bounds_in_the_history_hold)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE};
    for (uint64_t seed = 0; seed < 16; seed++) {
        qp_random rng = {seed + 5};
        qp_kind kind = {.d = 8, .m = 6 + (int64_t)seed, .condition = 30, .dependent = seed % 3 == 0};
        uz_problem problem = problem_of(seed < 2 ? random_obstacle(&rng, 25, 2) : random_qp(&rng, &kind));
        check_bounds_of_rows(&problem, methods[seed % 4], UZ_OPERATOR_CONDENSED);
        check_bounds_of_rows(&problem, methods[seed % 4], UZ_OPERATOR_FACTORED);
        uz_problem_clear(&problem);
    }
}

/* The psi(r) that the history reports is that of the r that is returned. */
TEST(dual_objective_is_that_of_the_reactions)
{
    qp_random rng = {6};
    uz_problem problem = problem_of(random_obstacle(&rng, 20, 1));
    quad_exact exact;
    CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
    for (int64_t limit = 0; limit < 40; limit++) {
        uz_settings settings = uz_settings_default();
        settings.stopping = UZ_STOP_PAPER;
        settings.method = limit < 20 ? UZ_METHOD_ACCELERATED_RESTART : UZ_METHOD_CONJUGATE;
        settings.max_iterations = limit;
        uz_result *result = solve_problem(&problem, &settings); /* of the last r */
        if (result)
            CHECK_REL(result->history.rows[result->history.count - 1].dual_objective,
                      quad_dual_objective(&exact, result->r), 1e-12);
        uz_result_free(result);
    }
    quad_exact_free(&exact);
    uz_problem_clear(&problem);
}

static void check_exact(const uz_problem *problem, uz_method method, double accuracy, int64_t steps)
{
    quad_exact exact;
    CHECK(quad_exact_solve(&exact, &problem->qp, NULL));
    CHECK(exact.violation < (quad)1e-22);
    uz_result *result = solve_for(problem, method, UZ_OPERATOR_CONDENSED, 0, 100000);
    if (result) {
        const uz_summary *s = &result->summary;
        double error = quad_error(&exact, result->u) / (double)quad_sqrt(exact.norm2);
        CHECK_MSG(error <= accuracy, "d %d m %d: error %g after %lld", (int)exact.d, (int)exact.m, error,
                  (long long)s->iterations);
        CHECK_MSG(s->outcome == UZ_CONVERGED, "d %d m %d: %s, certified %g", (int)exact.d, (int)exact.m,
                  uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), s->certificate.relative_error);
        CHECK_MSG(s->iterations <= steps, "d %d m %d: %lld steps", (int)exact.d, (int)exact.m,
                  (long long)s->iterations);
        for (int64_t i = 0; i < exact.m; i++) /* rows far from degenerate are on the right side */
            if (exact.g[i] > (quad)1e-9 || exact.r[i] < -(quad)1e-9)
                CHECK_INT(result->r[i] < 0, exact.r[i] < 0);
    }
    uz_result_free(result);
    quad_exact_free(&exact);
}

/* With an M-matrix in place of D^-1 the steps are monotone: m + 1 of them at most, in practice a few. */
TEST(active_set_on_obstacle_problems)
{
    for (uint64_t seed = 0; seed < 30; seed++) {
        qp_random rng = {seed + 40};
        int64_t d = random_int(&rng, 2, 60);
        uz_problem problem = problem_of(random_obstacle(&rng, d, random_int(&rng, 1, 4)));
        check_exact(&problem, UZ_METHOD_ACTIVE_SET, 1e-12, 20); /* a chain of 60 springs: a condition of 1e3 and more */
        uz_problem_clear(&problem);
    }
}

/* General positive definite D, where the steps may cycle and the rule that ends them is needed. Rows: d x d, of full
 * rank, nearly parallel for larger `mix`. */
static uz_qp coupled_problem(qp_random *rng, int64_t d, double mix)
{
    qp_kind kind = {.d = d, .m = 0, .condition = 50};
    uz_qp qp = random_qp(rng, &kind);
    double *N = vector(d * d);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++)
            N[i * d + j] = (i == j) + mix * random_signed(rng);
    uz_csc_clear(&qp.N);
    qp.N = csc_from_dense(N, d, d, false);
    free(qp.h);
    qp.h = vector(d);
    for (int64_t i = 0; i < d; i++)
        qp.h[i] = 0.1 * random_signed(rng);
    free(N);
    return qp;
}

TEST(active_set_on_coupled_rows)
{
    static const double mixes[] = {0.1, 0.5, 2};
    for (uint64_t seed = 0; seed < 30; seed++) {
        qp_random rng = {seed + 80};
        int64_t d = random_int(&rng, 2, 25);
        uz_problem problem = problem_of(coupled_problem(&rng, d, mixes[seed % 3]));
        check_exact(&problem, UZ_METHOD_ACTIVE_SET, 1e-10, 400);
        check_exact(&problem, UZ_METHOD_AUTO, 1e-10, 100000);
        uz_problem_clear(&problem);
    }
}

TEST(exact_accuracy_asks_for_rounding_level)
{
    qp_random rng = {9};
    uz_problem problem = problem_of(random_obstacle(&rng, 40, 2));
    for (size_t k = 0; k < COUNT(all_methods); k++) {
        uz_result *result = solve_for(&problem, all_methods[k], UZ_OPERATOR_CONDENSED, 0, 100000);
        if (result) {
            CHECK_REL(result->summary.requested_error, 1e-12, 1e-6);
            CHECK(result->summary.outcome == UZ_CONVERGED || result->summary.outcome == UZ_PRECISION_LIMIT);
            CHECK(result->summary.certificate.relative_error < 1e-9);
        }
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

static void check_refused(const uz_problem *problem, const uz_settings *settings, uz_status want, const char *where)
{
    uz_result *result = (uz_result *)problem;
    uz_error err = {0};
    uz_status status = uz_solve(&result, problem, settings, NULL, NULL, &err);
    CHECK_MSG(status == want, "%s: %s", where, uz_status_name(status));
    CHECK(result == NULL || status == UZ_OK);
    CHECK_INT(err.status, status);
    if (where)
        CHECK_STR(err.where, where);
    if (status == UZ_OK)
        uz_result_free(result);
}

TEST(settings_out_of_range_are_refused)
{
    qp_random rng = {10};
    uz_problem problem = problem_of(random_obstacle(&rng, 6, 1));
    const double bad[] = {NAN, -1, -1e-300, INFINITY};
    for (size_t k = 0; k < COUNT(bad); k++) {
        uz_settings s = uz_settings_default();
        s.relative_error = bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.epsilon = bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.alpha = bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.time_limit_s = bad[k];
        check_refused(&problem, &s, bad[k] > 0 ? UZ_OK : UZ_ERR_ARGUMENT, "");
    }
    uz_settings s = uz_settings_default();
    s.relative_error = 1.0000001;
    check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
    s = uz_settings_default();
    s.max_iterations = -1;
    check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
    uz_problem_clear(&problem);
}

TEST(unknown_choices_are_refused)
{
    qp_random rng = {11};
    uz_problem problem = problem_of(random_obstacle(&rng, 6, 1));
    static const int bad[] = {-1, UZ_METHOD_GIVEN, 99};
    for (size_t k = 0; k < COUNT(bad); k++) {
        uz_settings s = uz_settings_default();
        s.method = (uz_method)bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.op = (uz_operator)bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.ordering = (uz_ordering)bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
        s = uz_settings_default();
        s.stopping = (uz_stopping)bad[k];
        check_refused(&problem, &s, UZ_ERR_ARGUMENT, "");
    }
    uz_problem_clear(&problem);
}

TEST(numbers_that_are_not_finite_are_refused)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    static const char *const names[] = {"K", "N", "p", "h"};
    uz_settings settings = uz_settings_default();
    for (size_t k = 0; k < COUNT(bad) * COUNT(names); k++) {
        qp_random rng = {12};
        uz_problem problem = problem_of(random_obstacle(&rng, 6, 1));
        uz_qp *qp = &problem.qp;
        double *at[] = {&qp->K.val[4], &qp->N.val[2], &qp->p[5], &qp->h[0]};
        *at[k % 4] = bad[k / 4];
        check_refused(&problem, &settings, UZ_ERR_NOT_FINITE, names[k % 4]);
        uz_problem_clear(&problem);
    }
}

TEST(stiffness_that_is_not_positive_definite_is_refused)
{
    uz_settings settings = uz_settings_default();
    for (int k = 0; k < 3; k++) {
        qp_random rng = {13};
        uz_problem problem = problem_of(random_obstacle(&rng, 6, 1));
        problem.qp.K.val[0] = k == 0 ? -1 : k == 1 ? 0 : 1e-30;
        check_refused(&problem, &settings, UZ_ERR_NOT_SPD, "K");
        uz_problem_clear(&problem);
    }
}

TEST(shapes_that_disagree_are_refused)
{
    qp_random rng = {14};
    uz_settings settings = uz_settings_default();
    uz_problem problem = problem_of(random_obstacle(&rng, 6, 1)), other = problem_of(random_obstacle(&rng, 7, 1));
    uz_csc N = problem.qp.N;
    problem.qp.N = other.qp.N;
    check_refused(&problem, &settings, UZ_ERR_SIZE, "N");
    problem.qp.N = N;
    double *p = problem.qp.p;
    problem.qp.p = NULL;
    check_refused(&problem, &settings, UZ_ERR_SIZE, "p");
    problem.qp.p = p;
    uz_problem_clear(&problem);
    uz_problem_clear(&other);
}
