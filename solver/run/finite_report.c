/* finite_report.c: the answer of finite kinematics as a result. What follows from fixed moduli is left out: bounds, and
 * doubts about small deformation. */
#include "run/finite.h"

#include "post/balance.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "finite/mesh_error.h"
#include "linalg/linalg.h"
#include "post/evaluate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* An obstacle that stands deeper in a side between rows than this part of its length, or presses it from farther away:
 * rows leave 0.01 at most. */
#define CUTS_IN 0.03
/* And one that no side of the contact comes so near to. */
#define TOUCHES 1e-6
/* A body that stands so much farther from where coordinates begin than it is large gains digits there. */
#define FAR 3
/* Forces that are less than this part of those by which the strain energy comes from the largest displacement are what
 * equations leave, as of warmth, which holds itself. */
#define LEAST_OF_ENERGY 1e-6
/* What equations may have of the mesh's error in a balanced answer. */
#define OF_MESH 0.1

const char *uz_explain_stop(uz_outcome stopped)
{
    return stopped == UZ_DISMISSED    ? "stopped by request"
           : stopped == UZ_TIME_LIMIT ? "the time allowed was used up: raise time_limit_s"
                                      : "the iterations allowed were used up: raise max_iterations";
}

static void explain(uz_summary *s, const uz_finite_run *run, uz_part why, double tried)
{
    const double load = s->finite.load;
    const uz_finite_certificate *c = &run->certificate;
    char *text = s->message;
    const size_t size = sizeof s->message;
    const char *of = run->from ? "the way from the load of the case before it" : "the load";
    if (s->outcome == UZ_MESH_LIMIT && load >= 1 && c->least_part >= -CUTS_IN) {
        snprintf(text, size,
                 "contact presses where the body is %.3g of a side's length away from the obstacle, as sides are long "
                 "against its radius: use a finer mesh along the contact",
                 c->pressed_apart);
        return;
    }
    if (s->outcome == UZ_MESH_LIMIT && load >= 1) {
        snprintf(text, size,
                 "the obstacle, or another body, stands %.3g of a side's length deep in it, between rows: use a finer "
                 "mesh along the contact",
                 -c->least_part);
        return;
    }
    if (s->outcome == UZ_PRECISION_LIMIT && c->distance > FAR) {
        snprintf(
            text, size,
            "coordinates are up to %.3g times as large as the body, and the rounding of places and gaps leaves %.3g "
            "of the strains, asked for %.3g: move it to where they begin",
            c->distance, s->finite.residual, s->requested_error);
        return;
    }
    if (s->outcome == UZ_PRECISION_LIMIT) {
        snprintf(text, size,
                 "strains are so small that rounding of the deformation gradient leaves %.3g of them, asked for %.3g: "
                 "small deformation is the better model",
                 s->finite.residual, s->requested_error);
        return;
    }
    if (run->from && !run->from->whole) {
        snprintf(text, size,
                 "the case that this one is after has no answer under its whole load: this is where it ended");
        return;
    }
    switch (why) {
    case UZ_PART_INVERTED:
        snprintf(text, size,
                 "elements turn inside out under %.6g of %s: this is the answer under %.6g of it, the last part "
                 "with a stable equilibrium. Use a finer mesh, or another law",
                 tried, of, load);
        break;
    case UZ_PART_CONTRADICTORY:
        snprintf(text, size,
                 "under %.6g of %s contact conditions contradict each other: this is the answer under %.6g of "
                 "it, the last part with a stable equilibrium",
                 tried, of, load);
        break;
    case UZ_PART_SWALLOWED:
        snprintf(
            text, size,
            "under %.6g of %s an obstacle is inside of the body, whose sides have gone past it: this is the answer "
            "under %.6g of it. Use a finer mesh along the contact",
            tried, of, load);
        break;
    case UZ_PART_STOPPED:
        snprintf(text, size, "%s: this is the answer under %.6g of %s", uz_explain_stop(run->stopped), load, of);
        break;
    default:
        snprintf(text, size,
                 "no stable equilibrium was found under %.6g of %s: the last one is that under %.6g of it, and "
                 "this is the answer there. %s",
                 tried, of, load,
                 run->base.n_modes > 0
                     ? "Contact alone holds the body: it slides, tips over or has room; or a limit load"
                     : "A limit load or a bifurcation; prescribed displacements may pass it");
    }
}

