/* mesh_demands.h: what must be true of a mesh that was read from any bytes: in range, and either one that can be
 * computed with or refused with a reason and its place. */
#ifndef FUZZ_MESH_DEMANDS_H
#define FUZZ_MESH_DEMANDS_H

#include "scene/mesh.h"
#include "uzawa.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 1 << 24 };

static inline void demand(bool condition)
{
    if (!condition)
        abort();
}

static inline void demand_group(const uz_given_mesh *mesh, const uz_given_group *group)
{
    demand(group->name[0] && memchr(group->name, '\0', sizeof group->name));
    demand(group->n_nodes + group->n_faces + group->n_elements > 0);
    for (int64_t i = 0; i < group->n_nodes; i++)
        demand(group->node[i] >= 0 && group->node[i] < mesh->n_nodes);
    for (int64_t i = 0; i < group->n_elements; i++)
        demand(group->element[i] >= 0 && group->element[i] < mesh->n_elements);
    for (int64_t q = 0; group->n_faces > 0 && q < group->face_first[group->n_faces]; q++)
        demand(group->face_node[q] >= 0 && group->face_node[q] < mesh->n_nodes);
}

static inline void demand_valid(const uz_given_mesh *mesh)
{
    demand(mesh->from_file && (mesh->dim == 2 || mesh->dim == 3) && mesh->n_elements > 0);
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++)
        demand(isfinite(mesh->xyz[i]));
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        demand(kind < UZ_ELEMENT_KINDS && uz_element_type_of(kind)->dim == mesh->dim);
        demand(mesh->first[e + 1] - mesh->first[e] == uz_element_node_count(kind));
    }
    for (int64_t q = 0; q < mesh->first[mesh->n_elements]; q++)
        demand(mesh->node[q] >= 0 && mesh->node[q] < mesh->n_nodes);
    for (int64_t i = 0; i < mesh->n_groups; i++)
        demand_group(mesh, &mesh->groups[i]);
}

/* The faces of groups are sides of elements, and nodes of groups ascend. */
static inline void demand_mesh(const uz_mesh *mesh)
{
    demand(mesh->n_nodes > 0 && isfinite(mesh->extent) && mesh->extent > 0);
    for (int64_t g = 0; g < mesh->n_groups; g++) {
        const uz_group *group = &mesh->groups[g];
        for (int64_t i = 0; i < group->n_nodes; i++)
            demand(group->node[i] < mesh->n_nodes && group->node[i] > (i ? group->node[i - 1] : -1));
        for (int64_t f = 0; f < group->n_faces; f++)
            demand(group->face[f].element >= 0 && group->face[f].element < mesh->n_elements &&
                   group->face[f].side >= 0);
    }
}

static inline void demand_usable(const uz_given_mesh *given)
{
    uz_mesh mesh;
    uz_error err = {0};
    const uz_status status = uz_mesh_from_given(&mesh, given, given->dim, &err);
    if (status == UZ_OK)
        demand_mesh(&mesh);
    else
        demand(err.message[0] && strcmp(err.where, given->from_file) == 0);
    uz_mesh_clear(&mesh);
}

/* Reads bytes, and makes these demands on what comes of it. */
static inline void demand_of_reader(uz_status (*read)(uz_given_mesh *, const char *, size_t, size_t, uz_error *),
                                    const uint8_t *data, size_t size)
{
    uz_given_mesh mesh;
    uz_error err = {0};
    const uz_status status = read(&mesh, (const char *)data, size, MEMORY, &err);
    if (status == UZ_OK) {
        demand_valid(&mesh);
        demand_usable(&mesh);
    } else {
        demand(err.status == status && (err.line >= 1 || strncmp(err.message, "at byte", 7) == 0));
        demand(status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED || status == UZ_ERR_NOT_FINITE ||
               status == UZ_ERR_LIMIT);
        demand(!mesh.xyz && !mesh.groups);
    }
    uz_given_mesh_clear(&mesh);
}

#endif
