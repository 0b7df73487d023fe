#include "scene/scene.h"

#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { POINTER = 96 };

static const char *const AXES = "xyz";

/* "/materials/0/poisson"; key NULL: "/materials/0". */
static const char *pointer_to(char where[POINTER], const char *list, int64_t i, const char *key)
{
    snprintf(where, POINTER, "/%s/%lld%s%s", list, (long long)i, key ? "/" : "", key ? key : "");
    return where;
}

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

/* Each item costs work on every node of its group. */
static uz_status check_counts(const uz_scene *scene, uz_error *err)
{
    enum { MOST = 1000 };
    const struct {
        const char *where;
        int64_t count;
    } lists[] = {{"/supports", scene->n_supports}, {"/loads", scene->n_loads}, {"/contacts", scene->n_contacts}};
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++)
        if (lists[i].count > MOST)
            return uz_fail(err, UZ_ERR_SCENE, lists[i].where, "%lld items; at most %d are allowed",
                           (long long)lists[i].count, MOST);
    return UZ_OK;
}

static uz_status check_model(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    if (scene->model > UZ_SOLID)
        return uz_fail(err, UZ_ERR_SCENE, "/model",
                       "unknown model; use plane_stress, plane_strain, axisymmetric or solid");
    if (uz_model_dim(scene->model) != mesh->dim)
        return uz_fail(err, UZ_ERR_SCENE, "/model", "a mesh in %d dimensions needs the model %s", mesh->dim,
                       mesh->dim == 3 ? "solid" : "plane_stress, plane_strain or axisymmetric");
    if (!isfinite(scene->thickness))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "/thickness", "the thickness is not a finite number");
    if (scene->thickness <= 0)
        return uz_fail(err, UZ_ERR_SCENE, "/thickness", "the thickness must be positive");
    return UZ_OK;
}

/* Positive strain energy needs -1 < poisson < 1/2; in plane stress 1/2 itself (incompressible) is harmless. */
static uz_status check_poisson(const uz_scene *scene, double poisson, const char *where, uz_error *err)
{
    if (!isfinite(poisson))
        return uz_fail(err, UZ_ERR_NOT_FINITE, where, "Poisson's ratio is not a finite number");
    if (poisson == 0.5 && scene->model == UZ_PLANE_STRAIN)
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "Poisson's ratio 0.5 makes the body infinitely stiff in plane strain; use less, such as 0.49");
    if (poisson <= -1 || poisson > 0.5)
        return uz_fail(err, UZ_ERR_SCENE, where, "Poisson's ratio must lie between -1 and 0.5; it is %g", poisson);
    return UZ_OK;
}

static uz_status check_young(double young, const char *where, uz_error *err)
{
    if (!isfinite(young))
        return uz_fail(err, UZ_ERR_NOT_FINITE, where, "Young's modulus is not a finite number");
    if (young <= 0)
        return uz_fail(err, UZ_ERR_SCENE, where, "Young's modulus must be positive; it is %g", young);
    return UZ_OK;
}

static uz_status check_material(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    char where[POINTER];
    const uz_material *material = &scene->materials[i];
    const uz_group *group = uz_mesh_group(mesh, material->on, pointer_to(where, "materials", i, "on"), err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->kind != UZ_GROUP_ELEMENTS)
        return uz_fail(err, UZ_ERR_SCENE, where, "\"%s\" is a side; a material fills elements: use \"all\"",
                       group->name);
    if (i > 0)
        return uz_fail(err, UZ_ERR_SCENE, where, "the elements of \"%s\" already have material 0", group->name);
    uz_status status = check_young(material->young, pointer_to(where, "materials", i, "young"), err);
    if (status != UZ_OK)
        return status;
    return check_poisson(scene, material->poisson, pointer_to(where, "materials", i, "poisson"), err);
}

static uz_status check_materials(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = UZ_OK;
    if (scene->n_materials < 1)
        return uz_fail(err, UZ_ERR_SCENE, "/materials", "no material; give young and poisson on \"all\"");
    for (int64_t i = 0; i < scene->n_materials && status == UZ_OK; i++)
        status = check_material(scene, mesh, i, err);
    return status;
}