static bool is_pressed_apart(const uz_finite_certificate *c)
{
    return c->pressed_apart > CUTS_IN || c->touches_nowhere > TOUCHES;
}

static uz_outcome outcome_of(const uz_finite_run *run, uz_part why)
{
    const uz_finite_certificate *c = &run->certificate;
    if (run->found.load >= 1)
        return c->least_part < -CUTS_IN || is_pressed_apart(c) ? UZ_MESH_LIMIT
               : !(c->residual <= run->requested)              ? UZ_PRECISION_LIMIT
                                                               : UZ_CONVERGED;
    return why == UZ_PART_INVERTED    ? UZ_INVERTED
           : why == UZ_PART_SWALLOWED ? UZ_MESH_LIMIT
           : why == UZ_PART_STOPPED   ? run->stopped
                                      : UZ_UNSTABLE;
}

/* Of what was found, in place of what the last contact problem has of its own. */
static void summarize(uz_summary *s, const uz_finite_run *run, uz_part why, double tried)
{
    const uz_finite_certificate *c = &run->certificate;
    s->outcome = outcome_of(run, why);
    s->finite = run->found;
    const bool known = run->found.steps > 0 || run->from;
    s->finite.part = NAN;
    s->finite.least_det = known ? c->least_det : 1;
    s->finite.residual = known ? c->residual : 0;
    s->finite.definite = known && c->definite;
    s->finite.displacement = 0;
    const int dim = run->base.mesh.dim;
    for (int64_t i = 0; i < run->n; i += dim)
        s->finite.displacement = fmax(s->finite.displacement, sqrt(uz_distance2(run->at.u + i, (double[3]){0}, dim)));
    s->finite.least_gap = known && isfinite(c->least_gap) ? c->least_gap : (double)NAN;
    s->geometry = (uz_geometry){.kind = UZ_KINEMATICS_FINITE, .passes = run->found.qps, .change = NAN, .sliding = NAN};
    s->requested_error = run->requested;
    s->timings = run->spent;
    s->origin = UZ_FROM_ZERO;
    s->rounds = 1;
    s->added = 0;
    s->infeasible_radius = 0;
    s->discretization_error = NAN;
    s->stress_share = 1; /* all strain makes stress */
    s->message[0] = '\0';
    memset(&s->certificate, 0xff, sizeof s->certificate); /* every byte set is a NaN */
    if (s->outcome != UZ_CONVERGED)
        explain(s, run, why, tried);
}

static uz_status take_rows(uz_result *result, const uz_finite_run *run, uz_error *err)
{
    const uz_body_model *rows = &run->at.rows;
    const int64_t m = rows->m;
    uz_summary *s = &result->summary;
    result->m = s->m = s->kept = m;
    result->d = s->d = run->d;
    result->r = uz_alloc_zero(m, sizeof *result->r);
    result->g = uz_alloc(m, sizeof *result->g);
    result->u = uz_alloc(run->n, sizeof *result->u);
    result->place = uz_alloc(run->n, sizeof *result->place);
    if (!result->r || !result->g || !result->u || !result->place)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer at %lld nodes",
                       (long long)run->base.mesh.n_nodes);
    memcpy(result->u, run->at.u, (size_t)run->n * sizeof *result->u);
    if (run->free_strain) {
        result->n_free_strain = run->base.mesh.n_elements;
        result->free_strain = uz_alloc(result->n_free_strain, sizeof *result->free_strain);
        if (!result->free_strain)
            return uz_no_memory(err, "temperatures");
        memcpy(result->free_strain, run->free_strain, (size_t)result->n_free_strain * sizeof *result->free_strain);
    }
    memcpy(result->place, run->at.u, (size_t)run->n * sizeof *result->place);
    if (m > 0)
        memcpy(result->g, run->at.gap, (size_t)m * sizeof *result->g);
    if (m > 0 && run->n_r == m)
        memcpy(result->r, run->r, (size_t)m * sizeof *result->r);
    s->active = 0;
    s->reaction_sum = s->max_penetration = 0;
    for (int64_t i = 0; i < m; i++) {
        s->active += rows->law->kind->active(rows->law, NULL, &result->r[i], 1);
        s->reaction_sum += result->r[i];
        s->max_penetration = fmax(s->max_penetration, -result->g[i]);
    }
    result->n_nodes = run->base.mesh.n_nodes;
    return uz_mesh_info_copy(&result->mesh, &rows->info, m, err);
}

