/* conjugate.c: projected conjugate gradients on the dual, one application of D per iteration.
 *
 * On the rows that press psi is maximized by conjugate gradients: the factor of the last direction and the
 * length of the step are the best ones, where Algorithm 2 has a fixed step and a momentum that grows with k. Where the
 * bounds come in the way, that point is the extrapolated rho from which a projected step is made, as in Algorithm 2:
 *
 *     tau = 1, rho = r   a plain step: r+ = P(r + alpha g)
 *     tau = 1 otherwise  the step ended at a bound: r+ = P(rho), unless psi(r) is better: then rho = r
 *     tau = 2            a conjugate step; r - rho is the last one's direction, 0: there is none
 *
 * psi never decreases, but by rounding. Rows come into contact by plain steps, when what they ask for is more than what
 * is left on the rows that press.
 *
 * Sources: Dostal and Schoeberl, Comput. Optim. Appl. 30 (2005) (MPRGP; the test of proportion, Gamma = 1); More and
 * Toraldo, SIAM J. Optim. 1 (1991) (projected steps of conjugate gradients); Kruzik, Horak, Cermak, Pospisil, Pecha,
 * Adv. Eng. Softw. 149 (2020) (the projected step where a bound is met); van der Vorst and Ye, SIAM J. Sci. Comput. 22
 * (2000) (D r made again now and then). */
#include "methods/iterate.h"
#include "methods/kinds.h"
#include "methods/steps.h"

#include <math.h>
#include <string.h>

/* A direction along which psi curves by less than this part of lambda_max has no curvature, only rounding. */
#define FLAT 1e-14
/* Along which reactions only grow, with less curvature than this: looked at as a ray. */
#define RAY 1e-8
/* A direction must rise by this part of what the gradient alone would: rounding, or a rho that another method left, may
 * have made it a bad one. */
#define RISE 1e-2

/* Iterations after which D r is made again; and when it may miss so many times what an application leaves. */
enum { SETTLED_FOR = 64, SETTLED_AT = 4 };

/* Where there is no direction to go on from. */
static void forget(uz_iterate *it)
{
    memcpy(it->rho, it->r, (size_t)it->m * sizeof *it->r);
    memcpy(it->Drho, it->Dr, (size_t)it->m * sizeof *it->Dr);
    it->tau = 1.0;
}

static void make_gaps(uz_iterate *it, const uz_dual_load *load)
{
    const double *g0 = load->g0;
    for (int64_t i = 0; i < it->m; i++)
        it->gamma[i] = g0[i] - it->Dr[i];
}

/* The direction (r_next): the gradient on the rows that press, in the metric of their weights, made conjugate to the
 * last step. Returns gamma'd. */
static double make_direction(uz_iterate *it)
{
    const double *weight = it->weight;
    double curvature = 0.0, cross = 0.0, rise = 0.0, gradient = 0.0, *d = it->r_next;
    const bool *presses = it->close;
    it->law->kind->active(it->law, it->close, it->r, it->m);
    for (int64_t i = 0; i < it->m; i++) {
        double w = weight ? weight[i] : 1.0, g = w * it->gamma[i];
        d[i] = presses[i] ? w * g : 0.0;
        if (presses[i]) {
            curvature += (it->r[i] - it->rho[i]) * (it->Dr[i] - it->Drho[i]);
            cross += d[i] * (it->Dr[i] - it->Drho[i]);
            gradient += g * g;
        }
    }
    double beta = curvature > 0.0 ? -cross / curvature : 0.0;
    for (int64_t i = 0; i < it->m; i++) {
        d[i] += presses[i] ? beta * (it->r[i] - it->rho[i]) : 0.0;
        rise += it->gamma[i] * d[i];
    }
    if (rise > RISE * gradient)
        return rise;
    for (int64_t i = 0; i < it->m; i++)
        d[i] = !presses[i] ? 0.0 : weight ? weight[i] * weight[i] * it->gamma[i] : it->gamma[i];
    return gradient;
}

/* Along d by the length that maximizes psi; true: it goes beyond `bound`, where the first row stops to press. Along
 * what is flat the step goes beyond the bound, unless what curvature there is says less; without a bound it goes as far
 * as a plain one: rise / curvature would be the quotient of two roundings. near: the length along d of the point that D
 * was applied to, of which `left` is missing: D r of another point has as much more of it as that is farther. */
static bool take_direction(uz_iterate *it, double rise, double near, double left)
{
    const double *d = it->r_next, *Dd = it->Dr_next;
    double curvature = 0.0, square = 0.0, bound = INFINITY, *reach = it->gamma; /* how far each row can go */
    it->law->kind->reach(it->law, reach, it->r, d, it->m);
    for (int64_t i = 0; i < it->m; i++) {
        const double part = it->weight ? d[i] / it->weight[i] : d[i];
        curvature += d[i] * Dd[i];
        square += part * part;
        if (reach[i] < bound)
            bound = reach[i];
    }
    it->along_ray = isinf(bound) && it->alpha * curvature <= RAY * square;
    if (it->along_ray)
        memcpy(it->ray, d, (size_t)it->m * sizeof *d);
    double length = curvature > 0.0 ? fmin(rise / curvature, 2.0 * bound) : 2.0 * bound;
    if (it->alpha * curvature > FLAT * square)
        length = rise / curvature;
    else if (isinf(bound))
        length = it->alpha;
    const double taken = fmin(length, bound), share = taken / near;
    const bool beyond = length > bound;
    for (int64_t i = 0; i < it->m; i++) {
        double r = it->r[i], Dr = it->Dr[i];
        bool stops = beyond && reach[i] <= bound;
        it->r[i] = stops ? 0.0 : r + taken * d[i];
        it->Dr[i] = Dr + taken * Dd[i];
        it->rho[i] = beyond ? r + length * d[i] : r;
        it->Drho[i] = beyond ? Dr + length * Dd[i] : Dr;
    }
    it->law->kind->project(it->law, it->r, it->m);
    it->tau = beyond ? 1.0 : 2.0;
    it->length = taken;
    it->missed = fabs(1.0 - share) * it->missed + share * left;
    return beyond;
}

