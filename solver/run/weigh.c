/* weigh.c: is small deformation enough (kinematics AUTO)?
 *
 * An answer of small deformation tells about how much it leaves out (post/nonlinear.c). Where that is surely little the
 * answer stays as it is, and nothing else is computed. Else the same scene is solved for large deformation, and both
 * are compared: Newton's first correction alone would say little of slender bodies, whose rotations make strains that
 * are not there. Laws of finite strain then decide which of the two is the answer. Under the linear law, which says
 * nothing of finite strain, it stays and has a warning; rotations are taken into account by St. Venant and Kirchhoff's
 * law, which is the linear one in the strain of Green and Lagrange. Of what nearly keeps its volume that law would keep
 * the trace of this strain, another volume by the square of the strains, and the neo-Hookean one keeps J. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "element/element.h"
#include "post/balance.h"
#include "run/problem.h"
#include "run/settings.h"
#include "run/solve.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Small deformation is off by less than the first; gaps and normals that are off by more than the second are a reason
 * to compare, too. */
#define TOLERABLE UZ_MOST_SLIDING
#define SLIDES    0.02
/* Under the linear law: the error of the equations that are compared. */
#define COMPARED_TO 1e-4

/* ---- which answers are looked at */

static bool has_orthotropic(const uz_scene *scene)
{
    bool has = false;
    for (int64_t k = 0; k < scene->n_materials && !has; k++)
        has = scene->materials[k].is_orthotropic;
    return has;
}

bool uz_may_be_compared(const uz_scene *scene, const uz_body_model *model)
{
    const bool small = scene->model != UZ_SOLID || model->d <= UZ_MOST_FINITE_DOFS;
    return small && uz_has_finite_model(scene, &model->mesh) && !has_orthotropic(scene) &&
           (scene->kinematics == UZ_KINEMATICS_FINITE || scene->kinematics == UZ_KINEMATICS_AUTO);
}

/* The equations were solved well enough to tell about the model, of which what the mesh is short of says nothing. */
static bool is_answer(const uz_summary *s)
{
    return s->outcome == UZ_CONVERGED || s->outcome == UZ_MESH_LIMIT ||
           (s->outcome == UZ_PRECISION_LIMIT && s->certificate.relative_error <= COMPARED_TO);
}

static bool is_asked(const uz_result *result, const uz_problem *one, bool own_laws)
{
    const uz_summary *s = &result->summary;
    const uz_evaluation *e = result->evaluation;
    if (one->kind != UZ_PROBLEM_SCENE || one->scene.kinematics != UZ_KINEMATICS_AUTO || !e || !is_answer(s))
        return false;
    if (own_laws)
        return e->nonlinear > UZ_SURELY_SMALL || s->geometry.sliding > SLIDES;
    if (has_orthotropic(&one->scene)) /* there is no law to compare with: a warning has told */
        return false;
    return e->nonlinear > UZ_SURELY_SMALL; /* NaN: nothing to compare with */
}

/* ---- the comparison */

/* What one of them tells counts the other one's time, and its memory: what made the small answer is still there. */
static void count_both(uz_summary *told, const uz_summary *other)
{
    uz_timings_add(&told->timings, &other->timings);
    told->cost.actual_bytes += other->cost.actual_bytes;
}

/* Large deformation was ended on its way to the whole load: it tells nothing of small deformation. */
static bool is_stopped(const uz_summary *large)
{
    return large->finite.load < 1 &&
           (large->outcome == UZ_TIME_LIMIT || large->outcome == UZ_DISMISSED || large->outcome == UZ_ITERATION_LIMIT);
}

/* The answer of small deformation is under the whole load, and stays in place of one under a part of it. large: NULL
 * where there is not even that. */
