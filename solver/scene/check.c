/* check.c: what a scene must satisfy as a whole, and its loads. */
#include "scene/check.h"

#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>

/* ---- pieces */

const char *uz_check_place(char where[UZ_CHECK_POINTER], const char *list, int64_t i, const char *key)
{
    snprintf(where, UZ_CHECK_POINTER, "/%s/%lld%s%s", list, (long long)i, key ? "/" : "", key ? key : "");
    return where;
}

const uz_group *uz_check_group(const uz_mesh *mesh, const char *on, const char *list, int64_t i, const char *key,
                               uz_error *err)
{
    const char *where = UZ_PLACE(list, i, key);
    const uz_group *group = uz_mesh_group(mesh, on, where, err);
    if (!group || uz_group_node_count(mesh, group) > 0)
        return group;
    uz_fail(err, UZ_ERR_SCENE, where, "the group \"%s\" has no node that belongs to an element", group->name);
    return NULL;
}

const uz_group *uz_check_sides(const uz_mesh *mesh, const char *on, const char *list, int64_t i, const char *key,
                               const char *remedy, uz_error *err)
{
    const char *where = UZ_PLACE(list, i, key);
    const uz_group *group = uz_check_group(mesh, on, list, i, key, err);
    if (!group || group->kind == UZ_GROUP_FACES)
        return group;
    if (group->everything)
        uz_fail(err, UZ_ERR_SCENE, where, "\"%s\" is the whole body, not a part of its boundary; %s", group->name,
                remedy);
    else
        uz_fail(err, UZ_ERR_SCENE, where, "the group \"%s\" is made of %s, which have no sides here; %s", group->name,
                group->kind == UZ_GROUP_NODES ? "nodes" : "elements", remedy);
    return NULL;
}

uz_status uz_check_number(double value, const char *list, int64_t i, const char *key, uz_error *err)
{
    if (isfinite(value))
        return UZ_OK;
    return uz_fail(err, UZ_ERR_NOT_FINITE, UZ_PLACE(list, i, key), "not a finite number");
}

uz_status uz_check_vector(const double *v, int dim, const char *list, int64_t i, const char *key, uz_error *err)
{
    char place[32];
    uz_status status = UZ_OK;
    for (int c = 0; c < dim && status == UZ_OK; c++) {
        snprintf(place, sizeof place, "%s/%d", key, c);
        status = uz_check_number(v[c], list, i, place, err);
    }
    return status;
}

/* ---- the whole */

static uz_status check_tie(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    const uz_tie *tie = &scene->ties[i];
    for (int k = 0; k < 2; k++)
        if (!uz_check_sides(mesh, k == 0 ? tie->on : tie->to, "ties", i, k == 0 ? "on" : "to",
                            "surfaces are tied: name sides", err))
            return UZ_ERR_SCENE;
    return uz_check_number(tie->tolerance, "ties", i, "tolerance", err);
}

static uz_status check_supports_and_contacts(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    enum { MOST = 1000 }; /* each item costs work on every node of its group */
    const struct {
        const char *where;
        int64_t count;
    } lists[] = {{"/supports", scene->n_supports},
                 {"/loads", scene->n_loads},
                 {"/contacts", scene->n_contacts},
                 {"/ties", scene->n_ties},
                 {"/materials", scene->n_materials}};
    uz_status status = UZ_OK;
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++)
        if (lists[i].count > MOST)
            return uz_fail(err, UZ_ERR_SCENE, lists[i].where, "%lld items; at most %d are allowed",
                           (long long)lists[i].count, MOST);
    for (int64_t i = 0; i < scene->n_supports && status == UZ_OK; i++)
        status = uz_check_support(scene, mesh, i, err);
    for (int64_t i = 0; i < scene->n_contacts && status == UZ_OK; i++)
        status = uz_check_contact(scene, mesh, i, err);
    for (int64_t i = 0; i < scene->n_ties && status == UZ_OK; i++)
        status = check_tie(scene, mesh, i, err);
    return status;
}

