/* Runs that go on from where another one stood, and runs that start from reactions. */
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

static uz_result *solve_from(const uz_problem *problem, const uz_settings *settings, const uz_state *start,
                             const uz_hooks *hooks)
{
    uz_result **results = NULL, *result = NULL;
    uz_error err = {0};
    const uz_state *starts[1] = {start};
    uz_status status = uz_solve_cases(&results, problem, settings, start ? starts : NULL, NULL, hooks, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s %s", uz_status_name(status), err.where, err.message);
    if (!results)
        exit(1);
    result = results[0];
    free(results);
    return result;
}

static bool same_vector(const double *x, const double *y, int64_t m)
{
    return m == 0 || memcmp(x, y, (size_t)m * sizeof *x) == 0;
}

static void check_same_state(const uz_state *x, const uz_state *y)
{
    CHECK(same_vector(x->r, y->r, x->m));
    CHECK(same_vector(x->rho, y->rho, x->m));
    CHECK(same_vector(x->Dr, y->Dr, x->m));
    CHECK(same_vector(x->Drho, y->Drho, x->m));
    CHECK(same_vector(x->best_r, y->best_r, x->m));
    CHECK(same_vector(x->anchor, y->anchor, x->m));
    CHECK(x->alpha == y->alpha && x->tau == y->tau && x->as_given == y->as_given);
    CHECK(x->best_bound == y->best_bound && x->best_relative == y->best_relative);
    CHECK(x->step_norm == y->step_norm || (isnan(x->step_norm) && isnan(y->step_norm)));
    CHECK_INT(x->iteration, y->iteration);
    CHECK_INT(x->restarts, y->restarts);
    CHECK_INT(x->next_check, y->next_check);
    CHECK_INT(x->best_iteration, y->best_iteration);
    CHECK_INT(x->phase, y->phase);
    CHECK_INT(x->made_by, y->made_by);
}

/* The history of `later` begins with the row after the last of `earlier`, and both together are that of `whole`. */
static void check_history(const uz_result *whole, const uz_result *earlier, const uz_result *later)
{
    CHECK_INT(earlier->history.count + later->history.count, whole->history.count);
    for (int64_t k = 0; k < later->history.count; k++) {
        const uz_history_row *a = &later->history.rows[k], *b = &whole->history.rows[earlier->history.count + k];
        CHECK_INT(a->iteration, b->iteration);
        CHECK_INT(a->contacts, b->contacts);
        CHECK_INT(a->restart, b->restart);
        CHECK(a->dual_objective == b->dual_objective);
        CHECK(a->error_bound == b->error_bound);
        CHECK(a->residual.total == b->residual.total);
        CHECK(a->step_norm == b->step_norm || (isnan(a->step_norm) && isnan(b->step_norm)));
    }
}

static void check_same_answer(const uz_result *x, const uz_result *y)
{
    CHECK_INT(x->summary.outcome, y->summary.outcome);
    CHECK_INT(x->summary.iterations, y->summary.iterations);
    CHECK_INT(x->summary.restarts, y->summary.restarts);
    CHECK(same_vector(x->r, y->r, x->m));
    CHECK(same_vector(x->g, y->g, x->m));
    CHECK(same_vector(x->u, y->u, x->mesh.dim ? x->n_nodes * x->mesh.dim : x->d));
    CHECK(x->summary.certificate.absolute_error == y->summary.certificate.absolute_error);
    check_same_state(x->state, y->state);
}

/* Stopped after k iterations, continued to the end. */
static void check_continued(const uz_problem *problem, const uz_settings *settings, int64_t k)
{
    uz_settings shorter = *settings;
    shorter.max_iterations = k;
    uz_result *whole = solve_from(problem, settings, NULL, NULL);
    uz_result *earlier = solve_from(problem, &shorter, NULL, NULL);
    uz_result *later = solve_from(problem, settings, earlier->state, NULL);
    check_same_answer(later, whole);
    check_history(whole, earlier, later);
    uz_result_free(whole);
    uz_result_free(earlier);
    uz_result_free(later);
}

TEST(gradient_runs_continue_bit_for_bit)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE};
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    static const int64_t stops[] = {0, 1, 2, 5, 16, 33, 100, 400}; /* some have ended by then */
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    for (int mo = 0; mo < 4; mo++)
        for (int op = 0; op < 2; op++)
            for (int k = 0; k < 8; k++) {
                uz_settings settings = uz_settings_default();
                settings.method = methods[mo];
                settings.op = ops[op];
                settings.relative_error = 1e-6;
                settings.max_iterations = 400;
                check_continued(&problem, &settings, stops[k]);
                settings.stopping = UZ_STOP_PAPER;
                settings.epsilon = 1e-4;
                check_continued(&problem, &settings, stops[k]);
            }
    uz_problem_clear(&problem);
}

