/* check_boundary.c: supports and contacts. */
#include "scene/check.h"

#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <string.h>

bool uz_unit_normal(double out[3], const double normal[3], int dim)
{
    double largest = 0, norm = 0;
    memset(out, 0, 3 * sizeof *out);
    for (int c = 0; c < dim; c++) {
        if (!isfinite(normal[c]))
            return false;
        largest = fmax(largest, fabs(normal[c]));
    }
    if (!(largest > 0))
        return false;
    for (int c = 0; c < dim; c++)
        norm += (normal[c] / largest) * (normal[c] / largest);
    for (int c = 0; c < dim; c++) {
        double component = normal[c] / largest / sqrt(norm);
        out[c] = fabs(component) > 4 * DBL_EPSILON ? component : 0;
    }
    return true;
}

/* A direction: finite, not zero. */
static uz_status check_direction(const double normal[3], int dim, const char *list, int64_t i, const char *key,
                                 const char *meaning, uz_error *err)
{
    double unit[3];
    char where[UZ_CHECK_POINTER];
    uz_status status = uz_check_vector(normal, dim, list, i, key, err);
    if (status == UZ_OK && !uz_unit_normal(unit, normal, dim))
        return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, list, i, key), "the normal is zero; %s", meaning);
    return status;
}

uz_status uz_check_support(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    char where[UZ_CHECK_POINTER];
    const uz_support *support = &scene->supports[i];
    const int dim = mesh->dim;
    bool any = false;
    uz_status status;
    if (!uz_check_group(where, mesh, support->on, "supports", i, "on", err))
        return UZ_ERR_SCENE;
    switch (support->kind) {
    case UZ_SUPPORT_COMPONENTS:
        for (int c = 0; c < dim; c++) {
            const char key[3] = {'u', "xyz"[c], '\0'};
            if (isinf(support->u[c]))
                return uz_fail(err, UZ_ERR_NOT_FINITE, uz_check_place(where, "supports", i, key),
                               "the prescribed displacement is not a finite number");
            any = any || !isnan(support->u[c]);
        }
        return any ? UZ_OK
                   : uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "supports", i, NULL),
                             "this support holds no direction; give %s",
                             dim == 2 ? "ux, uy or both" : "ux, uy, uz or some");
    case UZ_SUPPORT_NORMAL:
        status = check_direction(support->normal, dim, "supports", i, "normal", "it must be the direction that is held",
                                 err);
        return status == UZ_OK ? uz_check_number(support->value, "supports", i, "u", err) : status;
    case UZ_SUPPORT_SPRING:
        if ((status = uz_check_vector(support->spring, dim, "supports", i, "spring", err)) != UZ_OK)
            return status;
        for (int c = 0; c < dim; c++) {
            const char key[] = {'s', 'p', 'r', 'i', 'n', 'g', '/', (char)('0' + c), '\0'};
            if (support->spring[c] < 0)
                return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "supports", i, key),
                               "a stiffness must not be negative; it is %g", support->spring[c]);
            any = any || support->spring[c] > 0;
        }
        if (!any)
            return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "supports", i, "spring"),
                           "this spring has no stiffness in any direction");
        if (!uz_check_sides(where, mesh, support->on, "supports", i, "on",
                            "a spring is spread over sides by area: name the sides that stand on it", err))
            return UZ_ERR_SCENE;
        return UZ_OK;
    }
    return uz_fail(err, UZ_ERR_ARGUMENT, uz_check_place(where, "supports", i, NULL), "an unknown kind of support");
}

/* A side that may touch has an outside. */
static uz_status check_contact_side(const uz_mesh *mesh, const char *on, int64_t i, const char *key, uz_error *err)
{
    char where[UZ_CHECK_POINTER];
    const uz_group *group = uz_check_sides(
        where, mesh, on, "contacts", i, key,
        mesh->dim == 2
            ? "name the side that can touch: left, right, bottom or top in a box, a group of edges in other meshes"
            : "name the side that can touch: a side of a box, a group of faces in other meshes",
        err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->n_inner > 0)
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "%lld faces of \"%s\" lie between two elements, where nothing can touch; leave them out",
                       (long long)group->n_inner, group->name);
    return UZ_OK;
}

uz_status uz_check_contact(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    char where[UZ_CHECK_POINTER];
    const uz_contact *contact = &scene->contacts[i];
    uz_status status = check_contact_side(mesh, contact->on, i, "on", err);
    if (status != UZ_OK)
        return status;
    if (contact->kind == UZ_OBSTACLE_PLANE)
        return check_direction(contact->normal, mesh->dim, "contacts", i, "obstacle/plane/normal",
                               "it must point out of the obstacle, towards the body", err);
    if (contact->kind != UZ_OBSTACLE_BODY)
        return UZ_OK; /* its values are checked with the obstacle */
    status = check_contact_side(mesh, contact->with, i, "with", err);
    if (status == UZ_OK && strncmp(contact->on, contact->with, sizeof contact->on) == 0)
        return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "contacts", i, "with"),
                       "\"%.63s\" would touch itself; name a side of another part", contact->with);
    return status;
}
