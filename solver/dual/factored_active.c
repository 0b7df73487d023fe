/* factored_active.c: the contact problem with given rows as equations where each row bounds a single dof: the dofs that
 * touch are held at their bounds, K u = p is solved on the others, and the reactions are what holds them. */
#include "dual/dual_private.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Which row holds each dof. Of several rows on a dof the tightest counts; a dof is not held from both sides. */
void uz_bounded_hold(uz_bounded *box, const uz_bounds *bounds, const bool *active, bool keep, int64_t d, int64_t m)
{
    for (int64_t j = 0; j < d; j++)
        box->holder[j] = -1;
    for (int64_t i = 0; i < m; i++) {
        int64_t j = bounds->dof[i];
        if (!active[i])
            continue;
        if (bounds->scale[i] > 0.0)
            box->holder[j] = box->upper[j];
        else if (box->holder[j] < 0)
            box->holder[j] = box->lower[j];
    }
    for (int64_t j = 0; j < d; j++) {
        box->fixed[j] = box->holder[j] >= 0;
        double free = keep ? box->u[j] : 0.0;
        box->u[j] = !box->fixed[j] ? free : bounds->scale[box->holder[j]] > 0.0 ? box->top[j] : box->bottom[j];
    }
}

/* force = K u - p, and size = |K| |u| + |p|, what its rounding is in proportion to. */
void uz_bounded_balance(uz_bounded *box, const uz_csc *K)
{
    for (int64_t j = 0; j < K->cols; j++) {
        box->force[j] = -box->p[j];
        box->size[j] = fabs(box->p[j]);
    }
    for (int64_t j = 0; j < K->cols; j++) {
        /* Rows above have added their terms; the diagonal comes first in a sorted column. */
        double u = box->u[j], own = K->val[K->ptr[j]] * u, force = box->force[j] + own, size = box->size[j] + fabs(own);
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            int64_t i = K->idx[k];
            double below = K->val[k] * u, across = K->val[k] * box->u[i];
            box->force[i] += below;
            box->size[i] += fabs(below);
            force += across;
            size += fabs(across);
        }
        box->force[j] = force;
        box->size[j] = size;
    }
}

enum { PASSES = 2 }; /* solve, and once more for the residual */

static uz_status solve_free(uz_dual_load *load, bool *solved, uz_error *err)
{
    uz_bounded *box = load->box;
    uz_principal *part = NULL;
    uz_status status = uz_principal_create(&part, load->K, box->fixed, load->dual->factor, load->ws, &load->stop, err);
    *solved = part && !uz_stop_is_due(&load->stop);
    for (int pass = 0; status == UZ_OK && *solved && pass < PASSES; pass++) {
        uz_bounded_balance(box, load->K);
        status = uz_principal_solve(box->force, part, err);
        for (int64_t j = 0; status == UZ_OK && j < load->K->cols; j++)
            box->u[j] -= box->fixed[j] ? 0.0 : box->force[j];
        *solved = !uz_stop_is_due(&load->stop);
    }
    uz_principal_free(part);
    return status;
}

/* Signs below this, relative to the terms of a sum, are rounding: weakly active rows must not make the steps chatter.
 */
#define NOISE (64.0 * DBL_EPSILON)

/* r from what holds the dofs; `active` becomes the rows that do. A dof whose bounds meet is held from the side that it
 * leans on. */
void uz_bounded_react(uz_bounded *box, bool *active, const uz_bounds *bounds, int64_t d, int64_t m)
{
    memset(box->r, 0, (size_t)m * sizeof *box->r);
    memset(active, 0, (size_t)m * sizeof *active);
    for (int64_t j = 0; j < d; j++) {
        int64_t row = box->holder[j];
        if (row < 0)
            continue;
        if (box->top[j] <= box->bottom[j])
            row = box->force[j] > 0.0 ? box->lower[j] : box->upper[j];
        active[row] = true;
        box->r[row] = box->force[j] / bounds->scale[row];
        if (box->r[row] > 0.0 && fabs(box->force[j]) <= NOISE * box->size[j])
            box->r[row] = 0.0;
    }
}

void uz_bounded_measure_gaps(double *g, const uz_dual_load *load, const bool *active)
{
    const uz_bounds *bounds = &load->dual->bounds;
    for (int64_t i = 0; i < load->dual->info.m; i++) {
        double reach = bounds->scale[i] * load->box->u[bounds->dof[i]];
        g[i] = load->h[i] - reach;
        if (active[i] || (g[i] < 0.0 && -g[i] <= NOISE * (fabs(load->h[i]) + fabs(reach))))
            g[i] = 0.0;
    }
}

uz_status uz_bounded_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active, uz_error *err)
{
    uz_bounded *box = load->box;
    const uz_dual *dual = load->dual;
    if (box->contradictory)
        return UZ_OK;
    box->has_exact = false;
    uz_bounded_hold(box, &dual->bounds, active, load->inexact != NULL, dual->info.d, dual->info.m);
    uz_status status = UZ_OK;
    if (load->inexact) {
        status = uz_inexact_solve_active(load, r, g, solved, active, err);
    } else {
        status = solve_free(load, solved, err);
    }
    if (status != UZ_OK || !*solved)
        return status;
    if (!load->inexact) {
        uz_bounded_balance(box, load->K);
        uz_bounded_react(box, active, &dual->bounds, dual->info.d, dual->info.m);
        uz_bounded_measure_gaps(g, load, active);
    }
    memcpy(r, box->r, (size_t)dual->info.m * sizeof *r);
    box->has_exact = true;
    return UZ_OK;
}

bool uz_bounded_recover(const uz_dual_load *load, double *u, const double *r)
{
    const uz_bounded *box = load->box;
    if (!box || !box->has_exact)
        return false;
    for (int64_t i = 0; i < load->dual->info.m; i++)
        if (r[i] != box->r[i])
            return false;
    memcpy(u, box->u, (size_t)load->dual->info.d * sizeof *u);
    return true;
}
