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

uz_status uz_cg_init(uz_cg *cg, const uz_multigrid *mg, const bool *held, int64_t n, uz_error *err)
{
    memset(cg, 0, sizeof *cg);
    cg->mg = mg;
    cg->held = held;
    cg->n = n;
    cg->room = uz_multigrid_room_new(mg);
    double **vectors[] = {&cg->r, &cg->z, &cg->p, &cg->q};
    bool ok = cg->room != NULL;
    for (int k = 0; k < 4; k++)
        ok = (*vectors[k] = uz_alloc(n, sizeof(double))) && ok;
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to solve for %lld dofs", (long long)n);
}

void uz_cg_clear(uz_cg *cg)
{
    uz_multigrid_room_free(cg->room);
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

/* r = b - K x on the free dofs, z = M^-1 r, *square = r'z. x at held dofs counts as 0: through q. */
static uz_status begin(double *square, const double *x, uz_cg *cg, const uz_csc *K, const double *b, uz_error *err)
{
    memcpy(cg->q, x, (size_t)cg->n * sizeof *x);
    clear_held(cg->q, cg);
    memcpy(cg->r, b, (size_t)cg->n * sizeof *b);
    uz_csc_symv(cg->r, K, -1.0, cg->q);
    clear_held(cg->r, cg);
    uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
    *square = uz_dot(cg->n, cg->r, cg->z);
    return status;
}

static bool should_stop(const uz_cg_info *info, const uz_cg_stop *stop)
{
    return info->iterations >= stop->max_iterations || uz_cancelled(stop->hooks) || uz_seconds() >= stop->deadline;
}

/* Iterates until the recurrence says that r'M^-1 r is at most goal^2, or something stops it. */
static uz_status iterate(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, double square, double goal,
                         const uz_cg_stop *stop, uz_error *err)
{
    memcpy(cg->p, cg->z, (size_t)cg->n * sizeof *cg->p);
    while (square > goal * goal && !should_stop(info, stop)) {
        memset(cg->q, 0, (size_t)cg->n * sizeof *cg->q);
        uz_csc_symv(cg->q, K, 1.0, cg->p);
        clear_held(cg->q, cg);
        double curvature = uz_dot(cg->n, cg->p, cg->q);
        if (fabs(curvature) < DBL_MIN) /* underflow: there is no more to gain */
            break;
        if (!(curvature > 0.0))
            return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                           "K is not positive definite: conjugate gradients met a direction that it does not resist. "
                           "Support the body so that it can't move freely, or check the signs of K.");
        double alpha = square / curvature, before = square;
        for (int64_t j = 0; j < cg->n; j++) {
            x[j] += cg->held && cg->held[j] ? 0.0 : alpha * cg->p[j];
            cg->r[j] -= alpha * cg->q[j];
        }
        uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
        if (status != UZ_OK)
            return status;
        square = uz_dot(cg->n, cg->r, cg->z);
        for (int64_t j = 0; j < cg->n; j++)
            cg->p[j] = cg->z[j] + square / before * cg->p[j];
        info->iterations++;
    }
    return UZ_OK;
}

/* The recurrence drifts from the true residual by rounding (Greenbaum 1997): it is begun again from the true one until
 * that meets the goal too, or gains nothing more. */
uz_status uz_cg_solve(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b, const uz_cg_stop *stop,
                      uz_error *err)
{
    double square = 0.0, goal = 0.0, before = INFINITY;
    memset(info, 0, sizeof *info);
    uz_status status = begin(&square, x, cg, K, b, err);
    info->first = info->last = uz_root(square);
    goal = fmax(stop->absolute, stop->relative * info->first);
    for (int k = 0; status == UZ_OK && k < RESTARTS_MOST && info->last > goal && info->last < 0.5 * before; k++) {
        before = info->last;
        status = iterate(info, x, cg, K, square, goal, stop, err);
        if (status == UZ_OK)
            status = begin(&square, x, cg, K, b, err);
        info->last = uz_root(square);
        if (should_stop(info, stop))
            break;
    }
    info->met = info->last <= goal;
    return status;
}