double uz_finite_bytes(const uz_body_model *base, const uz_body_model *rows, bool pairs)
{
    enum { NODAL = 16, FREE = 12 }; /* places, steps and what is gone back to, by node and by dof */
    uz_body_model place = rows ? *rows : *base;
    const double n = (double)(base->mesh.dim * base->mesh.n_nodes),
                 values = (double)(base->K.ptr[base->d] + base->K_fixed.ptr[base->K_fixed.cols]);
    place.is_place = true;
    return (double)uz_body_model_bytes(base) + 2 * (double)uz_body_model_bytes(&place) + 8 * values +
           (pairs ? (double)uz_csc_bytes(&base->K) : 0) + 8 * (NODAL * n + FREE * (double)base->d);
}

/* Is the body only carried along? The certificate takes its strains for rounding, and there is nothing to strain it.
 * Each element by itself: soft ones have little energy beside what rounding makes of stiff ones. */
static bool is_carried(const uz_finite_run *run)
{
    bool so = run->certificate.residual == 0 && run->certificate.unstrained && !uz_is_loaded(&run->base, &run->scene) &&
              !uz_is_stretched(&run->base, run->at.u, true);
    for (int64_t i = 0; i < run->n_r && so; i++)
        so = !(run->r[i] < 0);
    return so;
}

/* Of a body at rest, as no part of the load was borne, nothing is told; nor where there is no memory, but that a mesh
 * is refined by it. */
static uz_status mesh_error(double *error, const uz_finite_run *run, uz_error *err)
{
    const bool known = run->found.steps > 0 || run->from, asked = run->scene.refine;
    *error = NAN;
    const uz_status status = known ? uz_finite_mesh_error(error, NULL, &run->base, &run->scene, run->free_strain,
                                                          run->at.u, asked ? err : NULL)
                                   : UZ_OK;
    if (status == UZ_OK && known && is_carried(run))
        *error = 0;
    return asked ? status : UZ_OK;
}

/* A balanced answer's equations may have a tenth of the mesh's error, and were solved as well as if it were exact. */
static void balance(uz_summary *s, const uz_finite_run *run)
{
    const double share = OF_MESH * s->discretization_error;
    if (!run->balanced || !(share > s->requested_error))
        return;
    s->requested_error = fmin(1, share);
    if (s->outcome == UZ_PRECISION_LIMIT && s->finite.residual <= s->requested_error) {
        s->outcome = UZ_CONVERGED;
        s->message[0] = '\0';
    }
}

/* Where the answer passes through itself, or else the deepest that others on the way to it did. */
static uz_status doubt_passing(uz_evaluation *out, const uz_finite_run *run, uz_error *err)
{
    uz_interpenetration now;
    const uz_status status = uz_find_interpenetration(&now, &run->base, &run->scene, &run->outer, run->at.u, err);
    const bool ends = now.depth > 0;
    if (status == UZ_OK)
        uz_doubt_interpenetration(out, ends ? &now : &run->passed, run->base.mesh.dim, ends ? 1 : run->passed_under);
    return status;
}

