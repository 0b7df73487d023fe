/* finite_turn.c: large steps of slender parts, turned.
 *
 * A step that is made by the tangent takes parts that turn along it, which stretches them: a beam that is to bend by a
 * right angle becomes several times as long, and Newton's method halves that from step to step. Where what turning adds
 * is more than the strain that the step is made for, the place that it leads to is the one whose gradients are nearest
 * to those of the turned step (finite/turning.h), with supports where they are to be; rigid groups are first turned as
 * elements are, and it is sought from there. It is a place like any other: the next step begins there, and the
 * certificate asks nothing of how it was reached. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/dual.h"
#include "finite/turning.h"
#include "run/setup_cache.h"

#include <stdlib.h>
#include <string.h>

/* What turning adds to a step that is less than this part of its strain is none. */
#define LITTLE_TURNING 0.01

/* run->v = K^-1 p on the metric, which takes the tangent's place: no contact has a say in it, but its dofs come last,
 * so that the order of tangents does. */
static uz_status solve_metric(uz_finite_run *run, uz_error *err)
{
    uz_setup *setup = NULL;
    uz_dual_load *load = NULL;
    const uz_stop stop = {&run->hooks, run->deadline};
    double *none = uz_alloc_zero(run->at.rows.m, sizeof *none);
    uz_status status = none
                           ? uz_finite_acquire(&setup, run, &run->at, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)run->at.rows.m);
    if (status == UZ_OK)
        status = uz_dual_load_create(&load, setup->dual, run->K, run->p, run->at.h, err);
    if (status == UZ_OK)
        status = uz_dual_load_aim(load, run->settings.relative_error, &stop, err);
    if (status == UZ_OK)
        status = uz_dual_load_recover(load, run->v, none, false, err);
    uz_dual_load_free(load);
    uz_setup_release(run->cache, setup);
    free(none);
    return status;
}

uz_status uz_finite_turn(bool *turned, uz_finite_run *run, uz_error *err)
{
    const uz_body_model *model = &run->base;
    const size_t bytes = (size_t)run->n * sizeof *run->step;
    uz_finite_place *to = &run->trial;
    bool moved;
    uz_turning found;
    double *force = to->force, *near = run->step; /* room until the place is looked at, and the next tangent */
    memcpy(near, model->n_rigid > 0 ? to->u : run->at.u, bytes);
    uz_rigid_step(near, model, run->at.u, true);
    uz_turning_of(&found, force, model, run->at.u, to->u, model->n_rigid > 0 ? near : NULL);
    *turned = found.turning > found.strain;
    run->unturned = found.turning < LITTLE_TURNING * LITTLE_TURNING * found.strain;
    if (!*turned)
        return UZ_OK;
    uz_finite_restrict(run->Kv, to);
    memcpy(to->u, near, bytes);
    uz_finite_forget_factors(run);
    uz_status status = uz_finite_place_groups(to, run, err);
    if (status != UZ_OK)
        return status;
    run->tangent.follow = to->turned.follow;
    uz_turning_metric(&run->tangent, model);
    uz_gather_nodal(run->p, &to->turned, force);
    uz_finite_move_supports(&moved, run, to);
    uz_finite_restrict(run->v, to);
    for (int64_t j = 0; j < run->d; j++)
        run->Kv[j] -= run->v[j];
    uz_finite_hold_free(run, run->Kv); /* what nothing holds goes as far as the step does */
    status = solve_metric(run, err);
    if (status != UZ_OK)
        return status;
    uz_finite_restrict(run->Kv, to);
    for (int64_t j = 0; j < run->d; j++)
        run->v[j] += run->Kv[j];
    uz_finite_lead(near, to, run->v);
    uz_rigid_step(near, model, to->u, false);
    memcpy(to->u, near, bytes);
    return UZ_OK;
}
