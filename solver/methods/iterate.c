/* iterate.c: the state of an iteration, and the bound on what it holds. */
#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/milestones.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_iterate_init(uz_iterate *it, const uz_law *law, const uz_dual *dual, bool as_given, double alpha,
                          uz_error *err)
{
    const int64_t m = dual->m;
    memset(it, 0, sizeof *it);
    double **vectors[] = {&it->r,     &it->Dr,     &it->r_next, &it->Dr_next, &it->rho,      &it->Drho,
                          &it->gamma, &it->best_r, &it->anchor, &it->ray,     &it->before.r, &it->step};
    bool ok = true;
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++) {
        *vectors[k] = uz_alloc_zero(m, sizeof(double));
        ok = ok && *vectors[k];
    }
    it->close = uz_alloc_zero(m, sizeof(bool));
    if (!ok || !it->close) {
        uz_iterate_clear(it);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the iterates of %lld contacts", (long long)m);
    }
    it->law = law;
    it->m = m;
    it->weight = as_given ? dual->row_weight : NULL;
    it->unit = as_given || !dual->row_weight ? dual->row_unit : 1.0;
    /* the norm of the largest row may have a square that is out of range */
    uz_iterate_set_alpha(it, alpha > 0.0 ? fmin(DBL_MAX, fmax(DBL_MIN, alpha / it->unit / it->unit)) : 0.0);
    it->tau = 1.0;
    it->best_bound = INFINITY;
    it->best_relative = INFINITY;
    it->step_norm = NAN;
    return UZ_OK;
}

void uz_iterate_clear(uz_iterate *it)
{
    uz_free_all(it->r, it->Dr, it->r_next, it->Dr_next, it->rho, it->Drho, it->gamma, it->best_r, it->anchor, it->ray,
                it->before.r, it->step);
    free(it->close);
    memset(it, 0, sizeof *it);
}

void uz_iterate_set_alpha(uz_iterate *it, double alpha)
{
    it->alpha = alpha;
    for (int64_t i = 0; i < it->m; i++)
        it->step[i] = it->weight ? alpha * (it->weight[i] * it->weight[i]) : alpha;
}

double uz_iterate_alpha(const uz_iterate *it)
{
    return it->alpha > 0.0 ? fmin(DBL_MAX, fmax(DBL_MIN, it->alpha * it->unit * it->unit)) : 0.0;
}

/* Rows that a projected step would keep in contact are closed, so that the complementarity term of the bound vanishes
 * there; the prediction is that of the primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003)).
 */
uz_status uz_iterate_bound(uz_iterate *it, uz_dual_load *load, uz_method by, uz_error *err)
{
    const double *g0 = load->g0;
    double bound, psi, norm2;
    for (int64_t i = 0; i < it->m; i++)
        it->gamma[i] = g0[i] - it->Dr[i];
    it->law->kind->predict(it->law, it->close, it->r, it->gamma, it->step, it->m);
    uz_status status = uz_dual_load_correct(load, &bound, it->best_bound, it->r, it->gamma, it->close, err);
    if (status != UZ_OK || !(bound < it->best_bound))
        return status;
    uz_dual_load_energies(load, &psi, &norm2, it->r, it->Dr);
    double norm = sqrt(norm2);
    it->best_bound = bound;
    it->best_relative = bound == 0.0 ? 0.0 : norm > 2.0 * bound ? bound / (norm - 2.0 * bound) : INFINITY;
    it->best_iteration = it->iteration;
    it->made_by = by;
    memcpy(it->best_r, it->r, (size_t)it->m * sizeof *it->r);
    uz_milestones_note(it->milestones, UZ_MILESTONE_OF_ITERATION, it->best_relative, it->iteration, load->applications);
    return UZ_OK;
}

uz_status uz_iterate_bound_best(uz_iterate *it, uz_dual_load *load, uz_error *err)
{
    double *r = it->r, *Dr = it->Dr;
    it->r = it->r_next;
    it->Dr = it->Dr_next;
    memcpy(it->r, it->best_r, (size_t)it->m * sizeof *r);
    it->best_bound = INFINITY;
    uz_status status = uz_dual_load_apply(load, it->Dr, it->r, err);
    if (status == UZ_OK)
        status = uz_iterate_bound(it, load, it->made_by, err);
    it->r = r;
    it->Dr = Dr;
    return status;
}

uz_status uz_iterate_take(uz_iterate *it, const double *r, const double *g, uz_dual_load *load, uz_method by,
                          uz_error *err)
{
    const double *g0 = load->g0;
    const bool admissible = it->law->kind->admissible(it->law, r, it->m);
    for (int64_t i = 0; i < it->m; i++) {
        it->r[i] = r[i];
        it->Dr[i] = g0[i] - g[i];
    }
    it->law->kind->project(it->law, it->r, it->m);
    /* Where D r takes a solve, a guess that is wrong is not bounded: the next one is as near. */
    const bool passed = !admissible && !load->dual->can->exact;
    uz_status status = admissible || passed ? UZ_OK : uz_dual_load_apply(load, it->Dr, it->r, err);
    memcpy(it->rho, it->r, (size_t)it->m * sizeof *it->r);
    memcpy(it->Drho, it->Dr, (size_t)it->m * sizeof *it->Dr);
    it->tau = 1.0;
    it->step_norm = NAN;
    it->fresh = false;
    it->iteration++;
    return status == UZ_OK && !passed ? uz_iterate_bound(it, load, by, err) : status;
}

