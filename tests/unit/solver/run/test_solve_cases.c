/* Several loads on one body: the answers are those of the loads one by one, certified one by one, and none depends on
 * its neighbours. */
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

#include <stdint.h>

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

static void add_cases(uz_problem *problem, int64_t n)
{
    problem->cases = calloc((size_t)n, sizeof *problem->cases);
    problem->n_cases = n;
    for (int64_t i = 0; i < n; i++)
        snprintf(problem->cases[i].name, sizeof problem->cases[i].name, "%lld", (long long)i);
}

/* The paper's body under n loads: pull and pressure vary; the first one is the scene's own. */
static uz_problem scene_with_cases(int64_t n)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    add_cases(&problem, n);
    for (int64_t i = 1; i < n; i++) {
        uz_load_case *c = &problem.cases[i];
        c->n_loads = 2;
        c->loads = calloc(2, sizeof *c->loads);
        memcpy(c->loads, problem.scene.loads, 2 * sizeof *c->loads);
        c->loads[0].v[1] *= 1 + 0.5 * sin((double)i);
        c->loads[1].v[0] *= 1 + 0.5 * cos((double)i);
    }
    return problem;
}

static uz_problem matrices_with_cases(qp_random *rng, const qp_kind *kind, int64_t n)
{
    uz_problem problem = problem_of(random_qp(rng, kind));
    add_cases(&problem, n);
    for (int64_t i = 0; i < n; i++) {
        problem.cases[i].p = vector(kind->d);
        for (int64_t j = 0; j < kind->d; j++)
            problem.cases[i].p[j] = 3 * random_signed(rng);
    }
    return problem;
}

/* The same problem with the load of case i as its own; borrows. */
static uz_problem single(const uz_problem *problem, int64_t i)
{
    uz_problem one = *problem;
    const uz_load_case *c = &problem->cases[i];
    one.cases = NULL;
    one.n_cases = 0;
    one.qp.p = c->p ? c->p : one.qp.p;
    one.qp.h = c->h ? c->h : one.qp.h;
    if (c->loads) {
        one.scene.loads = c->loads;
        one.scene.n_loads = c->n_loads;
    }
    return one;
}

static uz_result **solve_cases(const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks)
{
    uz_result **results = NULL;
    uz_error err = {0};
    uz_status status = uz_solve_cases(&results, problem, settings, NULL, NULL, hooks, &err);
    CHECK_MSG(status == UZ_OK && results, "%s: %s %s", uz_status_name(status), err.where, err.message);
    if (!results)
        exit(1);
    return results;
}

static int64_t length_of_u(const uz_result *x)
{
    return x->mesh.dim ? x->n_nodes * x->mesh.dim : x->d;
}

static double largest_difference(const double *x, const double *y, int64_t n)
{
    double value = 0;
    for (int64_t i = 0; i < n; i++)
        value = fmax(value, fabs(x[i] - y[i]));
    return value;
}

static double largest(const double *x, int64_t n)
{
    double value = 0;
    for (int64_t i = 0; i < n; i++)
        value = fmax(value, fabs(x[i]));
    return value;
}

/* Two converged answers to one load differ by rounding. */
static void check_alike(const uz_result *x, const uz_result *y, double tolerance, int64_t which)
{
    int64_t n = length_of_u(x);
    CHECK_INT(x->summary.outcome, y->summary.outcome);
    CHECK_INT(x->summary.active, y->summary.active);
    double du = largest_difference(x->u, y->u, n), dr = largest_difference(x->r, y->r, x->m);
    CHECK_MSG(du <= tolerance * largest(y->u, n), "case %lld: u differs by %g", (long long)which, du);
    CHECK_MSG(dr <= tolerance * largest(y->r, y->m), "case %lld: r differs by %g", (long long)which, dr);
    CHECK_REL(x->summary.certificate.energy_primal, y->summary.certificate.energy_primal, 1e-10);
}

/* Bit for bit, but for the clock. */
static void check_same(const uz_result *x, const uz_result *y)
{
    CHECK(memcmp(x->u, y->u, (size_t)length_of_u(x) * sizeof *x->u) == 0);
    CHECK(x->m == 0 || memcmp(x->r, y->r, (size_t)x->m * sizeof *x->r) == 0);
    CHECK(x->m == 0 || memcmp(x->g, y->g, (size_t)x->m * sizeof *x->g) == 0);
    CHECK(memcmp(&x->summary.certificate, &y->summary.certificate, sizeof x->summary.certificate) == 0);
    CHECK_INT(x->summary.iterations, y->summary.iterations);
    CHECK_INT(x->summary.outcome, y->summary.outcome);
    CHECK_INT(x->history.count, y->history.count);
}