/* Rows of many sizes: scaled inside, as they were outside. A step size too long, so that it is shortened on the way. */
TEST(scaled_rows_and_shortened_steps_continue_bit_for_bit)
{
    for (uint64_t seed = 0; seed < 40; seed++) {
        qp_random rng = {seed + 70};
        qp_kind kind = {.d = 12, .m = 6, .condition = 30, .badly_scaled = seed % 2 == 1, .dependent = seed % 3 == 0};
        uz_problem problem = problem_of(random_qp(&rng, &kind));
        uz_settings settings = uz_settings_default();
        settings.method = seed < 20 ? UZ_METHOD_ACCELERATED_RESTART : UZ_METHOD_CONJUGATE;
        settings.max_iterations = 300;
        settings.alpha = seed % 2 ? 0 : 100;
        check_continued(&problem, &settings, (int64_t)(seed % 7) * 3);
        uz_problem_clear(&problem);
    }
}

/* Many links: stopped every few iterations. */
TEST(a_chain_of_runs_is_one_run)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    uz_settings settings = uz_settings_default();
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    uz_result *whole = solve_from(&problem, &settings, NULL, NULL), *at = NULL;
    int64_t rows = 0;
    for (int64_t limit = 0; limit <= whole->summary.iterations + 8; limit += 9) {
        settings.max_iterations = limit;
        uz_result *next = solve_from(&problem, &settings, at ? at->state : NULL, NULL);
        rows += next->history.count;
        uz_result_free(at);
        at = next;
        if (at->summary.outcome == UZ_CONVERGED && at->summary.iterations == whole->summary.iterations)
            break;
    }
    check_same_answer(at, whole);
    CHECK_INT(rows, whole->history.count);
    uz_result_free(at);
    uz_result_free(whole);
    uz_problem_clear(&problem);
}

/* A looser target reached, then a sharper one. */
TEST(a_loose_answer_is_continued_to_a_sharp_one)
{
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    for (int op = 0; op < 2; op++) {
        uz_settings settings = uz_settings_default(), loose = settings;
        settings.method = loose.method = UZ_METHOD_ACCELERATED_RESTART;
        settings.op = loose.op = ops[op];
        loose.relative_error = 1e-2;
        uz_result *whole = solve_from(&problem, &settings, NULL, NULL);
        uz_result *earlier = solve_from(&problem, &loose, NULL, NULL);
        uz_result *later = solve_from(&problem, &settings, earlier->state, NULL);
        CHECK_INT(earlier->summary.outcome, UZ_CONVERGED);
        CHECK(earlier->summary.iterations < whole->summary.iterations);
        check_same_answer(later, whole);
        uz_result_free(whole);
        uz_result_free(earlier);
        uz_result_free(later);
    }
    uz_problem_clear(&problem);
}

typedef struct {
    int64_t asked, limit;
} patience;

static bool ask(void *ctx)
{
    patience *p = ctx;
    return ++p->asked > p->limit;
}

TEST(a_cancelled_run_is_continued)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    uz_settings settings = uz_settings_default();
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    patience p = {.limit = 40};
    uz_hooks hooks = {.ctx = &p, .cancelled = ask};
    uz_result *whole = solve_from(&problem, &settings, NULL, NULL);
    uz_result *earlier = solve_from(&problem, &settings, NULL, &hooks);
    CHECK_INT(earlier->summary.outcome, UZ_DISMISSED);
    CHECK(earlier->summary.iterations > 0 && earlier->summary.iterations < whole->summary.iterations);
    uz_result *later = solve_from(&problem, &settings, earlier->state, NULL);
    check_same_answer(later, whole);
    check_history(whole, earlier, later);
    uz_result_free(whole);
    uz_result_free(earlier);
    uz_result_free(later);
    uz_problem_clear(&problem);
}

