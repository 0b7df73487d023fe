/* given.c: from a mesh as somebody gave it to one that can be computed with. */
#include "scene/given.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/corner_table.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int uz_model_dim(uz_model model)
{
    return model == UZ_SOLID ? 3 : 2;
}

static uz_status check_size(const uz_given_mesh *given, int dim, uz_error *err)
{
    const char *where = given->from_file ? "/mesh/gmsh" : "/mesh/nodes";
    if (given->dim != dim)
        return uz_fail(err, UZ_ERR_SCENE, where, "this is a mesh in %d dimensions; its model is %s", given->dim,
                       given->dim == 3 ? "solid" : "plane_stress, plane_strain or axisymmetric");
    if (given->n_nodes < 1 || given->n_elements < 1)
        return uz_fail(err, UZ_ERR_SCENE, given->from_file ? where : "/mesh/elements", "the mesh has no element");
    if (given->n_nodes > UZ_SCENE_MAX_DOFS / dim)
        return uz_fail(err, UZ_ERR_SCENE, where, "%lld nodes are more than %d unknowns; use a coarser mesh",
                       (long long)given->n_nodes, UZ_SCENE_MAX_DOFS);
    return UZ_OK;
}

/* ---- nodes that no element uses */

/* Lists the first few of them for a message. */
static uz_status refuse_unused(const int64_t *new_node, int64_t n_nodes, int64_t unused, uz_error *err)
{
    enum { SHOWN = 5 };
    char list[160] = "", where[UZ_POINTER] = "";
    int shown = 0;
    size_t used = 0;
    for (int64_t i = 0; i < n_nodes && shown < SHOWN; i++)
        if (new_node[i] < 0) {
            if (shown == 0)
                snprintf(where, sizeof where, "/mesh/nodes/%lld", (long long)i);
            used += (size_t)snprintf(list + used, sizeof list - used, "%s%lld", shown++ ? ", " : "", (long long)i);
        }
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "node%s %s%s belong%s to no element, so that nothing holds %s; leave %s out of the mesh",
                   unused > 1 ? "s" : "", list, unused > SHOWN ? ", ..." : "", unused > 1 ? "" : "s",
                   unused > 1 ? "them" : "it", unused > 1 ? "them" : "it");
}

/* The numbers of the nodes that are kept, -1 for the others; returns how many are kept. */
static int64_t number_nodes(int64_t *new_node, const uz_given_mesh *given)
{
    int64_t kept = 0;
    for (int64_t i = 0; i < given->n_nodes; i++)
        new_node[i] = -1;
    for (int64_t q = 0; q < given->first[given->n_elements]; q++)
        new_node[given->node[q]] = 0;
    for (int64_t i = 0; i < given->n_nodes; i++)
        if (new_node[i] == 0)
            new_node[i] = kept++;
    return kept;
}

/* ---- copying */

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
    double extent = 0;
    for (int c = 0; c < mesh->dim; c++) {
        double low = mesh->xyz[c], high = low;
        for (int64_t i = 0; i < mesh->n_nodes; i++) {
            low = fmin(low, mesh->xyz[i * mesh->dim + c]);
            high = fmax(high, mesh->xyz[i * mesh->dim + c]);
        }
        extent = hypot(extent, high - low);
    }
    mesh->extent = extent;
    if (isfinite(mesh->extent))
        return UZ_OK;
    return uz_fail(err, UZ_ERR_NOT_FINITE, given->from_file ? "/mesh/gmsh" : "/mesh/nodes",
                   "the mesh reaches beyond the largest number");
}

/* Two elements on the same corners would count the material twice. */
static uz_status check_twins(const uz_mesh *mesh, const uz_given_mesh *given, uz_error *err)
{
    uz_corner_table table;
    char where[UZ_POINTER], text[UZ_ELEMENT_TEXT];
    uz_status status = uz_corner_table_build(&table, mesh, false, err);
    for (int64_t i = 0; i < table.count && status == UZ_OK; i++) {
        if (!table.same[i])
            continue;
        uz_given_element_place(where, given, table.item[i].element);
        uz_given_element_text(text, given, table.item[i].element);
        status = uz_fail(err, UZ_ERR_SCENE, where, "%s has the corners of element %lld; each may be there only once",
                         text, (long long)table.item[i - 1].element);
    }
    uz_corner_table_clear(&table);
    return status;
}

static uz_status build(uz_mesh *mesh, const uz_given_mesh *given, int64_t *new_node, uz_error *err)
{
    mesh->n_nodes = number_nodes(new_node, given);
    mesh->n_unused = given->n_nodes - mesh->n_nodes;
    if (mesh->n_unused > 0 && !given->from_file)
        return refuse_unused(new_node, given->n_nodes, mesh->n_unused, err);
    uz_status status = copy_mesh(mesh, given, new_node, err);
    if (status == UZ_OK)
        status = check_twins(mesh, given, err);
    return status == UZ_OK ? uz_given_groups(mesh, given, new_node, err) : status;
}

uz_status uz_mesh_from_given(uz_mesh *out, const uz_given_mesh *given, int dim, uz_error *err)
{
    int64_t *new_node = NULL;
    memset(out, 0, sizeof *out);
    uz_status status = check_size(given, dim, err);
    if (status == UZ_OK)
        status = uz_given_check(given, err);
    if (status != UZ_OK)
        return status;
    new_node = uz_alloc(given->n_nodes, sizeof *new_node);
    if (!new_node)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mesh of %lld nodes", (long long)given->n_nodes);
    status = build(out, given, new_node, err);
    free(new_node);
    if (status != UZ_OK)
        uz_mesh_clear(out);
    return status;
}

uz_status uz_mesh_from_scene(uz_mesh *out, const uz_scene *scene, uz_error *err)
{
    if (scene->source == UZ_MESH_GIVEN)
        return uz_mesh_from_given(out, &scene->given, uz_model_dim(scene->model), err);
    return uz_mesh_from_box(out, &scene->box, err);
}
