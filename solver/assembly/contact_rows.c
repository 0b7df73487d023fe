/* contact_rows.c: the rows of N, and what each of them is in the mesh. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool uz_is_contact_row(const uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    for (int c = 0; c < dim; c++)
        if (normal[c] != 0 && model->dof[node * dim + c] >= 0)
            return true;
    return false;
}

/* The obstacle's normal and the group that can touch it. The scene was checked. */
static const uz_group *read_contact(double normal[3], const uz_mesh *mesh, const uz_contact *contact, uz_error *err)
{
    const uz_group *group = uz_mesh_group(mesh, contact->on, "/contacts", err);
    uz_unit_normal(normal, contact->normal, mesh->dim);
    return group;
}

static uz_status count_rows(int64_t *rows, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    double normal[3];
    *rows = 0;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group = read_contact(normal, &model->mesh, &scene->contacts[k], err);
        if (!group)
            return UZ_ERR_SCENE;
        for (int64_t i = 0; i < uz_group_node_count(&model->mesh, group); i++)
            *rows += uz_is_contact_row(model, uz_group_node_at(group, i), normal);
        if (*rows > UZ_SCENE_MAX_DOFS)
            return uz_fail(err, UZ_ERR_SCENE, "/contacts", "more than %d contact candidates; use fewer contacts",
                           UZ_SCENE_MAX_DOFS);
    }
    return UZ_OK;
}

/* N as triplets, and one double per node for tributary areas: zero between contacts. */
typedef struct {
    int64_t count, *row, *col;
    double *val, *area;
} row_work;

/* A consistent constant pressure gives each end of an edge half of its area. */
static void spread_area(double *area, const uz_body_model *model, const uz_group *group)
{
    for (int64_t e = 0; e < group->n_faces; e++) {
        int64_t ends[UZ_FACE_NODES];
        uz_mesh_face(ends, &model->mesh, group->face[e]);
        const double half = 0.5 * uz_edge_area(model, ends);
        area[ends[0]] += half;
        area[ends[1]] += half;
    }
}

/* The normal along the node's free dofs. In a turned frame what rounding has left across the normal becomes zero: it
 * would make a second entry out of noise. */
static void free_shares(double share[3], const uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double largest = 0;
    uz_to_frame(share, model, node, normal);
    for (int c = 0; c < dim; c++) {
        if (model->dof[node * dim + c] < 0)
            share[c] = 0;
        largest = fmax(largest, fabs(share[c]));
    }
    for (int c = 0; c < dim && uz_node_frame(model, node); c++)
        if (fabs(share[c]) <= 8 * DBL_EPSILON * largest)
            share[c] = 0;
}

static void add_row(uz_body_model *model, row_work *work, int64_t row, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double share[3];
    model->info.contact_node[row] = node;
    model->info.contact_area[row] = work->area[node];
    memcpy(model->info.contact_normal + row * dim, normal, (size_t)dim * sizeof *normal);
    free_shares(share, model, node, normal);
    for (int c = 0; c < dim; c++) {
        if (share[c] == 0)
            continue;
        work->row[work->count] = row;
        work->col[work->count] = model->dof[node * dim + c];
        work->val[work->count++] = -share[c];
    }
}

static void add_contact(uz_body_model *model, row_work *work, int64_t *row, const uz_group *group,
                        const double normal[3])
{
    const int64_t count = uz_group_node_count(&model->mesh, group);
    spread_area(work->area, model, group);
    for (int64_t i = 0; i < count; i++) {
        const int64_t node = uz_group_node_at(group, i);
        if (uz_is_contact_row(model, node, normal))
            add_row(model, work, (*row)++, node, normal);
        work->area[node] = 0;
    }
}

static bool alloc_rows(uz_body_model *model, row_work *work)
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    info->contact_node = uz_alloc(model->m, sizeof *info->contact_node);
    info->contact_area = uz_alloc(model->m, sizeof *info->contact_area);
    info->contact_normal = uz_alloc(model->m * dim, sizeof *info->contact_normal);
    work->count = 0;
    work->row = uz_alloc(model->m * dim, sizeof *work->row);
    work->col = uz_alloc(model->m * dim, sizeof *work->col);
    work->val = uz_alloc(model->m * dim, sizeof *work->val);
    work->area = uz_alloc_zero(model->mesh.n_nodes, sizeof *work->area);
    return info->contact_node && info->contact_area && info->contact_normal && work->row && work->col && work->val &&
           work->area;
}

static void free_work(row_work *work)
{
    free(work->row);
    free(work->col);
    free(work->val);
    free(work->area);
}

uz_status uz_build_contact_rows(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    row_work work;
    double normal[3];
    int64_t row = 0;
    uz_status status = count_rows(&model->m, model, scene, err);
    if (status != UZ_OK)
        return status;
    if (!alloc_rows(model, &work)) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
        goto done;
    }
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group = read_contact(normal, &model->mesh, &scene->contacts[k], err);
        add_contact(model, &work, &row, group, normal);
    }
    status = uz_csc_from_triplets(&model->N, model->m, model->d, work.count, work.row, work.col, work.val, err);
done:
    free_work(&work);
    return status;
}

/* (x + u - point) . n with the prescribed displacements in u and zero for the free ones. The sum is also given in
 * absolute values: the size against which a rounding error is small. */
static double gap_at(double *scale, const uz_body_model *model, int64_t node, const double *prescribed,
                     const double point[3], const double normal[3])
{
    const int dim = model->mesh.dim;
    double gap = 0;
    *scale = 0;
    for (int c = 0; c < dim; c++) {
        const int64_t dof = model->dof[node * dim + c];
        const double x = model->mesh.xyz[node * dim + c], u = dof < 0 ? prescribed[-1 - dof] : 0;
        gap += ((x - point[c]) + u) * normal[c];
        *scale += (fabs(x) + fabs(point[c]) + fabs(u)) * fabs(normal[c]);
    }
    return gap;
}

/* A node without a row cannot give way: it must be outside, up to what is surely rounding or of no consequence. */
static uz_status check_held(const uz_body_model *model, int64_t contact, int64_t node, double gap, double scale,
                            uz_error *err)
{
    char where[96];
    const double *x = model->mesh.xyz + node * model->mesh.dim;
    if (gap >= -1e-9 * model->mesh.extent - 1e-13 * scale)
        return UZ_OK;
    snprintf(where, sizeof where, "/contacts/%lld", (long long)contact);
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "node %lld at (%g, %g) is held by a support %g inside the obstacle and cannot give way; "
                   "move the obstacle, or let the node move along its normal",
                   (long long)node, x[0], x[1], -gap);
}

uz_status uz_initial_gaps(double *h, const double *prescribed, const uz_body_model *model, const uz_scene *scene,
                          uz_error *err)
{
    double normal[3], scale;
    int64_t row = 0;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        const uz_group *group = read_contact(normal, &model->mesh, &scene->contacts[k], err);
        const int64_t count = group ? uz_group_node_count(&model->mesh, group) : 0;
        if (!group)
            return UZ_ERR_SCENE;
        for (int64_t i = 0; i < count && status == UZ_OK; i++) {
            const int64_t node = uz_group_node_at(group, i);
            const double gap = gap_at(&scale, model, node, prescribed, scene->contacts[k].point, normal);
            if (!uz_is_contact_row(model, node, normal))
                status = check_held(model, k, node, gap, scale, err);
            else if (row == model->m)
                return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", "the scene's contacts are not those of this body");
            else
                h[row++] = gap;
        }
    }
    if (status == UZ_OK && row != model->m)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", "the scene's contacts are not those of this body");
    return status;
}
