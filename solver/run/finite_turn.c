/* finite_turn.c: large steps of slender parts, turned.
 *
 * A step that is made by the tangent takes parts that turn along it, which stretches them: a beam that is to bend by a
 * right angle becomes several times as long, and Newton's method halves that from step to step. Where what turning adds
 * is more than the strain that the step is made for, the place that it leads to is the one whose gradients are nearest
 * to those of the turned step (finite/turning.h), with supports where they are to be. It is a place like any other: the
 * next step begins there, and the certificate asks nothing of how it was reached. */
#include "run/finite.h"

#include "finite/turning.h"

#include <string.h>

/* u = K^-1 p on the metric, which takes the tangent's place: no contact has a say in it. *solved: to the accuracy of
 * steps. */
static uz_status solve_metric(bool *solved, uz_finite_run *run, uz_error *err)
{
    const uz_qp linear = {.K = run->tangent.K, .p = run->p};
    uz_result *result = NULL;
    *solved = false;
    const uz_status status = uz_finite_solve(&result, run, &linear, err);
    if (status != UZ_OK)
        return status;
    *solved = result->summary.outcome == UZ_CONVERGED || result->summary.outcome == UZ_PRECISION_LIMIT;
    memcpy(run->v, result->u, (size_t)run->d * sizeof *run->v);
    uz_result_free(result);
    return UZ_OK;
}

uz_status uz_finite_turn(bool *turned, uz_finite_run *run, uz_error *err)
{
    const uz_body_model *model = &run->base;
    bool moved;
    uz_turning found;
    double *force = run->trial.force; /* room until the place is looked at */
    uz_turning_of(&found, force, model, run->at.u, run->trial.u);
    *turned = found.turning > found.strain;
    if (!*turned)
        return UZ_OK;
    uz_finite_forget_factors(run);
    uz_turning_metric(&run->tangent, model);
    uz_gather_nodal(run->p, model, force);
    uz_finite_move_supports(&moved, run);
    const uz_status status = solve_metric(turned, run, err);
    if (status != UZ_OK || !*turned)
        return status;
    uz_restrict_nodal(run->Kv, model, run->at.u);
    for (int64_t j = 0; j < run->d; j++)
        run->v[j] += run->Kv[j];
    uz_recover_nodal(run->trial.u, model, run->v, run->prescribed);
    return UZ_OK;
}