static uz_status check_support(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    char where[POINTER];
    const uz_support *support = &scene->supports[i];
    bool any = false;
    if (!uz_mesh_group(mesh, support->on, pointer_to(where, "supports", i, "on"), err))
        return UZ_ERR_SCENE;
    for (int c = 0; c < mesh->dim; c++) {
        const char key[3] = {'u', AXES[c], '\0'};
        if (isinf(support->u[c]))
            return uz_fail(err, UZ_ERR_NOT_FINITE, pointer_to(where, "supports", i, key),
                           "the prescribed displacement is not a finite number");
        any = any || !isnan(support->u[c]);
    }
    if (!any)
        return uz_fail(err, UZ_ERR_SCENE, pointer_to(where, "supports", i, NULL),
                       "this support holds no direction; give ux, uy or both");
    return UZ_OK;
}

/* Each component must be finite; key is "traction", "point", ... */
static uz_status check_vector(const double *v, int dim, const char *list, int64_t i, const char *key, uz_error *err)
{
    char where[POINTER], place[32];
    for (int c = 0; c < dim; c++) {
        if (isfinite(v[c]))
            continue;
        snprintf(place, sizeof place, "%s/%d", key, c);
        return uz_fail(err, UZ_ERR_NOT_FINITE, pointer_to(where, list, i, place), "not a finite number");
    }
    return UZ_OK;
}

/* The group must be made of edges: loads and contacts act on a boundary. */
static uz_status check_boundary(const uz_mesh *mesh, const char *on, const char *list, int64_t i, const char *remedy,
                                uz_error *err)
{
    char where[POINTER];
    const uz_group *group = uz_mesh_group(mesh, on, pointer_to(where, list, i, "on"), err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->kind != UZ_GROUP_FACES)
        return uz_fail(err, UZ_ERR_SCENE, where, "\"%s\" is the whole body, not a part of its boundary; %s",
                       group->name, remedy);
    return UZ_OK;
}

static uz_status check_contact(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    double unit[3];
    char where[POINTER];
    const uz_contact *contact = &scene->contacts[i];
    uz_status status = check_boundary(mesh, contact->on, "contacts", i,
                                      "name the side that can touch: left, right, bottom or top", err);
    if (status == UZ_OK)
        status = check_vector(contact->normal, mesh->dim, "contacts", i, "obstacle/plane/normal", err);
    if (status == UZ_OK && !uz_unit_normal(unit, contact->normal, mesh->dim))
        return uz_fail(err, UZ_ERR_SCENE, pointer_to(where, "contacts", i, "obstacle/plane/normal"),
                       "the normal is zero; it must point out of the obstacle, towards the body");
    return status;
}

static uz_status check_supports_and_contacts(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = check_counts(scene, err);
    for (int64_t i = 0; i < scene->n_supports && status == UZ_OK; i++)
        status = check_support(scene, mesh, i, err);
    for (int64_t i = 0; i < scene->n_contacts && status == UZ_OK; i++)
        status = check_contact(scene, mesh, i, err);
    return status;
}

uz_status uz_scene_check_body(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = check_model(scene, mesh, err);
    if (status == UZ_OK)
        status = check_materials(scene, mesh, err);
    if (status == UZ_OK)
        status = check_supports_and_contacts(scene, mesh, err);
    return status;
}

static uz_status check_load(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    uz_status status = check_boundary(mesh, scene->loads[i].on, "loads", i,
                                      "a traction is a force per area of boundary: name the sides that it pulls", err);
    return status == UZ_OK ? check_vector(scene->loads[i].v, mesh->dim, "loads", i, "traction", err) : status;
}

uz_status uz_scene_check_load(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = check_supports_and_contacts(scene, mesh, err);
    for (int64_t i = 0; i < scene->n_loads && status == UZ_OK; i++)
        status = check_load(scene, mesh, i, err);
    for (int64_t i = 0; i < scene->n_contacts && status == UZ_OK; i++)
        status = check_vector(scene->contacts[i].point, mesh->dim, "contacts", i, "obstacle/plane/point", err);
    return status;
}
