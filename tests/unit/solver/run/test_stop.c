/* not under ThreadSanitizer: one thread, but for one that ends with a lock
 * Solves that are told to stop at any of their questions, on every route: what comes back is the best answer so far,
 * with a bound that holds. */
#include "body_fixture.h"
#include "harness.h"
#include "membrane.h"
#include "obstacle.h"
#include "sanitized.h"
#include "core/lock.h"
#include "uzawa.h"

#include <stdio.h>

__attribute__((constructor)) static void settle_process(void)
{
    uz_process_init(2);
    uz_thread_init();
}

typedef struct {
    const char *name;
    membrane kind; /* n 0: the obstacle problem, bounds from both sides on 24 x 24 dofs */
    uz_operator op;
    uz_method method;
    int64_t cases;
} route;

static const route routes[] = {
    {"rows of one entry", {30, 400, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"rows of two entries", {30, 400, 1, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"a row again", {30, 400, 0, 1, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"iterations", {30, 400, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_ACCELERATED_RESTART, 0},
    {"exchange", {20, 150, 1, 1, 0}, UZ_OPERATOR_FACTORED, UZ_METHOD_ACTIVE_SET, 0},
    {"sparse solves", {20, 150, 1, 0, 0}, UZ_OPERATOR_FACTORED, UZ_METHOD_AUTO, 0},
    {"bounds", {0}, UZ_OPERATOR_FACTORED, UZ_METHOD_AUTO, 0},
    {"matrix free", {60, 1500, 0, 0, 0}, UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 0},
    {"matrix free iterations", {20, 150, 1, 0, 0}, UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 0},
    {"load cases", {20, 150, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 11},
    {"held by the obstacle", {16, 100, 0, 0, 1}, UZ_OPERATOR_AUTO, UZ_METHOD_AUTO, 0},
};
enum { ROUTES = sizeof routes / sizeof routes[0], SIDE = 24, STOPS = 40 };

typedef struct {
    bool began;
    int64_t asked, stop_at; /* since it began; -1: never */
} pause;

static void note_begin(void *ctx, int64_t load_case)
{
    (void)load_case;
    ((pause *)ctx)->began = true;
}

static bool ask(void *ctx)
{
    pause *p = ctx;
    if (p->began)
        p->asked++;
    return p->stop_at >= 0 && p->asked > p->stop_at;
}

static int64_t count_results(const uz_problem *problem)
{
    return problem->n_cases > 0 ? problem->n_cases : 1;
}

static void make_problem(uz_problem *problem, const route *r)
{
    uz_error err = {0};
    *problem = (uz_problem){.kind = UZ_PROBLEM_MATRICES};
    uz_status status =
        r->kind.n > 0 ? membrane_qp(&problem->qp, &r->kind, &err) : obstacle_qp(&problem->qp, SIDE, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", r->name, err.message);
    problem->cases = r->cases > 0 ? calloc((size_t)r->cases, sizeof *problem->cases) : NULL;
    for (int64_t i = 0; problem->cases && i < r->cases; i++) {
        snprintf(problem->cases[i].name, sizeof problem->cases[i].name, "%lld", (long long)i);
        problem->cases[i].p = calloc((size_t)problem->qp.K.cols, sizeof(double));
        membrane_load(problem->cases[i].p, r->kind.n, i);
        problem->n_cases = i + 1;
    }
}

static uz_settings settings_of(const route *r)
{
    uz_settings settings = uz_settings_default();
    settings.method = r->method;
    settings.op = r->op;
    settings.semidefinite = r->kind.loose;
    return settings;
}

/* ||u - v||_K */
static double distance(const uz_csc *K, const double *u, const double *v)
{
    double square = 0.0, *e = calloc((size_t)K->cols, sizeof *e), *Ke = calloc((size_t)K->cols, sizeof *Ke);
    for (int64_t j = 0; j < K->cols; j++)
        e[j] = u[j] - v[j];
    uz_csc_symv(Ke, K, 1.0, e);
    for (int64_t j = 0; j < K->cols; j++)
        square += e[j] * Ke[j];
    free(e);
    free(Ke);
    return sqrt(fmax(0.0, square));
}

/* Certified, and the bound holds: `exact` is an answer with a bound of its own. */
static void check_bound(const char *name, int64_t at, const uz_csc *K, const uz_result *got, const uz_result *exact)
{
    const uz_certificate *c = &got->summary.certificate;
    CHECK_MSG(!isnan(c->relative_error) && !isnan(c->absolute_error), "%s, stopped at %lld: no bound", name,
              (long long)at);
    for (int64_t j = 0; j < got->d; j++)
        if (!isfinite(got->u[j])) {
            CHECK_MSG(false, "%s, stopped at %lld: u(%lld) is not finite", name, (long long)at, (long long)j);
            return;
        }
    double error = distance(K, got->u, exact->u),
           allowed = c->absolute_error + exact->summary.certificate.absolute_error;
    CHECK_MSG(error <= allowed, "%s, stopped at %lld: error %g, bound %g", name, (long long)at, error, allowed);
}

static void stop_at(const route *r, const uz_problem *problem, uz_result *const *exact, int64_t at)
{
    uz_settings settings = settings_of(r);
    uz_result **results = NULL;
    uz_error err = {0};
    pause p = {.stop_at = at};
    uz_hooks hooks = {.ctx = &p, .cancelled = ask, .begins = note_begin};
    uz_status status = uz_solve_cases(&results, problem, &settings, NULL, NULL, &hooks, &err);
    bool refused = r->kind.loose && status == UZ_ERR_CANCELLED; /* before a first round there is no answer */
    CHECK_MSG(status == UZ_OK || refused, "%s, stopped at %lld: %s %s", r->name, (long long)at, uz_status_name(status),
              err.message);
    for (int64_t i = 0; status == UZ_OK && i < count_results(problem); i++) {
        uz_outcome outcome = results[i]->summary.outcome;
        CHECK_MSG(outcome == UZ_DISMISSED || outcome == UZ_CONVERGED, "%s, stopped at %lld: %s", r->name, (long long)at,
                  uz_choice_name(UZ_CHOICE_OUTCOME, outcome));
        check_bound(r->name, at, &problem->qp.K, results[i], exact[i]);
    }
    uz_results_free(results, count_results(problem));
}

static void stop_everywhere(const route *r)
{
    uz_problem problem;
    uz_settings settings = settings_of(r);
    uz_result **exact = NULL;
    uz_error err = {0};
    pause whole = {.stop_at = -1};
    uz_hooks hooks = {.ctx = &whole, .cancelled = ask, .begins = note_begin};
    make_problem(&problem, r);
    uz_status status = uz_solve_cases(&exact, &problem, &settings, NULL, NULL, &hooks, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", r->name, err.message);
    for (int64_t i = 0; status == UZ_OK && i < count_results(&problem); i++)
        CHECK_MSG(exact[i]->summary.outcome == UZ_CONVERGED, "%s: %s", r->name,
                  uz_choice_name(UZ_CHOICE_OUTCOME, exact[i]->summary.outcome));
    printf("# %s: %lld questions\n", r->name, (long long)whole.asked);
    int64_t step = whole.asked / (SANITIZED ? STOPS / 5 : STOPS) + 1;
    for (int64_t at = 0; status == UZ_OK && at < whole.asked; at += step)
        stop_at(r, &problem, exact, at);
    CHECK(whole.asked > 3);
    uz_results_free(exact, count_results(&problem));
    uz_problem_clear(&problem);
}

TEST(a_solve_stops_at_any_question_with_a_certified_answer)
{
    for (int k = 0; k < ROUTES; k++)
        stop_everywhere(&routes[k]);
}

/* A mesh of few elements is looked at after its answer is there: whoever ends that ends the solve. */
TEST(a_look_at_few_elements_can_be_stopped)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){2, 1, 0});
    s.materials[0].young = 1;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, -0.01, 0);
    for (int large = 0; large < 2; large++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
        const uz_settings settings = uz_settings_default();
        problem.scene.kinematics = large ? UZ_KINEMATICS_FINITE : UZ_KINEMATICS_FIXED;
        problem.scene.materials[0].law = large ? UZ_ELASTIC_NEO_HOOKE : UZ_ELASTIC_LINEAR;
        pause p = {.began = true, .stop_at = -1};
        int64_t all = 1;
        for (int64_t k = 0; k <= all; k++) { /* the first one is not stopped */
            const uz_hooks hooks = {.ctx = &p, .cancelled = ask};
            uz_result *result = NULL;
            uz_error err = {0};
            p.asked = 0;
            const uz_status status = uz_solve(&result, &problem, &settings, NULL, &hooks, &err);
            const bool stopped = p.stop_at >= 0 && p.asked > p.stop_at;
            CHECK_MSG(stopped ? status == UZ_ERR_CANCELLED || (result && result->summary.outcome == UZ_DISMISSED)
                              : status == UZ_OK && result->summary.outcome == UZ_CONVERGED,
                      "large %d: stopped at question %lld of %lld: %s, %s", large, (long long)p.stop_at, (long long)all,
                      err.message, result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "nothing");
            all = k == 0 ? p.asked : all;
            p.stop_at = k;
            uz_result_free(result);
        }
        CHECK(all > 4);
    }
    uz_scene_clear(&s);
}

/* Of two cases the second one bears a part of its load: that was so before the look, and stays what is told of it. */
TEST(a_look_that_is_stopped_leaves_cases_that_had_no_answer)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){2, 1, 0});
    s.kinematics = UZ_KINEMATICS_FINITE;
    s.materials[0].young = 1;
    s.materials[0].law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", -0.01, 0, 0);
    uz_load_case cases[] = {{.name = "little"}, {.name = "much", .part = 200, .has_part = true}};
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .cases = cases, .n_cases = 2};
    const uz_settings settings = uz_settings_default();
    pause p = {.began = true, .stop_at = -1};
    const uz_hooks hooks = {.ctx = &p, .cancelled = ask};
    uz_outcome of_much = UZ_CONVERGED;
    for (int stops = 0; stops < 2; stops++) {
        uz_result **r = NULL;
        uz_error err = {0};
        p.asked = 0;
        const uz_status status = uz_solve_cases(&r, &problem, &settings, NULL, NULL, &hooks, &err);
        CHECK_MSG(status == UZ_OK, "%s", err.message);
        if (status != UZ_OK)
            break;
        CHECK_INT(r[0]->summary.outcome, stops ? UZ_DISMISSED : UZ_CONVERGED);
        CHECK_MSG(stops ? r[1]->summary.outcome == of_much : r[1]->summary.outcome != UZ_CONVERGED, "%s",
                  r[1]->summary.message);
        of_much = r[1]->summary.outcome;
        p.stop_at = p.asked - 1; /* the last question is one of the look */
        uz_results_free(r, 2);
    }
    uz_scene_clear(&s);
}