uz_status uz_scene_check_body(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    if (scene->model > UZ_SOLID)
        return uz_fail(err, UZ_ERR_SCENE, "/model",
                       "unknown model; use plane_stress, plane_strain, axisymmetric or solid");
    if (uz_scene_dim(scene) != mesh->dim)
        return uz_fail(err, UZ_ERR_SCENE, "/model", "a mesh in %d dimensions needs the model %s", mesh->dim,
                       mesh->dim == 3 ? "solid" : "plane_stress, plane_strain or axisymmetric");
    const bool has_thickness = scene->model == UZ_PLANE_STRESS || scene->model == UZ_PLANE_STRAIN;
    if (has_thickness && !isfinite(scene->thickness))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "/thickness", "the thickness is not a finite number");
    if (has_thickness && scene->thickness <= 0)
        return uz_fail(err, UZ_ERR_SCENE, "/thickness", "the thickness must be positive");
    for (int64_t i = 0; scene->model == UZ_AXISYMMETRIC && i < mesh->n_nodes; i++) /* x is the radius */
        if (mesh->xyz[2 * i] < -1e-12 * mesh->extent)
            return uz_fail(err, UZ_ERR_SCENE, "/mesh",
                           "node %lld at (%g, %g) has a negative x, which is the radius in a body of revolution; "
                           "mesh the half with x >= 0",
                           (long long)i, mesh->xyz[2 * i], mesh->xyz[2 * i + 1]);
    const uz_formulation formulation = scene->formulation;
    if (formulation >= UZ_FORMULATIONS)
        return uz_fail(err, UZ_ERR_SCENE, "/formulation",
                       "unknown formulation; use auto, standard, bbar or incompatible_modes");
    bool fits = formulation == UZ_FORMULATION_AUTO || formulation == UZ_FORMULATION_STANDARD ||
                mesh->from_first; /* what was given had some, and they may all be bisected */
    for (int64_t e = 0; e < mesh->n_elements && !fits; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        fits = type->bbar || type->incompatible;
    }
    if (!fits)
        return uz_fail(err, UZ_ERR_SCENE, "/formulation",
                       "the formulations bbar and incompatible_modes are those of quad4 and hex8, and the mesh has "
                       "none; use auto");
    uz_status status = uz_check_finite_body(scene, err);
    if (status == UZ_OK)
        status = uz_check_materials(scene, mesh, err);
    if (status == UZ_OK)
        status = check_supports_and_contacts(scene, mesh, err);
    return status == UZ_OK ? uz_check_finite_size(scene, mesh, err) : status;
}

/* ---- loads */

static const char *const LOAD_KEY[UZ_LOAD_KINDS] = {
    [UZ_LOAD_TRACTION] = "traction",      [UZ_LOAD_PRESSURE] = "pressure", [UZ_LOAD_FORCE] = "force",
    [UZ_LOAD_BODY_FORCE] = "body_force",  [UZ_LOAD_GRAVITY] = "gravity",   [UZ_LOAD_NODE_FORCE] = "force",
    [UZ_LOAD_TEMPERATURE] = "temperature"};

/* A load on elements is multiplied by a number of their materials, which some of them must have. */
static uz_status check_on_elements(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    const uz_load *load = &scene->loads[i];
    const uz_group *group = uz_check_group(mesh, load->on, "loads", i, "on", err);
    bool density = false, expansion = false;
    if (!group)
        return UZ_ERR_SCENE;
    if (group->kind != UZ_GROUP_ELEMENTS)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "on"),
                       "the group \"%s\" is not made of elements, and %s acts on elements: use \"all\"", group->name,
                       LOAD_KEY[load->kind]);
    for (int64_t k = 0; k < scene->n_materials; k++) {
        density = density || scene->materials[k].density != 0;
        expansion = expansion || uz_expands(&scene->materials[k]);
    }
    if (load->kind == UZ_LOAD_GRAVITY && !density)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "gravity"),
                       "no material has a density; give one, or use body_force");
    if (load->kind == UZ_LOAD_TEMPERATURE && !expansion)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "temperature"),
                       "no material has an expansion, so that a temperature does nothing");
    return UZ_OK;
}

