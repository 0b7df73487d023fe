/* scene.c: what a scene owns. */
#include "scene/scene.h"
#include "core/alloc.h"

#include <string.h>

void uz_given_mesh_clear(uz_given_mesh *mesh)
{
    if (!mesh)
        return;
    for (int64_t i = 0; mesh->groups && i < mesh->n_groups; i++) {
        uz_free_all(mesh->groups[i].node, mesh->groups[i].face_first, mesh->groups[i].face_node,
                    mesh->groups[i].element);
    }
    uz_free_all(mesh->groups, mesh->xyz, mesh->kind, mesh->first, mesh->node);
    memset(mesh, 0, sizeof *mesh);
}

void uz_scene_clear(uz_scene *scene)
{
    if (!scene)
        return;
    for (int64_t i = 0; scene->contacts && i < scene->n_contacts; i++) {
        uz_free_all(scene->contacts[i].x, scene->contacts[i].y, scene->contacts[i].z, scene->contacts[i].on_groups.name,
                    scene->contacts[i].with_groups.name);
    }
    uz_given_mesh_clear(&scene->given);
    uz_free_all(scene->selections, scene->materials, scene->supports, scene->loads, scene->contacts, scene->ties);
    memset(scene, 0, sizeof *scene);
}

int uz_scene_dim(const uz_scene *scene)
{
    return scene->model == UZ_SOLID ? 3 : 2;
}
