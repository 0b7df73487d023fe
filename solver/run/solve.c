/* solve.c: where a call enters. What follows stands in the order in which control goes down (solve.h):
 *
 *     chosen cells -> grids -> rounds of contact rows -> blocks or one by one -> one load
 *                           -> what the answers of the rounds ask for */
#include "run/solve.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "run/results.h"

#include <stdlib.h>

/* Are the cells of a box, or the elements to be bisected, chosen by the error asked for? */
static bool is_mesh_chosen(const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    return problem->kind == UZ_PROBLEM_SCENE &&
           (scene->refine || (scene->source == UZ_MESH_BOX && scene->box.automatic));
}

uz_status uz_solve(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                   const uz_hooks *hooks, uz_error *err)
{
    const double started = uz_seconds();
    uz_status status;
    *out = NULL;
    uz_error_reset(err);
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "a problem with load cases is for uz_solve_cases");
    if (is_mesh_chosen(problem)) {
        status = uz_solve_grid_sequence(out, problem, settings, NULL, cache, hooks, err);
    } else {
        status = uz_solve_rounds(out, problem, settings, NULL, NULL, cache, hooks, err);
        status = uz_settle_cases(out, status, problem, settings, NULL, cache, hooks, started, err);
    }
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
    const double started = uz_seconds();
    uz_status status;
    *out = NULL;
    uz_error_reset(err);
    uz_result **results = uz_alloc_zero(n, sizeof(uz_result *));
    if (!results)
        return uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for the results of %lld cases", (long long)n);
    if (is_mesh_chosen(problem)) {
        status = uz_solve_grid_sequence(results, problem, settings, starts, cache, hooks, err);
    } else {
        status = uz_solve_rounds(results, problem, settings, starts, NULL, cache, hooks, err);
        status = uz_settle_cases(results, status, problem, settings, starts, cache, hooks, started, err);
    }
    if (status == UZ_OK)
        *out = results;
    else
        uz_results_free(results, n);
    return status;
}
