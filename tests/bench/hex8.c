/* hex8.c: three dimensions: a cold contact solve on a cube of bricks against CHOLMOD's solve of the same K. */
#include "hex8.h"
#include "bench/bench.h"
#include "core/clock.h"

enum { RUNS = 5 };

static double seconds_of_solve(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err;
    double start = uz_seconds();
    uz_status status = uz_solve(&result, problem, &settings, NULL, NULL, &err);
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
        samples[k] = seconds_of_solve(&problem) / (linear.analyze + linear.factorize + linear.solve);
        ok = !isnan(samples[k]);
    }
    if (ok)
        *ratio = bench_summarise(samples, RUNS);
    uz_qp_clear(&problem.qp);
    return ok;
}
