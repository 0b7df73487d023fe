#include "post/evaluate.h"

#include "certificate/bound.h"
#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "finite/follower.h"
#include "post/balance.h"
#include "post/overlap.h"
#include "post/parts.h"
#include "post/trend.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void uz_evaluation_free(uz_evaluation *evaluation)
{
    if (!evaluation)
        return;
    uz_free_all(evaluation->totals, evaluation->contacts, evaluation->supports, evaluation->overlap,
                evaluation->surfaces, evaluation->quantities, evaluation->share, evaluation);
}

/* Room, names, and what does not depend on the answer. */
static uz_status begin(uz_result *result, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_evaluation *e = uz_alloc_zero(1, sizeof *e);
    result->evaluation = e;
    if (!e)
        return uz_no_memory(err, "a summary");
    e->n_contacts = scene->n_contacts;
    e->n_supports = scene->n_supports;
    e->peak_node = -1;
    e->totals = uz_alloc_zero(e->n_contacts, sizeof *e->totals);
    e->contacts = uz_alloc_zero(e->n_contacts, sizeof *e->contacts);
    e->supports = uz_alloc_zero(e->n_supports, sizeof *e->supports);
    e->overlap = uz_alloc_zero(e->n_contacts, sizeof *e->overlap);
    e->surfaces = uz_alloc_zero(2 * e->n_contacts, sizeof *e->surfaces);
    if (!e->totals || !e->contacts || !e->supports || !e->overlap || !e->surfaces)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld resultants",
                       (long long)(e->n_contacts + e->n_supports));
    for (int64_t i = 0; i < e->n_contacts && model->sites; i++)
        for (int k = 0; k < 2 && model->sites[i].surface[0].parts > 0; k++)
            e->surfaces[e->n_surfaces++] = model->sites[i].surface[k];
    for (int64_t i = 0; i < e->n_contacts; i++)
        memcpy(e->contacts[i].on, scene->contacts[i].on, sizeof e->contacts[i].on);
    for (int64_t i = 0; i < e->n_supports; i++)
        memcpy(e->supports[i].on, scene->supports[i].on, sizeof e->supports[i].on);
    result->summary.evaluation = e;
    result->pressure = uz_alloc(result->m, sizeof *result->pressure);
    return result->pressure
               ? UZ_OK
               : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld rows", (long long)result->m);
}

/* Adds to a contact's total what acts at one of its rows; its centre is a sum until end_totals. moved: by node, NULL:
 * where the body is before anything moves. */
static void add_total(uz_contact_total *to, const uz_result *result, const uz_body_model *model, int64_t row,
                      double force, const double *moved)
{
    const uz_inner_place *inner = uz_row_inner(model, row);
    const int dim = result->mesh.dim;
    to->normal_force += force;
    to->max_pressure = fmax(to->max_pressure, result->pressure[row]);
    for (int a = 0; a < (inner ? inner->nodes : 1); a++) {
        const int64_t at = dim * (inner ? inner->node[a] : result->mesh.contact_node[row]);
        for (int axis = 0; axis < dim; axis++)
            to->center[axis] += force * (inner ? inner->share[a] : 1.0) *
                                (result->mesh.xyz[at + axis] + (moved ? moved[at + axis] : 0.0));
    }
}

static void end_totals(uz_evaluation *e)
{
    for (int64_t k = 0; k < e->n_contacts; k++) {
        uz_contact_total *total = &e->totals[k];
        total->mean_pressure = total->area > 0.0 ? total->normal_force / total->area : (double)NAN;
        for (int axis = 0; axis < 3; axis++)
            total->center[axis] = total->normal_force > 0.0 ? total->center[axis] / total->normal_force : (double)NAN;
    }
}

/* Force (of rings: axial), area and peak of the contact: the obstacle pushes a row's node along its normal by -push,
 * and `on` is pushed the other way where the masters are its own. *pressed: the sum of the forces of all rows; moved:
 * as of add_total. */