static void compare_with_singles(const uz_problem *problem, const uz_settings *settings, double tolerance)
{
    uz_result **results = solve_cases(problem, settings, NULL);
    for (int64_t i = 0; i < problem->n_cases; i++) {
        uz_problem one = single(problem, i);
        uz_result *alone = solve_problem(&one, settings);
        CHECK(results[i]->state != NULL);
        if (alone) {
            const double among = results[i]->summary.certificate.relative_error,
                         by_itself = alone->summary.certificate.relative_error;
            check_alike(results[i], alone, tolerance, i);
            CHECK_MSG(among < 8 * by_itself && by_itself < 8 * among, "case %lld: certified %g, alone %g", (long long)i,
                      among, by_itself); /* u differs by rounding, which is what is left of the residual */
        }
        uz_result_free(alone);
    }
    uz_results_free(results, problem->n_cases);
}

TEST(cases_of_a_scene_are_the_scenes_one_by_one)
{
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    for (int k = 0; k < 2; k++) {
        uz_problem problem = scene_with_cases(k == 0 ? 21 : 3);
        uz_settings settings = uz_settings_default();
        settings.op = ops[k];
        compare_with_singles(&problem, &settings, k == 0 ? 1e-12 : 1e-7);
        uz_problem_clear(&problem);
    }
}

TEST(cases_of_matrices_are_the_matrices_one_by_one)
{
    for (uint64_t seed = 0; seed < 20; seed++) {
        qp_random rng = {seed + 7};
        qp_kind kind = {.d = random_int(&rng, 1, 40), .m = random_int(&rng, 0, 12), .condition = 100};
        uz_problem problem = matrices_with_cases(&rng, &kind, random_int(&rng, 1, 20));
        uz_settings settings = uz_settings_default();
        settings.method = seed % 2 ? UZ_METHOD_AUTO : UZ_METHOD_ACCELERATED_RESTART;
        settings.op = UZ_OPERATOR_CONDENSED;
        compare_with_singles(&problem, &settings, 1e-5);
        uz_problem_clear(&problem);
    }
}

/* Identical loads in every lane of two blocks and more. */
TEST(an_answer_does_not_depend_on_its_lane)
{
    uz_problem problem = scene_with_cases(19);
    uz_settings settings = uz_settings_default();
    for (int64_t i = 2; i < problem.n_cases; i++)
        memcpy(problem.cases[i].loads, problem.cases[1].loads, 2 * sizeof(uz_load));
    uz_result **results = solve_cases(&problem, &settings, NULL);
    for (int64_t i = 2; i < problem.n_cases; i++)
        check_same(results[1], results[i]);
    uz_results_free(results, problem.n_cases);
    uz_problem_clear(&problem);
}

TEST(an_answer_does_not_depend_on_its_neighbours)
{
    uz_problem many = scene_with_cases(19), few = scene_with_cases(19);
    uz_settings settings = uz_settings_default();
    memcpy(few.cases[1].loads, many.cases[17].loads, 2 * sizeof(uz_load));
    for (int64_t i = 2; i < 19; i++)
        free(few.cases[i].loads);
    few.n_cases = 2;
    uz_result **a = solve_cases(&many, &settings, NULL), **b = solve_cases(&few, &settings, NULL);
    check_same(a[0], b[0]);
    check_same(a[17], b[1]);
    uz_results_free(a, many.n_cases);
    uz_results_free(b, few.n_cases);
    uz_problem_clear(&many);
    uz_problem_clear(&few);
}

/* Bounds of certificates in lanes against the exact solution, many of them for answers that are not converged. */
static void check_bounds(uz_problem *problem, int64_t max_iterations)
{
    uz_settings settings = uz_settings_default();
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    settings.op = UZ_OPERATOR_CONDENSED;
    settings.max_iterations = max_iterations;
    uz_result **results = solve_cases(problem, &settings, NULL);
    for (int64_t i = 0; i < problem->n_cases; i++) {
        quad_exact exact;
        uz_problem one = single(problem, i);
        if (quad_exact_solve(&exact, &one.qp, NULL)) {
            const uz_certificate *c = &results[i]->summary.certificate;
            double error = quad_error(&exact, results[i]->u);
            CHECK_MSG(c->absolute_error >= error, "case %lld: off by %.17g, bound %.17g", (long long)i, error,
                      c->absolute_error);
            CHECK(fabs(c->energy_norm - (double)quad_sqrt(exact.norm2)) <= c->absolute_error + 1e-12 * c->energy_norm);
        }
        quad_exact_free(&exact);
    }
    uz_results_free(results, problem->n_cases);
}

