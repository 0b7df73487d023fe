/* check_finite.c: what there is a model of large deformation for. Everything else is refused: an answer that leaves out
 * what a scene has would be a wrong one. */
#include "scene/check.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>

bool uz_has_finite_law(const uz_scene *scene)
{
    bool has = false;
    for (int64_t i = 0; i < scene->n_materials && !has; i++)
        has = scene->materials[i].law != UZ_ELASTIC_LINEAR;
    return has;
}

bool uz_is_finite_answer(const uz_scene *scene)
{
    return scene->kinematics == UZ_KINEMATICS_FINITE ||
           (scene->kinematics == UZ_KINEMATICS_AUTO && scene->place && uz_has_finite_law(scene));
}

bool uz_may_be_finite(const uz_scene *scene)
{
    return scene->kinematics == UZ_KINEMATICS_FINITE ||
           (scene->kinematics == UZ_KINEMATICS_AUTO && uz_has_finite_law(scene));
}

static uz_status check_laws(const uz_scene *scene, uz_error *err)
{
    const bool finite = uz_may_be_finite(scene);
    for (int64_t i = 0; i < scene->n_materials; i++) {
        const uz_elasticity law = scene->materials[i].law;
        const char *where = UZ_PLACE("materials", i, "law");
        if (law >= UZ_ELASTICITIES)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "unknown law; use linear, st_venant_kirchhoff, neo_hooke or neo_hooke_isochoric");
        if (finite && scene->materials[i].is_orthotropic)
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "orthotropic"),
                           "orthotropic materials are linear, which says nothing of finite strain: use the kinematics "
                           "\"moving\", or isotropic ones, all of such a law");
        if (finite && law == UZ_ELASTIC_LINEAR)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "the linear law says nothing of finite strain, and which law is taken decides the answer "
                           "beyond some per cent of it: use st_venant_kirchhoff (large rotations, small strains), "
                           "neo_hooke, or neo_hooke_isochoric");
        if (!finite && law != UZ_ELASTIC_LINEAR)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "this law is one of finite strain: use the kinematics \"auto\" or \"finite\", or the law "
                           "linear, which it becomes where strains are small");
    }
    return UZ_OK;
}

/* Contact between bodies. */
static uz_status check_pair(const uz_scene *scene, int64_t i, uz_error *err)
{
    const uz_contact *contact = &scene->contacts[i];
    if (contact->between != UZ_CONTACT_SURFACES)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, "discretization"),
                       "finite kinematics have contact between bodies by surfaces; leave discretization out");
    if (!contact->faceted && !scene->compared && uz_may_be_finite(scene))
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, "smooth"),
                       "finite kinematics take sides of bodies as they are deformed; leave smooth out, and use quad8 "
                       "or tri6 where surfaces are curved");
    return UZ_OK;
}

/* Whatever its laws. */
static uz_status check_body(const uz_scene *scene, uz_error *err)
{
    for (int64_t i = 0; i < scene->n_materials && scene->model == UZ_PLANE_STRESS; i++)
        if (scene->materials[i].poisson == 0.5)
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "poisson"),
                           "finite kinematics have no material that keeps its volume; use less than 0.5, such as 0.49");
    if (scene->formulation == UZ_FORMULATION_INCOMPATIBLE)
        return uz_fail(err, UZ_ERR_SCENE, "/formulation",
                       "finite kinematics have no incompatible modes; use auto, and for bending %s",
                       scene->model == UZ_SOLID ? "hex20 or tet10" : "quad8 or tri6");
    for (int64_t i = 0; i < scene->n_supports && scene->model == UZ_SOLID; i++) {
        const uz_support *support = &scene->supports[i];
        int held = 0, moved = 0;
        for (int c = 0; c < 3 && support->kind == UZ_SUPPORT_RIGID; c++) {
            held += !isnan(support->turn[c]);
            moved += !isnan(support->turn[c]) && support->turn[c] != 0;
        }
        if (held == 1 || (held == 2 && moved > 0))
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", i, "rigid"),
                           "large rotations about several axes are no sum, so that one of them alone is not told by a "
                           "number: hold rx, ry and rz, or none, or two at 0");
    }
    for (int64_t i = 0; i < scene->n_contacts; i++) {
        const uz_status status = scene->contacts[i].kind == UZ_OBSTACLE_BODY ? check_pair(scene, i, err) : UZ_OK;
        if (status != UZ_OK)
            return status;
        if (scene->contacts[i].kind == UZ_OBSTACLE_SURFACE)
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, "obstacle/surface"),
                           "finite kinematics of solids have planes, spheres and cylinders for obstacles; use these, "
                           "or the kinematics \"moving\"");
        if (scene->contacts[i].kind == UZ_OBSTACLE_HEIGHT && scene->model == UZ_SOLID) /* cells between values bend */
            return uz_fail(
                err, UZ_ERR_SCENE, UZ_PLACE("contacts", i, "obstacle/height"),
                "finite kinematics of solids have planes, spheres and cylinders for obstacles; use these, or "
                "the kinematics \"moving\"");
    }
    return UZ_OK;
}

