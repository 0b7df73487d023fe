/* cg.c: preconditioned conjugate gradients (Hestenes and Stiefel 1952). */
#include "amg/amg.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RESTARTS_MOST = 4 };

uz_status uz_cg_init(uz_cg *cg, const uz_multigrid *mg, uz_error *err)
{
    double **vectors[] = {&cg->r, &cg->z, &cg->p, &cg->q};
    *cg = (uz_cg){.mg = mg, .n = mg->n};
    cg->room = mg->kind->room(mg, &cg->bytes);
    bool ok = cg->room != NULL;
    for (int k = 0; k < 4; k++)
        ok = (*vectors[k] = uz_alloc(mg->n, sizeof(double))) && ok;
    cg->bytes += 32 * (size_t)mg->n;
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to solve for %lld dofs", (long long)mg->n);
}

uz_status uz_cg_hold(uz_cg *cg, const uz_csc *K, const bool *held, const uz_stop *stop, uz_error *err)
{
    cg->held = held;
    return cg->mg->kind->hold(cg->mg, K, cg->room, held, &cg->grown, stop, err);
}

void uz_cg_clear(uz_cg *cg)
{
    if (cg->mg)
        cg->mg->kind->free_room(cg->room);
    free(cg->r);
    free(cg->z);
    free(cg->p);
    free(cg->q);
    memset(cg, 0, sizeof *cg);
}

static void clear_held(double *x, const uz_cg *cg)
{
    for (int64_t j = 0; cg->held && j < cg->n; j++)
        x[j] = cg->held[j] ? 0.0 : x[j];
}

static bool should_stop(const uz_cg_info *info, const uz_cg_stop *stop)
{
    return info->iterations >= stop->max_iterations || uz_cancelled(stop->hooks) || uz_seconds() >= stop->deadline;
}

/* The recurrence drifts from the true residual by rounding (Greenbaum 1997): it is begun again from the true one until
 * that meets the goal too, or gains nothing more. */
uz_status uz_cg_solve(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b, const uz_cg_stop *stop,
                      uz_error *err)
{
    const int64_t n = cg->n;
    double goal = 0.0, before = INFINITY;
    memset(info, 0, sizeof *info);
    if (cg->mg->kind->solve)
        return cg->mg->kind->solve(cg->mg, K, cg->room, info, x, cg->r, b, stop, err);
    for (int k = 0;; k++) {
        /* r = b - K x on the free dofs, z = M^-1 r; x at held dofs counts as 0 */
        memcpy(cg->p, x, (size_t)n * sizeof *x);
        clear_held(cg->p, cg);
        cg->mg->kind->multiply(cg->mg, K, cg->room, cg->q, cg->p);
        for (int64_t j = 0; j < n; j++)
            cg->r[j] = b[j] - cg->q[j];
        clear_held(cg->r, cg);
        uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
        double square = uz_dot(n, cg->r, cg->z);
        info->last = uz_root(square);
        if (k == 0) {
            info->first = info->last;
            goal = fmax(stop->absolute, stop->relative * info->first);
        }
        info->met = info->last <= goal;
        if (status != UZ_OK || (k > 0 && should_stop(info, stop)) || k == RESTARTS_MOST || !(info->last > goal) ||
            !(info->last < 0.5 * before))
            return status;
        before = info->last;
        memcpy(cg->p, cg->z, (size_t)n * sizeof *cg->p);
        while (square > goal * goal && !should_stop(info, stop)) {
            cg->mg->kind->multiply(cg->mg, K, cg->room, cg->q, cg->p);
            clear_held(cg->q, cg);
            const double curvature = uz_dot(n, cg->p, cg->q), alpha = square / curvature, last = square;
            if (fabs(curvature) < DBL_MIN) /* underflow: there is no more to gain */
                break;
            if (!(curvature > 0.0))
                return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                               "K is not positive definite: conjugate gradients met a direction that it does not "
                               "resist. Support the body so that it can't move freely, or check the signs of K.");
            for (int64_t j = 0; j < n; j++) {
                x[j] += cg->held && cg->held[j] ? 0.0 : alpha * cg->p[j];
                cg->r[j] -= alpha * cg->q[j];
            }
            status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
            if (status != UZ_OK)
                return status;
            square = uz_dot(n, cg->r, cg->z);
            for (int64_t j = 0; j < n; j++)
                cg->p[j] = cg->z[j] + square / last * cg->p[j];
            info->iterations++;
        }
        if (stop->unchecked && square <= goal * goal) {
            info->last = uz_root(square);
            info->met = true;
            return UZ_OK;
        }
    }
}
