/* dofs.c: which unknowns are free, and what the supported ones are given. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Along one axis? Which, and on which side of zero. */
static int single_axis(double *sign, const double n[3], int dim)
{
    int axis = -1, shares = 0;
    for (int c = 0; c < dim; c++)
        if (n[c] != 0) {
            shares++;
            axis = c;
        }
    if (shares != 1)
        return -1;
    *sign = n[axis] < 0 ? -1 : 1;
    return axis;
}

void uz_support_values(double u[3], const uz_support *support, int dim)
{
    double n[3], sign;
    int axis;
    for (int c = 0; c < 3; c++)
        u[c] = support->kind == UZ_SUPPORT_COMPONENTS && c < dim ? support->u[c] : NAN;
    if (support->kind != UZ_SUPPORT_NORMAL || !uz_unit_normal(n, support->normal, dim))
        return;
    axis = single_axis(&sign, n, dim);
    if (axis >= 0)
        u[axis] = sign * support->value;
}

bool uz_support_is_inclined(double n[3], const uz_support *support, int dim)
{
    double sign;
    return support->kind == UZ_SUPPORT_NORMAL && uz_unit_normal(n, support->normal, dim) &&
           single_axis(&sign, n, dim) < 0;
}

bool uz_is_on_axis(const uz_body_model *model, int64_t node)
{
    const uz_mesh *mesh = &model->mesh;
    return model->kind == UZ_AXISYMMETRIC && fabs(mesh->xyz[node * mesh->dim]) <= 1e-12 * mesh->extent;
}

uz_status uz_number_dofs(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_status status = UZ_OK;
    double u[3], n[3];
    model->dof = uz_alloc_zero(mesh->n_nodes * mesh->dim, sizeof *model->dof);
    if (!model->dof)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the numbers of %lld nodes", (long long)mesh->n_nodes);
    for (int64_t a = 0; a < mesh->n_nodes && model->kind == UZ_AXISYMMETRIC; a++)
        if (uz_is_on_axis(model, a))
            model->dof[a * mesh->dim] = -1;
    for (int inclined = 0; inclined < 2; inclined++) /* axes first: they stay what they are */
        for (int64_t k = 0; k < scene->n_supports && status == UZ_OK; k++) {
            const uz_support *support = &scene->supports[k];
            const uz_group *group = uz_mesh_group(mesh, support->on, "/supports", err);
            if (!group)
                return UZ_ERR_SCENE;
            const int64_t count = uz_group_node_count(mesh, group);
            if (inclined && uz_support_is_inclined(n, support, mesh->dim)) {
                status = uz_reserve_frames(model, count, err);
                for (int64_t i = 0; i < count && status == UZ_OK; i++) { /* turned so that one of their dofs is held */
                    const int64_t node = uz_group_node_at(group, i);
                    const int held = uz_mesh_hangs(mesh, node) ? -1 : uz_hold_direction(model, node, n);
                    if (held >= 0) /* else it is already */
                        model->dof[node * mesh->dim + held] = -1;
                }
            }
            uz_support_values(u, support, mesh->dim);
            for (int64_t i = 0; i < count && !inclined; i++)
                for (int c = 0; c < mesh->dim; c++)
                    if (!isnan(u[c]))
                        model->dof[uz_group_node_at(group, i) * mesh->dim + c] = -1;
        }
    if (status != UZ_OK)
        return status;
    status = uz_number_rigid(model, scene, err);
    if (status == UZ_OK)
        status = uz_find_tied(model, scene, err);
    if (status == UZ_OK)
        status = uz_number_tied(model, err);
    if (status != UZ_OK)
        return status;
    const int64_t total = mesh->n_nodes * mesh->dim;
    model->d = model->n_fixed = 0;
    for (int64_t i = 0; i < total; i++)
        if (uz_mesh_hangs(mesh, i / mesh->dim)) /* one of a group that is held lies amid nodes of it */
            model->dof[i] = UZ_NO_DOF;
        else if (model->dof[i] != UZ_NO_DOF)
            model->dof[i] = model->dof[i] < 0 ? -1 - model->n_fixed++ : model->d++;
    if (model->d == 0)
        return uz_fail(err, UZ_ERR_SCENE, "/supports", "the supports hold every node: nothing is left to move");
    return UZ_OK;
}
