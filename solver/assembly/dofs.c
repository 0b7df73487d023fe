/* dofs.c: which unknowns are free, and what the supported ones are given. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Marks the dofs of one support with -1. */
static void mark_support(uz_body_model *model, const uz_support *support, const uz_group *group)
{
    const int dim = model->mesh.dim;
    const int64_t count = uz_group_node_count(&model->mesh, group);
    for (int64_t i = 0; i < count; i++)
        for (int c = 0; c < dim; c++)
            if (!isnan(support->u[c]))
                model->dof[uz_group_node_at(group, i) * dim + c] = -1;
}

static void number(uz_body_model *model)
{
    const int64_t total = model->mesh.n_nodes * model->mesh.dim;
    model->d = model->n_fixed = 0;
    for (int64_t i = 0; i < total; i++)
        model->dof[i] = model->dof[i] < 0 ? -1 - model->n_fixed++ : model->d++;
}

uz_status uz_number_dofs(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    model->dof = uz_alloc_zero(mesh->n_nodes * mesh->dim, sizeof *model->dof);
    if (!model->dof)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the numbers of %lld nodes", (long long)mesh->n_nodes);
    for (int64_t i = 0; i < scene->n_supports; i++) {
        const uz_group *group = uz_mesh_group(mesh, scene->supports[i].on, "/supports", err);
        if (!group)
            return UZ_ERR_SCENE;
        mark_support(model, &scene->supports[i], group);
    }
    number(model);
    if (model->d == 0)
        return uz_fail(err, UZ_ERR_SCENE, "/supports", "the supports hold every node: nothing is left to move");
    return UZ_OK;
}

typedef struct {
    const uz_body_model *model;
    const uz_scene *scene;
    double *value;   /* n_fixed */
    int64_t *source; /* n_fixed: 1 + the support that gave it, 0: none yet */
} prescription;

static uz_status contradiction(const prescription *p, int64_t support, int64_t node, int c, int64_t fixed,
                               uz_error *err)
{
    char where[96];
    const char axis = "xyz"[c];
    const int64_t earlier = p->source[fixed] - 1;
    snprintf(where, sizeof where, "/supports/%lld/u%c", (long long)support, axis);
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "node %lld, where \"%.63s\" meets \"%.63s\", is given u%c = %g here and %g by support %lld; "
                   "leave one of them out or make them agree",
                   (long long)node, p->scene->supports[support].on, p->scene->supports[earlier].on, axis,
                   p->scene->supports[support].u[c], p->value[fixed], (long long)earlier);
}

static uz_status prescribe(prescription *p, int64_t support, int64_t node, int c, uz_error *err)
{
    const int64_t dof = p->model->dof[node * p->model->mesh.dim + c];
    const double value = p->scene->supports[support].u[c];
    if (dof >= 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/supports", "the scene's supports are not those of this body");
    const int64_t fixed = -1 - dof;
    if (p->source[fixed] && p->value[fixed] != value)
        return contradiction(p, support, node, c, fixed, err);
    p->value[fixed] = value;
    if (!p->source[fixed])
        p->source[fixed] = support + 1;
    return UZ_OK;
}

static uz_status prescribe_group(prescription *p, int64_t support, uz_error *err)
{
    const uz_mesh *mesh = &p->model->mesh;
    const uz_group *group = uz_mesh_group(mesh, p->scene->supports[support].on, "/supports", err);
    uz_status status = group ? UZ_OK : UZ_ERR_SCENE;
    const int64_t count = group ? uz_group_node_count(mesh, group) : 0;
    for (int c = 0; c < mesh->dim; c++)
        for (int64_t i = 0; i < count && status == UZ_OK; i++)
            if (!isnan(p->scene->supports[support].u[c]))
                status = prescribe(p, support, uz_group_node_at(group, i), c, err);
    return status;
}

uz_status uz_prescribed_values(double *value, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = UZ_OK;
    prescription p = {model, scene, value, uz_alloc_zero(model->n_fixed, sizeof *p.source)};
    if (!p.source)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld supported dofs", (long long)model->n_fixed);
    for (int64_t i = 0; i < scene->n_supports && status == UZ_OK; i++)
        status = prescribe_group(&p, i, err);
    free(p.source);
    return status;
}
