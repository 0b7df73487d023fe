/* gradient.c: projected gradient steps on the dual: Kanno's Algorithm 1 (uzawa) and Algorithm 2 (accelerated, with and
 * without restart), with the corrections of the design: tau from 1 + 4 tau^2, rho from r(k+1).
 *
 * D is applied once per iteration, to r(k+1); D rho follows from D r(k+1) and D r(k), rho being their combination. */
#include "methods/iterate.h"
#include "methods/kinds.h"
#include "methods/steps.h"

#include <math.h>

/* A projected gradient step from rho, r(k+1) = P(rho + alpha gamma), then the next rho. */
static uz_status step(const uz_steps *steps, uz_iterate *it, uz_dual_load *load, double *step_norm, bool *restart,
                      uz_error *err)
{
    const double *g0 = load->g0, *scale = load->dual->row_scale;
    double square = 0.0;
    for (int64_t i = 0; i < it->m; i++) {
        it->gamma[i] = g0[i] - it->Drho[i];
        it->r_next[i] = it->rho[i] + it->step[i] * it->gamma[i];
    }
    it->law->kind->project(it->law, it->r_next, it->m);
    for (int64_t i = 0; i < it->m; i++) {
        const double length = scale[i] * (it->rho[i] - it->r_next[i]);
        square += length * length;
    }
    *step_norm = sqrt(square);
    uz_status status = uz_dual_load_apply(load, it->Dr_next, it->r_next, err);
    it->iteration++;
    *restart = status == UZ_OK && uz_iterate_shorten(it, load);
    if (status != UZ_OK)
        return status;
    if (*restart) {
        it->restarts++;
        *step_norm = NAN; /* no step was taken */
        return uz_dual_load_apply(load, it->Dr, it->r, err);
    }
    double tau = 0.5 * (1.0 + sqrt(1.0 + 4.0 * it->tau * it->tau)), omega = (it->tau - 1.0) / tau, ascent = 0.0;
    for (int64_t i = 0; i < it->m; i++)
        ascent += it->gamma[i] * (it->r_next[i] - it->r[i]);
    *restart = steps->restarts && ascent < 0.0; /* the momentum is dropped (O'Donoghue and Candes 2015) */
    if (!steps->momentum || *restart)
        omega = 0.0;
    for (int64_t i = 0; i < it->m; i++) {
        it->rho[i] = it->r_next[i] + omega * (it->r_next[i] - it->r[i]);
        it->Drho[i] = it->Dr_next[i] + omega * (it->Dr_next[i] - it->Dr[i]);
    }
    it->tau = *restart ? 1.0 : tau;
    uz_iterate_swap(&it->r, &it->r_next);
    uz_iterate_swap(&it->Dr, &it->Dr_next);
    it->restarts += *restart;
    return UZ_OK;
}

static const uz_steps plain = {.step = step}, accelerated = {.step = step, .momentum = true},
                      restarted = {.step = step, .momentum = true, .restarts = true};

const uz_method_kind uz_method_uzawa = {
    .method = UZ_METHOD_UZAWA, .name = "uzawa", .as_given = true, .run = uz_steps_run, .steps = &plain};
const uz_method_kind uz_method_accelerated = {.method = UZ_METHOD_ACCELERATED,
                                              .name = "accelerated",
                                              .as_given = true,
                                              .run = uz_steps_run,
                                              .steps = &accelerated};
const uz_method_kind uz_method_accelerated_restart = {.method = UZ_METHOD_ACCELERATED_RESTART,
                                                      .name = "accelerated_restart",
                                                      .as_given = true,
                                                      .run = uz_steps_run,
                                                      .steps = &restarted};
