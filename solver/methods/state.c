/* state.c: a run's iterate as something to keep and go on from.
 *
 * Rows here are scaled by powers of two (dual.h); those of a state are the caller's, and the scaling is exact, so that
 * what comes back is bit for bit what went out. */
#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <string.h>

void uz_state_free(uz_state *state)
{
    if (!state)
        return;
    uz_free_all(state->r, state->rho, state->Dr, state->Drho, state->best_r, state->anchor, state);
}

/* Lengths of the rows to scaled ones, and scaled forces back: to = from x scale. The other way by dividing. */
static void rescale(double *to, const double *from, const double *scale, int64_t m, bool divide)
{
    for (int64_t i = 0; i < m; i++)
        to[i] = divide ? from[i] / scale[i] : scale[i] * from[i];
}

uz_status uz_state_check(const uz_state *s, int64_t m, uz_error *err)
{
    if (s->m != m)
        return uz_fail(err, UZ_ERR_SIZE, "start", "the start has %lld rows, the problem %lld", (long long)s->m,
                       (long long)m);
    if (!s->r || (s->rho && !(s->Dr && s->Drho && s->best_r && s->anchor)))
        return uz_fail(err, UZ_ERR_ARGUMENT, "start", "the start lacks some of its vectors");
    const double *vectors[] = {s->r, s->rho, s->Dr, s->Drho, s->best_r, s->anchor};
    const char *const names[] = {"r", "rho", "D r", "D rho", "best r", "anchor"};
    for (int k = 0; k < (s->rho ? 6 : 1); k++)
        for (int64_t i = 0; i < m; i++)
            if (!isfinite(vectors[k][i]))
                return uz_fail(err, UZ_ERR_NOT_FINITE, "start", "the start's %s(%lld) is not a finite number (from 1)",
                               names[k], (long long)i + 1);
    const bool counts = s->iteration >= 0 && s->restarts >= 0 && s->next_check >= 0 && s->best_iteration >= 0 &&
                        s->phase_end >= 0 && s->phase >= 0;
    const bool sizes = s->alpha >= 0.0 && isfinite(s->alpha) && s->tau >= 1.0 && isfinite(s->tau) &&
                       s->best_bound >= 0.0 && s->best_relative >= 0.0;
    if (s->rho && !(counts && sizes))
        return uz_fail(err, UZ_ERR_ARGUMENT, "start",
                       "the start's counts, alpha, tau or bounds can't be those of a run");
    return UZ_OK;
}

/* How far what another problem's state says may be from what this problem gives: far above rounding, as D r made by the
 * active set is g0 - g, and far below what another load or body makes of it. */
#define SAME 1e-5
/* A bound, relative to the answer's energy norm, that may be rounding alone: 3e-11 was seen on a slender column. */
#define ROUNDING 1e-9

static uz_status restore(bool *same, uz_iterate *it, uz_dual_load *load, const uz_state *s, uz_error *err)
{
    const double *scale = load->dual->row_scale;
    rescale(it->r, s->r, scale, it->m, true);
    rescale(it->rho, s->rho, scale, it->m, true);
    rescale(it->best_r, s->best_r, scale, it->m, true);
    rescale(it->anchor, s->anchor, scale, it->m, true);
    rescale(it->Dr, s->Dr, scale, it->m, false);
    rescale(it->Drho, s->Drho, scale, it->m, false);
    /* of a state whose steps were those of other rows, it is no step size */
    if (s->alpha > 0.0 && s->as_given == (it->weight || !load->dual->row_weight))
        uz_iterate_set_alpha(it, fmin(DBL_MAX, fmax(DBL_MIN, s->alpha / it->unit / it->unit)));
    it->tau = s->tau;
    it->step_norm = s->step_norm;
    it->iteration = s->iteration;
    it->restarts = s->restarts;
    it->next_check = s->next_check;
    it->phase = s->phase;
    it->phase_end = s->phase_end;
    uz_status status = uz_dual_load_apply(load, it->Dr_next, it->r, err);
    double size = 0.0, difference = 0.0;
    for (int64_t i = 0; i < it->m; i++) {
        size = fmax(size, fabs(it->Dr[i]));
        difference = fmax(difference, fabs(it->Dr[i] - it->Dr_next[i]));
    }
    *same = status == UZ_OK && difference <= SAME * size;
    /* A state does not have the correction of its best answer: it is made again, and its bound with it. What rounding
     * alone leaves of a bound is another number each time: the larger one is kept, so that a state of nearly the same
     * load never passes for the answer. */
    double bound = s->best_bound, relative = s->best_relative;
    if (*same && !isinf(bound)) {
        it->made_by = s->made_by;
        status = uz_iterate_bound_best(it, load, err);
        const bool equal = it->best_bound <= (1.0 + 1e-3) * bound && bound <= (1.0 + 1e-3) * it->best_bound;
        *same = equal || (it->best_relative <= ROUNDING && relative <= ROUNDING);
        bound = equal ? bound : fmax(bound, it->best_bound);
        relative = equal ? relative : fmax(relative, it->best_relative);
    }
    if (status != UZ_OK || !*same)
        return status;
    it->best_bound = bound;
    it->best_relative = relative;
    it->best_iteration = s->best_iteration;
    it->made_by = s->made_by;
    it->begun = it->fresh = it->resumed = true;
    return UZ_OK;
}

