/* solve.c: where a call enters. What follows stands in the order in which control goes down (solve.h):
 *
 *     chosen cells -> grids -> load cases on a mesh -> rounds of contact rows -> blocks or one by one -> one load */
#include "run/solve.h"

#include "core/error.h"

#include <stdlib.h>

/* Are the cells of a box, or the elements to be bisected, chosen by the error asked for? */
static uz_solver *solver_of(const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    bool chosen =
        problem->kind == UZ_PROBLEM_SCENE && (scene->refine || (scene->source == UZ_MESH_BOX && scene->box.automatic));
    return chosen ? uz_solve_grid_sequence : uz_solve_on_mesh;
}

uz_status uz_solve(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                   const uz_hooks *hooks, uz_error *err)
{
    uz_result **results = NULL;
    *out = NULL;
    uz_error_reset(err);
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "a problem with load cases is for uz_solve_cases");
    uz_status status = solver_of(problem)(&results, problem, settings, NULL, cache, hooks, err);
    if (status == UZ_OK)
        *out = results[0];
    free(results);
    return status;
}

uz_status uz_solve_cases(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    uz_error_reset(err);
    return solver_of(problem)(out, problem, settings, starts, cache, hooks, err);
}