/* On sides, or on points: what a load on a part of the boundary may be. */
static uz_status check_on_boundary(const uz_load *load, const uz_mesh *mesh, uz_model kind, int64_t i, uz_error *err)
{
    if (load->kind == UZ_LOAD_NODE_FORCE) {
        const char *where = UZ_PLACE("loads", i, "node");
        if (mesh->n_unused > 0)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "%lld nodes of the file belong to no element and are left out, so that numbers are not "
                           "those of the file; name a physical point by \"on\"",
                           (long long)mesh->n_unused);
        if (load->node < 0 || load->node >= mesh->n_nodes)
            return uz_fail(err, UZ_ERR_SCENE, where, "there is no node %lld; this mesh has 0 to %lld",
                           (long long)load->node, (long long)mesh->n_nodes - 1);
        return UZ_OK;
    }
    const bool pressure = load->kind == UZ_LOAD_PRESSURE;
    const uz_group *group =
        load->kind == UZ_LOAD_FORCE
            ? uz_check_group(mesh, load->on, "loads", i, "on", err)
            : uz_check_sides(mesh, load->on, "loads", i, "on",
                             pressure ? "a pressure is a force per area of boundary: name the sides that it pushes"
                                      : "a traction is a force per area of boundary: name the sides that it pulls",
                             err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->kind == UZ_GROUP_ELEMENTS)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "on"),
                       "the group \"%s\" is made of elements; a force is spread over sides or nodes: use body_force "
                       "(force per volume), or name sides",
                       group->name);
    for (int c = 0; c < 6 && load->has_point; c++) {
        const double *vector = c < 3 ? load->point : load->moment;
        if (!isfinite(vector[c % 3]))
            return uz_check_vector(vector, 3, "loads", i, c < 3 ? "at" : "moment", err);
    }
    if (load->has_point && kind == UZ_AXISYMMETRIC)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, NULL),
                       "in a body of revolution forces are of the whole ring, at its axis, and there are no moments: "
                       "leave at and moment out");
    if (pressure && group->n_inner > 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "on"),
                       "%lld faces of \"%s\" lie between two elements, where there is no outward normal; use a "
                       "traction, or leave them out",
                       (long long)group->n_inner, group->name);
    return UZ_OK;
}

uz_status uz_scene_check_load(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = check_supports_and_contacts(scene, mesh, err);
    if (status == UZ_OK)
        status = uz_check_finite_loads(scene, mesh, err);
    for (int64_t i = 0; i < scene->n_loads && status == UZ_OK; i++) {
        const uz_load *load = &scene->loads[i];
        if (load->kind >= UZ_LOAD_KINDS)
            return uz_fail(err, UZ_ERR_ARGUMENT, UZ_PLACE("loads", i, NULL), "an unknown kind of load");
        if (load->kind == UZ_LOAD_BODY_FORCE || load->kind == UZ_LOAD_GRAVITY || load->kind == UZ_LOAD_TEMPERATURE)
            status = check_on_elements(scene, mesh, i, err);
        else
            status = check_on_boundary(load, mesh, scene->model, i, err);
        if (status == UZ_OK && (load->kind == UZ_LOAD_PRESSURE || load->kind == UZ_LOAD_TEMPERATURE))
            status = uz_check_number(load->value, "loads", i, LOAD_KEY[load->kind], err);
        else if (status == UZ_OK)
            status = uz_check_vector(load->v, mesh->dim, "loads", i, LOAD_KEY[load->kind], err);
    }
    for (int64_t i = 0; i < scene->n_contacts && status == UZ_OK; i++)
        if (scene->contacts[i].kind == UZ_OBSTACLE_PLANE)
            status = uz_check_vector(scene->contacts[i].point, mesh->dim, "contacts", i, "obstacle/plane/point", err);
    return status;
}
