/* solve.c: where a call enters. What follows stands in the order in which control goes down (solve.h):
 *
 *     auto, laws of finite strain or chosen cells -> what is given or chosen, compared with finite kinematics
 *     chosen cells -> grids -> rounds of contact rows -> blocks or one by one -> one load
 *                           -> what the answers of the rounds ask for
 *                           -> of finite kinematics:
 *     finite kinematics -> parts of a load -> contact problems on tangents, each by rounds */
#include "run/solve.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "run/finite.h"
#include "run/problem.h"

/* The kinds of runs. The first that is one for the problem takes it; results as those of uz_solve_rounds. */
typedef struct {
    bool (*takes)(const uz_problem *problem);
    uz_status (*solve)(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                       const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
} run_kind;

static bool any(const uz_problem *problem)
{
    (void)problem;
    return true;
}

/* What is proved of an answer is by its factor, too. */
uz_status uz_solve_given(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    const double started = uz_seconds();
    uz_cache *own = settings->guaranteed && !cache ? uz_cache_new(SIZE_MAX) : NULL, *kept = own ? own : cache;
    uz_status status = uz_solve_rounds(results, problem, settings, starts, NULL, kept, hooks, err);
    status = uz_settle_cases(results, status, problem, settings, starts, kept, hooks, started, err);
    uz_cache_free(own);
    for (int64_t i = 0; i < (problem->n_cases > 0 ? problem->n_cases : 1) && status == UZ_OK; i++) {
        const uz_problem one = uz_problem_of_case(problem, i);
        status = uz_weigh_deformation(&results[i], &one, settings, hooks, started, err);
        if (status != UZ_OK && problem->n_cases > 0)
            uz_error_name_case(err, problem, i);
    }
    return status;
}

static const run_kind KINDS[] = {{uz_is_weighed, uz_solve_weighed},
                                 {uz_is_mesh_chosen, uz_solve_grid_sequence},
                                 {uz_is_finite, uz_solve_finite},
                                 {any, uz_solve_given}};

static uz_status run(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                     const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    const run_kind *kind = KINDS;
    while (!kind->takes(problem))
        kind++;
    return kind->solve(results, problem, settings, starts, cache, hooks, err);
}

uz_status uz_solve(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                   const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    uz_error_reset(err);
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "a problem with load cases is for uz_solve_cases");
    const uz_status status = run(out, problem, settings, NULL, cache, hooks, err);
    if (status != UZ_OK) {
        uz_result_free(*out);
        *out = NULL;
    }
    return status;
}

uz_status uz_solve_cases(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    *out = NULL;
    uz_error_reset(err);
    uz_result **results = uz_alloc_zero(n, sizeof(uz_result *));
    if (!results)
        return uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for the results of %lld cases", (long long)n);
    const uz_status status = run(results, problem, settings, starts, cache, hooks, err);
    if (status == UZ_OK)
        *out = results;
    else
        uz_results_free(results, n);
    return status;
}
