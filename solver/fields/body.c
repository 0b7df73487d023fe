/* body.c: what is known of each element of a scene: its material, its temperature, its shape. */
#include "fields/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

static void fill_materials(uz_field_body *body)
{
    const uz_mesh *mesh = &body->model->mesh;
    for (int64_t i = 0; i < body->scene->n_materials; i++) {
        const uz_group *group = uz_mesh_group(mesh, body->scene->materials[i].on, "", NULL);
        const int64_t count = group ? uz_group_element_count(mesh, group) : 0;
        for (int64_t k = 0; k < count; k++)
            body->material[uz_group_element_at(group, k)] = (int32_t)i;
    }
}

/* Loads of temperature on one element add up, as loads do. */
static bool fill_temperature(uz_field_body *body)
{
    const uz_mesh *mesh = &body->model->mesh;
    for (int64_t i = 0; i < body->scene->n_loads; i++) {
        const uz_load *load = &body->scene->loads[i];
        if (load->kind != UZ_LOAD_TEMPERATURE)
            continue;
        if (!body->rise && !(body->rise = uz_alloc_zero(mesh->n_elements, sizeof *body->rise)))
            return false;
        const uz_group *group = uz_mesh_group(mesh, load->on, "", NULL);
        const int64_t count = group ? uz_group_element_count(mesh, group) : 0;
        for (int64_t k = 0; k < count; k++)
            body->rise[uz_group_element_at(group, k)] += load->value;
    }
    return true;
}

uz_status uz_field_body_init(uz_field_body *out, const uz_scene *scene, const uz_body_model *model, uz_error *err)
{
    *out = (uz_field_body){.scene = scene, .model = model, .components = model->mesh.dim == 2 ? 4 : 6};
    out->material = uz_alloc_zero(model->mesh.n_elements, sizeof *out->material);
    if (!out->material || !fill_temperature(out))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the materials of %lld elements",
                       (long long)model->mesh.n_elements);
    fill_materials(out);
    return UZ_OK;
}

void uz_field_body_clear(uz_field_body *body)
{
    free(body->material);
    free(body->rise);
    memset(body, 0, sizeof *body);
}

void uz_field_element_at(uz_field_element *out, const uz_field_body *body, const double *u, int64_t element)
{
    const uz_mesh *mesh = &body->model->mesh;
    const uz_scene *scene = body->scene;
    const uz_material *material = &scene->materials[body->material[element]];
    const uz_element_kind kind = (uz_element_kind)mesh->kind[element];
    int nodes;
    const int64_t *node = uz_mesh_element(mesh, element, &nodes);
    for (int a = 0; a < nodes; a++)
        for (int c = 0; c < mesh->dim; c++) {
            out->xyz[a * mesh->dim + c] = mesh->xyz[node[a] * mesh->dim + c];
            out->u[a * mesh->dim + c] = u[node[a] * mesh->dim + c];
        }
    out->young = material->young;
    out->poisson = material->poisson;
    out->lame = uz_lame_of(scene->model, material->young, material->poisson);
    out->free_strain = body->rise ? material->expansion * body->rise[element] : 0;
    out->element =
        (uz_element){.kind = kind,
                     .model = scene->model,
                     .formulation = uz_resolve_formulation(scene->formulation, kind, scene->model, material->poisson),
                     .lame = out->lame,
                     .thickness = scene->thickness,
                     .xyz = out->xyz};
    uz_element_move(&out->motion, &out->element, out->u);
}

/* What a plane model leaves out: strain across the plane. */
static double strain_zz(const uz_field_element *element, const double *stress)
{
    if (element->element.model != UZ_PLANE_STRESS)
        return 0;
    return element->free_strain - element->poisson / element->young * (stress[0] + stress[1]);
}

/* Shear strains become tensor components. Axisymmetric: rr, zz, hoop, rz are xx, yy, zz, xy here. */
void uz_field_state_at(uz_field_state *out, const uz_field_element *element, const double point[3])
{
    const uz_model model = element->element.model;
    double strain[UZ_ELEMENT_STRESSES], thermal[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES];
    const int n = uz_stress_count(model), direct = n == 3 ? 2 : 3;
    uz_element_strain(strain, &element->motion, point);
    memcpy(stress, strain, sizeof stress);
    if (element->free_strain != 0) {
        uz_thermal_strain(thermal, model, element->lame, element->free_strain);
        for (int c = 0; c < n; c++)
            stress[c] -= thermal[c];
    }
    uz_elastic_stress(stress, model, element->lame, stress);
    for (int c = direct; c < n; c++)
        strain[c] *= 0.5;
    if (n != 3) {
        memcpy(out->stress, stress, (size_t)n * sizeof *stress);
        memcpy(out->strain, strain, (size_t)n * sizeof *strain);
        return;
    }
    const double zz = uz_stress_zz(model, element->lame, stress, element->free_strain);
    memcpy(out->stress, (double[4]){stress[0], stress[1], zz, stress[2]}, 4 * sizeof *stress);
    memcpy(out->strain, (double[4]){strain[0], strain[1], strain_zz(element, stress), strain[2]}, 4 * sizeof *strain);
}

void uz_field_side_at(uz_field_side *out, const uz_mesh *mesh, const uz_scene *scene, uz_face face)
{
    const int nodes = uz_mesh_face(out->node, mesh, face);
    for (int a = 0; a < nodes; a++)
        memcpy(out->xyz + a * mesh->dim, mesh->xyz + out->node[a] * mesh->dim, (size_t)mesh->dim * sizeof *out->xyz);
    out->side = (uz_side){
        .dim = mesh->dim, .nodes = nodes, .model = scene->model, .thickness = scene->thickness, .xyz = out->xyz};
}
