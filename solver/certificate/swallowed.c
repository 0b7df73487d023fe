/* swallowed.c: an obstacle that is inside of a body.
 *
 * It is looked at in its middle, and half of its radius from there along each axis: points that are no part of a body
 * unless much of the obstacle is. */
#include "certificate/swallowed.h"

#include "assembly/parts.h"
#include "core/vector3.h"

#include <math.h>

/* Rows leave a hundredth of a side, whose length is 2 in local coordinates, or 1. */
#define DEEP 0.06

/* The middle of the obstacle, of a cylinder next to a place. */
static void middle_of(double at[3], const uz_contact *contact, const double *near)
{
    double along = 0;
    for (int c = 0; c < 3; c++)
        at[c] = contact->point[c];
    if (contact->kind != UZ_OBSTACLE_CYLINDER)
        return;
    const double size = uz_dot3(contact->normal, contact->normal);
    for (int c = 0; c < 3; c++)
        along += (near[c] - at[c]) * contact->normal[c] / size;
    for (int c = 0; c < 3; c++)
        at[c] += along * contact->normal[c];
}

static bool holds(const uz_element_type *type, const double *xyz, double extent, const double at[3])
{
    double point[3];
    for (int c = 0; c < type->dim; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int a = 0; a < type->nodes; a++) {
            low = fmin(low, xyz[a * type->dim + c]);
            high = fmax(high, xyz[a * type->dim + c]);
        }
        const double room = 0.25 * (high - low); /* curved sides leave the box of their nodes */
        if (!(at[c] > low - room && at[c] < high + room))
            return false;
    }
    return uz_element_find(point, type, xyz, extent, at) && uz_element_depth(type, point) > DEEP;
}

bool uz_swallows(const uz_body_model *model, const uz_scene *scene, int64_t k, const double *u)
{
    const uz_contact *contact = &scene->contacts[k];
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    if ((contact->kind != UZ_OBSTACLE_ROUND && contact->kind != UZ_OBSTACLE_CYLINDER) || contact->inside)
        return false;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        double xyz[3 * UZ_ELEMENT_NODES], centre[3] = {0}, at[3];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        for (int i = 0; i < dim * count; i++) {
            xyz[i] = mesh->xyz[dim * node[i / dim] + i % dim] + u[dim * node[i / dim] + i % dim];
            centre[i % dim] += xyz[i] / count;
        }
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        for (int way = 0; way <= 2 * dim; way++) {
            middle_of(at, contact, centre);
            if (way > 0)
                at[(way - 1) / 2] += (way % 2 ? 0.5 : -0.5) * contact->radius;
            if (holds(type, xyz, mesh->extent, at))
                return true;
        }
    }
    return false;
}
