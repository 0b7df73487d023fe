/* finite_free.c: bodies that only obstacles, or other bodies, hold.
 *
 * Under loads that keep their direction the tangent of such a body has its translations for null vectors, wherever it
 * is; rotations get what the stress makes of them, which is negative under compression. Rows that press hold it, by the
 * stiffness that a tangent gets along these (finite_newton.c). Before any of them is known, and where they do not hold
 * all of it, a step is one of the proximal point method (R. T. Rockafellar, SIAM J. Control 14 (1976) 877-898): it
 * minimizes the energy with that of soft springs which are at rest where the body is. Where it stays they have no
 * force, so that the equilibrium is that of the body alone, and steps become about as much smaller as the springs are
 * softer than the body that contact holds. The certificate knows of none of this: what the pressed rows do not hold is
 * no strict minimum. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

/* The springs, in parts of each dof's stiffness; and softer, so that over the body's extent they bear no more than a
 * part of the load, as far as a factor can tell them from nothing. */
#define SOFT    1e-10
#define SOFTEST 1e-12
#define OF_LOAD 1e-2
/* Rigid groups may have no stiffness of their own: theirs is at least this part of the stiffest dof's. */
#define OF_GROUPS 1e-3

/* What springs at dof j are a part of. */
static double stiffness_of(const uz_finite_run *run, int64_t j)
{
    const double own = run->base.K.val[run->base.K.ptr[j]];
    return run->base.n_rigid > 0 ? fmax(own, OF_GROUPS * run->stiffest) : own;
}

static double softness(const uz_finite_run *run)
{
    double all = 0, load = 0;
    for (int64_t j = 0; j < run->d; j++)
        all += stiffness_of(run, j);
    for (int64_t i = 0; i < run->n; i++)
        load += fabs(run->at.loads[i]);
    return fmax(SOFTEST, fmin(SOFT, OF_LOAD * load / (all * run->base.mesh.extent)));
}

void uz_finite_begin_free(uz_finite_run *run)
{
    const uz_csc *K = &run->base.K, *fixed = &run->base.K_fixed;
    memcpy(run->tangent.K.val, K->val, (size_t)K->ptr[K->cols] * sizeof *K->val);
    if (fixed->ptr[fixed->cols] > 0)
        memcpy(run->tangent.K_fixed.val, fixed->val, (size_t)fixed->ptr[fixed->cols] * sizeof *fixed->val);
    uz_csc_clear(&run->skew);
}

void uz_finite_hold_free(uz_finite_run *run, const double *rest)
{
    uz_csc *K = &run->tangent.K;
    if (run->base.n_modes == 0)
        return;
    const double soft = softness(run);
    for (int64_t j = 0; j < run->d; j++) {
        const double stiffness = soft * stiffness_of(run, j);
        K->val[K->ptr[j]] += stiffness;
        run->p[j] += rest ? stiffness * rest[j] : 0;
    }
}

uz_status uz_finite_check_pressed(const uz_finite_run *run, uz_error *err)
{
    double *nodal = uz_alloc(run->n, sizeof *nodal), *p = uz_alloc(run->d, sizeof *p),
           *rest = uz_alloc_zero(run->n, sizeof *rest);
    uz_status status = nodal && p && rest ? UZ_OK
                                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld nodes",
                                                    (long long)run->base.mesh.n_nodes);
    if (status == UZ_OK) {
        memcpy(nodal, run->loads, (size_t)run->n * sizeof *nodal);
        if (run->follows)
            status = uz_follower_loads(nodal, &run->base, &run->scene, rest, err);
    }
    if (status == UZ_OK) {
        uz_gather_nodal(p, &run->base, nodal);
        status = uz_check_pressed(&run->base, p, err);
    }
    uz_free_all(nodal, p, rest);
    return status;
}