TEST(bounds_hold_for_every_case)
{
    for (uint64_t seed = 0; seed < 40; seed++) {
        qp_random rng = {seed + 1000};
        qp_kind kind = {
            .d = random_int(&rng, 1, 30), .m = random_int(&rng, 1, 10), .condition = pow(10, (double)(seed % 8))};
        uz_problem problem = matrices_with_cases(&rng, &kind, 10);
        check_bounds(&problem, (int64_t)(seed % 4) * 7);
        check_bounds(&problem, 20000);
        uz_problem_clear(&problem);
    }
}

/* One case without a feasible displacement: the others are answered. */
TEST(a_contradiction_stays_in_its_case)
{
    qp_random rng = {5};
    qp_kind kind = {.d = 6, .m = 4, .condition = 10, .dependent = true};
    uz_problem problem = matrices_with_cases(&rng, &kind, 5);
    uz_settings settings = uz_settings_default();
    uz_csc *N = &problem.qp.N;
    for (int64_t k = 0; k < N->ptr[N->cols]; k++) /* row 1 is minus row 0 */
        if (N->idx[k] < 2)
            N->val[k] = N->idx[k] == 0 ? 1.0 : -1.0;
    double *dense = vector(4 * 6);
    for (int64_t i = 0; i < 4; i++)
        for (int64_t j = 0; j < 6; j++)
            dense[i * 6 + j] = i == 0 ? 1 : i == 1 ? -1 : random_signed(&rng);
    uz_csc_clear(N);
    *N = csc_from_dense(dense, 4, 6, false);
    for (int64_t i = 0; i < 4; i++)
        problem.qp.h[i] = 1;
    problem.cases[2].h = vector(4);
    problem.cases[2].h[0] = problem.cases[2].h[1] = -1; /* sum u <= -1 and >= 1 */
    uz_result **results = solve_cases(&problem, &settings, NULL);
    for (int64_t i = 0; i < 5; i++) {
        CHECK_INT(results[i]->summary.outcome, i == 2 ? UZ_INFEASIBLE : UZ_CONVERGED);
        CHECK((results[i]->ray != NULL) == (i == 2));
        CHECK(isnan(results[i]->u[0]) == (i == 2));
        CHECK((results[i]->state == NULL) == (i == 2));
    }
    uz_results_free(results, 5);
    uz_problem_clear(&problem);
    free(dense);
}

typedef struct {
    int64_t begun, current;
    int64_t stop_at; /* cancels when this case begins; -1: never */
    bool in_order;
} watch;

static void watch_begin(void *ctx, int64_t load_case)
{
    watch *w = ctx;
    w->in_order = w->in_order && load_case == w->begun;
    w->begun++;
    w->current = load_case;
}

static bool watch_cancel(void *ctx)
{
    const watch *w = ctx;
    return w->stop_at >= 0 && w->begun > w->stop_at;
}

TEST(cases_begin_in_order)
{
    uz_problem problem = scene_with_cases(11);
    uz_settings settings = uz_settings_default();
    watch w = {.stop_at = -1, .in_order = true};
    uz_hooks hooks = {.ctx = &w, .begins = watch_begin};
    uz_results_free(solve_cases(&problem, &settings, &hooks), 11);
    CHECK_INT(w.begun, 11);
    CHECK(w.in_order);
    uz_problem_clear(&problem);
}

/* Cases without a turn are answered with r = 0, certified. */
TEST(cancelled_cases_are_answered)
{
    uz_problem problem = scene_with_cases(20);
    uz_settings settings = uz_settings_default();
    watch w = {.stop_at = 12, .in_order = true};
    uz_hooks hooks = {.ctx = &w, .cancelled = watch_cancel, .begins = watch_begin};
    uz_result **results = solve_cases(&problem, &settings, &hooks);
    for (int64_t i = 0; i < 20; i++) {
        const uz_summary *s = &results[i]->summary;
        CHECK_INT(s->outcome, i < 12 ? UZ_CONVERGED : UZ_DISMISSED);
        CHECK(i < 12 || (s->iterations == 0 && s->active == 0 && isfinite(s->certificate.absolute_error)));
    }
    uz_results_free(results, 20);
    uz_problem_clear(&problem);
}

TEST(time_is_of_all_cases)
{
    uz_problem problem = scene_with_cases(10);
    uz_settings settings = uz_settings_default();
    settings.time_limit_s = 0;
    uz_result **results = solve_cases(&problem, &settings, NULL);
    for (int64_t i = 0; i < 10; i++) {
        CHECK_INT(results[i]->summary.outcome, UZ_TIME_LIMIT);
        CHECK(results[i]->summary.certificate.absolute_error > 0 &&
              isfinite(results[i]->summary.certificate.absolute_error));
    }
    uz_results_free(results, 10);
    uz_problem_clear(&problem);
}

