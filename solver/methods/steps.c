/* steps.c: the loop around the steps of a method that applies D once per iteration: where bounds are due, when it ends,
 * and the search for rays. */
#include "methods/iterate.h"
#include "methods/steps.h"

#include "certificate/infeasible.h"
#include "dual/ray.h"

#include <float.h>
#include <math.h>
#include <string.h>

static bool should_end(uz_end *end, const uz_iterate *it, const uz_dual_load *load, const uz_method_options *options,
                       double step_norm)
{
    const bool started = it->iteration > 0, paper = options->stopping == UZ_STOP_PAPER;
    const double *scale = load->dual->row_scale;
    if (paper && started && step_norm <= options->epsilon) {
        *end = UZ_END_PAPER;
        return true;
    }
    if (!paper && it->best_relative <= options->target) {
        *end = UZ_END_TARGET;
        return true;
    }
    if (uz_should_stop(end, it, options))
        return true;
    if (paper || !started)
        return false;
    /* step_norm is in the units of the problem's own rows, r in those of the scaled ones. */
    double size = 0.0;
    for (int64_t i = 0; i < it->m; i++)
        size += scale[i] * it->r[i] * (scale[i] * it->r[i]);
    const int64_t patience = it->best_iteration / 2 + 4000;
    const bool stalled = step_norm <= 4.0 * DBL_EPSILON * sqrt(size) ||
                         (isfinite(it->best_bound) && it->iteration - it->best_iteration > patience);
    if (stalled)
        *end = UZ_END_STALLED;
    return stalled;
}

static uz_status try_ray(bool *found, uz_iterate *it, uz_dual_load *load, uz_error *err)
{
    const uz_csc *N = &load->dual->N;
    uz_status status = uz_ray_project(it->ray, N, err);
    *found = status == UZ_OK && uz_ray_is_likely(it->ray, N, load->h, load->g0, it->gamma);
    return status;
}

/* The answer of the paper's rule is its last r, good or bad; otherwise the last r may still be the best. */
static uz_status finish(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                        uz_error *err)
{
    /* The bound of a run's last answer is out of turn: a run that goes on from there as if it had not ended must not
     * know it. */
    uz_best *before = &it->before;
    before->kept = true;
    before->bound = it->best_bound;
    before->relative = it->best_relative;
    before->iteration = it->best_iteration;
    before->made_by = it->made_by;
    memcpy(before->r, it->best_r, (size_t)it->m * sizeof *it->r);
    if (options->stopping == UZ_STOP_PAPER)
        it->best_bound = INFINITY;
    /* where D r is carried along the bound is with the one that an apply gives, and the run goes on with its own */
    const bool carried = uz_method_kind_of(options->method)->steps->settle != NULL;
    const bool bounded = carried && isfinite(it->best_bound) && it->best_iteration == it->iteration;
    uz_status status = carried && !bounded ? uz_dual_load_apply(load, it->Dr_next, it->r, err) : UZ_OK;
    if (carried && !bounded)
        uz_iterate_swap(&it->Dr, &it->Dr_next);
    if (status == UZ_OK && !bounded)
        status = uz_iterate_bound(it, load, options->method, err);
    if (carried && !bounded)
        uz_iterate_swap(&it->Dr, &it->Dr_next);
    if (isinf(it->best_bound)) /* nothing could be bounded: the last r is as good as any */
        memcpy(it->best_r, it->r, (size_t)it->m * sizeof *it->r);
    if (history->count > 0) /* none in a run that continued another and ended at once */
        history->rows[history->count - 1].error_bound = it->best_bound;
    return status;
}

/* A start with reactions may be the solution: it is bounded before anything is prepared. alpha = 1 / lambda_max(D)
 * where the user gave none. A run that is told to stop before lambda_max is known has no alpha: who goes on with it
 * chooses. */
