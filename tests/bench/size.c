/* size.c: what a solve costs as the paper's body is divided ever finer: seconds of CHOLMOD's linear solve with the
 * better of AMD and METIS, of a cold certified solve from the assembled matrices and of one with the factor cached. */
#include "bench/bench.h"
#include "core/clock.h"

#include <stdlib.h>

enum { RUNS = 3, SIZES = 12, COLUMNS = 3 };
static const int64_t CELLS[SIZES] = {30, 42, 63, 90, 132, 189, 273, 396, 573, 828, 1197, 1731}; /* about x 1.45 */
static const char *const COLUMN[COLUMNS] = {"linear", "cold", "cached"};

typedef struct {
    int64_t d, m, iterations;
    double seconds[COLUMNS];
    size_t factor_bytes;
    bench_ordering ordering; /* of the linear solve */
} size_row;

/* A run of less than this is repeated, and counts as their mean. */
#define LEAST_S 0.05

typedef struct {
    const uz_problem *problem;
    uz_cache *cache;
    size_row *row;
} solve_task;

static void solve_once(void *ctx)
{
    const solve_task *task = ctx;
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = 1e-8;
    settings.op = UZ_OPERATOR_CONDENSED; /* by its cells the scene would have no factor */
    if (uz_solve(&result, task->problem, &settings, task->cache, NULL, &err) != UZ_OK ||
        result->summary.outcome != UZ_CONVERGED) {
        printf("a bench problem did not converge: %s\n", result ? result->summary.message : err.message);
        exit(1);
    }
    task->row->d = result->d;
    task->row->m = result->m;
    task->row->iterations = result->summary.iterations;
    task->row->factor_bytes = result->summary.factor_bytes;
    uz_result_free(result);
}

typedef struct {
    const uz_qp *qp;
    bench_ordering ordering;
} linear_task;

static void solve_linear(void *ctx)
{
    const linear_task *task = ctx;
    bench_cholmod(&task->qp->K, task->qp->p, task->ordering);
}

static double mean_seconds(void (*run)(void *), void *ctx)
{
    double start = uz_seconds(), passed = 0.0;
    int count = 0;
    for (; passed < LEAST_S; count++) {
        run(ctx);
        passed = uz_seconds() - start;
    }
    return passed / count;
}

/* The better of both, as timed once each. */
static bench_ordering better_ordering(const uz_qp *qp)
{
    linear_task amd = {qp, BENCH_AMD}, metis = {qp, BENCH_METIS};
    return mean_seconds(solve_linear, &amd) <= mean_seconds(solve_linear, &metis) ? BENCH_AMD : BENCH_METIS;
}

static void measure(size_row *row, int64_t cells)
{
    uz_problem scene = {.kind = UZ_PROBLEM_SCENE}, matrices = {.kind = UZ_PROBLEM_MATRICES};
    uz_error err;
    double samples[COLUMNS][RUNS];
    scene.scene = bench_paper_scene(cells);
    if (uz_scene_to_qp(&matrices.qp, NULL, &scene.scene, &err) != UZ_OK) {
        printf("%s\n", err.message);
        exit(1);
    }
    solve_task cold = {&matrices, NULL, row};
    linear_task linear = {&matrices.qp, better_ordering(&matrices.qp)};
    row->ordering = linear.ordering;
    for (int k = 0; k < RUNS; k++) {
        samples[0][k] = mean_seconds(solve_linear, &linear);
        samples[1][k] = mean_seconds(solve_once, &cold);
    }
    uz_problem_clear(&matrices); /* before the cache takes a factor, too */
    solve_task cached = {&scene, uz_cache_new((size_t)16 << 30), row};
    for (int k = 0; k < 2; k++) /* the second one leaves what only a body that is used again is worth */
        solve_once(&cached);
    for (int k = 0; k < RUNS; k++)
        samples[2][k] = mean_seconds(solve_once, &cached);
    for (int c = 0; c < COLUMNS; c++)
        row->seconds[c] = bench_summarise(samples[c], RUNS).median;
    uz_cache_free(cached.cache);
    uz_problem_clear(&scene);
}

/* The slopes are fitted to what is written, where a part of the sizes may be from another run (tests/figures). */
static void print_size(FILE *json, const size_row *row, bool first)
{
    printf("%8lld %6lld %11.5f %11.5f %11.5f %7.2f %7.2f %6lld %9.1f %6s\n", (long long)row->d, (long long)row->m,
           row->seconds[0], row->seconds[1], row->seconds[2], row->seconds[1] / row->seconds[0],
           row->seconds[2] / row->seconds[0], (long long)row->iterations, 1e-6 * (double)row->factor_bytes,
           row->ordering == BENCH_AMD ? "amd" : "metis");
    fflush(stdout);
    fprintf(json, "%s  {\"d\": %lld, \"m\": %lld, \"iterations\": %lld, \"factor_bytes\": %zu", first ? "" : ",\n",
            (long long)row->d, (long long)row->m, (long long)row->iterations, row->factor_bytes);
    for (int c = 0; c < COLUMNS; c++)
        fprintf(json, ", \"%s_s\": %.6g", COLUMN[c], row->seconds[c]);
    fprintf(json, "}");
}

static bool chosen(int64_t cells, char **wanted, int count)
{
    bool found = count == 0;
    for (int k = 0; k < count; k++)
        found = found || atoll(wanted[k]) == cells;
    return found;
}

void bench_sizes(FILE *json, char **wanted, int count)
{
    int written = 0;
    printf("%8s %6s %11s %11s %11s %7s %7s %6s %9s %6s\n", "d", "m", "linear s", "cold s", "cached s", "cold/",
           "cached/", "steps", "factor MB", "linear");
    fprintf(json, "\"sizes\": [\n");
    for (int i = 0; i < SIZES; i++) {
        size_row row = {0};
        if (!chosen(CELLS[i], wanted, count))
            continue;
        measure(&row, CELLS[i]);
        print_size(json, &row, written++ == 0);
    }
    fprintf(json, "\n]");
}
