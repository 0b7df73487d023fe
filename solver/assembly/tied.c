/* tied.c: surfaces that are tied, whatever their meshes.
 *
 * The mean of u_slave - u_master with each dual function of the slave's surface (mortar.c) is to vanish, u_j = sum_l
 * M_jl / D_j u_l, in all directions: bilateral rows with one slave node each, by which its displacement is eliminated.
 * Stress that is constant across the surface is a solution exactly, since the dual functions sum to 1 and the slave's
 * displacement may be any linear one. What supports hold of a slave, along an axis or a normal, stays theirs. */
#include "assembly/discretization.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Without a tolerance: surfaces that are farther apart than this part of a master's side are not tied. */
#define NEAR 0.1

/* Shares below this are rounding. */
#define ROUNDING 1e-13

static double longest_edge(const uz_body_model *model, uz_face face)
{
    uz_side side;
    double xyz[3 * UZ_ELEMENT_NODES], most = 0;
    int64_t node[UZ_FACE_NODES];
    const int dim = model->mesh.dim;
    uz_body_side(&side, xyz, node, model, face);
    const int corners = dim == 2 ? 2 : side.nodes % 3 == 0 ? 3 : 4;
    for (int a = 0; a < corners; a++)
        most = fmax(most, uz_distance2(xyz + a * dim, xyz + (a + 1) % corners * dim, dim));
    return sqrt(most);
}

/* The sites of a contact are looked for as those of a tie: places in messages are the tie's. */
static uz_status find_sites(uz_contact_sites *sites, const uz_body_model *model, const uz_tie *tie, int64_t k,
                            uz_error *err)
{
    static const char CONTACTS[] = "/contacts", TIES[] = "/ties";
    uz_contact contact = {.kind = UZ_OBSTACLE_BODY, .between = UZ_CONTACT_SURFACES, .faceted = true};
    memcpy(contact.on, tie->on, sizeof contact.on);
    memcpy(contact.with, tie->to, sizeof contact.with);
    const uz_contact_input in = {.model = model,
                                 .contact = &contact,
                                 .index = k,
                                 .tie = true,
                                 .on = uz_mesh_group(&model->mesh, tie->on, TIES, err),
                                 .with = uz_mesh_group(&model->mesh, tie->to, TIES, err)};
    if (!in.on || !in.with)
        return UZ_ERR_SCENE;
    const uz_status status = uz_surface_to_surface.find(sites, &in, err);
    if (status != UZ_OK && err && strncmp(err->where, CONTACTS, sizeof CONTACTS - 1) == 0) {
        char rest[sizeof err->where];
        memcpy(rest, err->where, sizeof rest);
        snprintf(err->where, sizeof err->where, "%s%s", TIES, rest + sizeof CONTACTS - 1);
    }
    return status;
}

/* Adds the masters of each slave, by area times weight. */
static uz_status add_tie(uz_entries *to, const uz_body_model *model, const uz_tie *tie, int64_t k, uz_error *err)
{
    uz_contact_sites sites = {.n = 0};
    uz_status status = find_sites(&sites, model, tie, k, err);
    const int64_t before = to->n;
    double nearest = INFINITY;
    for (int64_t p = 0; p < sites.n && status == UZ_OK; p++) {
        if (!isfinite(sites.gap[p]))
            continue;
        const double near = tie->tolerance > 0 ? tie->tolerance : NEAR * longest_edge(model, sites.face[p]);
        nearest = fmin(nearest, fabs(sites.gap[p]));
        for (int64_t q = sites.first[p]; q < sites.first[p + 1] && fabs(sites.gap[p]) <= near; q++)
            uz_entries_add(to, sites.node[q], sites.at[p], sites.area[p] * sites.weight[q]);
    }
    if (status == UZ_OK && to->n == before && !to->failed)
        status =
            uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("ties", k, NULL),
                    "\"%.63s\" is not near enough to \"%.63s\" to be tied: %g apart; give a tolerance, or move the "
                    "parts together",
                    tie->on, tie->to, nearest);
    uz_contact_sites_clear(&sites);
    return status;
}

