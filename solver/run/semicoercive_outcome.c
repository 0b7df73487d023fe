/* semicoercive_outcome.c: what a semicoercive solve leaves behind, or why it is refused. */
#include "certificate/bound.h"
#include "certificate/certificate.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "assembly/pressed.h"
#include "run/quantities.h"
#include "run/semicoercive_private.h"
#include "run/setup_cache.h"
#include "methods/milestones.h"
#include "run/results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The null space of matrices is known by iterations on a factor: its rounding allows no more. */
#define BALANCED 1e-7

uz_status uz_semi_norms(double *norm, double *augmented, const uz_semi *s, double error, uz_error *err)
{
    const uz_csc *K = s->of.K;
    const double *u = s->last->u, *g = s->last->g;
    double energy = 0.0, springs = 0.0, whole;
    for (int64_t j = 0; j < s->d; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            energy += (K->idx[q] == j ? 1.0 : 2.0) * K->val[q] * u[j] * u[K->idx[q]];
    for (int64_t i = 0; i < s->m; i++)
        springs += s->weight[i] * (s->of.h[i] - g[i]) * (s->of.h[i] - g[i]);
    *norm = sqrt(fmax(0.0, energy));
    *augmented = sqrt(fmax(0.0, energy) + springs);
    if (!s->is_scene)
        return UZ_OK;
    /* of matrices what a fall leaves by rounding can't be told from strain */
    uz_status status = uz_whole_norm(&whole, &s->model, u, s->prescribed, err);
    const bool moved = status == UZ_OK && uz_is_moved(&s->model, s->prescribed);
    const bool loaded = moved && uz_is_loaded(&s->model, &s->problem->scene);
    *norm = moved ? uz_bound_reference(whole, *norm, error, loaded ? UZ_ACTING_LOADS : UZ_ACTING_NOTHING) : whole;
    return status;
}

/* The dofs that the motion moves most: "dof 7 (+1), dof 3 (-0.5)". */
static void name_dofs(char *text, size_t size, const double *z, int64_t d)
{
    int64_t named[4] = {0};
    double largest = 0.0;
    size_t at = 0;
    text[0] = '\0';
    for (int n = 0; n < 4; n++) {
        int64_t best = -1;
        for (int64_t j = 0; j < d; j++) {
            bool taken = false;
            for (int k = 0; k < n; k++)
                taken = taken || named[k] == j;
            if (!taken && (best < 0 || fabs(z[j]) > fabs(z[best])))
                best = j;
        }
        if (best < 0 || fabs(z[best]) <= 1e-6 * largest)
            break;
        named[n] = best;
        largest = fmax(largest, fabs(z[best]));
        at += (size_t)snprintf(text + at, size - at, "%sdof %lld (%+.3g)", n ? ", " : "", (long long)best,
                               z[best] / largest);
    }
}

uz_status uz_semi_check_pressed(const uz_semi *s, bool strict, uz_error *err)
{
    uz_pressing how = UZ_PRESSED_ON;
    char dofs[200] = "";
    if (s->is_scene)
        return uz_check_pressed(&s->model, s->of.p, err);
    if (!s->Z)
        return UZ_OK;
    double *y = uz_alloc_zero(s->k, sizeof *y), *z = uz_alloc_zero(s->d, sizeof *z);
    uz_status status = y && z ? uz_load_on_modes(&how, y, s->Z, s->k, s->of.N, s->of.p, BALANCED, strict, err)
                              : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld null vectors", (long long)s->k);
    if (status == UZ_OK && how != UZ_PRESSED_ON) {
        for (int64_t c = 0; c < s->k; c++)
            for (int64_t j = 0; j < s->d; j++)
                z[j] += y[c] * s->Z[c * s->d + j];
        name_dofs(dofs, sizeof dofs, z, s->d);
    }
    uz_free_all(y, z);
    if (status != UZ_OK || how == UZ_PRESSED_ON)
        return status;
    if (how == UZ_PUSHED_AWAY)
        return uz_fail(err, UZ_ERR_FREE_BODY, "p",
                       "K is singular and the load pushes a part of the body away along a motion without stiffness "
                       "that no row of N stands in the way of; it moves most: %s. Support it there, add a row of N "
                       "that stops this motion, or load it towards the rows that are there.",
                       dofs);
    return uz_fail(
        err, UZ_ERR_FREE_BODY, "K",
        "K is singular and the load does not press the body on: a motion without stiffness that no row of N "
        "stands in the way of costs nothing; it moves most: %s. Support it there, or add a row of N or a load "
        "that stops this motion.",
        dofs);
}

/* The singular K bounds nothing by its inverse. */
static uz_status no_inverse(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    (void)ctx, (void)e, (void)enough, (void)err;
    *value = INFINITY;
    return UZ_OK;
}

/* Residuals, gaps and energies of the original data; the bound is that of the augmented problem. */
static uz_status certify(uz_semi *s, uz_error *err)
{
    uz_result *result = s->last;
    uz_certificate *c = &result->summary.certificate;
    double gap = c->gap;
    /* Of the answer itself, as if the residual force moved nothing: an unbounded motion would take the energy along. */
    uz_certify_input input = {.K = s->of.K,
                              .N = s->of.N,
                              .p = s->of.p,
                              .h = s->of.h,
                              .inverse_norm = no_inverse,
                              .rcond = 1.0,
                              .inverse_bound = 0.0,
                              .spares = true};
    uz_status status = uz_certify(c, result->r, result->g, result->u, &input, err);
    if (status != UZ_OK)
        return status;
    c->gap = c->absolute_error = c->relative_error = INFINITY;
    if (s->proved) {
        double norm = c->energy_norm, augmented;
        if (s->is_scene)
            status = uz_semi_norms(&norm, &augmented, s, s->absolute, err);
        c->energy_norm = norm;
        c->gap = gap;
        c->absolute_error = s->absolute;
        c->relative_error = s->absolute < norm ? s->absolute / (norm - s->absolute) : INFINITY;
        if (s->absolute == 0.0)
            c->relative_error = 0.0;
    }
    c->energy_dual = c->energy_primal - c->gap;
    return status;
}

/* A sum of loads that is no more than their rounding. */
#define NO_LOAD 1e-12

/* What rounding of loads is relative to. Of a scene that is all that acts on it: of what acts on rigid groups the free
 * motions may have rounding alone. */
static uz_status sum_loads(double *size, const uz_semi *s, uz_error *err)
{
    const int64_t n = s->is_scene ? s->model.mesh.n_nodes * s->model.mesh.dim : 0;
    double of_dofs = 0.0, of_nodes = 0.0, *f = n > 0 ? uz_alloc(n, sizeof *f) : NULL;
    *size = 0.0;
    if (n > 0 && !f)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld dofs", (long long)n);
    const uz_status status = f ? uz_nodal_loads(f, &s->model, &s->problem->scene, err) : UZ_OK;
    for (int64_t j = 0; j < s->d; j++)
        of_dofs += fabs(s->of.p[j]);
    for (int64_t i = 0; status == UZ_OK && i < n; i++)
        of_nodes += fabs(f[i]);
    free(f);
    *size = fmax(of_dofs, of_nodes);
    return status;
}

/* Do loads leave all motions without stiffness alone, and reactions, where they are proved to hold the body? Then
 * nothing says where in their room the motions end: what is more than rounding there comes from overlaps alone. */
static uz_status look_for_room(bool *loose, const uz_semi *s, uz_error *err)
{
    const uz_csc *Nt = &s->Nt;
    double size;
    *loose = false;
    const uz_status status = sum_loads(&size, s, err);
    if (status != UZ_OK)
        return status;
    *loose = s->Z != NULL;
    for (int64_t c = 0; *loose && c < s->k; c++) {
        const double *z = s->Z + c * s->d;
        double work = 0.0, pressed = 0.0, largest = 0.0;
        for (int64_t j = 0; j < s->d; j++) {
            work += z[j] * s->of.p[j];
            largest = fmax(largest, fabs(z[j]));
        }
        for (int64_t i = 0; s->proved && i < s->m; i++) {
            double along = 0.0;
            for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
                along += Nt->val[k] * z[Nt->idx[k]];
            pressed += fabs(s->last->r[i] * along);
        }
        *loose = fmax(fabs(work), pressed) <= NO_LOAD * size * largest;
    }
    return UZ_OK;
}

/* On the factor of the last augmented problem, whose springs stand on rows that are in contact. */
static uz_status find_quantities(uz_semi *s, uz_error *err)
{
    const uz_stop stop = {s->hooks, s->deadline};
    uz_problem augmented;
    uz_setup *setup = NULL;
    uz_reuse reused;
    uz_quantity_work work = {.problem = s->problem,
                             .settings = s->settings,
                             .scene = &s->problem->scene,
                             .model = &s->model,
                             .weight = s->weight,
                             .h = s->of.h,
                             .prescribed = s->prescribed,
                             .stop = &stop};
    if (!s->proved)
        return uz_find_quantities(s->last, &work, err);
    uz_status status = uz_augment(&augmented, &s->of, &s->Nt, s->weight, s->target, err);
    if (status == UZ_OK)
        status = uz_setup_acquire(&setup, &reused, s->cache, &augmented, NULL, s->settings, s->hooks, err);
    if (status == UZ_OK) {
        work.K = &augmented.qp.K;
        work.dual = setup->dual;
        status = uz_find_quantities(s->last, &work, err);
    }
    uz_setup_release(s->cache, setup);
    uz_augmented_clear(&augmented);
    return status;
}

/* Bounds of iterations were about regularized problems; that of the certificate alone is about this one. */
static void count_times(uz_result *result, const uz_semi *s)
{
    uz_summary *summary = &result->summary;
    uz_milestones milestones;
    summary->timings.assemble += s->assemble_s;
    summary->timings.total = uz_seconds() - s->started;
    uz_milestones_init(&milestones, false);
    uz_milestones_resume(&milestones, summary->timings.total);
    uz_milestones_pause(&milestones);
    uz_milestones_note(&milestones, UZ_MILESTONE_OF_CERTIFICATE, summary->certificate.relative_error,
                       summary->iterations, 0);
    result->trade = milestones.trade;
    result->trade.total_s = milestones.trade.iterated_s;
}

uz_status uz_semi_conclude(uz_semi *s, uz_error *err)
{
    uz_result *result = s->last;
    uz_summary *summary = &result->summary;
    bool loose = false;
    uz_status status = result->ray ? UZ_OK : look_for_room(&loose, s, err);
    s->proved = s->proved && !loose;
    if (status == UZ_OK && !result->ray)
        status = certify(s, err);
    if (status != UZ_OK)
        return status;
    if (!result->ray && s->proved && summary->certificate.relative_error <= s->requested)
        summary->outcome = UZ_CONVERGED;
    else if (!result->ray && summary->outcome == UZ_CONVERGED)
        summary->outcome = UZ_PRECISION_LIMIT;
    if (!s->proved && summary->outcome == UZ_PRECISION_LIMIT && loose)
        summary->outcome = UZ_LOOSE;
    summary->requested_error = s->requested;
    uz_semicoercive *held = &summary->semicoercive;
    *held = (uz_semicoercive){.free_modes = s->k, .rounds = s->rounds};
    for (int64_t i = 0; s->proved && i < s->m; i++)
        if (s->weight[i] > 0.0) { /* the first rows that hold it are named */
            if (held->held < (int64_t)(sizeof held->held_by / sizeof held->held_by[0]))
                held->held_by[held->held] = i;
            held->held++;
        }
    if (s->is_scene)
        status = uz_describe_scene(result, &s->model, &s->problem->scene, result->u, s->prescribed, s->m, NULL, err);
    if (s->is_scene && status == UZ_OK && !result->ray && s->problem->n_quantities > 0)
        status = find_quantities(s, err);
    if (result->ray)
        uz_blank_answer(result);
    summary->message[0] = '\0';
    uz_explain_outcome(result, UZ_END_STALLED);
    if (!s->proved && (summary->outcome == UZ_PRECISION_LIMIT || summary->outcome == UZ_LOOSE))
        snprintf(summary->message, sizeof summary->message, "%s",
                 summary->outcome == UZ_LOOSE
                     ? "no load moves the body along a motion that no support holds: where the obstacles on both sides "
                       "leave it room it may lie anywhere, and this is one such place"
                     : "no rows could be proved to hold the body, which no support does: it may be balanced on the "
                       "edge of its contact");
    count_times(result, s);
    return status;
}

uz_status uz_semi_refuse(uz_result **out, const uz_semi *s, const uz_error *why, uz_error *err)
{
    uz_result *result = uz_alloc_zero(1, sizeof *result);
    uz_summary *summary = result ? &result->summary : NULL;
    if (result) {
        result->d = summary->d = s->d;
        result->m = summary->m = summary->kept = s->m;
        result->u = uz_alloc_zero(s->d, sizeof *result->u);
        result->r = uz_alloc_zero(s->m, sizeof *result->r);
        result->g = uz_alloc_zero(s->m, sizeof *result->g);
    }
    uz_status status = result && result->u && result->r && result->g
                           ? UZ_OK
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a result of %lld dofs", (long long)s->d);
    if (status == UZ_OK && s->is_scene)
        status = uz_describe_scene(result, &s->model, &s->problem->scene, result->u, s->prescribed, s->m, NULL, err);
    if (status != UZ_OK) {
        uz_result_free(result);
        return status;
    }
    summary->outcome = UZ_UNHELD;
    summary->row_scaling = UZ_ROW_SCALING_NONE;
    summary->rounds = 1;
    summary->requested_error = s->requested;
    summary->semicoercive = (uz_semicoercive){.free_modes = s->k};
    const char *end = strstr(why->message, "; "); /* what to do about it does not fit in beside others */
    end = end ? end : strstr(why->message, ". ");
    snprintf(summary->message, sizeof summary->message, "%.*s", end ? (int)(end - why->message) : 200, why->message);
    uz_blank_answer(result);
    count_times(result, s);
    *out = result;
    return UZ_OK;
}
