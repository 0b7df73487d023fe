/* check_boundary.c: supports and contacts. */
#include "scene/check.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define DEGREE (180 / 3.14159265358979323846)

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
    uz_status status = uz_check_vector(normal, dim, list, i, key, err);
    if (status == UZ_OK && !uz_unit_normal(unit, normal, dim))
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE(list, i, key), "the normal is zero; %s", meaning);
    return status;
}

bool uz_support_turns(const uz_support *support)
{
    return support->kind == UZ_SUPPORT_COMPONENTS &&
           (support->turn[0] != 0 || support->turn[1] != 0 || support->turn[2] != 0);
}

double uz_support_angle(const uz_support *support)
{
    double angle = 0;
    for (int c = 0; c < 3; c++)
        angle = isnan(support->turn[c]) ? angle : hypot(angle, support->turn[c]);
    return angle;
}

static uz_status check_turn(const uz_scene *scene, int64_t i, uz_error *err)
{
    const uz_support *support = &scene->supports[i];
    const double *turn = support->turn, angle = hypot(hypot(turn[0], turn[1]), turn[2]);
    uz_status status = uz_check_vector(support->about, 3, "supports", i, "rotation/about", err);
    if (status == UZ_OK)
        status = uz_check_number(angle, "supports", i, "rotation/angle", err);
    if (status != UZ_OK)
        return status;
    if (scene->model == UZ_AXISYMMETRIC)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, "rotation"),
                       "a body of revolution stays one, and nothing of it can rotate; prescribe ux and uy, or mesh it "
                       "as a solid");
    if (scene->model != UZ_SOLID && (turn[0] != 0 || turn[1] != 0))
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, "rotation/axis"),
                       "a plane body rotates about z only; leave the axis out");
    if (angle > UZ_MOST_LINEAR_TURN && !uz_may_be_finite(scene))
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, "rotation/angle"),
                       "a rotation by %g degrees is not small, and small deformation would stretch the group by %.2g "
                       "%%; use a law of finite strain (st_venant_kirchhoff, neo_hooke) with the kinematics "
                       "\"finite\", or at most %.3g degrees",
                       angle * DEGREE, 100 * (hypot(1, angle) - 1), UZ_MOST_LINEAR_TURN * DEGREE);
    return UZ_OK;
}

/* A group that moves as a rigid body; what is left out of its motions is NaN. */
static uz_status check_rigid(const uz_scene *scene, int64_t i, uz_error *err)
{
    static const char *const KEYS[] = {"rigid/ux", "rigid/uy", "rigid/uz", "rigid/rx", "rigid/ry", "rigid/rz"};
    const uz_support *support = &scene->supports[i];
    const bool ring = scene->model == UZ_AXISYMMETRIC, plane = scene->model != UZ_SOLID;
    double angle = 0;
    const uz_status status = uz_check_vector(support->about, 3, "supports", i, "rigid/point", err);
    if (status != UZ_OK)
        return status;
    for (int k = 0; k < 6; k++) {
        const double value = k < 3 ? support->u[k] : support->turn[k - 3];
        const char *where = UZ_PLACE("supports", i, KEYS[k]);
        if (isnan(value))
            continue;
        if (isinf(value))
            return uz_fail(err, UZ_ERR_NOT_FINITE, where, "the prescribed motion is not a finite number");
        if (ring && k != 1)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "a rigid group of a body of revolution moves along its axis only, and so does the body as a "
                           "whole: give uy, or nothing");
        if (plane && k >= 2 && k != 5)
            return uz_fail(err, UZ_ERR_SCENE, where, "in the plane a rigid group has ux, uy and rz");
        angle = k >= 3 ? hypot(angle, value) : angle;
        const bool finite = uz_may_be_finite(scene);
        if (angle > (finite ? UZ_MOST_TURN : UZ_MOST_LINEAR_TURN))
            return uz_fail(err, UZ_ERR_SCENE, where,
                           finite ? "a rigid group is turned by %g degrees, and a rotation by more than half a turn is "
                                    "another one: at most %.4g degrees"
                                  : "a rotation by %g degrees is not small: at most %.3g degrees, or a law of finite "
                                    "strain with the kinematics \"finite\"",
                           angle * DEGREE, (finite ? UZ_MOST_TURN : UZ_MOST_LINEAR_TURN) * DEGREE);
    }
    return UZ_OK;
}