static uz_status sum_contact(double *pressed, uz_result *result, const uz_body_model *model, const double *moved,
                             uz_error *err)
{
    uz_summary *summary = &result->summary;
    uz_evaluation *e = result->evaluation;
    const uz_mesh_info *mesh = &result->mesh;
    double *push = uz_alloc(result->m, sizeof *push);
    if (!push)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)result->m);
    uz_row_forces(push, model, result->r);
    summary->dim = mesh->dim;
    summary->max_pressure = *pressed = 0.0;
    memset(summary->force, 0, sizeof summary->force);
    for (int64_t i = 0; i < result->m; i++) {
        const int64_t node = mesh->contact_node[i];
        const uz_contact_sites *sites = model->sites ? &model->sites[mesh->contact_of[i]] : NULL;
        const int of = sites && sites->of ? sites->of[model->row_place[i]] : UZ_SLAVE_ON;
        const int times = (of & UZ_SLAVE_ON ? 1 : 0) - (of & UZ_MASTER_ON ? 1 : 0);
        for (int axis = model->kind == UZ_AXISYMMETRIC ? 1 : 0; axis < mesh->dim; axis++)
            summary->force[axis] -= times * push[i] * mesh->contact_normal[i * mesh->dim + axis];
        *pressed += fabs(push[i]);
        add_total(&e->totals[mesh->contact_of[i]], result, model, i, -push[i], moved);
        if (model->law->kind->active(model->law, NULL, &result->r[i], 1) > 0) {
            e->contact_area += mesh->contact_area[i];
            e->totals[mesh->contact_of[i]].area += mesh->contact_area[i];
        }
        if (!(result->pressure[i] > summary->max_pressure))
            continue;
        summary->max_pressure = result->pressure[i];
        e->peak_node = node;
        e->peak_size = pow(mesh->contact_area[i], 1.0 / (mesh->dim - 1));
        for (int axis = 0; axis < mesh->dim; axis++)
            e->peak_at[axis] = mesh->xyz[node * mesh->dim + axis];
    }
    free(push);
    end_totals(e);
    const double size = e->peak_node >= 0 ? 1.0 : 0.0; /* what nothing presses on tells nothing */
    uz_trend_fit(&e->peak, &(uz_trend_point){size, summary->max_pressure}, 1, summary->max_pressure, 0.0);
    uz_trend_fit(&e->area, &(uz_trend_point){size, e->contact_area}, 1, e->contact_area, 0.0);
    return UZ_OK;
}

/* What an answer is looked at for at its surfaces, which another thread may do. */
typedef struct {
    uz_aside_task task;
    const uz_result *result;
    const uz_body_model *model;
    const uz_scene *scene;
    uz_coarse_contact coarse;
    uz_status status;
    uz_error err;
} surface_work;

static void look_at_surfaces(void *ctx)
{
    surface_work *x = ctx;
    const uz_result *of = x->result;
    x->status = uz_measure_overlap(of->evaluation->overlap, x->model, x->scene, of->u, &x->err);
    if (x->status == UZ_OK)
        x->status = uz_find_coarse_contact(&x->coarse, x->model, x->scene, of->u, of->r, &x->err);
}

/* What the mesh has missed, with what is seen in passing, and what acts on the body; beside it how deep surfaces stand
 * in each other, and where contact is narrow. */
static uz_status look_at_answer(uz_coarse_contact *coarse, uz_mesh_look *look, uz_result *result,
                                const uz_body_model *model, const uz_scene *scene, uz_ahead *ahead, uz_error *err)
{
    enum { LEAST = 1000 }; /* rows; with fewer it takes less than a thread does to wake up */
    uz_summary *summary = &result->summary;
    surface_work x = {.result = result, .model = model, .scene = scene};
    const bool told = uz_ahead_take(ahead, &summary->discretization_error, look, result->u);
    x.task = (uz_aside_task){.run = look_at_surfaces, .ctx = &x};
    const bool aside = model->m >= LEAST && uz_aside_start(&x.task);
    if (!told)
        summary->discretization_error = uz_estimate_mesh_error(NULL, look, model, scene, result->u);
    summary->stress_share = look->share;
    const uz_status status =
        uz_balance_forces(result->evaluation, model, scene, result->u, result->r, NULL, look->twice, err);
    if (!aside || !uz_aside_finish(&x.task))
        look_at_surfaces(&x);
    *coarse = x.coarse;
    if (status == UZ_OK && x.status != UZ_OK)
        *err = x.err;
    return status == UZ_OK ? x.status : status;
}

/* Is all strain of bodies that may touch less than what places are rounded by? Only where the norm is that of a motion.
 * What supports alone strain as little is given like that. */
static bool is_rounding(const uz_evaluation *e, const uz_certificate *c)
{
    return e->n_contacts > 0 && sqrt(2 * e->strain_energy) < UZ_TOUCHING * c->energy_norm;
}