/* The time of the whole solve is over when the iterations begin. */
TEST(without_time_there_is_a_certified_answer)
{
    for (int k = 0; k < ROUTES; k++) {
        uz_problem problem;
        uz_settings settings = settings_of(&routes[k]);
        uz_result **results = NULL;
        uz_error err = {0};
        make_problem(&problem, &routes[k]);
        settings.time_limit_s = 0.0;
        uz_status status = uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err);
        CHECK_MSG(status == UZ_OK, "%s: %s", routes[k].name, err.message);
        for (int64_t i = 0; status == UZ_OK && i < count_results(&problem); i++) {
            CHECK_MSG(results[i]->summary.outcome == UZ_TIME_LIMIT, "%s: %s", routes[k].name,
                      uz_choice_name(UZ_CHOICE_OUTCOME, results[i]->summary.outcome));
            CHECK(!isnan(results[i]->summary.certificate.relative_error));
        }
        uz_results_free(results, count_results(&problem));
        uz_problem_clear(&problem);
    }
}

/* What a stopped run leaves in the cache is right: the next run on the body finds the lambda_max of a run that had all
 * the time. */
TEST(a_stopped_run_leaves_no_wrong_eigenvalue_behind)
{
    route r = {"iterations", {12, 60, 1, 0, 0}, UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_ACCELERATED_RESTART, 0};
    uz_problem problem;
    uz_settings settings = settings_of(&r);
    uz_result *whole = NULL;
    uz_error err = {0};
    pause count = {.stop_at = -1};
    uz_hooks counting = {.ctx = &count, .cancelled = ask, .begins = note_begin};
    make_problem(&problem, &r);
    settings.max_iterations = 1;
    CHECK(uz_solve(&whole, &problem, &settings, NULL, &counting, &err) == UZ_OK);
    printf("# %lld questions to the first iteration\n", (long long)count.asked);
    const int64_t each = SANITIZED ? count.asked / 20 + 1 : 1;
    for (int64_t at = 0; whole && at < count.asked; at += each) {
        uz_cache *cache = uz_cache_new((size_t)1 << 28);
        pause p = {.stop_at = at};
        uz_hooks hooks = {.ctx = &p, .cancelled = ask, .begins = note_begin};
        uz_result *stopped = NULL, *next = NULL;
        CHECK(uz_solve(&stopped, &problem, &settings, cache, &hooks, &err) == UZ_OK);
        CHECK(uz_solve(&next, &problem, &settings, cache, NULL, &err) == UZ_OK);
        if (next)
            CHECK_MSG(fabs(next->summary.lambda_max - whole->summary.lambda_max) <= 1e-3 * whole->summary.lambda_max,
                      "stopped at %lld: lambda_max %g, is %g", (long long)at, next->summary.lambda_max,
                      whole->summary.lambda_max);
        uz_result_free(stopped);
        uz_result_free(next);
        uz_cache_free(cache);
    }
    uz_result_free(whole);
    uz_problem_clear(&problem);
}

