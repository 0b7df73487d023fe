/* Projected conjugate gradients: how many applications of D they take, and what must hold of their steps. */
#include "harness.h"
#include "judge.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

static uz_settings settings_for(uz_method method, double relative_error)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.relative_error = relative_error;
    return settings;
}

static uz_settings paper_rule(uz_method method)
{
    uz_settings settings = settings_for(method, 1e-2);
    settings.stopping = UZ_STOP_PAPER;
    settings.epsilon = 1e-6;
    return settings;
}

/* The paper's body. Iterations to ||rho - r|| <= 1e-6 N: of Algorithm 2 with the paper's step size lambda_1(K), of
 * Algorithm 1, and the error of Algorithm 2's answer with 1 / lambda_max(D). */
static const struct {
    int64_t nx, paper_step, uzawa;
    double error;
} BODIES[] = {{30, 615, 2872, 7.7e-6}, {60, 675, 4054, 1.4e-5}, {120, 658, 5298, 2.3e-5}, {240, 693, 5411, 3.8e-5}};

TEST(a_tenth_of_the_iterations_of_the_paper)
{
    for (size_t k = 0; k < sizeof BODIES / sizeof BODIES[0]; k++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(BODIES[k].nx, BODIES[k].nx / 3)};
        uz_settings settings = paper_rule(UZ_METHOD_CONJUGATE);
        uz_result *result = solve_problem(&problem, &settings);
        const uz_summary *s = &result->summary;
        const uz_history *history = &result->history;
        CHECK_INT(s->outcome, UZ_CONVERGED);
        CHECK_MSG(10 * s->iterations <= BODIES[k].paper_step && 100 * s->iterations <= BODIES[k].uzawa,
                  "%lld iterations at NX = %lld", (long long)s->iterations, (long long)BODIES[k].nx);
        CHECK_MSG(s->certificate.relative_error <= BODIES[k].error, "%g", s->certificate.relative_error);
        CHECK(history->rows[history->count - 1].step_norm <= settings.epsilon);
        CHECK(history->rows[history->count - 2].step_norm > settings.epsilon);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* Of D, when the only bound of a run by the paper's rule is made, after its last iteration. */
static int64_t applications_after(const uz_problem *problem, int64_t iterations)
{
    uz_settings settings = paper_rule(UZ_METHOD_CONJUGATE);
    settings.epsilon = 0;
    settings.max_iterations = iterations;
    uz_result *result = solve_problem(problem, &settings);
    CHECK_INT(result->summary.iterations, iterations);
    int64_t applications = -1;
    for (int k = 0; k < UZ_TRADE_STEPS; k++)
        if (!isnan(result->trade.step[k].seconds) && result->trade.step[k].iterations == iterations)
            applications = result->trade.step[k].applications;
    CHECK(applications > 0);
    uz_result_free(result);
    return applications;
}

/* So counts of iterations are fair beside those of the other methods. */
TEST(one_application_for_each_iteration)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(60, 20)};
    int64_t early = applications_after(&problem, 8), late = applications_after(&problem, 33);
    CHECK_INT(late - early, 25);
    uz_problem_clear(&problem);
}

/* psi(r) of each row is no less than that of the row before, but by rounding. */
static void check_rise(const uz_result *result, const char *what)
{
    double size = 0;
    for (int64_t i = 0; i < result->history.count; i++)
        size = fmax(size, fabs(result->history.rows[i].dual_objective));
    for (int64_t i = 1; i < result->history.count; i++) {
        const uz_history_row *row = &result->history.rows[i];
        CHECK_MSG(row->dual_objective >= row[-1].dual_objective - 1e-13 * size, "%s, iteration %lld: %.17g after %.17g",
                  what, (long long)row->iteration, row->dual_objective, row[-1].dual_objective);
    }
    int64_t restarts = 0;
    for (int64_t i = 0; i < result->history.count; i++)
        restarts += result->history.rows[i].restart;
    CHECK_INT(restarts, result->summary.restarts);
    for (int64_t i = 0; i < result->m; i++)
        CHECK(result->r[i] <= 0);
}