uz_status uz_steps_begin(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                         uz_error *err)
{
    const uz_stop stop = {options->hooks, options->deadline};
    double lambda = 0.0;
    uz_status status = UZ_OK;
    if (!it->begun && it->warm) {
        status = uz_iterate_begin(it, load, options, history, err);
        if (status == UZ_OK && options->stopping == UZ_STOP_CERTIFIED && it->best_relative <= options->target)
            return UZ_OK;
    }
    if (status == UZ_OK)
        status = uz_dual_load_prepare(load, err);
    if (status == UZ_OK && !(it->alpha > 0.0))
        status = uz_dual_load_lambda_max(load, &lambda, it->weight != NULL, err);
    if (status == UZ_OK && it->alpha <= 0.0 && (lambda > 0.0 || !uz_stop_is_due(&stop)))
        uz_iterate_set_alpha(it, lambda > 0.0 ? 1.0 / lambda : 1.0);
    if (status == UZ_OK && !it->begun)
        return uz_iterate_begin(it, load, options, history, err);
    /* Before D was prepared it was applied by its factors, which rounds otherwise: a state's best answer gets the
     * correction that it had in the run that found it. Its numbers stay those of the state. */
    if (status == UZ_OK && it->resumed && isfinite(it->best_bound) && it->made_by != UZ_METHOD_ACTIVE_SET &&
        it->made_by != UZ_METHOD_DUAL_ACTIVE_SET) {
        const double bound = it->best_bound, relative = it->best_relative;
        const int64_t iteration = it->best_iteration;
        status = uz_iterate_bound_best(it, load, err);
        it->best_bound = bound;
        it->best_relative = relative;
        it->best_iteration = iteration;
    }
    it->resumed = false;
    /* r may have been changed by another engine, and preparing overwrites what the last apply left */
    if (status == UZ_OK && !it->fresh) {
        status = uz_dual_load_apply(load, it->Dr, it->r, err);
        if (it->tau == 1.0) {
            memcpy(it->rho, it->r, (size_t)it->m * sizeof *it->r);
            memcpy(it->Drho, it->Dr, (size_t)it->m * sizeof *it->Dr);
        }
    }
    if (status == UZ_OK && it->warm && it->iteration == 0) /* with the step size it may be bounded better */
        status = uz_iterate_bound(it, load, options->method, err);
    return status;
}

uz_status uz_steps_run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                       uz_history *history, uz_error *err)
{
    const uz_steps *steps = uz_method_kind_of(options->method)->steps;
    bool restart = false, ray = false;
    double *rho, *Drho;
    uz_status status = UZ_OK;
    it->before.kept = false;
    while (status == UZ_OK && !ray && !should_end(end, it, load, options, it->step_norm)) {
        it->fresh = false;
        status = steps->step(steps, it, load, &it->step_norm, &restart, err);
        /* A conjugate step may have gone along a ray: so far that what is bounded afterwards is rounding. */
        if (status == UZ_OK && it->along_ray && isinf(it->best_bound))
            status = try_ray(&ray, it, load, err);
        it->along_ray = false;
        const bool due = options->stopping == UZ_STOP_CERTIFIED && it->iteration >= it->next_check;
        if (status == UZ_OK && steps->settle)
            status = steps->settle(it, load, due, err);
        if (status == UZ_OK && due) {
            status = uz_iterate_bound(it, load, options->method, err);
            /* bounds cost about one iteration; a check at every sixteenth of the way adds 6 % and overshoots by 6 % */
            it->next_check = it->iteration + (it->iteration < 16 ? 1 : it->iteration / 16);
        }
        /* Contradicting rows leave no feasible displacement, so nothing is ever bounded, and the reactions grow along a
         * ray. Looked for at powers of two, from the growth since the last one. */
        const bool power_of_two = it->iteration >= 8 && (it->iteration & (it->iteration - 1)) == 0;
        if (status == UZ_OK && !ray && !isfinite(it->best_bound) && power_of_two) {
            for (int64_t i = 0; i < it->m; i++)
                it->ray[i] = it->r[i] - it->anchor[i];
            memcpy(it->anchor, it->r, (size_t)it->m * sizeof *it->r);
            status = try_ray(&ray, it, load, err);
        }
        rho = it->rho;
        Drho = it->Drho;
        if (steps->rho_is_r) { /* the row is that of (u(r), r) */
            it->rho = it->r;
            it->Drho = it->Dr;
        }
        if (status == UZ_OK)
            status = uz_iterate_record(it, load, options, history, it->step_norm, restart, err);
        it->rho = rho;
        it->Drho = Drho;
    }
    if (ray)
        *end = UZ_END_RAY;
    return status == UZ_OK ? finish(it, load, options, history, err) : status;
}