/* Nodes of a group that a force at a point is spread over, which has a stiffness of all of them at once. */
enum { MOST_POINT_NODES = 1500 };

/* *rigid: are all nodes of a group of one that is rigid? */
static uz_status find_rigid(bool *rigid, const uz_scene *scene, const uz_mesh *mesh, const uz_group *group,
                            uz_error *err)
{
    *rigid = false;
    for (int64_t k = 0; k < scene->n_supports && !*rigid; k++) {
        if (scene->supports[k].kind != UZ_SUPPORT_RIGID)
            continue;
        const uz_group *whole = uz_mesh_group(mesh, scene->supports[k].on, "", NULL);
        unsigned char *of = whole ? uz_alloc_zero(mesh->n_nodes, sizeof *of) : NULL;
        if (whole && !of)
            return uz_no_memory(err, "the nodes of a rigid group");
        for (int64_t i = 0; of && i < uz_group_node_count(mesh, whole); i++)
            of[uz_group_node_at(whole, i)] = 1;
        *rigid = of;
        for (int64_t i = 0; of && i < uz_group_node_count(mesh, group) && *rigid; i++)
            *rigid = of[uz_group_node_at(group, i)];
        free(of);
    }
    return UZ_OK;
}

static uz_status check_loads(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const double *moment = scene->loads[i].moment;
        const uz_group *group = scene->loads[i].has_point ? uz_mesh_group(mesh, scene->loads[i].on, "", NULL)
                                                          : NULL; /* is not there: that is told elsewhere */
        const int64_t nodes = group ? uz_group_node_count(mesh, group) : 0;
        bool rigid = true;
        const uz_status status = nodes > MOST_POINT_NODES ? find_rigid(&rigid, scene, mesh, group, err) : UZ_OK;
        if (status != UZ_OK)
            return status;
        if (!rigid)
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "at"),
                           "a point goes with a group of up to %d nodes, which it couples, and \"%.63s\" has %lld: "
                           "name a part of it, or make it rigid by a support",
                           MOST_POINT_NODES, scene->loads[i].on, (long long)nodes);
        if (scene->loads[i].has_point && scene->model == UZ_SOLID && uz_dot3(moment, moment) > 0)
            return uz_fail(
                err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "moment"),
                "the work of a moment that keeps its direction depends on the way in space: put two opposite "
                "forces at points of the group or beside it, or turn it by rx, ry and rz as a rigid group");
        if (scene->loads[i].kind == UZ_LOAD_TEMPERATURE && !uz_may_be_finite(scene))
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("loads", i, "temperature"),
                           "small deformation of the linear law is not compared with large where there is temperature");
    }
    return UZ_OK;
}

uz_status uz_check_finite_body(const uz_scene *scene, uz_error *err)
{
    const uz_status status = check_laws(scene, err);
    return status == UZ_OK && uz_may_be_finite(scene) ? check_body(scene, err) : status;
}

uz_status uz_check_finite_size(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    int64_t d = 3 * mesh->n_nodes;
    if (scene->model != UZ_SOLID || !uz_may_be_finite(scene) || d <= UZ_MOST_FINITE_DOFS)
        return UZ_OK;
    unsigned char *held = uz_alloc_zero(mesh->n_nodes, sizeof *held); /* bits of axes; the fourth: of a direction */
    if (!held)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the supports of %lld nodes", (long long)mesh->n_nodes);
    for (int64_t k = 0; k < scene->n_supports; k++) {
        const uz_support *support = &scene->supports[k];
        const uz_group *group = uz_mesh_group(mesh, support->on, "/supports", NULL);
        unsigned axes = support->kind == UZ_SUPPORT_NORMAL ? 8 : 0;
        for (int c = 0; c < 3; c++)
            axes |= support->kind == UZ_SUPPORT_COMPONENTS && !isnan(support->u[c]) ? 1u << c : 0u;
        for (int64_t i = 0; group && i < uz_group_node_count(mesh, group); i++)
            held[uz_group_node_at(group, i)] |= (unsigned char)axes;
    }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (unsigned axes = held[a]; axes; axes >>= 1)
            d -= axes & 1;
    free(held);
    if (d <= UZ_MOST_FINITE_DOFS)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_SCENE, "/mesh",
                   "finite kinematics of solids have at most %d dofs, and this mesh has %lld: use a coarser one, or "
                   "the linear law with the kinematics \"moving\"",
                   UZ_MOST_FINITE_DOFS, (long long)d);
}

uz_status uz_check_finite_loads(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    const uz_status status = uz_check_finite_body(scene, err); /* the body may be one of other kinematics */
    return status == UZ_OK && uz_may_be_finite(scene) ? check_loads(scene, mesh, err) : status;
}

bool uz_has_finite_model(const uz_scene *scene, const uz_mesh *mesh)
{
    return check_body(scene, NULL) == UZ_OK && check_loads(scene, mesh, NULL) == UZ_OK;
}
