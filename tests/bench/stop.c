/* stop.c: how soon a solve that is to stop does: the longest time between two questions whether to go on, once the
 * iterations have begun, and the time from the answer "stop" to the return, which gives the best answer so far and its
 * certificate. */
#include "membrane.h"
#include "obstacle.h"
#include "bench/bench.h"
#include "core/clock.h"

#include <time.h>

enum { RUNS = 5, OBSTACLE_SIDE = 98 };

typedef struct {
    bool began;
    double last, longest;        /* uz_seconds() of the last question; between two */
    double last_work, most_work; /* the same in processor_seconds() */
    int64_t asked, stop_at;      /* questions since it began; the one that is answered "stop", -1: none */
    double stopped, returned;    /* uz_seconds() of that answer, and of the return */
} watch;

/* Seconds of processor that this thread has had: what other programs take is not in it. */
static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void note_begin(void *ctx, int64_t load_case)
{
    watch *w = ctx;
    (void)load_case;
    if (!w->began) {
        w->last = uz_seconds();
        w->last_work = processor_seconds();
    }
    w->began = true;
}

static bool note_question(void *ctx)
{
    watch *w = ctx;
    double now = uz_seconds(), work = processor_seconds();
    if (!w->began)
        return false;
    if (work - w->last_work > w->most_work)
        w->most_work = work - w->last_work;
    if (now - w->last > w->longest)
        w->longest = now - w->last;
    bool stop = w->asked++ == w->stop_at || w->stopped > 0.0;
    if (stop && w->stopped == 0.0)
        w->stopped = now;
    w->last_work = processor_seconds();
    w->last = uz_seconds(); /* what asking takes is not the solve's */
    return stop;
}

/* false: the call failed. */
static bool solve(watch *w, const uz_problem *problem, const uz_settings *settings)
{
    uz_hooks hooks = {.ctx = w, .cancelled = note_question, .begins = note_begin};
    uz_result **results = NULL;
    uz_error err;
    uz_status status = uz_solve_cases(&results, problem, settings, NULL, NULL, &hooks, &err);
    w->returned = uz_seconds();
    if (status != UZ_OK)
        printf("%s: %s\n", uz_status_name(status), err.message);
    uz_results_free(results, problem->n_cases > 0 ? problem->n_cases : 1);
    return status == UZ_OK || (status == UZ_ERR_CANCELLED && w->stopped > 0.0);
}

typedef struct {
    const char *name;
    membrane kind; /* n 0: the obstacle problem with bounds from both sides on all of 98 x 98 dofs */
    uz_operator op;
    uz_method method;
    int64_t cases; /* 0: the problem's own load */
} row;

static const row rows[] = {
    {"stop_condensed_m3000", {80, 3000, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"stop_condensed_pairs_m3000", {80, 3000, 1, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"stop_condensed_repeated_m3000", {80, 2999, 0, 1, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 0},
    {"stop_condensed_restart_m3000", {80, 3000, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_ACCELERATED_RESTART, 0},
    {"stop_factored_m1500", {80, 1500, 1, 0, 0}, UZ_OPERATOR_FACTORED, UZ_METHOD_AUTO, 0},
    {"stop_bounds_m19208", {0}, UZ_OPERATOR_FACTORED, UZ_METHOD_AUTO, 0},
    {"stop_matrix_free_m3000", {80, 3000, 0, 0, 0}, UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 0},
    {"stop_20_cases_m1000", {80, 1000, 0, 0, 0}, UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 20},
    {"stop_held_by_obstacle_m600", {40, 600, 0, 0, 1}, UZ_OPERATOR_AUTO, UZ_METHOD_AUTO, 0},
};

const char *bench_stop_name(int which)
{
    return which < (int)(sizeof rows / sizeof rows[0]) ? rows[which].name : NULL;
}

/* The problem's cases, `count` of them, each with a load of its own. */
static void add_cases(uz_problem *problem, int64_t n, int64_t count)
{
    problem->cases = calloc((size_t)count, sizeof *problem->cases);
    for (int64_t i = 0; problem->cases && i < count; i++) {
        uz_load_case *c = &problem->cases[i];
        snprintf(c->name, sizeof c->name, "%lld", (long long)i);
        c->p = calloc((size_t)(n * n), sizeof(double));
        if (c->p)
            membrane_load(c->p, n, i);
        problem->n_cases = i + 1;
    }
}

static bool make_problem(uz_problem *problem, const row *r)
{
    uz_error err;
    *problem = (uz_problem){.kind = UZ_PROBLEM_MATRICES};
    uz_status status =
        r->kind.n > 0 ? membrane_qp(&problem->qp, &r->kind, &err) : obstacle_qp(&problem->qp, OBSTACLE_SIDE, &err);
    if (status == UZ_OK && r->cases > 0)
        add_cases(problem, r->kind.n, r->cases);
    return status == UZ_OK;
}

/* One solve to the end, and one that is told to stop after a share of the questions of the first. */
static bool run_pair(double *longest, double *work, double *to_return, const row *r, double share)
{
    uz_problem problem;
    uz_settings settings = uz_settings_default();
    watch whole = {.stop_at = -1}, cut = {0};
    settings.method = r->method;
    settings.op = r->op;
    settings.semidefinite = r->kind.loose;
    bool ok = make_problem(&problem, r) && solve(&whole, &problem, &settings);
    cut.stop_at = (int64_t)((double)whole.asked * share);
    ok = ok && solve(&cut, &problem, &settings);
    *longest = 1e3 * whole.longest;
    *work = 1e3 * whole.most_work;
    *to_return = cut.stopped > 0.0 ? 1e3 * (cut.returned - cut.stopped) : NAN;
    uz_problem_clear(&problem);
    return ok && cut.stopped > 0.0;
}

bool bench_stop(bench_value *between, bench_value *work, bench_value *to_return, int which)
{
    double longest[RUNS], worked[RUNS], returned[RUNS];
    bool ok = true;
    for (int k = 0; ok && k < RUNS; k++)
        ok = run_pair(&longest[k], &worked[k], &returned[k], &rows[which], (k + 0.5) / RUNS);
    if (ok) {
        *between = bench_summarise(longest, RUNS);
        *work = bench_summarise(worked, RUNS);
        *to_return = bench_summarise(returned, RUNS);
    }
    return ok;
}
