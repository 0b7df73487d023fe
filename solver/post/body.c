/* body.c: the state of each element of a scene, from displacements and temperature. */
#include "post/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

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
    if (fill_temperature(out))
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the temperature of %lld elements",
                   (long long)model->mesh.n_elements);
}

void uz_field_body_clear(uz_field_body *body)
{
    free(body->rise);
    memset(body, 0, sizeof *body);
}

/* Displacements of one element's nodes; returns how many numbers. */
static int gather(double *out, const uz_mesh *mesh, const double *u, int64_t element)
{
    int nodes;
    const int64_t *node = uz_mesh_element(mesh, element, &nodes);
    for (int a = 0; a < nodes; a++)
        memcpy(out + a * mesh->dim, u + node[a] * mesh->dim, (size_t)mesh->dim * sizeof *u);
    return nodes * mesh->dim;
}

void uz_field_element_at(uz_field_element *out, const uz_field_body *body, const double *u, int64_t element)
{
    gather(out->u, &body->model->mesh, u, element);
    uz_body_element(&out->element, out->xyz, body->model, element);
    out->material = uz_element_material(body->model, element);
    out->free_strain = body->rise ? out->material->expansion * body->rise[element] : 0;
    uz_element_move(&out->motion, &out->element, out->u);
}

/* What a plane model leaves out: strain across the plane. */
static double strain_zz(const uz_field_element *element, const double *stress)
{
    if (element->element.model != UZ_PLANE_STRESS)
        return 0;
    const double poisson = element->material->poisson, young = 2 * element->material->lame.mu * (1 + poisson);
    return element->free_strain - poisson / young * (stress[0] + stress[1]);
}

/* Stress and strain from the strains of the model; shear strains become tensor components. Axisymmetric: rr, zz, hoop,
 * rz are xx, yy, zz, xy here. */
static void state_of_strain(uz_field_state *out, const uz_field_element *element, double strain[UZ_ELEMENT_STRESSES])
{
    const uz_model model = element->element.model;
    double thermal[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES];
    const int n = uz_stress_count(model), direct = n == 3 ? 2 : 3;
    memcpy(stress, strain, sizeof stress);
    if (element->free_strain != 0) {
        uz_thermal_strain(thermal, model, element->material->lame, element->free_strain);
        for (int c = 0; c < n; c++)
            stress[c] -= thermal[c];
    }
    uz_elastic_stress(stress, model, element->material->lame, stress);
    for (int c = direct; c < n; c++)
        strain[c] *= 0.5;
    if (n != 3) {
        memcpy(out->stress, stress, (size_t)n * sizeof *stress);
        memcpy(out->strain, strain, (size_t)n * sizeof *strain);
        return;
    }
    const double zz = uz_stress_zz(model, element->material->lame, stress, element->free_strain);
    memcpy(out->stress, (double[4]){stress[0], stress[1], zz, stress[2]}, 4 * sizeof *stress);
    memcpy(out->strain, (double[4]){strain[0], strain[1], strain_zz(element, stress), strain[2]}, 4 * sizeof *strain);
}

void uz_field_state_at(uz_field_state *out, const uz_field_element *element, const double point[3])
{
    double strain[UZ_ELEMENT_STRESSES] = {0};
    uz_element_strain(strain, &element->motion, point);
    state_of_strain(out, element, strain);
}

/* ---- the same points of element after element */

void uz_field_points_init(uz_field_points *out, const uz_field_body *body, const double *u, int64_t element)
{
    const uz_body_model *model = body->model;
    out->body = body;
    out->u = u;
    out->kind = (uz_element_kind)model->mesh.kind[element];
    out->alike = model->mesh.uniform && model->kind != UZ_AXISYMMETRIC && !model->material_of;
    out->first = out->loaded = 0;
    if (!out->alike) {
        uz_strain_rule_at(&out->rule, out->kind, model->kind, (const double(*)[3])out->point, out->count);
        return;
    }
    uz_field_element_at(&out->at, body, u, element);
    for (int k = 0; k < out->count; k++)
        uz_element_strain_operator(out->strain_of[k], &out->at.element, out->point[k]);
}

