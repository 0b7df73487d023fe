/* recover.c: stress and strain at nodes and at Gauss points.
 *
 * Linear elements are accurate in their middle alone, and get their slope from their neighbours where these tell it
 * (patches.c); all others continue their own strain to the nodes (assembly/nodal_strains.c). */
#include "post/parts.h"

#include "assembly/nodal_strains.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BETWEEN_QUESTIONS = 1024 };

/* Sums at the nodes that are not done, over the materials that meet there, and the volumes that they are divided by. */
static void average_materials(double *stress, double *strain, double *volume, const unsigned char *done,
                              const uz_nodal_strains *recovered, const uz_field_body *body)
{
    const int n = body->components, strains = recovered->strains;
    const int64_t n_nodes = body->model->mesh.n_nodes;
    for (int64_t i = 0; i < recovered->count; i++) {
        const int64_t node = recovered->node ? recovered->node[i] : i;
        const double *row = recovered->rows + i * recovered->size;
        const double own = row[strains], free_strain = recovered->size > strains + 1 ? row[strains + 1] : 0;
        const uz_body_material *material = &body->model->materials[recovered->material ? recovered->material[i] : 0];
        double of_place[UZ_ELEMENT_STRESSES] = {0};
        uz_field_state state;
        if (done[node])
            continue;
        memcpy(of_place, row, (size_t)strains * sizeof *row);
        uz_field_state_of_strain(&state, body->model->kind, material, free_strain, of_place);
        volume[node] += own;
        for (int c = 0; stress && c < n; c++)
            stress[node * n + c] += own * state.stress[c];
        for (int c = 0; strain && c < n; c++)
            strain[node * n + c] += own * state.strain[c];
    }
    for (int64_t a = 0; a < n_nodes; a++)
        for (int c = 0; !done[a] && c < n; c++) {
            if (stress)
                stress[a * n + c] = volume[a] > 0 ? stress[a * n + c] / volume[a] : NAN;
            if (strain)
                strain[a * n + c] = volume[a] > 0 ? strain[a * n + c] / volume[a] : NAN;
        }
}

/* Of finite kinematics, whose stress does not follow from strains at nodes: the stress at the points where an element
 * is most accurate, continued to its nodes, and averaged by volume; of nodes that are not done. */
static void average_states(double *stress, double *strain, double *volume, const unsigned char *done,
                           const uz_field_body *body, const double *u)
{
    const uz_mesh *mesh = &body->model->mesh;
    const int n = body->components;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        double share[UZ_ELEMENT_NODES][UZ_ELEMENT_SAMPLES], sample[UZ_ELEMENT_SAMPLES][3], xyz[3 * UZ_ELEMENT_NODES];
        uz_field_state state[UZ_ELEMENT_SAMPLES];
        uz_field_points points = {.count = uz_element_type_of(kind)->recover(sample, share, kind)};
        uz_element element;
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        memcpy(points.point, sample, (size_t)points.count * sizeof *sample);
        uz_field_points_init(&points, body, u);
        uz_field_points_states(state, &points, e);
        uz_body_element(&element, xyz, body->model, e);
        const double own = uz_element_volume(&element);
        for (int a = 0; a < count; a++) {
            if (done[node[a]])
                continue;
            volume[node[a]] += own;
            for (int k = 0; k < points.count; k++)
                for (int c = 0; c < n; c++) {
                    if (stress)
                        stress[node[a] * n + c] += own * share[a][k] * state[k].stress[c];
                    if (strain)
                        strain[node[a] * n + c] += own * share[a][k] * state[k].strain[c];
                }
        }
    }
    for (int64_t i = 0; i < mesh->n_nodes * n; i++) {
        if (stress && !done[i / n])
            stress[i] = volume[i / n] > 0 ? stress[i] / volume[i / n] : NAN;
        if (strain && !done[i / n])
            strain[i] = volume[i / n] > 0 ? strain[i] / volume[i / n] : NAN;
    }
}

