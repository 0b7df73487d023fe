/* recover.c: stress and strain at nodes.
 *
 * Derivatives of a finite element solution are most accurate at certain points of each element (Barlow, Int. J. Numer.
 * Meth. Engng 10 (1976) 243-251): the Gauss points of one order less than the element's. From there they are continued
 * over the element by the polynomial that the points determine, and averaged at the nodes. Linear elements have one
 * such point alone, and get their slope from their neighbours where these tell it (patches.c). */
#include "post/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = UZ_ELEMENT_SAMPLES, BETWEEN_QUESTIONS = 1024 };

/* The points of a kind, and what each of them gives to each node. */
typedef struct {
    int points;
    double point[POINTS][3];
    double share[UZ_ELEMENT_NODES][POINTS];
    uz_field_points states; /* at these points, once there is an element of the kind */
    bool known;
} recovery;

/* Sums at the nodes, but for those that are done. */
typedef struct {
    double *stress, *strain, *volume; /* stress, strain: NULL where they are not wanted */
    unsigned char *done;
} nodal_sums;

/* sum[node] += volume x what the points give to that node. */
static void add_to_nodes(double *sum, const unsigned char *done, const recovery *plan,
                         double value[POINTS][UZ_FIELD_COMPONENTS], const int64_t *node, int nodes, int components,
                         double volume)
{
    for (int a = 0; sum && a < nodes; a++)
        for (int c = 0; !done[node[a]] && c < components; c++) {
            double at_node = 0;
            for (int k = 0; k < plan->points; k++)
                at_node += plan->share[a][k] * value[k][c];
            sum[node[a] * components + c] += volume * at_node;
        }
}

static void add_element(const nodal_sums *to, recovery *plan, const uz_field_body *body, int64_t element)
{
    uz_field_state state[UZ_ELEMENT_GAUSS];
    double sigma[POINTS][UZ_FIELD_COMPONENTS], epsilon[POINTS][UZ_FIELD_COMPONENTS];
    int nodes;
    const int64_t *node = uz_mesh_element(&body->model->mesh, element, &nodes);
    uz_field_points_states(state, &plan->states, element);
    for (int k = 0; k < plan->points; k++) {
        memcpy(sigma[k], state[k].stress, sizeof sigma[k]);
        memcpy(epsilon[k], state[k].strain, sizeof epsilon[k]);
    }
    const double size = uz_field_points_volume(&plan->states, element);
    for (int a = 0; a < nodes; a++)
        to->volume[node[a]] += size;
    add_to_nodes(to->stress, to->done, plan, sigma, node, nodes, body->components, size);
    add_to_nodes(to->strain, to->done, plan, epsilon, node, nodes, body->components, size);
}

static void divide(double *sum, const nodal_sums *by, int64_t n_nodes, int components)
{
    for (int64_t a = 0; sum && a < n_nodes; a++)
        for (int c = 0; !by->done[a] && c < components; c++)
            sum[a * components + c] = by->volume[a] > 0 ? sum[a * components + c] / by->volume[a] : NAN;
}

static uz_status average_the_others(const nodal_sums *to, recovery plan[UZ_ELEMENT_KINDS], const uz_field_body *body,
                                    const double *u, const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &body->model->mesh;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        recovery *own = &plan[mesh->kind[e]];
        if (e % BETWEEN_QUESTIONS == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while stresses were computed");
        int nodes, done = 0;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        while (done < nodes && to->done[node[done]])
            done++;
        if (done == nodes)
            continue;
        if (!own->known) {
            const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
            memset(own, 0, sizeof *own);
            own->points = uz_element_type_of(kind)->recover(own->point, own->share, kind);
            own->states.count = own->points;
            memcpy(own->states.point, own->point, sizeof own->point);
            uz_field_points_init(&own->states, body, u);
            own->known = true;
        }
        add_element(to, own, body, e);
    }
    divide(to->stress, to, mesh->n_nodes, body->components);
    divide(to->strain, to, mesh->n_nodes, body->components);
    return UZ_OK;
}

uz_status uz_field_recover(double *stress, double *strain, const uz_field_body *body, const double *u,
                           const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &body->model->mesh;
    const size_t bytes = (size_t)(mesh->n_nodes * body->components) * sizeof(double);
    nodal_sums to = {.stress = stress, .strain = strain};
    to.volume = uz_alloc_zero(mesh->n_nodes, sizeof *to.volume);
    to.done = uz_alloc_zero(mesh->n_nodes, 1);
    recovery *plan = uz_alloc_zero(UZ_ELEMENT_KINDS, sizeof *plan);
    if (stress)
        memset(stress, 0, bytes);
    if (strain)
        memset(strain, 0, bytes);
    uz_status status = UZ_OK;
    if (!to.volume || !to.done || !plan)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stress at %lld nodes", (long long)mesh->n_nodes);
    if (status == UZ_OK)
        status = uz_field_fit_patches(stress, strain, to.done, body, u, hooks, err);
    if (status == UZ_OK)
        status = average_the_others(&to, plan, body, u, hooks, err);
    free(plan);
    free(to.volume);
    free(to.done);
    return status;
}

/* ---- Gauss points */

int64_t uz_field_gauss_count(const uz_field_body *body)
{
    const uz_mesh *mesh = &body->model->mesh;
    int64_t count = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        count += uz_element_gauss_count((uz_element_kind)mesh->kind[e], body->scene->model);
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
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stress at Gauss points");
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
            own->points.count = uz_element_gauss_count(kind, body->scene->model);
            for (int g = 0; g < own->points.count; g++) {
                uz_element_gauss(own->points.point[g], kind, body->scene->model, g);
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