/* The same contacts, the same level, and no more than a few steps in addition. */
static void check_guesses(const uz_problem *problem, const uz_settings *settings, int64_t k)
{
    uz_settings shorter = *settings;
    shorter.max_iterations = k;
    uz_result *whole = solve_from(problem, settings, NULL, NULL);
    uz_result *earlier = solve_from(problem, &shorter, NULL, NULL);
    uz_result *later = solve_from(problem, settings, earlier->state, NULL);
    CHECK_INT(later->summary.outcome, whole->summary.outcome);
    CHECK(later->summary.iterations >= earlier->summary.iterations);
    CHECK_MSG(later->summary.iterations <= whole->summary.iterations + 2, "%lld after %lld, %lld at once",
              (long long)later->summary.iterations, (long long)k, (long long)whole->summary.iterations);
    if (whole->summary.outcome == UZ_CONVERGED)
        for (int64_t i = 0; i < whole->m; i++)
            CHECK_INT(later->r[i] < 0, whole->r[i] < 0);
    uz_result_free(whole);
    uz_result_free(earlier);
    uz_result_free(later);
}

TEST(guessing_runs_continue)
{
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACTIVE_SET};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    for (int op = 0; op < 2; op++)
        for (int mo = 0; mo < 2; mo++)
            for (int64_t k = 0; k < 6; k++) {
                uz_settings settings = uz_settings_default();
                settings.method = methods[mo];
                settings.op = ops[op];
                check_guesses(&problem, &settings, k);
            }
    uz_problem_clear(&problem);
}

/* Dependent rows, where auto goes through its phases. */
TEST(auto_continues_in_its_phase)
{
    for (uint64_t seed = 0; seed < 20; seed++) {
        qp_random rng = {seed + 900};
        qp_kind kind = {.d = 9, .m = 12, .condition = 50, .dependent = true};
        uz_problem problem = problem_of(random_qp(&rng, &kind));
        uz_settings settings = uz_settings_default();
        uz_result *whole = solve_from(&problem, &settings, NULL, NULL);
        for (int64_t k = 0; k < whole->summary.iterations; k += 1 + whole->summary.iterations / 7) {
            settings.max_iterations = k;
            uz_result *earlier = solve_from(&problem, &settings, NULL, NULL);
            settings.max_iterations = 100000;
            uz_result *later = solve_from(&problem, &settings, earlier->state, NULL);
            CHECK_INT(later->summary.outcome, whole->summary.outcome);
            uz_result_free(earlier);
            uz_result_free(later);
        }
        uz_result_free(whole);
        uz_problem_clear(&problem);
    }
}

/* From nothing but the solution's reactions: certified before the first iteration. */
TEST(the_solution_itself_takes_no_iteration)
{
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_ACTIVE_SET,
                                        UZ_METHOD_CONJUGATE};
    static const double errors[] = {1e-4, 1e-8};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    for (int op = 0; op < 2; op++)
        for (int mo = 0; mo < 4; mo++)
            for (int e = 0; e < 2; e++) {
                uz_settings settings = uz_settings_default();
                settings.method = methods[mo];
                settings.op = ops[op];
                settings.relative_error = errors[e];
                uz_result *cold = solve_from(&problem, &settings, NULL, NULL);
                uz_state start = {.m = cold->m, .r = cold->r};
                uz_result *warm = solve_from(&problem, &settings, &start, NULL);
                CHECK_INT(warm->summary.outcome, cold->summary.outcome);
                CHECK_MSG(cold->summary.outcome != UZ_CONVERGED || warm->summary.iterations == 0,
                          "%s %s %g: %lld iterations", uz_method_name(methods[mo]),
                          uz_choice_name(UZ_CHOICE_OPERATOR, ops[op]), errors[e], (long long)warm->summary.iterations);
                CHECK_INT(warm->history.rows[0].iteration, 0);
                uz_result_free(cold);
                uz_result_free(warm);
            }
    uz_problem_clear(&problem);
}

/* Any reactions: cut at 0, and no worse an answer for it. */
TEST(any_reactions_may_be_a_start)
{
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_ACTIVE_SET,
                                        UZ_METHOD_CONJUGATE};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    qp_random rng = {77};
    double r[64];
    for (int trial = 0; trial < 30; trial++) {
        uz_settings settings = uz_settings_default();
        settings.method = methods[trial / 2 % 4];
        settings.op = trial % 2 ? UZ_OPERATOR_CONDENSED : UZ_OPERATOR_FACTORED;
        uz_result *cold = solve_from(&problem, &settings, NULL, NULL);
        for (int64_t i = 0; i < cold->m; i++)
            r[i] = pow(10, trial % 9 - 4) * random_signed(&rng);
        uz_state start = {.m = cold->m, .r = r};
        uz_result *warm = solve_from(&problem, &settings, &start, NULL);
        CHECK_INT(warm->summary.outcome, cold->summary.outcome);
        CHECK_INT(warm->summary.active, cold->summary.active);
        uz_result_free(cold);
        uz_result_free(warm);
    }
    uz_problem_clear(&problem);
}