uz_status uz_field_recover(double *stress, double *strain, const uz_field_body *body, const double *u,
                           const uz_hooks *hooks, uz_error *err)
{
    const int64_t n_nodes = body->model->mesh.n_nodes;
    const size_t bytes = (size_t)(n_nodes * body->components) * sizeof(double);
    const uz_strain_source from = {.model = body->model, .nodal = u, .free_strain = body->free_strain};
    uz_nodal_strains recovered = {0};
    double *volume = uz_alloc_zero(n_nodes, sizeof *volume);
    unsigned char *done = uz_alloc_zero(n_nodes, 1);
    if (stress)
        memset(stress, 0, bytes);
    if (strain)
        memset(strain, 0, bytes);
    uz_status status = UZ_OK;
    if (!volume || !done)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stress at %lld nodes", (long long)n_nodes);
    if (status == UZ_OK)
        status = uz_field_fit_patches(stress, strain, done, body, u, hooks, err);
    if (status == UZ_OK && uz_is_finite_answer(body->scene)) {
        average_states(stress, strain, volume, done, body, u);
    } else if (status == UZ_OK && memchr(done, 0, (size_t)n_nodes)) {
        status = uz_nodal_strains_recover(&recovered, &from, UZ_CONTINUE_WHOLE, hooks, err);
        if (status == UZ_OK)
            average_materials(stress, strain, volume, done, &recovered, body);
        uz_nodal_strains_clear(&recovered);
    }
    for (int64_t a = 0; a < n_nodes && status == UZ_OK; a++) /* as the sides that they hang on */
        for (int c = 0; c < body->components && uz_mesh_hangs(&body->model->mesh, a); c++) {
            if (stress)
                stress[a * body->components + c] =
                    uz_mesh_value_amid(&body->model->mesh, a, stress + c, body->components);
            if (strain)
                strain[a * body->components + c] =
                    uz_mesh_value_amid(&body->model->mesh, a, strain + c, body->components);
        }
    uz_free_all(volume, done);
    return status;
}

/* ---- Gauss points */

int64_t uz_field_gauss_count(const uz_field_body *body)
{
    const uz_mesh *mesh = &body->model->mesh;
    int64_t count = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        count += uz_element_rule((uz_element_kind)mesh->kind[e], body->scene->model)->count;
    return count;
}

/* The Gauss points of elements of one kind, and the shape functions there. */
typedef struct {
    uz_field_points points;
    double N[UZ_ELEMENT_GAUSS][UZ_ELEMENT_NODES];
    bool known;
} gauss_plan;

uz_status uz_field_gauss(double *element, double *point, double *stress, const uz_field_body *body, const double *u,
                         const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &body->model->mesh;
    uz_field_state state[UZ_ELEMENT_GAUSS];
    uz_status status = UZ_OK;
    gauss_plan *plan = uz_alloc_zero(UZ_ELEMENT_KINDS, sizeof *plan);
    if (!plan)
        return uz_no_memory(err, "the stress at Gauss points");
    for (int64_t e = 0; status == UZ_OK && e < mesh->n_elements; e++) {
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        gauss_plan *own = &plan[kind];
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        if (e % BETWEEN_QUESTIONS == 0 && uz_cancelled(hooks)) {
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while stresses were computed");
            break;
        }
        if (!own->known) {
            const uz_gauss_rule *rule = uz_element_rule(kind, body->scene->model);
            own->points.count = rule->count;
            for (int g = 0; g < own->points.count; g++) {
                memcpy(own->points.point[g], rule->point[g].at, sizeof own->points.point[g]);
                uz_element_shape(own->N[g], kind, own->points.point[g]);
            }
            uz_field_points_init(&own->points, body, u);
            own->known = true;
        }
        uz_field_points_states(state, &own->points, e);
        for (int g = 0; g < own->points.count; g++) {
            *element++ = (double)e;
            for (int c = 0; c < mesh->dim; c++, point++) {
                *point = 0;
                for (int a = 0; a < nodes; a++)
                    *point += own->N[g][a] * mesh->xyz[node[a] * mesh->dim + c];
            }
            memcpy(stress, state[g].stress, (size_t)body->components * sizeof *stress);
            stress += body->components;
        }
    }
    free(plan);
    return status;
}
