/* body.c: the state of each element of a scene, from displacements and temperature. */
#include "post/parts.h"

#include "core/error.h"
#include "finite/finite_element.h"
#include "scene/scene.h"

#include <stdlib.h>
#include <string.h>

uz_status uz_field_body_init(uz_field_body *out, const uz_scene *scene, const uz_body_model *model, uz_error *err)
{
    *out = (uz_field_body){.scene = scene, .model = model, .components = model->mesh.dim == 2 ? 4 : 6};
    if (!scene->free_strain) {
        const uz_status status = uz_free_strains(&out->own, model, scene, err);
        out->free_strain = out->own;
        return status;
    }
    if (scene->n_free_strain != model->mesh.n_elements)
        return uz_fail(err, UZ_ERR_SIZE, "free_strain", "%lld elements have temperatures, and the mesh has %lld",
                       (long long)scene->n_free_strain, (long long)model->mesh.n_elements);
    out->free_strain = scene->free_strain;
    return UZ_OK;
}

void uz_field_body_clear(uz_field_body *body)
{
    free(body->own);
    memset(body, 0, sizeof *body);
}

void uz_field_points_init(uz_field_points *out, const uz_field_body *body, const double *u)
{
    out->body = body;
    out->u = u;
    out->volume = 0;
    out->group.begun = out->group.shaped = out->group.alike = false;
    out->group.count = 0;
}

/* Cauchy's stress, and the Green-Lagrange strain of the body at rest: of its warm one, which is larger by a part w, it
 * has E = (C - I) / 2 of C / (1 + w)^2. */
static void finite_states(uz_field_state *state, const uz_field_points *points, int64_t e)
{
    const uz_body_model *model = points->body->model;
    const int dim = model->mesh.dim;
    double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS];
    uz_element element;
    int count;
    const int64_t *node = uz_mesh_element(&model->mesh, e, &count);
    uz_body_element(&element, xyz, model, e);
    for (int i = 0; i < dim * count; i++)
        u[i] = points->u[dim * node[i / dim] + i % dim];
    const double warm = points->body->free_strain ? points->body->free_strain[e] : 0;
    uz_finite_warm(&element, xyz, u, warm);
    for (int k = 0; k < points->count; k++) {
        uz_finite_state at;
        uz_finite_state_at(&at, &element, uz_element_material(model, e)->law, u, points->point[k]);
        memcpy(state[k].stress, at.stress, (size_t)points->body->components * sizeof at.stress[0]);
        for (int c = 0; c < points->body->components; c++)
            state[k].strain[c] = at.strain[c] + warm * (2 + warm) * (at.strain[c] + (c < 3 ? 0.5 : 0));
    }
}

void uz_field_points_states(uz_field_state *state, uz_field_points *points, int64_t element)
{
    if (uz_is_finite_answer(points->body->scene)) {
        finite_states(state, points, element);
        return;
    }
    uz_strain_group *group = &points->group;
    if (group->count == 0 || element < group->element[0] || element >= group->element[0] + group->count) {
        /* This element and those that follow it, as long as they are of its kind and formulation. */
        const uz_body_model *model = points->body->model;
        const uz_mesh *mesh = &model->mesh;
        const uz_formulation formulation = uz_element_formulation(model, element);
        if (!group->begun || formulation != group->rule.formulation) {
            uz_strain_rule_at(&group->rule, (uz_element_kind)mesh->kind[element], model->kind, formulation,
                              (const double(*)[3])points->point, NULL, points->count);
            group->begun = true;
            group->shaped = group->alike = false;
        }
        group->count = 0;
        int64_t e = element;
        do
            group->element[group->count++] = e++;
        while (group->count < UZ_STRAIN_LANES && e < mesh->n_elements && mesh->kind[e] == mesh->kind[e - 1] &&
               uz_element_formulation(model, e) == formulation);
        const uz_strain_source from = {.model = model, .nodal = points->u, .free_strain = points->body->free_strain};
        uz_strain_group_load(group, &from);
    }
    const int lane = (int)(element - group->element[0]);
    const uz_body_material *material = uz_element_material(points->body->model, element);
    for (int k = 0; k < points->count; k++) {
        double strain[UZ_ELEMENT_STRESSES] = {0};
        for (int c = 0; c < group->rule.stresses; c++)
            strain[c] = group->strain[k][c][lane];
        uz_field_state_of_strain(&state[k], points->body->model->kind, material, group->free_strain[lane], strain);
    }
}

/* Shear strains become tensor components. Axisymmetric: rr, zz, hoop, rz are xx, yy, zz, xy here. */
void uz_field_state_of_strain(uz_field_state *out, uz_model model, const uz_body_material *material, double free_strain,
                              double *strain)
{
    double thermal[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES];
    const int n = uz_stress_count(model), direct = n == 3 ? 2 : 3;
    memcpy(stress, strain, sizeof stress);
    if (free_strain != 0) {
        uz_thermal_strain(thermal, model, material->lame, free_strain);
        for (int c = 0; c < n; c++)
            stress[c] -= thermal[c];
    }
    uz_elastic_stress(stress, model, material->lame, stress);
    for (int c = direct; c < n; c++)
        strain[c] *= 0.5;
    if (n != 3) {
        memcpy(out->stress, stress, (size_t)n * sizeof *stress);
        memcpy(out->strain, strain, (size_t)n * sizeof *strain);
        return;
    }
    /* What a plane model leaves out: stress and strain across the plane. */
    const double zz = uz_stress_zz(model, material->lame, stress, free_strain);
    const double strain_zz = uz_strain_zz(model, material->lame, stress, free_strain);
    memcpy(out->stress, (double[4]){stress[0], stress[1], zz, stress[2]}, 4 * sizeof *stress);
    memcpy(out->strain, (double[4]){strain[0], strain[1], strain_zz, strain[2]}, 4 * sizeof *strain);
}