uz_status uz_iterate_start(uz_iterate *it, uz_dual_load *load, const uz_state *start, uz_error *err)
{
    double alpha = it->alpha;
    bool same = false;
    uz_status status = uz_state_check(start, it->m, err);
    it->started = uz_seconds();
    if (status == UZ_OK && start->rho)
        status = restore(&same, it, load, start, err);
    if (status == UZ_OK && !same) { /* nothing but the reactions */
        for (int64_t i = 0; i < it->m; i++)
            it->r[i] = start->r[i] / load->dual->row_scale[i];
        it->law->kind->project(it->law, it->r, it->m);
        if (it->law->kind->active(it->law, NULL, it->r, it->m) > 0)
            it->warm = true;
        memset(it->anchor, 0, (size_t)it->m * sizeof *it->anchor);
        memset(it->best_r, 0, (size_t)it->m * sizeof *it->best_r);
        uz_iterate_set_alpha(it, alpha);
        it->tau = 1.0;
        it->step_norm = NAN;
        it->best_bound = it->best_relative = INFINITY;
        it->iteration = it->restarts = it->next_check = it->best_iteration = it->phase_end = 0;
        it->phase = 0;
    }
    it->origin = same ? UZ_FROM_STATE : UZ_FROM_REACTIONS;
    return status;
}

uz_status uz_iterate_state(uz_state **out, const uz_iterate *it, const uz_dual_load *load, uz_method method,
                           uz_error *err)
{
    *out = NULL;
    const uz_best *before = &it->before;
    const double *scale = load->dual->row_scale;
    uz_state *s = uz_alloc_zero(1, sizeof *s);
    if (!s)
        return uz_no_memory(err, "a state");
    s->r = uz_alloc(it->m, sizeof *s->r);
    s->rho = uz_alloc(it->m, sizeof *s->rho);
    s->Dr = uz_alloc(it->m, sizeof *s->Dr);
    s->Drho = uz_alloc(it->m, sizeof *s->Drho);
    s->best_r = uz_alloc(it->m, sizeof *s->best_r);
    s->anchor = uz_alloc(it->m, sizeof *s->anchor);
    if (!s->r || !s->rho || !s->Dr || !s->Drho || !s->best_r || !s->anchor) {
        uz_state_free(s);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the state of %lld contacts", (long long)it->m);
    }
    rescale(s->r, it->r, scale, it->m, false);
    rescale(s->rho, it->rho, scale, it->m, false);
    rescale(s->best_r, before->kept ? before->r : it->best_r, scale, it->m, false);
    rescale(s->anchor, it->anchor, scale, it->m, false);
    rescale(s->Dr, it->Dr, scale, it->m, true);
    rescale(s->Drho, it->Drho, scale, it->m, true);
    s->m = it->m;
    s->alpha = uz_iterate_alpha(it);
    s->as_given = it->weight || !load->dual->row_weight;
    s->tau = it->tau;
    s->step_norm = it->step_norm;
    s->iteration = it->iteration;
    s->restarts = it->restarts;
    s->next_check = it->next_check;
    s->phase = it->phase;
    s->phase_end = it->phase_end;
    s->best_bound = before->kept ? before->bound : it->best_bound;
    s->best_relative = before->kept ? before->relative : it->best_relative;
    s->best_iteration = before->kept ? before->iteration : it->best_iteration;
    s->made_by = before->kept ? before->made_by : it->made_by;
    s->method = method;
    *out = s;
    return UZ_OK;
}