static void *hold(void *mutex)
{
    pthread_mutex_lock(mutex);
    return NULL;
}

/* Another thread works under the lock and does not end: who waits is told to stop all the same. */
TEST(who_waits_for_anothers_work_can_be_stopped)
{
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_t other;
    pause p = {.began = true, .stop_at = 3};
    uz_hooks hooks = {.ctx = &p, .cancelled = ask};
    uz_stop stop = {&hooks, INFINITY}, late = {NULL, 0.0};
    CHECK(uz_lock_while(&mutex, &stop) && pthread_mutex_unlock(&mutex) == 0);
    CHECK_INT(p.asked, 0);
    CHECK(pthread_create(&other, NULL, hold, &mutex) == 0 && pthread_join(other, NULL) == 0);
    CHECK(!uz_lock_while(&mutex, &stop));
    CHECK_INT(p.asked, 4);
    CHECK(!uz_lock_while(&mutex, &late));
}

/* Whatever question it was stopped at, a run goes on from its state and converges. */
static void continue_from(const route *r, int64_t at)
{
    uz_problem problem;
    uz_settings settings = settings_of(r);
    uz_result **stopped = NULL, **next = NULL;
    uz_error err = {0};
    pause p = {.stop_at = at};
    uz_hooks hooks = {.ctx = &p, .cancelled = ask, .begins = note_begin};
    make_problem(&problem, r);
    for (int64_t e = 0; e < problem.qp.K.ptr[problem.qp.K.cols]; e++) /* a step of 1 is not by chance about right */
        problem.qp.K.val[e] *= 1e8;
    for (int64_t j = 0; j < problem.qp.K.cols; j++)
        problem.qp.p[j] *= 1e8;
    uz_status status = uz_solve_cases(&stopped, &problem, &settings, NULL, NULL, &hooks, &err);
    CHECK_MSG(status == UZ_OK && stopped[0]->state, "%s: %s", r->name, err.message);
    if (stopped && stopped[0]->state) {
        const uz_state *start = stopped[0]->state;
        settings.max_iterations = 2000;
        status = uz_solve_cases(&next, &problem, &settings, &start, NULL, NULL, &err);
        CHECK_MSG(status == UZ_OK && next[0]->summary.outcome == UZ_CONVERGED, "%s, stopped at %lld, goes on to: %s",
                  r->name, (long long)at,
                  next ? uz_choice_name(UZ_CHOICE_OUTCOME, next[0]->summary.outcome) : err.message);
    }
    uz_results_free(stopped, 1);
    uz_results_free(next, 1);
    uz_problem_clear(&problem);
}

TEST(a_run_goes_on_from_where_it_was_stopped)
{
    static const route iterated[] = {
        {"dense", {12, 60, 1, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_ACCELERATED_RESTART, 0},
        {"sparse", {12, 60, 1, 0, 0}, UZ_OPERATOR_FACTORED, UZ_METHOD_ACCELERATED_RESTART, 0},
        {"matrix free", {12, 60, 1, 0, 0}, UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 0},
    };
    for (size_t k = 0; k < sizeof iterated / sizeof iterated[0]; k++)
        for (int64_t at = 0; at < 60; at++)
            continue_from(&iterated[k], at);
}