static void check_refused(const uz_problem *problem, const uz_state *start, uz_status expected)
{
    uz_result **results = (uz_result **)&expected;
    uz_settings settings = uz_settings_default();
    uz_error err;
    CHECK_INT(uz_solve_cases(&results, problem, &settings, &start, NULL, NULL, &err), expected);
    CHECK(results == NULL);
    CHECK(strstr(err.where, "start") != NULL);
}

TEST(impossible_starts_are_refused)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    uz_settings settings = uz_settings_default();
    uz_result *good = solve_from(&problem, &settings, NULL, NULL);
    uz_state *s = good->state;
    s->m--;
    check_refused(&problem, s, UZ_ERR_SIZE);
    s->m++;
    double kept = s->r[1];
    s->r[1] = NAN;
    check_refused(&problem, s, UZ_ERR_NOT_FINITE);
    s->r[1] = -INFINITY;
    check_refused(&problem, s, UZ_ERR_NOT_FINITE);
    s->r[1] = kept;
    double *vector_of_state = s->anchor;
    s->anchor = NULL;
    check_refused(&problem, s, UZ_ERR_ARGUMENT);
    s->anchor = vector_of_state;
    s->tau = 0;
    check_refused(&problem, s, UZ_ERR_ARGUMENT);
    s->tau = 1;
    s->iteration = -1;
    check_refused(&problem, s, UZ_ERR_ARGUMENT);
    uz_result_free(good);
    uz_problem_clear(&problem);
}

/* The state of another load, or of another body: its reactions are a start, what it says else is not believed. */
TEST(a_state_of_another_problem_is_a_warm_start)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    uz_problem other = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    for (int trial = 0; trial < 4; trial++) {
        uz_settings settings = uz_settings_default(), first = settings;
        settings.method = first.method = trial % 2 ? UZ_METHOD_ACCELERATED_RESTART : UZ_METHOD_AUTO;
        first.max_iterations = trial < 2 ? 3 : 100000;
        other.scene.loads[0].v[1] = trial % 2 ? -0.07 : -0.05;
        other.scene.materials[0].young = trial % 2 ? 200e3 : 70e3;
        uz_result *from = solve_from(&other, &first, NULL, NULL), *cold = solve_from(&problem, &settings, NULL, NULL);
        uz_result *warm = solve_from(&problem, &settings, from->state, NULL);
        CHECK_INT(warm->summary.outcome, UZ_CONVERGED);
        CHECK_INT(warm->summary.active, cold->summary.active);
        CHECK(warm->history.count > 0 && warm->history.rows[0].iteration == 0);
        CHECK_INT(cold->summary.origin, UZ_FROM_ZERO);
        CHECK_INT(warm->summary.origin, UZ_FROM_REACTIONS);
        uz_result_free(from);
        uz_result_free(cold);
        uz_result_free(warm);
    }
    uz_problem_clear(&problem);
    uz_problem_clear(&other);
}

TEST(a_neighbouring_load_is_a_good_start)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    uz_problem other = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_CONJUGATE};
    for (int mo = 0; mo < 3; mo++) {
        int64_t no_worse = 0;
        for (int k = 1; k <= 9; k++) {
            uz_settings settings = uz_settings_default();
            settings.method = methods[mo];
            other.scene.loads[1].v[0] = 0.5 * (1 + 0.01 * k);
            uz_result *from = solve_from(&other, &settings, NULL, NULL);
            uz_result *cold = solve_from(&problem, &settings, NULL, NULL);
            uz_state start = {.m = from->m, .r = from->r};
            uz_result *warm = solve_from(&problem, &settings, &start, NULL);
            printf("# %s, %d %% away: %lld iterations warm, %lld cold\n", uz_method_name(methods[mo]), k,
                   (long long)warm->summary.iterations, (long long)cold->summary.iterations);
            no_worse += warm->summary.iterations <= cold->summary.iterations;
            uz_result_free(from);
            uz_result_free(cold);
            uz_result_free(warm);
        }
        CHECK_MSG(no_worse >= 5, "%s: %lld of 9", uz_method_name(methods[mo]), (long long)no_worse);
    }
    uz_problem_clear(&problem);
    uz_problem_clear(&other);
}
