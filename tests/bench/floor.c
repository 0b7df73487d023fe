/* floor.c: a membrane and a plate over a floor (tests/support/floor.h) by a cold certified solve, in units of CHOLMOD's
 * linear solve of the same K. */
#include "floor.h"
#include "bench/bench.h"
#include "core/clock.h"

enum { RUNS = 5 };

bool bench_floor(bench_value *ratio, int64_t *steps, int64_t n, bool plate, double sink)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    const uz_settings settings = uz_settings_default();
    uz_error err;
    double ratios[RUNS];
    bool ok = floor_qp(&problem.qp, n, plate, sink, 0.0, &err) == UZ_OK;
    for (int k = 0; ok && k < RUNS; k++) {
        const bench_linear linear = bench_cholmod(&problem.qp.K, problem.qp.p, BENCH_AMD);
        uz_result *result = NULL;
        double start = uz_seconds();
        uz_status status = uz_solve(&result, &problem, &settings, NULL, NULL, &err);
        ratios[k] = (uz_seconds() - start) / (linear.analyze + linear.factorize + linear.solve);
        ok = status == UZ_OK && result->summary.outcome == UZ_CONVERGED;
        *steps = ok ? result->summary.iterations : 0;
        uz_result_free(result);
    }
    if (ok)
        *ratio = bench_summarise(ratios, RUNS);
    uz_problem_clear(&problem);
    return ok;
}