TEST(the_dual_objective_never_falls)
{
    for (uint64_t seed = 0; seed < 60; seed++) {
        qp_random rng = {seed + 400};
        qp_kind kind = {.d = 20,
                        .m = 15 + (int64_t)(seed % 20),
                        .condition = pow(10, (double)(seed % 7)),
                        .dependent = seed % 5 == 0};
        uz_problem problem = problem_of(seed % 3 ? random_qp(&rng, &kind) : random_obstacle(&rng, 60, 1));
        uz_settings settings = settings_for(UZ_METHOD_CONJUGATE, 1e-10);
        settings.max_iterations = 3000;
        uz_result *result = solve_problem(&problem, &settings);
        char what[32];
        snprintf(what, sizeof what, "seed %d", (int)seed);
        check_rise(result, what);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* On one face conjugate gradients end after as many steps as there are rows: all rows pressed, at most a handful of
 * restarts on the way to that. */
TEST(the_end_is_finite)
{
    for (uint64_t seed = 0; seed < 10; seed++) {
        qp_random rng = {seed + 900};
        uz_problem problem = problem_of(random_obstacle(&rng, 30, 2));
        for (int64_t j = 0; j < 30; j++)
            problem.qp.p[j] = 5; /* pressed onto every bound */
        uz_settings settings = settings_for(UZ_METHOD_CONJUGATE, 1e-11);
        uz_result *result = solve_problem(&problem, &settings);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_MSG(result->summary.iterations <= 2 * result->m, "%lld iterations, %lld rows",
                  (long long)result->summary.iterations, (long long)result->m);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* A step size of the user's that is too long is shortened; one that is much too short costs iterations only. */
TEST(any_step_size_ends_at_the_answer)
{
    static const double factors[] = {1e-4, 1e-2, 0.5, 1.9, 30, 1e6};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    for (size_t k = 0; k < sizeof factors / sizeof factors[0]; k++) {
        uz_settings settings = settings_for(UZ_METHOD_CONJUGATE, 1e-9);
        settings.alpha = factors[k] / 9.427e-4;
        uz_result *result = solve_problem(&problem, &settings);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_INT(result->summary.active, 22);
        CHECK_REL(result->summary.reaction_sum, -10.51371700, 1e-8);
        CHECK_MSG(result->summary.iterations < 2000, "%lld iterations", (long long)result->summary.iterations);
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

/* A run of Algorithm 2 continued by conjugate gradients and the other way round: the vectors of a state mean the same
 * problem, whatever the method. */
TEST(states_go_from_method_to_method)
{
    static const uz_method methods[] = {UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_CONJUGATE, UZ_METHOD_UZAWA};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    for (int k = 0; k < 9; k++)
        for (int64_t limit = 3; limit < 30; limit += 5) {
            uz_settings first = settings_for(methods[k / 3], 1e-8), then = settings_for(methods[k % 3], 1e-8);
            first.max_iterations = limit;
            uz_result *earlier = solve_problem(&problem, &first), **later = NULL;
            const uz_state *start = earlier->state;
            uz_error err = {0};
            CHECK(uz_solve_cases(&later, &problem, &then, &start, NULL, NULL, &err) == UZ_OK);
            CHECK_INT(later[0]->summary.outcome, UZ_CONVERGED);
            CHECK_REL(later[0]->summary.reaction_sum, -10.51371700, 1e-6);
            uz_result_free(earlier);
            uz_results_free(later, 1);
        }
    uz_problem_clear(&problem);
}

/* Rows in general position but for one, minus a combination of the first few, exactly: they contradict it by `overlap`,
 * or leave room where that is negative. More rows than dofs: D is singular. */
static uz_problem dependent_rows(uint64_t seed, double overlap)
{
    enum { D = 12, OTHERS = 10 };
    qp_random rng = {seed * 77 + 1};
    int64_t first = 3 + (int64_t)(seed % 5), m = first + 1 + OTHERS;
    double *K = random_spd(&rng, D, 10, 1), *N = vector(m * D), u[D];
    uz_qp qp = {.p = vector(D), .h = vector(m)};
    for (int64_t j = 0; j < D; j++) {
        u[j] = random_signed(&rng);
        qp.p[j] = random_signed(&rng);
    }
    for (int64_t i = 0; i < m * D; i++)
        N[i] = ldexp((double)random_int(&rng, -(1 << 20), 1 << 20), -20);
    for (int64_t j = 0; j < D; j++) {
        N[first * D + j] = 0;
        for (int64_t i = 0; i < first; i++)
            N[first * D + j] -= N[i * D + j] * (double)(1 + i % 2);
    }
    qp.K = csc_from_dense(K, D, D, true);
    qp.N = csc_from_dense(N, m, D, false);
    uz_csc_gaxpy(qp.h, &qp.N, 1, u);
    for (int64_t i = first + 1; i < m; i++)
        qp.h[i] += random_unit(&rng);
    qp.h[first] -= overlap;
    free(K);
    free(N);
    return problem_of(qp);
}

static int64_t count_of(uz_outcome outcome, uz_method method, uz_operator op, double overlap)
{
    int64_t count = 0;
    for (uint64_t seed = 0; seed < 20; seed++) {
        uz_problem problem = dependent_rows(seed, overlap);
        uz_settings settings = settings_for(method, 1e-6);
        settings.op = op;
        settings.max_iterations = 20000;
        uz_result *result = solve_problem(&problem, &settings);
        CHECK(result->summary.outcome != UZ_CONVERGED || overlap <= 0);
        CHECK(result->summary.outcome != UZ_INFEASIBLE || overlap > 0);
        count += result->summary.outcome == outcome;
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
    return count;
}

/* A step along a ray goes as far as rounding has it: the ray is looked at before anything is bounded there. */
TEST(contradictions_are_found_along_a_direction)
{
    CHECK_INT(count_of(UZ_ITERATION_LIMIT, UZ_METHOD_CONJUGATE, UZ_OPERATOR_FACTORED, 1e-2), 0);
    int64_t proved = count_of(UZ_INFEASIBLE, UZ_METHOD_CONJUGATE, UZ_OPERATOR_FACTORED, 1e-2);
    CHECK_MSG(proved >= 18, "%lld of 20", (long long)proved);
}

/* Without a factor what inner iterations leave is more than the curvature of such directions. */
TEST(auto_without_a_factor_takes_dependent_rows)
{
    CHECK_INT(count_of(UZ_CONVERGED, UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE, -1e-2), 20);
    CHECK_INT(count_of(UZ_CONVERGED, UZ_METHOD_CONJUGATE, UZ_OPERATOR_FACTORED, -1e-6), 20);
}