/* By the operator of all elements: no gradient is made again. */
static void states_of_alike(uz_field_state *state, uz_field_points *points, int64_t element)
{
    const uz_field_body *body = points->body;
    double *u = points->at.u;
    const int n = uz_stress_count(points->at.element.model);
    const int dofs = gather(u, &body->model->mesh, points->u, element);
    points->at.free_strain = body->rise ? points->at.material->expansion * body->rise[element] : 0;
    for (int k = 0; k < points->count; k++) {
        double strain[UZ_ELEMENT_STRESSES] = {0};
        for (int i = 0; i < n; i++) {
            const double *row = points->strain_of[k] + i * dofs;
            for (int j = 0; j < dofs; j++)
                strain[i] += row[j] * u[j];
        }
        state_of_strain(&state[k], &points->at, strain);
    }
}

/* Others average over the element, so that its Gauss points are needed too. */
static bool is_standard(const uz_body_model *model, int64_t element)
{
    return uz_resolve_formulation(model->formulation, (uz_element_kind)model->mesh.kind[element], model->kind,
                                  uz_element_material(model, element)->poisson) == UZ_FORMULATION_STANDARD;
}

/* Values (n_nodes x dim) at the nodes of the loaded elements; lanes that have none repeat the first. */
static void gather_lanes(uz_lanes *out, const uz_field_points *points, const double *value)
{
    const uz_mesh *mesh = &points->body->model->mesh;
    const int64_t *node[UZ_STRAIN_LANES];
    for (int l = 0; l < UZ_STRAIN_LANES; l++)
        node[l] = mesh->node + mesh->first[points->first + (l < points->loaded ? l : 0)];
    for (int a = 0; a < points->rule.nodes; a++)
        for (int c = 0; c < mesh->dim; c++)
            *out++ = (uz_lanes){value[node[0][a] * mesh->dim + c], value[node[1][a] * mesh->dim + c],
                                value[node[2][a] * mesh->dim + c], value[node[3][a] * mesh->dim + c]};
}

/* Strains of this element and those that follow it, as long as they are of its kind. */
static void load_lanes(uz_field_points *points, int64_t element)
{
    const uz_body_model *model = points->body->model;
    const uz_mesh *mesh = &model->mesh;
    uz_lanes x[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS];
    uz_lane_shape shape;
    points->first = element;
    points->loaded = 1;
    while (points->loaded < UZ_STRAIN_LANES && element + points->loaded < mesh->n_elements &&
           mesh->kind[element + points->loaded] == mesh->kind[element])
        points->loaded++;
    gather_lanes(x, points, mesh->xyz);
    gather_lanes(u, points, points->u);
    uz_lane_shape_of(&shape, &points->rule, x, model->thickness);
    uz_lane_strains(points->strain, &points->rule, &shape, NULL, u);
}

static void states_of_lane(uz_field_state *state, uz_field_points *points, int64_t element)
{
    const uz_field_body *body = points->body;
    uz_field_element *at = &points->at;
    if (element < points->first || element >= points->first + points->loaded)
        load_lanes(points, element);
    uz_body_element(&at->element, at->xyz, body->model, element);
    at->material = uz_element_material(body->model, element);
    at->free_strain = body->rise ? at->material->expansion * body->rise[element] : 0;
    for (int k = 0; k < points->count; k++) {
        double strain[UZ_ELEMENT_STRESSES] = {0};
        for (int c = 0; c < points->rule.stresses; c++)
            strain[c] = points->strain[k][c][element - points->first];
        state_of_strain(&state[k], at, strain);
    }
}

void uz_field_points_states(uz_field_state *state, uz_field_points *points, int64_t element)
{
    if (points->alike) {
        states_of_alike(state, points, element);
        return;
    }
    if (is_standard(points->body->model, element)) {
        states_of_lane(state, points, element);
        return;
    }
    uz_field_element_at(&points->at, points->body, points->u, element);
    for (int k = 0; k < points->count; k++)
        uz_field_state_at(&state[k], &points->at, points->point[k]);
}