/* Of points that D r is carried along from. */
static uz_status apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    load->carried = true;
    const uz_status status = uz_dual_load_apply(load, Dr, r, err);
    load->carried = false;
    return status;
}

/* The step to r_next, plain or to rho: not taken, true, where it is too long, or where it led down. */
static bool leave_projection(uz_iterate *it, const uz_dual_load *load, bool plain)
{
    const double *g0 = load->g0;
    double gain = 0.0; /* psi(r_next) - psi(r) */
    for (int64_t i = 0; i < it->m; i++)
        gain += (it->r_next[i] - it->r[i]) * (g0[i] - 0.5 * (it->Dr_next[i] + it->Dr[i]));
    bool taken = plain ? !uz_iterate_shorten(it, load) : gain >= 0.0;
    if (taken) {
        uz_iterate_swap(&it->r, &it->r_next);
        uz_iterate_swap(&it->Dr, &it->Dr_next);
        it->missed = load->left;
    }
    forget(it);
    it->tau = taken ? 2.0 : 1.0;
    return !taken;
}

/* *step_norm: ||r - P(r + alpha g)|| at the new r, in the caller's forces: the paper's ||rho - r|| where rho is r.
 * *restart: a direction was given up, or a step was not taken. */
static uz_status step(const uz_steps *steps, uz_iterate *it, uz_dual_load *load, double *step_norm, bool *restart,
                      uz_error *err)
{
    (void)steps;
    make_gaps(it, load);
    *restart = false;
    if (it->tau > 1.0) {
        /* Is there more to be had from rows that should come into contact than from those that press? Of the latter
         * only what a plain step would leave them counts (the reduced free gradient). */
        double asked = 0.0, left = 0.0;
        it->law->kind->active(it->law, it->close, it->r, it->m);
        it->law->kind->penetration(it->law, it->r_next, it->gamma, it->m);
        for (int64_t i = 0; i < it->m; i++) {
            const double w = it->weight ? it->weight[i] : 1.0, g = w * it->gamma[i], depth = w * it->r_next[i];
            if (it->close[i])
                left += g * fmin(g, w * (-it->r[i] / it->step[i]));
            else
                asked += depth * depth;
        }
        *restart = !(left > 0.0) || asked > left;
    }
    if (*restart)
        forget(it);
    const bool along = it->tau > 1.0, plain = !along && memcmp(it->rho, it->r, (size_t)it->m * sizeof *it->r) == 0;
    /* D d. Inner iterations start from the last response and see to the size of the change: they are given a point near
     * r, the last step's length away, or a plain one's: about where this one ends, as D r of its end is what they left
     * there times the quotient of the lengths. Where D is exact the difference of two points would only lose digits. */
    const bool near = along && !load->dual->can->exact;
    const double away = it->length > 0.0 ? it->length : it->alpha;
    const double rise = along ? make_direction(it) : 0.0;
    for (int64_t i = 0; !along && i < it->m; i++)
        it->r_next[i] = it->rho[i] + (plain ? it->step[i] * it->gamma[i] : 0.0);
    if (!along)
        it->law->kind->project(it->law, it->r_next, it->m);
    for (int64_t i = 0; near && i < it->m; i++)
        it->gamma[i] = it->r[i] + away * it->r_next[i];
    uz_status status = apply(load, it->Dr_next, near ? it->gamma : it->r_next, err);
    for (int64_t i = 0; near && status == UZ_OK && i < it->m; i++)
        it->Dr_next[i] = (it->Dr_next[i] - it->Dr[i]) / away;
    if (status == UZ_OK)
        *restart =
            (along ? take_direction(it, rise, away, near ? load->left : 0.0) : leave_projection(it, load, plain)) ||
            *restart;
    it->iteration++;
    it->restarts += *restart;
    make_gaps(it, load);
    *step_norm = it->law->kind->residual(it->law, it->r, it->gamma, it->step, load->dual->row_scale, it->m);
    return status;
}

/* Applies D to r: where a bound is `due`, which is of the r of the last apply, and every so often, as D r is carried
 * along from the directions and gathers rounding, and of inner iterations what they leave. */
static uz_status settle(uz_iterate *it, uz_dual_load *load, bool due, uz_error *err)
{
    if (!due && it->iteration % SETTLED_FOR != 0 && !(it->missed > SETTLED_AT * load->left))
        return UZ_OK;
    const uz_status status = apply(load, it->Dr, it->r, err);
    it->missed = load->left;
    return status;
}

static const uz_steps steps = {.step = step, .settle = settle, .rho_is_r = true};

const uz_method_kind uz_method_conjugate = {.method = UZ_METHOD_CONJUGATE,
                                            .name = "conjugate",
                                            .one_sided = true,
                                            .exact = true,
                                            .run = uz_steps_run,
                                            .steps = &steps};
