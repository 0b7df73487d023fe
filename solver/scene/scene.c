/* scene.c: what a scene owns. */
#include "scene/scene.h"
#include "core/alloc.h"
#include "core/digest.h"

#include <string.h>

void uz_given_mesh_clear(uz_given_mesh *mesh)
{
    if (!mesh)
        return;
    if (mesh->lender) {
        mesh->give_back(mesh->lender);
        memset(mesh, 0, sizeof *mesh);
        return;
    }
    for (int64_t i = 0; mesh->groups && i < mesh->n_groups; i++) {
        uz_free_all(mesh->groups[i].node, mesh->groups[i].face_first, mesh->groups[i].face_node,
                    mesh->groups[i].element);
    }
    uz_free_all(mesh->groups, mesh->xyz, mesh->kind, mesh->first, mesh->node);
    memset(mesh, 0, sizeof *mesh);
}

void uz_given_digest(char hex[65], const uz_given_mesh *mesh)
{
    uz_digest *digest = mesh->digest[0] ? NULL : uz_digest_new();
    memcpy(hex, mesh->digest, sizeof mesh->digest);
    if (!digest)
        return;
    uz_digest_add_list(digest, mesh->xyz, mesh->n_nodes * mesh->dim, sizeof *mesh->xyz);
    uz_digest_add_list(digest, mesh->kind, mesh->n_elements, sizeof *mesh->kind);
    uz_digest_add_list(digest, mesh->first, mesh->n_elements + 1, sizeof *mesh->first);
    uz_digest_add_list(digest, mesh->node, mesh->first ? mesh->first[mesh->n_elements] : 0, sizeof *mesh->node);
    for (int64_t i = 0; i < mesh->n_groups; i++) {
        const uz_given_group *group = &mesh->groups[i];
        const int64_t faces = group->n_faces;
        uz_digest_add_list(digest, group->name, (int64_t)strnlen(group->name, sizeof group->name), 1);
        uz_digest_add_list(digest, group->node, group->n_nodes, sizeof *group->node);
        uz_digest_add_list(digest, group->face_first, faces > 0 ? faces + 1 : 0, sizeof *group->face_first);
        uz_digest_add_list(digest, group->face_node, faces > 0 ? group->face_first[faces] : 0,
                           sizeof *group->face_node);
        uz_digest_add_list(digest, group->element, group->n_elements, sizeof *group->element);
    }
    uz_digest_end(digest, hex);
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
