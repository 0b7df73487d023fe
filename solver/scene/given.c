/* given.c: from a mesh as somebody gave it to one that can be computed with. */
#include "scene/given.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/bisect.h"
#include "scene/corner_table.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The number of each given node, -1 where no element uses it: such nodes of a file are left out, others refused. */
static uz_status number_nodes(int64_t *new_node, uz_mesh *mesh, const uz_given_mesh *given, uz_error *err)
{
    enum { SHOWN = 5 };
    char list[160] = "", where[UZ_POINTER] = "";
    int shown = 0;
    size_t used = 0;
    for (int64_t i = 0; i < given->n_nodes; i++)
        new_node[i] = -1;
    for (int64_t q = 0; q < given->first[given->n_elements]; q++)
        new_node[given->node[q]] = 0;
    for (int64_t i = 0; i < given->n_nodes; i++)
        if (new_node[i] == 0)
            new_node[i] = mesh->n_nodes++;
    mesh->n_unused = given->n_nodes - mesh->n_nodes;
    if (mesh->n_unused == 0 || given->from_file)
        return UZ_OK;
    for (int64_t i = 0; i < given->n_nodes && shown < SHOWN; i++)
        if (new_node[i] < 0) {
            if (shown == 0)
                snprintf(where, sizeof where, "/mesh/nodes/%lld", (long long)i);
            used += (size_t)snprintf(list + used, sizeof list - used, "%s%lld", shown++ ? ", " : "", (long long)i);
        }
    const bool several = mesh->n_unused > 1;
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "node%s %s%s belong%s to no element, so that nothing holds %s; leave %s out of the mesh",
                   several ? "s" : "", list, mesh->n_unused > SHOWN ? ", ..." : "", several ? "" : "s",
                   several ? "them" : "it", several ? "them" : "it");
}

static uz_status copy_mesh(uz_mesh *mesh, const uz_given_mesh *given, const int64_t *new_node, uz_error *err)
{
    const int dim = given->dim;
    const int64_t n_elements = given->n_elements, n_places = given->first[n_elements];
    mesh->dim = dim;
    mesh->n_elements = n_elements;
    mesh->xyz = uz_alloc(mesh->n_nodes * dim, sizeof *mesh->xyz);
    mesh->kind = uz_alloc(n_elements, sizeof *mesh->kind);
    mesh->first = uz_alloc(n_elements + 1, sizeof *mesh->first);
    mesh->node = uz_alloc(n_places, sizeof *mesh->node);
    if (!mesh->xyz || !mesh->kind || !mesh->first || !mesh->node)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mesh of %lld nodes", (long long)mesh->n_nodes);
    for (int64_t i = 0; i < given->n_nodes; i++)
        if (new_node[i] >= 0)
            memcpy(mesh->xyz + new_node[i] * dim, given->xyz + i * dim, (size_t)dim * sizeof(double));
    memcpy(mesh->kind, given->kind, (size_t)n_elements * sizeof *mesh->kind);
    memcpy(mesh->first, given->first, (size_t)(n_elements + 1) * sizeof *mesh->first);
    for (int64_t q = 0; q < n_places; q++)
        mesh->node[q] = new_node[given->node[q]];
    for (int c = 0; c < dim; c++) {
        double low = mesh->xyz[c], high = low;
        for (int64_t i = 0; i < mesh->n_nodes; i++) {
            low = fmin(low, mesh->xyz[i * dim + c]);
            high = fmax(high, mesh->xyz[i * dim + c]);
        }
        mesh->extent = hypot(mesh->extent, high - low);
    }
    if (isfinite(mesh->extent))
        return UZ_OK;
    return uz_fail(err, UZ_ERR_NOT_FINITE, given->from_file ? given->from_file : "/mesh/nodes",
                   "the mesh reaches beyond the largest number");
}

uz_status uz_mesh_from_given(uz_mesh *out, const uz_given_mesh *given, int dim, uz_error *err)
{
    memset(out, 0, sizeof *out);
    uz_status status = uz_given_check(given, dim, err);
    if (status != UZ_OK)
        return status;
    int64_t *new_node = uz_alloc(given->n_nodes, sizeof *new_node);
    if (!new_node)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mesh of %lld nodes", (long long)given->n_nodes);
    status = number_nodes(new_node, out, given, err);
    if (status == UZ_OK)
        status = copy_mesh(out, given, new_node, err);
    uz_corner_table table = {.count = 0};
    if (status == UZ_OK)
        status = uz_corner_table_build(&table, out, false, err);
    for (int64_t i = 0; i < table.count && status == UZ_OK; i++)
        if (table.same[i]) { /* two elements on the same corners would count the material twice */
            char what[64];
            snprintf(what, sizeof what, "has the corners of element %lld",
                     (long long)uz_corner_table_item(&table, i - 1).element);
            status = uz_given_refuse(given, uz_corner_table_item(&table, i).element, what,
                                     "each may be there only once", err);
        }
    uz_corner_table_clear(&table);
    if (status == UZ_OK)
        status = uz_given_groups(out, given, new_node, err);
    free(new_node);
    if (status != UZ_OK)
        uz_mesh_clear(out);
    return status;
}

