#include "scene/mesh.h"

#include "core/error.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void uz_mesh_clear(uz_mesh *mesh)
{
    if (!mesh)
        return;
    for (int64_t i = 0; mesh->groups && i < mesh->n_groups; i++) {
        free(mesh->groups[i].node);
        free(mesh->groups[i].edge);
    }
    free(mesh->groups);
    free(mesh->xyz);
    free(mesh->element);
    memset(mesh, 0, sizeof *mesh);
}

static void list_names(char *text, size_t size, const uz_mesh *mesh)
{
    size_t used = 0;
    text[0] = '\0';
    for (int64_t i = 0; i < mesh->n_groups && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%s", i ? ", " : "", mesh->groups[i].name);
}

const uz_group *uz_mesh_group(const uz_mesh *mesh, const char *name, const char *where, uz_error *err)
{
    char names[256];
    for (int64_t i = 0; i < mesh->n_groups; i++)
        if (strncmp(mesh->groups[i].name, name, sizeof mesh->groups[i].name) == 0)
            return &mesh->groups[i];
    list_names(names, sizeof names, mesh);
    uz_fail(err, UZ_ERR_SCENE, where, "there is no group \"%.63s\"; this mesh has: %s", name, names);
    return NULL;
}

int64_t uz_group_node_count(const uz_mesh *mesh, const uz_group *group)
{
    return group->kind == UZ_GROUP_ELEMENTS ? mesh->n_nodes : group->n_nodes;
}

int64_t uz_group_node_at(const uz_group *group, int64_t i)
{
    return group->kind == UZ_GROUP_ELEMENTS ? i : group->node[i];
}
