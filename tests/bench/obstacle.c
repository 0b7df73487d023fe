/* obstacle.c: OBSTCLAE by Ipopt and by a certified solve, in pairs. */
#include "obstacle.h"
#include "bench/bench.h"
#include "core/clock.h"

enum { SIDE = 98, RUNS = 5 };

/* Bounds on the dofs as the rows of the problem say them; u starts at the nearest point to zero. */
static void find_bounds(double *lower, double *upper, double *u, const uz_qp *qp)
{
    int64_t d = qp->K.cols;
    for (int64_t j = 0; j < d; j++) {
        upper[j] = qp->h[j];
        lower[j] = -qp->h[d + j];
        u[j] = fmin(upper[j], fmax(lower[j], 0.0));
    }
}

/* At its default tolerance Ipopt ends with an objective 1.1e-5 above the least: an energy-norm error of about 5e-3. */
#define IPOPT_OBJECTIVE_ERROR 1e-4

/* Seconds of Ipopt; NAN where it is missing or came to something else. */
static double seconds_of_ipopt(const uz_qp *qp)
{
    int64_t d = qp->K.cols;
    double *room = calloc((size_t)(3 * d), sizeof *room), objective = NAN, seconds = NAN;
    if (room) {
        find_bounds(room, room + d, room + 2 * d, qp);
        seconds = bench_ipopt(room + 2 * d, &objective, &qp->K, qp->p, room, room + d);
    }
    free(room);
    return fabs(objective - OBSTACLE_98_OBJECTIVE) < IPOPT_OBJECTIVE_ERROR ? seconds : NAN;
}

static double seconds_of_solve(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err;
    double start = uz_seconds();
    uz_status status = uz_solve(&result, problem, &settings, NULL, NULL, &err);
    double seconds = uz_seconds() - start;
    bool ok = status == UZ_OK && result->summary.outcome == UZ_CONVERGED &&
              fabs(result->summary.certificate.energy_primal - OBSTACLE_98_OBJECTIVE) < 1e-9;
    uz_result_free(result);
    return ok ? seconds : NAN;
}

bool bench_obstacle(bench_value *ratio, bench_value *milliseconds, bool *compared)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_error err;
    double ratios[RUNS], own[RUNS];
    bool ok = obstacle_qp(&problem.qp, SIDE, &err) == UZ_OK;
    *compared = ok;
    for (int k = 0; ok && k < RUNS; k++) {
        double seconds = seconds_of_solve(&problem), other = seconds_of_ipopt(&problem.qp);
        ok = !isnan(seconds);
        *compared = *compared && !isnan(other);
        own[k] = 1e3 * seconds;
        ratios[k] = other / seconds;
    }
    if (ok) {
        *milliseconds = bench_summarise(own, RUNS);
        *ratio = bench_summarise(ratios, RUNS);
    }
    uz_problem_clear(&problem);
    return ok;
}
