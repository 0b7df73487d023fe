/* materials.c: which element is of what, and an element or side as solver/element takes it. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <stdio.h>
#include <string.h>

uz_status uz_take_materials(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    model->kind = scene->model;
    model->formulation = scene->formulation;
    model->thickness = scene->thickness;
    model->n_materials = scene->n_materials;
    model->materials = uz_alloc(scene->n_materials, sizeof *model->materials);
    if (!model->materials)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld materials", (long long)scene->n_materials);
    for (int64_t k = 0; k < scene->n_materials; k++) {
        const uz_material *from = &scene->materials[k];
        uz_body_material *to = &model->materials[k];
        *to = (uz_body_material){.density = from->density, .expansion = from->expansion, .law = from->law};
        if (from->is_orthotropic) {
            const double *expansion = from->orthotropic.expansion;
            uz_orthotropic_make(&to->general, scene->model, &from->orthotropic);
            to->lame = uz_lame_general(&to->general);
            to->poisson = to->general.poisson;
            to->expansion = expansion[0] != 0 || expansion[1] != 0 || expansion[2] != 0;
        } else {
            to->lame = uz_lame_of(scene->model, from->young, from->poisson);
            to->poisson = from->poisson;
        }
    }
    const int64_t n = model->mesh.n_elements;
    if (scene->n_materials <= 1)
        return UZ_OK;
    model->material_of = uz_alloc(n, sizeof *model->material_of);
    if (!model->material_of)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the materials of %lld elements", (long long)n);
    for (int64_t e = 0; e < n; e++)
        model->material_of[e] = -1;
    for (int64_t k = 0; k < scene->n_materials; k++) {
        const uz_group *group = uz_mesh_group(&model->mesh, scene->materials[k].on, "/materials", err);
        if (!group)
            return UZ_ERR_SCENE;
        for (int64_t i = 0; i < uz_group_element_count(&model->mesh, group); i++)
            model->material_of[uz_group_element_at(group, i)] = (int32_t)k;
    }
    for (int64_t e = 0; e < n; e++)
        if (model->material_of[e] < 0)
            return uz_fail(err, UZ_ERR_SCENE, "/materials", "element %lld has no material", (long long)e);
    return UZ_OK;
}

const uz_body_material *uz_element_material(const uz_body_model *model, int64_t e)
{
    return &model->materials[model->material_of ? model->material_of[e] : 0];
}

uz_formulation uz_element_formulation(const uz_body_model *model, int64_t e)
{
    return uz_resolve_formulation(model->formulation, (uz_element_kind)model->mesh.kind[e], model->kind,
                                  uz_element_material(model, e)->poisson);
}

void uz_body_element(uz_element *element, double xyz[3 * UZ_ELEMENT_NODES], const uz_body_model *model, int64_t e)
{
    const uz_mesh *mesh = &model->mesh;
    const uz_body_material *material = uz_element_material(model, e);
    const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    /* elements that are all one box share its corners, so that all have the same stiffness to the last bit */
    const double(*local)[3] = mesh->uniform && model->kind != UZ_AXISYMMETRIC ? uz_element_type_of(kind)->local : NULL;
    for (int a = 0; a < count; a++)
        for (int c = 0; c < mesh->dim; c++)
            xyz[a * mesh->dim + c] = !local ? mesh->xyz[node[a] * mesh->dim + c] : local[a][c] > 0 ? mesh->cell[c] : 0;
    *element = (uz_element){.kind = kind,
                            .model = model->kind,
                            .formulation = uz_element_formulation(model, e),
                            .lame = material->lame,
                            .thickness = model->thickness,
                            .xyz = xyz};
}

void uz_body_side(uz_side *side, double xyz[3 * UZ_FACE_NODES], int64_t node[UZ_FACE_NODES], const uz_body_model *model,
                  uz_face face)
{
    const uz_mesh *mesh = &model->mesh;
    const int count = uz_mesh_face(node, mesh, face);
    for (int a = 0; a < count; a++)
        memcpy(xyz + a * mesh->dim, mesh->xyz + node[a] * mesh->dim, (size_t)mesh->dim * sizeof *xyz);
    *side =
        (uz_side){.dim = mesh->dim, .nodes = count, .model = model->kind, .thickness = model->thickness, .xyz = xyz};
}
