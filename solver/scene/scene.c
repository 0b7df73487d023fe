/* scene.c: what a scene owns. */
#include "scene/scene.h"

#include <stdlib.h>
#include <string.h>

void uz_given_mesh_clear(uz_given_mesh *mesh)
{
    if (!mesh)
        return;
    for (int64_t i = 0; mesh->groups && i < mesh->n_groups; i++) {
        free(mesh->groups[i].node);
        free(mesh->groups[i].face_first);
        free(mesh->groups[i].face_node);
        free(mesh->groups[i].element);
    }
    free(mesh->groups);
    free(mesh->xyz);
    free(mesh->kind);
    free(mesh->first);
    free(mesh->node);
    memset(mesh, 0, sizeof *mesh);
}

void uz_scene_clear(uz_scene *scene)
{
    if (!scene)
        return;
    for (int64_t i = 0; scene->contacts && i < scene->n_contacts; i++) {
        free(scene->contacts[i].x);
        free(scene->contacts[i].y);
        free(scene->contacts[i].z);
        free(scene->contacts[i].on_groups.name);
        free(scene->contacts[i].with_groups.name);
    }
    uz_given_mesh_clear(&scene->given);
    free(scene->selections);
    free(scene->materials);
    free(scene->supports);
    free(scene->loads);
    free(scene->contacts);
    free(scene->ties);
    memset(scene, 0, sizeof *scene);
}

int uz_scene_dim(const uz_scene *scene)
{
    return scene->model == UZ_SOLID ? 3 : 2;
}
