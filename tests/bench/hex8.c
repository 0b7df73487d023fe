/* hex8.c: three dimensions: a cold contact solve on a cube of bricks against CHOLMOD's solve of the same K. */
#include "hex8.h"
#include "bench/bench.h"
#include "core/clock.h"

enum { RUNS = 5 };

static double seconds_of_solve(const uz_problem *problem, uz_operator op, double relative_error, uz_cache *cache)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err;
    settings.op = op;
    settings.relative_error = relative_error;
    double start = uz_seconds();
    uz_status status = uz_solve(&result, problem, &settings, cache, NULL, &err);
    double seconds = uz_seconds() - start;
    bool ok = status == UZ_OK && result->summary.outcome == UZ_CONVERGED;
    uz_result_free(result);
    return ok ? seconds : NAN;
}

/* The linear solve is given METIS, with which it takes a quarter of the time that it takes with AMD. */
bool bench_hex8(bench_value *ratio, int64_t n, bool leaning)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_error err;
    double samples[RUNS];
    bool ok = hex8_qp(&problem.qp, n, &err) == UZ_OK && (!leaning || hex8_lean(&problem.qp, &err) == UZ_OK);
    for (int k = 0; ok && k < RUNS; k++) {
        bench_linear linear = bench_cholmod(&problem.qp.K, problem.qp.p, BENCH_METIS);
        samples[k] = seconds_of_solve(&problem, UZ_OPERATOR_AUTO, 1e-8, NULL) /
                     (linear.analyze + linear.factorize + linear.solve);
        ok = !isnan(samples[k]);
    }
    if (ok)
        *ratio = bench_summarise(samples, RUNS);
    uz_qp_clear(&problem.qp);
    return ok;
}

/* A cube clamped on the left, pulled, and pressed on a plane under it. The lists are the caller's. */
static uz_scene cube_scene(int64_t n, uz_material *material, uz_support *support, uz_load loads[2], uz_contact *contact)
{
    *material = (uz_material){.on = "all", .young = 1000, .poisson = 0.3};
    *support = (uz_support){.on = "left"};
    loads[0] = (uz_load){.on = "top", .v = {0, -0.05, 0}};
    loads[1] = (uz_load){.on = "right", .v = {0.5, 0, 0}};
    *contact = (uz_contact){.on = "bottom", .normal = {0, 1, 0}};
    return (uz_scene){.model = UZ_SOLID,
                      .box = {.size = {40, 40, 40}, .cells = {n, n, n}, .dim = 3, .element = "hex8"},
                      .materials = material,
                      .n_materials = 1,
                      .supports = support,
                      .n_supports = 1,
                      .loads = loads,
                      .n_loads = 2,
                      .contacts = contact,
                      .n_contacts = 1};
}

bool bench_cells(bench_cells_row *row, int64_t n)
{
    uz_material material;
    uz_support support;
    uz_load loads[2];
    uz_contact contact;
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = cube_scene(n, &material, &support, loads, &contact)};
    uz_problem matrices = {.kind = UZ_PROBLEM_MATRICES};
    double linear[RUNS], aggregates[RUNS], cached[RUNS];
    uz_error err;
    bool ok = uz_scene_to_qp(&matrices.qp, NULL, &problem.scene, &err) == UZ_OK;
    for (int k = 0; ok && k < RUNS; k++) {
        uz_cache *cache = uz_cache_new((size_t)1 << 30);
        const bench_linear direct = bench_cholmod(&matrices.qp.K, matrices.qp.p, BENCH_METIS);
        const double cold = seconds_of_solve(&problem, UZ_OPERATOR_MATRIX_FREE, 1e-6, cache),
                     again = seconds_of_solve(&problem, UZ_OPERATOR_MATRIX_FREE, 1e-6, cache),
                     by_matrix = seconds_of_solve(&matrices, UZ_OPERATOR_MATRIX_FREE, 1e-6, NULL);
        uz_cache_free(cache);
        linear[k] = cold / (direct.analyze + direct.factorize + direct.solve);
        aggregates[k] = cold / by_matrix;
        cached[k] = again / cold;
        ok = !isnan(linear[k]) && !isnan(aggregates[k]) && !isnan(cached[k]);
    }
    if (ok)
        *row = (bench_cells_row){bench_summarise(linear, RUNS), bench_summarise(aggregates, RUNS),
                                 bench_summarise(cached, RUNS)};
    uz_qp_clear(&matrices.qp);
    return ok;
}
