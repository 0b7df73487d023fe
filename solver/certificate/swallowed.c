/* swallowed.c: an obstacle that is inside of a body.
 *
 * Round ones are looked at in their middle, and half of their radius from there along each axis; lines and tables of
 * heights in the plane in their corners. */
#include "certificate/swallowed.h"

#include "assembly/body_parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>

/* How deep in an element a corner is in the body, in lengths of its edges: rows leave a hundredth of a side. Round
 * obstacles are nowhere in it, be it between two elements, but for rounding. */
#define DEEP   0.03
#define AT_ALL (-1e-9)

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

/* How many points are looked at. */
static int64_t count_points(const uz_contact *contact, int dim)
{
    switch (contact->kind) {
    case UZ_OBSTACLE_ROUND:
    case UZ_OBSTACLE_CYLINDER:
        return contact->inside ? 0 : 2 * dim + 1;
    case UZ_OBSTACLE_POLYLINE:
        return contact->n_x;
    case UZ_OBSTACLE_HEIGHT:
        return dim == 2 ? contact->n_x : 0;
    default:
        return 0;
    }
}

/* One of them, of a cylinder next to a place. */
static void point_of(double at[3], const uz_contact *contact, int64_t i, const double *near)
{
    if (contact->kind == UZ_OBSTACLE_POLYLINE || contact->kind == UZ_OBSTACLE_HEIGHT) {
        at[0] = contact->x[i];
        at[1] = contact->kind == UZ_OBSTACLE_POLYLINE ? contact->y[i] : contact->z[i];
        at[2] = 0;
        return;
    }
    middle_of(at, contact, near);
    if (i > 0)
        at[(i - 1) / 2] += (i % 2 ? 0.5 : -0.5) * contact->radius;
}

static bool holds(const uz_element_type *type, const double *xyz, double extent, const double at[3], double deep)
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
    return uz_element_find(point, type, xyz, extent, at) && uz_element_depth(type, point) > deep;
}

/* An element of the displaced body. */
static bool looks_into(const uz_body_model *model, const uz_contact *contact, int64_t e, const double *u)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    double xyz[3 * UZ_ELEMENT_NODES] = {0}, centre[3] = {0}, at[3];
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
    for (int i = 0; i < dim * count; i++) {
        xyz[i] = mesh->xyz[dim * node[i / dim] + i % dim] + u[dim * node[i / dim] + i % dim];
        centre[i % dim] += xyz[i] / count;
    }
    const bool round = contact->kind == UZ_OBSTACLE_ROUND || contact->kind == UZ_OBSTACLE_CYLINDER;
    const double edge = type->corners == 4 ? 2 : 1, deep = round ? AT_ALL : DEEP * edge;
    for (int64_t i = 0; i < count_points(contact, dim); i++) {
        point_of(at, contact, i, centre);
        if (holds(type, xyz, mesh->extent, at, deep))
            return true;
    }
    return false;
}

uz_status uz_swallows(bool *inside, const uz_body_model *model, const uz_scene *scene, int64_t k, const double *u,
                      uz_error *err)
{
    const uz_contact *contact = &scene->contacts[k];
    const uz_mesh *mesh = &model->mesh;
    const uz_group *group = uz_mesh_group(mesh, contact->on, "", NULL);
    uz_parts parts = {0};
    *inside = false;
    if (count_points(contact, mesh->dim) == 0 || !group)
        return UZ_OK;
    uz_status status = uz_find_parts(&parts, model, err);
    bool *touches = status == UZ_OK ? uz_alloc_zero(parts.count, sizeof *touches) : NULL;
    if (status == UZ_OK && !touches)
        status = uz_no_memory(err, "the parts of a contact");
    for (int64_t i = 0; status == UZ_OK && i < uz_group_node_count(mesh, group); i++)
        touches[parts.of[uz_group_node_at(group, i)]] = true;
    for (int64_t e = 0; status == UZ_OK && e < mesh->n_elements && !*inside; e++)
        *inside = touches[parts.of[mesh->node[mesh->first[e]]]] && looks_into(model, contact, e, u);
    free(touches);
    uz_parts_clear(&parts);
    return status;
}
