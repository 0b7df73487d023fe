/* cases.c: what load cases ask for once they were solved together, as far as supports hold the body: one by one where
 * only the obstacle does, contacts found where the body has gone, bounds on the whole error. */
#include "run/solve.h"

#include "core/error.h"
#include "methods/iterate.h"
#include "run/moving.h"
#include "run/problem.h"
#include "run/results.h"
#include "run/semicoercive.h"

#include <string.h>

/* Without supports a body had no iteration to go on from a start; the start is checked all the same. */
static uz_status check_start(const uz_state *start, const uz_problem *problem, uz_error *err)
{
    int64_t m = problem->qp.N.rows, n_nodes;
    int dim;
    uz_error own = {0};
    uz_status status = UZ_OK;
    if (problem->kind == UZ_PROBLEM_SCENE)
        status = uz_scene_sizes(&dim, &n_nodes, &m, &problem->scene, &own);
    if (status == UZ_OK)
        status = uz_state_check(start, m, &own);
    if (status != UZ_OK && err)
        *err = own; /* in place of the refusal */
    return status;
}

/* A refusal that is not about the setup, which all cases share, names its case. */
static void name_case(uz_error *err, const uz_problem *problem, int64_t i)
{
    if (problem->n_cases > 0 && err &&
        (strcmp(err->where, "p") == 0 || strcmp(err->where, "start") == 0 || strncmp(err->where, "/loads", 6) == 0))
        uz_error_name_case(err, problem, i);
}

/* A scene's K is singular: be it for a piece of the body that hangs on a node of the rest, which is told in its place.
 */
static void name_hinge(uz_status *status, const uz_scene *scene, uz_error *err)
{
    uz_body_model outline;
    uz_error own = {0};
    if (uz_body_model_build(&outline, scene, UZ_BODY_OUTLINE, NULL) != UZ_OK)
        return;
    if (uz_check_hinges(&outline, &own) == UZ_ERR_FREE_BODY) {
        *status = UZ_ERR_FREE_BODY;
        if (err)
            *err = own;
    }
    uz_body_model_clear(&outline);
}

uz_status uz_settle_cases(uz_result **results, uz_status rounds, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, double started,
                          uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    uz_status status = rounds;
    int64_t unheld = 0;
    uz_error first = {0};             /* why the first of these is */
    for (int64_t i = 0; i < n; i++) { /* those refused or not certified, because only the obstacle holds the body */
        uz_problem one = uz_problem_of_case(problem, i);
        if (!uz_may_be_semicoercive(rounds, results[i], &one, settings))
            continue;
        if (problem->kind == UZ_PROBLEM_SCENE && problem->scene.kinematics == UZ_KINEMATICS_MOVING) {
            uz_error_reset(err); /* in place of the refusal */
            status = uz_fail(err, UZ_ERR_SCENE, "/kinematics",
                             "\"moving\" is for bodies that their supports hold, and this one only obstacles do: add "
                             "supports or springs, or ask for \"fixed\"");
            break;
        }
        if (hooks && hooks->begins)
            hooks->begins(hooks->ctx, i);
        status = starts && starts[i] ? check_start(starts[i], &one, err) : UZ_OK;
        if (status == UZ_OK)
            status = uz_solve_semicoercive(&results[i], &one, settings, cache, hooks, rounds, started, err);
        if (status != UZ_OK)
            name_case(err, problem, i);
        uz_pass_unheld(&status, &unheld, &first, results[i], n, err);
        if (status != UZ_OK)
            break;
    }
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        const uz_problem one = uz_problem_of_case(problem, i);
        status = uz_solve_moving(&results[i], &one, settings, cache, hooks, started, err);
        if (status != UZ_OK)
            name_case(err, problem, i);
    }
    if (status == UZ_OK && !problem->scene.refine)
        status = uz_look_at_few_elements(results, problem, settings, cache, hooks, started, err);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        const uz_problem one = uz_problem_of_case(problem, i);
        uz_judge_contact(results[i]);
        uz_judge_whole_error(results[i], &one, settings, cache, hooks, started);
        uz_judge_quantity(results[i]);
    }
    if (status == UZ_ERR_NOT_SPD && problem->kind == UZ_PROBLEM_SCENE)
        name_hinge(&status, &problem->scene, err);
    return status;
}
