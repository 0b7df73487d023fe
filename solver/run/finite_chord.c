/* finite_chord.c: steps on the factor of the last contact problem (the chord method, or modified Newton's: C. T.
 * Kelley, "Iterative Methods for Linear and Nonlinear Equations", SIAM 1995, section 5.4).
 *
 * With K, N and the rows that press of that problem, and forces f, gaps g and rows N(u) of where it has led to, a step
 * v and the change s of the reactions r are
 *
 *     K v - N's = f + N(u)'r,   N v = g on the rows that press.
 *
 * It takes no tangent, no factorization and no search for the rows: forces at a place, and one solve. What is left of
 * the error is about as much of it as the place of the tangent was off, so that a few such steps take the place of
 * the last contact problems. Which rows press has to stay, and nothing of a step is believed: the certificate looks at
 * where it leads as anywhere. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/dual.h"
#include "linalg/blas.h"

#include <math.h>
#include <string.h>

/* A gap below this part of the body's extent is one. */
#define NO_GAP 1e-11

/* run->p = f + N(u)'r, with what stiffness along pressed rows makes of their gaps, about whose being closed it is. */
static void find_forces(uz_finite_run *run)
{
    const uz_finite_place *at = &run->at;
    const uz_csc *N = &at->rows.N;
    const double hold = run->hold * run->stiffest;
    double *rest = run->trial.force; /* it is free until the next place is looked at */
    for (int64_t i = 0; i < run->n; i++)
        rest[i] = at->loads[i] - at->force[i];
    uz_gather_nodal(run->p, &at->turned, rest);
    for (int64_t j = 0; j < run->d; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
            const int64_t i = N->idx[q];
            run->p[j] += N->val[q] * (run->r[i] + (run->r[i] < 0 ? hold * at->gap[i] : 0));
        }
}

/* Is none of the rows penetrated that the setup does not have, nor does one of them press? g (m): room. */
static bool are_clear(const uz_finite_run *run, const double *v, double *g)
{
    const uz_finite_place *at = &run->at;
    bool clear = true;
    memcpy(g, at->gap, (size_t)at->rows.m * sizeof *g);
    uz_csc_gaxpy(g, &at->rows.N, -1, v);
    for (int64_t i = 0; i < at->rows.m && clear; i++)
        clear = run->kept.in[i] || (run->r[i] == 0 && g[i] >= -NO_GAP * run->base.mesh.extent);
    return clear;
}

uz_status uz_finite_chord(bool *found, double *norm, double *to, double *r, uz_finite_run *run, const uz_setup *setup,
                          uz_error *err)
{
    const uz_dual *dual = setup->dual;
    const uz_finite_place *at = &run->at;
    const uz_stop stop = {&run->hooks, run->deadline};
    const int64_t d = run->d, m = at->rows.m, kept = dual->m;
    uz_active_end end = UZ_ACTIVE_UNSOLVED;
    uz_dual_load *load = NULL;
    double *gap = uz_alloc(3 * kept + m, sizeof *gap), *s = NULL, *g = NULL;
    bool *pressing = uz_alloc(kept, sizeof *pressing);
    uz_status status =
        gap && pressing ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a step of %lld rows", (long long)m);
    *found = false;
    *norm = INFINITY;
    if (status == UZ_OK) {
        s = gap + kept;
        g = s + kept;
        uz_finite_gather(s, run, run->r);
        for (int64_t k = 0; k < kept; k++)
            pressing[k] = s[k] < 0;
        uz_finite_gather(gap, run, at->gap);
        find_forces(run);
        status = uz_dual_load_create(&load, dual, run->K, run->p, gap, err);
    }
    if (status == UZ_OK)
        load->equations = true; /* they bear a correction, which may pull */
    if (status == UZ_OK)
        status = uz_dual_load_aim(load, run->settings.relative_error, &stop, err);
    if (status == UZ_OK)
        status = uz_dual_load_solve_active(load, &end, s, g, pressing, err);
    if (status == UZ_OK && end == UZ_ACTIVE_SOLVED) {
        *found = true;
        status = uz_dual_load_recover(load, run->Kv, s, false, err);
    }
    if (*found && status == UZ_OK && run->kept.in)
        *found = are_clear(run, run->Kv, g + kept);
    for (int64_t i = 0, k = 0; i < m && *found; i++) {
        const bool presses = run->r[i] < 0;
        r[i] = run->r[i];
        if (run->kept.in && !run->kept.in[i])
            continue;
        r[i] += s[k] * dual->row_scale[k];
        *found = presses ? pressing[k] && r[i] < 0 : g[k] / dual->row_scale[k] >= -NO_GAP * run->base.mesh.extent;
        k++;
    }
    if (*found && status == UZ_OK) {
        uz_finite_restrict(run->v, at);
        uz_axpy(d, 1, run->Kv, run->v);
        uz_finite_lead(to, at, run->v);
        memcpy(run->v, run->Kv, (size_t)d * sizeof *run->v);
        *norm = uz_finite_norm(run);
    }
    uz_dual_load_free(load);
    uz_free_all(gap, pressing);
    return status;
}