static void keep_small(uz_result *small, const uz_result *large, const uz_hooks *hooks)
{
    uz_summary *s = &small->summary;
    s->outcome = large ? large->summary.outcome : uz_cancelled(hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT;
    snprintf(s->message, sizeof s->message,
             "%s: large deformation had come to %.6g of the load, and this is the answer of small deformation, under "
             "all of it",
             uz_explain_stop(s->outcome), large ? large->summary.finite.load : 0.0);
    if (large)
        count_both(s, &large->summary);
}

/* What stands for the linear law: by what elements of mean dilatation are told by, whatever the elements are. */
static uz_elasticity law_for_linear(uz_model model, double poisson)
{
    const bool rubber = uz_resolve_formulation(UZ_FORMULATION_AUTO, UZ_QUAD4, model, poisson) == UZ_FORMULATION_BBAR;
    return rubber ? UZ_ELASTIC_NEO_HOOKE : UZ_ELASTIC_ST_VENANT_KIRCHHOFF;
}

/* Of the linear law: by what it is in large deformation. */
static uz_status compare_linear(uz_result *result, const uz_problem *one, const uz_hooks *hooks, double deadline,
                                uz_error *err)
{
    uz_problem by_law = *one;
    uz_settings coarse = uz_settings_default();
    uz_result *large = NULL;
    uz_error own = {0};
    by_law.scene.kinematics = UZ_KINEMATICS_FINITE;
    by_law.scene.compared = true;
    by_law.scene.materials = uz_alloc(one->scene.n_materials, sizeof *by_law.scene.materials);
    if (!by_law.scene.materials)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld materials", (long long)one->scene.n_materials);
    for (int64_t i = 0; i < one->scene.n_materials; i++) {
        by_law.scene.materials[i] = one->scene.materials[i];
        by_law.scene.materials[i].law = law_for_linear(one->scene.model, one->scene.materials[i].poisson);
    }
    coarse.relative_error = COMPARED_TO;
    const uz_status status = uz_solve_finite_load(&large, &by_law, &coarse, hooks, deadline, result, NULL, &own);
    free(by_law.scene.materials);
    if (status == UZ_ERR_MEMORY || status == UZ_ERR_CANCELLED) { /* what is left is an answer */
        uz_result_free(large);
        uz_doubt_uncompared(result->evaluation, status == UZ_ERR_MEMORY ? "memory" : "time");
        return UZ_OK;
    }
    if (status == UZ_ERR_INTERNAL) {
        if (err)
            *err = own;
        return status;
    }
    if (status != UZ_OK) { /* there is no large deformation of it, as where a support holds a node in an obstacle */
        uz_result_free(large);
        return UZ_OK;
    }
    const uz_outcome outcome = large->summary.outcome;
    const bool ended = outcome == UZ_UNSTABLE || outcome == UZ_INVERTED || large->summary.small.load == 1;
    count_both(&result->summary, &large->summary);
    if (ended)
        result->summary.small = large->summary.small;
    if (ended && !(large->summary.small.error <= TOLERABLE))
        uz_doubt_deformation(result->evaluation, &large->summary.small);
    if (is_stopped(&large->summary))
        uz_doubt_uncompared(result->evaluation, "time");
    uz_result_free(large);
    return UZ_OK;
}

/* *large NULL: it was stopped, and the answer of small deformation stays. */
static uz_status solve_large(uz_result **large, uz_result *small, const uz_problem *finite, const uz_settings *settings,
                             const uz_hooks *hooks, double deadline, uz_error *err)
{
    uz_error own = {0};
    const uz_status status = uz_solve_finite_load(large, finite, settings, hooks, deadline, small, NULL, &own);
    if (status == UZ_ERR_CANCELLED || (status == UZ_OK && is_stopped(&(*large)->summary))) {
        keep_small(small, *large, hooks);
        uz_result_free(*large);
        *large = NULL;
        return UZ_OK;
    }
    if (status == UZ_OK)
        return UZ_OK;
    uz_result_free(*large); /* what is told of a load that does not press the body on */
    *large = NULL;
    if (err)
        *err = own;
    return status;
}

static uz_status choose(uz_result **result, const uz_problem *one, const uz_settings *settings, const uz_hooks *hooks,
                        double started, uz_error *err)
{
    const double deadline = started + settings->time_limit_s;
    uz_problem finite = *one;
    uz_result *large = NULL, *left;
    finite.scene.kinematics = UZ_KINEMATICS_FINITE;
    uz_status status = solve_large(&large, *result, &finite, settings, hooks, deadline, err);
    if (status != UZ_OK || !large)
        return status;
    const bool enough = large->summary.small.error <= TOLERABLE;
    left = enough ? *result : large;
    if (!enough)
        status = uz_look_at_few_elements(&large, &finite, settings, NULL, hooks, started, err);
    if (status != UZ_OK) {
        uz_result_free(large);
        return status;
    }
    uz_judge_finite(large, one, settings, hooks);
    left->summary.small = large->summary.small;
    count_both(&left->summary, enough ? &large->summary : &(*result)->summary);
    uz_result_free(enough ? large : *result);
    *result = left;
    return UZ_OK;
}

uz_status uz_weigh_deformation(uz_result **result, const uz_problem *one, const uz_settings *settings,
                               const uz_hooks *hooks, double started, uz_error *err)
{
    const bool own_laws = one->kind == UZ_PROBLEM_SCENE && uz_has_finite_law(&one->scene);
    if (!is_asked(*result, one, own_laws))
        return UZ_OK;
    if (own_laws)
        return choose(result, one, settings, hooks, started, err);
    return compare_linear(*result, one, hooks, started + settings->time_limit_s, err);
}

/* ---- the kind of run */

bool uz_is_weighed(const uz_problem *problem)
{
    return problem->kind == UZ_PROBLEM_SCENE && problem->scene.kinematics == UZ_KINEMATICS_AUTO &&
           (uz_has_finite_law(&problem->scene) || uz_is_mesh_chosen(problem));
}

/* Of a case whose mesh was chosen for small deformation: what that errs by there; *compared: false where that is
 * surely little, where there was no time to, or under the linear law, whose answer stays. */
static uz_status weigh_chosen(bool *compared, uz_result *result, const uz_problem *problem, int64_t i,
                              const uz_hooks *hooks, double deadline, uz_error *err)
{
    const bool own_laws = uz_has_finite_law(&problem->scene);
    uz_problem one = uz_problem_of_case(problem, i);
    uz_settings coarse = uz_settings_default();
    uz_result *large = NULL;
    *compared = false;
    if (!is_asked(result, &one, own_laws))
        return UZ_OK;
    if (one.scene.box.automatic)
        memcpy(one.scene.box.cells, result->grids->cells, sizeof one.scene.box.cells);
    one.scene.box.automatic = false;
    one.scene.bisected = result->grids->bisected;
    one.scene.n_bisected = result->grids->n_bisected;
    if (!own_laws)
        return compare_linear(result, &one, hooks, deadline, err);
    one.scene.kinematics = UZ_KINEMATICS_FINITE;
    one.scene.compared = true;
    coarse.relative_error = COMPARED_TO;
    const uz_status status = solve_large(&large, result, &one, &coarse, hooks, deadline, err);
    *compared = large != NULL;
    if (status != UZ_OK || !large)
        return status;
    result->summary.small = large->summary.small;
    count_both(&result->summary, &large->summary);
    uz_result_free(large);
    return UZ_OK;
}

/* *large, of a mesh that was chosen for it, gets what is known of small deformation, or gives way to it where it was
 * stopped. */
static void choose_meshed(uz_result **large, uz_result **small, const uz_hooks *hooks)
{
    uz_result *found = *large;
    if (!found || is_stopped(&found->summary)) {
        keep_small(*small, found, hooks);
        *large = *small;
        *small = found;
        return;
    }
    found->summary.small = (*small)->summary.small;
    uz_timings_add(&found->summary.timings, &(*small)->summary.timings);
}

/* On a mesh that is chosen for small deformation; where that is not enough, for one of the cases, on another one, that
 * is chosen for large deformation, for all of them. */
static uz_status solve_chosen(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                              const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    const double deadline = uz_seconds() + settings->time_limit_s;
    uz_result **kept = uz_alloc_zero(n, sizeof *kept); /* answers of small deformation, until there are others */
    bool enough = true;
    uz_status status = kept ? uz_solve_grid_sequence(results, problem, settings, starts, cache, hooks, err)
                            : uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for %lld cases", (long long)n);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        bool compared;
        status = weigh_chosen(&compared, results[i], problem, i, hooks, deadline, err);
        if (status != UZ_OK && problem->n_cases > 0)
            uz_error_name_case(err, problem, i);
        enough = enough && (!compared || results[i]->summary.small.error <= TOLERABLE);
    }
    if (status == UZ_OK && !enough) {
        uz_problem large = *problem;
        uz_settings rest = *settings;
        large.scene.kinematics = UZ_KINEMATICS_FINITE;
        rest.time_limit_s = fmax(0.0, deadline - uz_seconds());
        memcpy(kept, results, (size_t)n * sizeof *kept);
        memset(results, 0, (size_t)n * sizeof *results);
        status = uz_solve_grid_sequence(results, &large, &rest, NULL, cache, hooks, err);
        if (status == UZ_ERR_CANCELLED) {
            uz_error_reset(err);
            status = UZ_OK;
        }
        for (int64_t i = 0; i < n && status == UZ_OK; i++)
            choose_meshed(&results[i], &kept[i], hooks);
    }
    for (int64_t i = 0; i < n && kept; i++)
        uz_result_free(kept[i]);
    free(kept);
    return status;
}

uz_status uz_solve_weighed(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                           const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    uz_status status = uz_check_settings(settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(problem, err);
    if (status == UZ_OK && uz_has_finite_law(&problem->scene))
        status = uz_check_finite_settings(settings, err);
    if (status != UZ_OK)
        return status;
    return uz_is_mesh_chosen(problem) ? solve_chosen(results, problem, settings, starts, cache, hooks, err)
                                      : uz_solve_given(results, problem, settings, starts, cache, hooks, err);
}