uz_status uz_check_support(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    const uz_support *support = &scene->supports[i];
    const int dim = mesh->dim;
    bool any = false;
    uz_status status;
    if (!uz_check_group(mesh, support->on, "supports", i, "on", err))
        return UZ_ERR_SCENE;
    switch (support->kind) {
    case UZ_SUPPORT_COMPONENTS:
        for (int c = 0; c < dim; c++) {
            const char key[3] = {'u', "xyz"[c], '\0'};
            if (isinf(support->u[c]))
                return uz_fail(err, UZ_ERR_NOT_FINITE, UZ_PLACE("supports", i, key),
                               "the prescribed displacement is not a finite number");
            any = any || !isnan(support->u[c]);
        }
        if (any && uz_support_turns(support))
            return check_turn(scene, i, err);
        return any ? UZ_OK
                   : uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, NULL),
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
                return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, key),
                               "a stiffness must not be negative; it is %g", support->spring[c]);
            any = any || support->spring[c] > 0;
        }
        if (!any)
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, "spring"),
                           "this spring has no stiffness in any direction");
        if (!uz_check_sides(mesh, support->on, "supports", i, "on",
                            "a spring is spread over sides by area: name the sides that stand on it", err))
            return UZ_ERR_SCENE;
        return UZ_OK;
    case UZ_SUPPORT_RIGID:
        return check_rigid(scene, i, err);
    }
    return uz_fail(err, UZ_ERR_ARGUMENT, UZ_PLACE("supports", i, NULL), "an unknown kind of support");
}

/* A side that may touch has an outside. */
static uz_status check_contact_side(const uz_mesh *mesh, const char *on, int64_t i, const char *key, uz_error *err)
{
    const uz_group *group = uz_check_sides(
        mesh, on, "contacts", i, key,
        mesh->dim == 2
            ? "name the side that can touch: left, right, bottom or top in a box, a group of edges in other meshes"
            : "name the side that can touch: a side of a box, a group of faces in other meshes",
        err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->n_inner > 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, key),
                       "%lld faces of \"%s\" lie between two elements, where nothing can touch; leave them out",
                       (long long)group->n_inner, group->name);
    return UZ_OK;
}

/* Has the group a face among these: bits, by element? */
static bool has_any(const unsigned char *sides, const uz_mesh *mesh, const char *name)
{
    const uz_group *group = uz_mesh_group(mesh, name, "", NULL);
    for (int64_t i = 0; group && i < group->n_faces; i++)
        if (sides[group->face[i].element] >> group->face[i].side & 1)
            return true;
    return false;
}

/* Two contacts of the same sides would divide their pressure between them at will. */
static uz_status check_named_once(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    const uz_contact *mine = &scene->contacts[i];
    const char *const name[2] = {mine->on, mine->with};
    unsigned char *const of[2] = {uz_alloc_zero(mesh->n_elements, 1), uz_alloc_zero(mesh->n_elements, 1)};
    const bool room = of[0] && of[1];
    uz_status status = room ? UZ_OK : uz_no_memory(err, "the sides of contacts");
    for (int k = 0; k < 2 && room; k++) {
        const uz_group *group = uz_mesh_group(mesh, name[k], "", NULL);
        for (int64_t f = 0; group && f < group->n_faces; f++)
            of[k][group->face[f].element] |= (unsigned char)(1u << group->face[f].side);
    }
    for (int64_t k = 0; k < i && status == UZ_OK; k++) {
        const uz_contact *its = &scene->contacts[k];
        if (its->kind == UZ_OBSTACLE_BODY && ((has_any(of[0], mesh, its->on) && has_any(of[1], mesh, its->with)) ||
                                              (has_any(of[1], mesh, its->on) && has_any(of[0], mesh, its->with))))
            status =
                uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, NULL),
                        "sides of \"%.40s\" and \"%.40s\" that may touch here may do so by contact %lld (\"%.40s\" "
                        "and \"%.40s\"), too; name each pair once, several in one contact as lists",
                        mine->on, mine->with, (long long)k, its->on, its->with);
    }
    uz_free_all(of[0], of[1]);
    return status;
}

uz_status uz_check_contact(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
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
    return status == UZ_OK && i > 0 ? check_named_once(scene, mesh, i, err) : status;
}