/* Can the mesh be refined? */
static uz_status check_refinement(const uz_mesh *mesh, const uz_scene *scene, uz_error *err)
{
    if (!uz_mesh_can_subdivide(mesh))
        return uz_mesh_check_bisection(mesh, err);
    for (int64_t k = 0; k < scene->n_contacts && mesh->dim == 3; k++)
        if (scene->contacts[k].kind == UZ_OBSTACLE_BODY && scene->contacts[k].between == UZ_CONTACT_SURFACES)
            return uz_fail(err, UZ_ERR_SCENE, "/mesh/refine",
                           "%s elements can't be refined where two surfaces touch in the mean (contact %lld); mesh the "
                           "body with %s, or leave out \"refine\"",
                           uz_element_name((uz_element_kind)mesh->kind[0]), (long long)k,
                           uz_element_type_of((uz_element_kind)mesh->kind[0])->nodes > 8 ? "tet10" : "tet4 or tet10");
    return UZ_OK;
}

uz_status uz_mesh_from_scene(uz_mesh *out, const uz_scene *scene, uz_error *err)
{
    uz_status status = scene->source == UZ_MESH_GIVEN ? uz_mesh_from_given(out, &scene->given, uz_scene_dim(scene), err)
                                                      : uz_mesh_from_box(out, &scene->box, err);
    if (status == UZ_OK && scene->n_selections > 0)
        status = uz_mesh_select(out, scene, err);
    if (status == UZ_OK && scene->refine)
        status = check_refinement(out, scene, err);
    if (status == UZ_OK && scene->n_bisected > 0)
        status = (scene->bisected[0] == UZ_SUBDIVIDED ? uz_mesh_subdivide : uz_mesh_bisect)(out, scene->bisected,
                                                                                            scene->n_bisected, err);
    if (status == UZ_OK)
        status = uz_mesh_join_groups(out, scene, err);
    if (status != UZ_OK)
        uz_mesh_clear(out);
    return status;
}

bool uz_given_room(uz_given_mesh *given, double **xyz, int64_t places)
{
    const int dim = given->dim;
    double *room =
        dim == 3 ? uz_realloc(*xyz, given->n_nodes * dim, sizeof *room) : uz_alloc(given->n_nodes * dim, sizeof *room);
    if (dim == 3 && room)
        *xyz = NULL;
    for (int64_t i = 0; dim < 3 && room && i < given->n_nodes; i++)
        memcpy(room + i * dim, *xyz + 3 * i, (size_t)dim * sizeof *room);
    given->xyz = room;
    given->kind = uz_alloc(given->n_elements, sizeof *given->kind);
    given->first = uz_alloc_zero(given->n_elements + 1, sizeof *given->first);
    given->node = uz_alloc(places, sizeof *given->node);
    return given->xyz && given->kind && given->first && given->node;
}

bool uz_given_is_flat(const uz_given_mesh *given, const double *xyz)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int64_t q = 0; q < given->first[given->n_elements]; q++)
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], xyz[3 * given->node[q] + c]);
            high[c] = fmax(high[c], xyz[3 * given->node[q] + c]);
        }
    return high[2] - low[2] <= 1e-9 * hypot(high[0] - low[0], high[1] - low[1]);
}

bool uz_given_add(uz_given_members *members, uz_given_way way, int64_t element, const int64_t *node, int64_t n)
{
    uz_given_group *to = members->to;
    int64_t *room = members->room;
    if (way == UZ_GIVEN_ELEMENT) {
        if (!uz_grow(&to->element, to->n_elements, 1, &room[0], sizeof *to->element))
            return false;
        to->element[to->n_elements++] = element;
    } else if (way == UZ_GIVEN_SIDE) {
        const int64_t used = to->n_faces > 0 ? to->face_first[to->n_faces] : 0;
        if (!uz_grow(&to->face_first, to->n_faces + 1, 1, &room[1], sizeof *to->face_first) ||
            !uz_grow(&to->face_node, used, n, &room[2], sizeof *to->face_node))
            return false;
        memcpy(to->face_node + used, node, (size_t)n * sizeof *node);
        to->face_first[to->n_faces] = used;
        to->face_first[++to->n_faces] = used + n;
    } else {
        if (!uz_grow(&to->node, to->n_nodes, n, &room[3], sizeof *to->node))
            return false;
        memcpy(to->node + to->n_nodes, node, (size_t)n * sizeof *node);
        to->n_nodes += n;
    }
    return true;
}