uz_status uz_iterate_record(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                            double step_norm, bool restart, uz_error *err)
{
    uz_history_row row = {.iteration = it->iteration, .step_norm = step_norm, .restart = restart};
    const double *g0 = load->g0, *scale = load->dual->row_scale;
    const uz_csc *N = load->dual->touched;
    double norm2, e1 = 0.0, e2 = 0.0, e4 = 0.0, *difference = it->r_next, *penetration = it->gamma;
    uz_dual_load_energies(load, &row.dual_objective, &norm2, it->r, it->Dr);
    /* The paper's residual of the pair (u(rho(k)), r(k)): e1 = N'(rho - r), e3 = 0. */
    for (int64_t i = 0; i < it->m; i++) {
        double gap = g0[i] - it->Drho[i], complementarity = gap * it->r[i];
        difference[i] = it->rho[i] - it->r[i];
        penetration[i] = gap;
        e4 += complementarity * complementarity;
    }
    it->law->kind->penetration(it->law, penetration, penetration, it->m);
    for (int64_t i = 0; i < it->m; i++)
        e2 += (penetration[i] / scale[i]) * (penetration[i] / scale[i]);
    for (int64_t j = 0; j < N->cols; j++) { /* as a force on the dofs */
        double force = 0.0;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            force += N->val[k] * difference[N->idx[k]];
        e1 += force * force;
    }
    uz_residual *e = &row.residual;
    e->e1 = sqrt(e1);
    e->e2 = sqrt(e2);
    e->e4 = sqrt(e4);
    e->total = sqrt(e->e1 * e->e1 + e2 + e4);
    row.contacts = it->law->kind->active(it->law, NULL, it->r, it->m);
    row.error_bound = it->best_bound;
    row.seconds = uz_seconds() - it->started;
    uz_status status = uz_history_append(history, &row, err);
    if (status == UZ_OK && options->hooks && options->hooks->progress)
        options->hooks->progress(options->hooks->ctx, &row);
    return status;
}

uz_status uz_iterate_begin(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                           uz_error *err)
{
    it->started = uz_seconds();
    uz_status status = uz_dual_load_apply(load, it->Dr, it->r, err);
    memcpy(it->rho, it->r, (size_t)it->m * sizeof *it->r);
    memcpy(it->Drho, it->Dr, (size_t)it->m * sizeof *it->Dr);
    if (status == UZ_OK)
        status = uz_iterate_bound(it, load, UZ_METHOD_ACCELERATED_RESTART, err);
    it->begun = it->fresh = true;
    return status == UZ_OK ? uz_iterate_record(it, load, options, history, 0.0, false, err) : status;
}

void uz_iterate_go_back(uz_iterate *it)
{
    size_t bytes = (size_t)it->m * sizeof *it->r;
    if (isfinite(it->best_bound))
        memcpy(it->r, it->best_r, bytes);
    else
        memset(it->r, 0, bytes);
    memcpy(it->anchor, it->r, bytes);
    it->tau = 1.0;
    it->step_norm = NAN;
    it->fresh = false;
}

bool uz_should_stop(uz_end *end, const uz_iterate *it, const uz_method_options *options)
{
    if (uz_cancelled(options->hooks))
        *end = UZ_END_CANCELLED;
    else if (it->iteration >= options->max_iterations)
        *end = UZ_END_ITERATIONS;
    else if (uz_seconds() >= options->deadline)
        *end = UZ_END_TIME;
    else
        return false;
    return true;
}

void uz_iterate_swap(double **a, double **b)
{
    double *t = *a;
    *a = *b;
    *b = t;
}

enum { APPLICATIONS = 4 };

/* s'Ds <= s'W^-2 s / alpha for s = r(k+1) - rho? Of Dr(k+1) and of the two that Drho combines what inner iterations may
 * have left is taken off, and what one that was carried along misses: alpha is within 1e-4 of the longest, and much
 * less than that would look like a step too long.
 */
bool uz_iterate_shorten(uz_iterate *it, const uz_dual_load *load)
{
    double curvature = 0.0, square = 0.0, size = 0.0;
    for (int64_t i = 0; i < it->m; i++) {
        double s = it->r_next[i] - it->rho[i], w = it->weight ? it->weight[i] : 1.0;
        curvature += s * (it->Dr_next[i] - it->Drho[i]);
        square += (s / w) * (s / w);
        size += (it->r_next[i] / w) * (it->r_next[i] / w);
    }
    curvature -= (APPLICATIONS * load->left + it->missed) * sqrt(square / it->alpha);
    bool noise = square <= 1e-20 * size; /* differences of this size are rounding, not curvature */
    if (noise || !(it->alpha * curvature > square * (1.0 + 1e-6))) /* nor where it is NaN: no step size follows */
        return false;
    uz_iterate_set_alpha(it, 0.9 * square / curvature);
    memcpy(it->rho, it->r, (size_t)it->m * sizeof *it->r);
    memcpy(it->Drho, it->Dr, (size_t)it->m * sizeof *it->Dr);
    it->tau = 1.0;
    return true;
}