TEST(balanced_is_a_request_of_each_case)
{
    uz_problem problem = scene_with_cases(9);
    uz_settings settings = uz_settings_default();
    settings.balanced = true;
    uz_result **results = solve_cases(&problem, &settings, NULL);
    bool differ = false;
    for (int64_t i = 0; i < 9; i++) {
        const uz_summary *s = &results[i]->summary;
        CHECK_INT(s->outcome, UZ_CONVERGED);
        CHECK_REL(s->requested_error, 0.1 * s->discretization_error, 1e-12);
        CHECK(s->certificate.relative_error <= s->requested_error);
        differ = differ || s->requested_error != results[0]->summary.requested_error;
    }
    CHECK(differ);
    uz_results_free(results, 9);
    uz_problem_clear(&problem);
}

/* No case of its own, or one: still a result each. */
TEST(one_case_and_none)
{
    for (int64_t n = 0; n <= 1; n++) {
        uz_problem problem = scene_with_cases(1);
        problem.n_cases = n;
        uz_settings settings = uz_settings_default();
        uz_result **results = solve_cases(&problem, &settings, NULL);
        uz_problem one = single(&problem, 0);
        uz_result *alone = solve_problem(&one, &settings);
        check_same(results[0], alone);
        uz_results_free(results, 1);
        uz_result_free(alone);
        problem.n_cases = 1;
        uz_problem_clear(&problem);
    }
}

TEST(an_empty_list_of_loads_is_no_load)
{
    uz_problem problem = scene_with_cases(3);
    uz_settings settings = uz_settings_default();
    problem.cases[1].n_loads = 0;
    uz_result **results = solve_cases(&problem, &settings, NULL);
    CHECK_INT(results[1]->summary.outcome, UZ_CONVERGED);
    CHECK(largest(results[1]->u, length_of_u(results[1])) == 0);
    CHECK(largest(results[0]->u, length_of_u(results[0])) > 0);
    uz_results_free(results, 3);
    uz_problem_clear(&problem);
}

static void check_refused(const uz_problem *problem, const uz_settings *settings, const uz_state *const *starts,
                          uz_status expected, const char *where)
{
    uz_result **results = (uz_result **)&expected;
    uz_error err;
    memset(&err, 0x5a, sizeof err);
    CHECK_INT(uz_solve_cases(&results, problem, settings, starts, NULL, NULL, &err), expected);
    CHECK(results == NULL);
    CHECK_STR(err.where, where);
}

TEST(errors_say_which_case)
{
    uz_problem scene = scene_with_cases(5);
    uz_settings settings = uz_settings_default();
    snprintf(scene.cases[3].loads[1].on, sizeof scene.cases[3].loads[1].on, "nowhere");
    check_refused(&scene, &settings, NULL, UZ_ERR_SCENE, "/cases/3/loads/1/on");
    snprintf(scene.cases[3].loads[1].on, sizeof scene.cases[3].loads[1].on, "right");
    scene.cases[2].h = vector(1);
    check_refused(&scene, &settings, NULL, UZ_ERR_ARGUMENT, "/cases/2");
    free(scene.cases[2].h);
    scene.cases[2].h = NULL;
    uz_result *result = (uz_result *)&scene;
    uz_error err = {0};
    CHECK_INT(uz_solve(&result, &scene, &settings, NULL, NULL, &err), UZ_ERR_ARGUMENT);
    CHECK(result == NULL);
    uz_state start = {.m = 3};
    const uz_state *starts[5] = {NULL, NULL, NULL, NULL, &start};
    check_refused(&scene, &settings, starts, UZ_ERR_SIZE, "/cases/4/start");
    uz_problem_clear(&scene);

    qp_random rng = {8};
    qp_kind kind = {.d = 5, .m = 3, .condition = 10};
    uz_problem matrices = matrices_with_cases(&rng, &kind, 3);
    matrices.cases[1].p[2] = NAN;
    check_refused(&matrices, &settings, NULL, UZ_ERR_NOT_FINITE, "/cases/1/p");
    uz_problem_clear(&matrices);
}

TEST(results_count_as_memory)
{
    enum { CASES = 200 };
    uz_problem problem = scene_with_cases(CASES);
    uz_settings settings = uz_settings_default();
    uz_result **results = solve_cases(&problem, &settings, NULL);
    settings.memory_limit = (size_t)results[0]->summary.cost.bytes + 1000; /* the body fits, the results don't */
    uz_results_free(results, CASES);
    check_refused(&problem, &settings, NULL, UZ_ERR_LIMIT, "/cases");
    settings.memory_limit = 1 << 30;
    uz_results_free(solve_cases(&problem, &settings, NULL), CASES);
    uz_problem_clear(&problem);
}