uz_status uz_evaluate(uz_result *result, const uz_body_model *model, const uz_scene *scene, uz_ahead *ahead,
                      uz_error *err)
{
    uz_summary *summary = &result->summary;
    uz_coarse_contact coarse;
    uz_mesh_look look;
    double pressed;
    uz_status status = begin(result, model, scene, err);
    uz_evaluation *e = result->evaluation;
    if (status == UZ_OK)
        status = uz_contact_pressure(result->pressure, model, scene, result->r, err);
    if (status == UZ_OK)
        status = sum_contact(&pressed, result, model, NULL, err);
    if (status == UZ_OK)
        status = look_at_answer(&coarse, &look, result, model, scene, ahead, err);
    if (status != UZ_OK)
        return status;
    if (isnan(summary->discretization_error) && !result->ray)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to estimate the error of the mesh");
    if (is_rounding(e, &summary->certificate))
        summary->discretization_error = 0;
    e->approach = uz_contact_approach(e->strain_energy, pressed, e->overlap, e->n_contacts);
    status = uz_measure_sliding(&summary->geometry.sliding, model, scene, result->u, result->r, e->approach, err);
    if (status == UZ_OK)
        status = uz_find_peak_stress(e, model, scene, result->u, err);
    return status == UZ_OK ? uz_find_doubts(result, model, scene, &coarse, &look, err) : status;
}

/* ---- finite kinematics */

uz_status uz_displaced(uz_body_model *out, const uz_body_model *model, const double *u, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *xyz = uz_alloc(n, sizeof *xyz);
    if (!xyz)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the places of %lld nodes",
                       (long long)model->mesh.n_nodes);
    for (int64_t i = 0; i < n; i++)
        xyz[i] = model->mesh.xyz[i] + u[i];
    *out = *model;
    out->mesh.xyz = xyz;
    out->mesh.uniform = false;
    return UZ_OK;
}

/* The area of each row becomes that of the deformed side: as the sides around its node have grown. Rows between bodies
 * have been found on these, with their areas. */
static uz_status stretch_areas(uz_result *result, const uz_body_model *model, const uz_body_model *displaced,
                               const uz_scene *scene, uz_error *err)
{
    const uz_body_model *const of[2] = {model, displaced};
    double *area = uz_alloc_zero(2 * model->mesh.n_nodes, sizeof *area);
    if (!area)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the areas of %lld nodes", (long long)model->mesh.n_nodes);
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group = uz_mesh_group(&model->mesh, scene->contacts[k].on, "", NULL);
        for (int64_t f = 0; group && f < group->n_faces; f++)
            for (int which = 0; which < 2; which++) {
                double xyz[3 * UZ_FACE_NODES], weight[UZ_FACE_NODES];
                int64_t node[UZ_FACE_NODES];
                uz_side side;
                uz_body_side(&side, xyz, node, of[which], group->face[f]);
                uz_side_positive_weights(weight, &side);
                for (int a = 0; a < side.nodes; a++)
                    area[2 * node[a] + which] += weight[a];
            }
    }
    for (int64_t i = 0; i < result->m; i++) {
        const double *own = area + 2 * result->mesh.contact_node[i];
        if (scene->contacts[result->mesh.contact_of[i]].kind == UZ_OBSTACLE_BODY)
            continue;
        result->mesh.contact_area[i] *= own[0] > 0 ? own[1] / own[0] : 1;
    }
    free(area);
    return UZ_OK;
}

uz_status uz_evaluate_finite(uz_result *result, const uz_body_model *model, const uz_scene *scene, const double *inner,
                             double energy, uz_error *err)
{
    uz_body_model displaced = {.mesh.xyz = NULL};
    double pressed, *load = uz_alloc(model->mesh.n_nodes * model->mesh.dim, sizeof *load);
    uz_status status = begin(result, model, scene, err);
    if (status == UZ_OK && !load)
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld nodes", (long long)model->mesh.n_nodes);
    if (status == UZ_OK)
        status = uz_nodal_loads(load, model, scene, err);
    if (status == UZ_OK)
        status = uz_follower_loads(load, model, scene, result->u, err);
    if (status == UZ_OK)
        status = uz_displaced(&displaced, model, result->u, err);
    if (status == UZ_OK)
        status = uz_contact_pressure(result->pressure, &displaced, scene, result->r, err);
    if (status == UZ_OK)
        status = stretch_areas(result, model, &displaced, scene, err);
    if (status == UZ_OK)
        status = sum_contact(&pressed, result, model, result->u, err);
    if (status == UZ_OK)
        status = uz_balance_forces(result->evaluation, &displaced, scene, result->u, result->r,
                                   &(uz_balance_known){inner, load, energy, model}, NAN, err);
    if (status == UZ_OK)
        status = uz_measure_overlap(result->evaluation->overlap, model, scene, result->u, err);
    if (status == UZ_OK)
        status = uz_find_peak_stress(result->evaluation, model, scene, result->u, err);
    if (status == UZ_OK && uz_has_followers(scene)) /* their work is not their force times the displacement */
        result->evaluation->potential_energy = NAN;
    if (status == UZ_OK)
        result->evaluation->approach =
            uz_contact_approach(energy, pressed, result->evaluation->overlap, scene->n_contacts);
    uz_free_all(displaced.mesh.xyz, load);
    return status;
}