uz_status uz_finite_report(uz_result **out, uz_finite_run *run, uz_part why, double tried, uz_error *err)
{
    uz_result *result = uz_alloc_zero(1, sizeof *result);
    if (!result)
        return uz_no_memory(err, "a result");
    if (run->last) /* method, factor and cost: those of the last contact problem */
        result->summary = run->last->summary;
    else if (run->from)
        result->summary = run->from->last;
    else
        result->summary.row_scaling = UZ_ROW_SCALING_NONE; /* no step was taken */
    summarize(&result->summary, run, why, tried);
    double *bytes = &result->summary.cost.actual_bytes;
    *bytes = fmax(*bytes, run->certificate.bytes) + uz_finite_bytes(&run->base, &run->at.rows, run->pairs);
    uz_status status = take_rows(result, run, err);
    if (status == UZ_OK)
        status = uz_evaluate_finite(result, &run->at.rows, &run->scene, run->at.force, run->at.body.energy, err);
    if (status == UZ_OK)
        status = mesh_error(&result->summary.discretization_error, run, err);
    if (status == UZ_OK) {
        balance(&result->summary, run);
        status = doubt_passing(result->evaluation, run, err);
    }
    if (status == UZ_OK) {
        uz_doubt_mesh(result, &run->at.rows, &run->scene);
        status = uz_finite_quantities(result, run, err);
    }
    if (status == UZ_OK) {
        *out = result;
    } else {
        uz_result_free(result);
    }
    return status;
}

/* The largest difference of forces of the same list, and the largest force of large deformation. */
static void compare_forces(double *off, double *most, const uz_resultant *here, const uz_resultant *small, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        *off = fmax(*off, sqrt(uz_distance2(here[i].force, small[i].force, 3)));
        *most = fmax(*most, sqrt(uz_dot3(here[i].force, here[i].force)));
    }
}

/* The largest force that acts where resultants do not tell: what presses a ring all around has none, nor have supports
 * that bend or twist a body. Of what presses from all sides half comes from either side, which is less than what a side
 * alone has as its resultant; a moment counts as the force that has it over the body's size. */
static double force_within(const uz_evaluation *e, const uz_body_model *model)
{
    const double size = uz_mesh_size(&model->mesh);
    double middle[3], most = 0;
    uz_mesh_middle(middle, &model->mesh);
    for (int64_t i = 0; i < e->n_contacts; i++)
        most = fmax(most, 0.5 * e->totals[i].normal_force);
    for (int64_t i = 0; i < e->n_supports && model->kind != UZ_AXISYMMETRIC; i++) {
        double moment[3];
        uz_cross3(moment, middle, e->supports[i].force);
        most = fmax(most, sqrt(uz_distance2(e->supports[i].moment, moment, 3)) / size);
    }
    return most;
}

/* Takes what v has of q (n, of norm 1) off it; returns how much that was. */
static double take_off(double *v, const double *q, int64_t n)
{
    double along = 0;
    for (int64_t i = 0; i < n; i++)
        along += v[i] * q[i];
    for (int64_t i = 0; i < n; i++)
        v[i] -= along * q[i];
    return along;
}

/* The motions that supports leave free, by node, become orthonormal: n_modes x n. */
static void find_motions(double *motion, const uz_finite_run *run)
{
    const uz_body_model *model = &run->base;
    const int64_t n = run->n;
    for (int64_t k = 0; k < model->n_modes; k++) {
        double *own = motion + k * n, square = 0;
        uz_recover_nodal(own, model, model->modes + k * model->d, NULL);
        for (int64_t q = 0; q < 2 * k; q++) /* twice is enough */
            take_off(own, motion + q % k * n, n);
        for (int64_t i = 0; i < n; i++)
            square += own[i] * own[i];
        for (int64_t i = 0; i < n && square > 0; i++)
            own[i] /= sqrt(square);
    }
}

/* Displacements by their mean squares, without what carries the body as a whole. Where contact alone sets a motion, by
 * as little as one node, that is no part of what deforms, and is held against all displacements. */
