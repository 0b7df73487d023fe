/* load_cases.c: many loads on one body, in units of one linear solve: the paper's body, pulled and pressed differently
 * by each case, with the factor in the cache on both sides. */
#include "bench.h"
#include "core/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CASES = 100, RUNS = 5 };

/* The contact grows and shrinks with the ratio of pull and pressure. */
static bool add_cases(uz_problem *problem)
{
    problem->cases = calloc(CASES, sizeof *problem->cases);
    for (int i = 0; problem->cases && i < CASES; i++) {
        uz_load_case *c = &problem->cases[i];
        c->loads = malloc(2 * sizeof *c->loads);
        if (!c->loads)
            return false;
        problem->n_cases = i + 1;
        c->n_loads = 2;
        memcpy(c->loads, problem->scene.loads, 2 * sizeof *c->loads);
        snprintf(c->name, sizeof c->name, "%d", i);
        c->loads[0].v[1] *= 1.0 + 0.5 * sin(0.37 * i);
        c->loads[1].v[0] *= 1.0 + 0.5 * cos(0.11 * i);
    }
    return problem->cases != NULL;
}

/* Seconds of all cases; 0 where one did not converge. */
static double solve_all(const uz_problem *problem, uz_cache *cache)
{
    uz_settings settings = uz_settings_default();
    uz_result **results = NULL;
    double start = uz_seconds();
    uz_status status = uz_solve_cases(&results, problem, &settings, NULL, cache, NULL, NULL);
    double seconds = uz_seconds() - start;
    for (int i = 0; status == UZ_OK && i < CASES; i++)
        if (results[i]->summary.outcome != UZ_CONVERGED)
            seconds = 0.0;
    uz_results_free(results, CASES);
    return status == UZ_OK ? seconds : 0.0;
}

bool bench_load_cases(bench_value *ratio, int64_t nx)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = bench_paper_scene(nx)};
    uz_cache *cache = uz_cache_new((size_t)4 << 30);
    uz_mesh_info info = {0};
    uz_qp qp = {0};
    double samples[RUNS], warm;
    bool ok = cache && uz_scene_to_qp(&qp, &info, &problem.scene, NULL) == UZ_OK && add_cases(&problem);
    ok = ok && (warm = solve_all(&problem, cache)) > 0.0;
    for (int k = 0; ok && k < RUNS; k++) {
        double linear = bench_cholmod(&qp.K, qp.p, BENCH_AMD).solve, ours = solve_all(&problem, cache);
        samples[k] = ours / linear;
        ok = ours > 0.0;
    }
    if (ok)
        *ratio = bench_summarise(samples, RUNS);
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_problem_clear(&problem);
    uz_cache_free(cache);
    return ok;
}