/* Is each master a node that is none's slave, and no hanging one? */
static uz_status check_masters(const uz_tied *tied, const uz_mesh *mesh, uz_error *err)
{
    const uz_csc *share = &tied->share;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (int64_t q = share->ptr[a]; q < share->ptr[a + 1]; q++) {
            const int64_t master = share->idx[q];
            if (share->ptr[master] < share->ptr[master + 1])
                return uz_fail(err, UZ_ERR_SCENE, "/ties",
                               "node %lld follows a surface that it is tied to, and others follow it: of two ties that "
                               "meet leave the sides at that node out of one",
                               (long long)master);
        }
    return UZ_OK;
}

uz_status uz_find_tied(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes;
    uz_tied *tied = &model->tied;
    uz_entries all = {.n = 0};
    uz_status status = UZ_OK;
    if (scene->n_ties == 0)
        return UZ_OK;
    if (model->mesh.hangs)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/refine",
                       "quadrilaterals and hexahedra are not refined where parts are tied: use triangles, tetrahedra, "
                       "or a finer mesh");
    for (int64_t k = 0; k < scene->n_ties && status == UZ_OK; k++)
        status = add_tie(&all, model, &scene->ties[k], k, err);
    if (status == UZ_OK)
        status = uz_csc_from_entries(&tied->share, n, n, &all, err);
    uz_entries_clear(&all);
    for (int64_t a = 0; a < n && status == UZ_OK; a++) { /* by area, where several places or ties have the node */
        double sum = 0, *value = tied->share.val;
        for (int64_t q = tied->share.ptr[a]; q < tied->share.ptr[a + 1]; q++)
            sum += value[q];
        for (int64_t q = tied->share.ptr[a]; q < tied->share.ptr[a + 1]; q++)
            value[q] = fabs(value[q]) > ROUNDING * fabs(sum) ? value[q] / sum : 0;
    }
    return status == UZ_OK ? check_masters(tied, &model->mesh, err) : status;
}

bool uz_is_tied(const uz_body_model *model, int64_t node)
{
    const int64_t *ptr = model->tied.share.ptr;
    return ptr && ptr[node] < ptr[node + 1];
}

uz_status uz_number_tied(uz_body_model *model, uz_error *err)
{
    const int dim = model->mesh.dim;
    for (int64_t a = 0; a < model->mesh.n_nodes && model->tied.share.ptr; a++) {
        if (!uz_is_tied(model, a))
            continue;
        if (uz_is_rigid(model, a))
            return uz_fail(err, UZ_ERR_SCENE, "/ties",
                           "node %lld follows a surface that it is tied to, and is of a rigid group: leave the sides "
                           "there out of one",
                           (long long)a);
        for (int c = 0; c < dim; c++) /* what supports hold stays */
            if (model->dof[a * dim + c] == 0)
                model->dof[a * dim + c] = UZ_NO_DOF;
    }
    return UZ_OK;
}

double uz_tied_value(const uz_body_model *model, int64_t a, const double *value, int64_t stride)
{
    const uz_csc *share = &model->tied.share;
    double sum = 0;
    for (int64_t q = share->ptr[a]; q < share->ptr[a + 1]; q++)
        sum += share->val[q] * value[share->idx[q] * stride];
    return sum;
}

double uz_tied_along(const uz_body_model *model, int64_t a, int c, const double *nodal)
{
    double v[3];
    for (int i = 0; i < model->mesh.dim; i++)
        v[i] = uz_tied_value(model, a, nodal + i, model->mesh.dim);
    return uz_along_dof(model, a, c, v);
}

void uz_tied_part(double v[3], const uz_body_model *model, int64_t a)
{
    double local[3];
    uz_to_frame(local, model, a, v);
    for (int c = 0; c < model->mesh.dim; c++)
        v[c] = model->dof[a * model->mesh.dim + c] == UZ_NO_DOF ? local[c] : 0;
    uz_from_frame(v, model, a);
}