static uz_status compare_displacements(double *error, const uz_finite_run *run, const double *here, const double *small,
                                       uz_error *err)
{
    const int64_t n = run->n, modes = run->base.n_modes;
    const int dim = run->base.mesh.dim;
    double mean[3] = {0}, off = 0, all = 0, off_motion = 0, motions = 0;
    double *apart = uz_alloc(n, sizeof *apart), *whole = uz_alloc(n, sizeof *whole),
           *motion = uz_alloc(modes * n, sizeof *motion);
    const bool room = apart && whole && motion;
    if (room)
        find_motions(motion, run);
    for (int64_t i = 0; i < n && room; i++) {
        apart[i] = here[i] - small[i];
        whole[i] = here[i];
    }
    for (int64_t k = 0; k < modes && room; k++) {
        off_motion = hypot(off_motion, take_off(apart, motion + k * n, n));
        motions = hypot(motions, take_off(whole, motion + k * n, n));
    }
    for (int64_t i = 0; i < n && room; i++)
        mean[i % dim] += whole[i] * dim / (double)n;
    for (int64_t i = 0; i < n && room; i++) {
        off += apart[i] * apart[i];
        all += (whole[i] - mean[i % dim]) * (whole[i] - mean[i % dim]);
    }
    *error = all > 0 ? fmax(sqrt(off / all), off_motion / hypot(motions, sqrt(all))) : off > 0 ? (double)INFINITY : 0;
    uz_free_all(apart, whole, motion);
    return room ? UZ_OK
                : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for displacements of %lld nodes", (long long)(n / dim));
}

static void take_greater(uz_small *out, double error, const char *in)
{
    if (error > out->error) {
        out->error = error;
        out->in = in;
    }
}

/* What is asked for: of a force or a displacement in parts of such a part of the largest at least. most: of forces. */
static void compare_asked(uz_small *out, const uz_result *large, const uz_evaluation *small, double most)
{
    const uz_evaluation *here = large->evaluation;
    if (here->stressed && small->stressed && here->von_mises.value > 0)
        take_greater(out, fabs(small->von_mises.value / here->von_mises.value - 1), "stress");
    for (int64_t i = 0; i < here->n_quantities && i < small->n_quantities; i++) {
        const uz_quantity_found *one = &here->quantities[i];
        const double least = one->kind == UZ_QUANTITY_DISPLACEMENT    ? large->summary.finite.displacement
                             : one->kind == UZ_QUANTITY_CONTACT_FORCE ? most
                             : one->kind == UZ_QUANTITY_REACTION      ? most
                                                                      : 0,
                     size = fmax(fabs(one->found), UZ_LEAST_FORCE * least);
        if (size > 0)
            take_greater(out, fabs(one->found - small->quantities[i].found) / size, "quantities");
    }
}

uz_status uz_finite_compare(uz_small *out, const uz_finite_run *run, const uz_result *result, const uz_result *small,
                            uz_error *err)
{
    const uz_evaluation *here = result->evaluation, *there = small->evaluation;
    const uz_finite *told = &result->summary.finite;
    const double energy = run->at.body.energy;
    double off = 0, most = 0;
    *out = (uz_small){.compared = true, .error = INFINITY, .in = "displacements", .load = run->found.load};
    if (run->found.load < 1)
        return UZ_OK;
    const uz_status status = compare_displacements(&out->error, run, result->u, small->u, err);
    if (status != UZ_OK || energy <= 10 * run->grain) /* forces and energy are rounding, too */
        return status;
    compare_forces(&off, &most, here->contacts, there->contacts, here->n_contacts);
    compare_forces(&off, &most, here->supports, there->supports, here->n_supports);
    most = fmax(most, force_within(here, &run->base));
    most = fmax(most, UZ_LEAST_FORCE * here->loads_size); /* of loads that hold each other supports have rounding */
    if (told->displacement > 0)
        most = fmax(most, fmax(LEAST_OF_ENERGY, told->residual) * energy / told->displacement);
    if (most > 0)
        take_greater(out, off / most, "forces");
    take_greater(out, fabs(sqrt((there->strain_energy + there->kept_energy) / energy) - 1), "energy");
    compare_asked(out, result, there, most);
    uz_doubt_strain(small->evaluation, out, &run->base, &run->scene, small->u, run->at.u);
    return UZ_OK;
}
