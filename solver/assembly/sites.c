/* sites.c: where the nodes of contact groups stand to obstacles that are no planes. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uz_status make_sites(uz_contact_sites *sites, const uz_mesh *mesh, int64_t count, uz_error *err)
{
    sites->gap = uz_alloc(count, sizeof *sites->gap);
    sites->normal = uz_alloc_zero(count * mesh->dim, sizeof *sites->normal);
    if (!sites->gap || !sites->normal)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the gaps of %lld nodes", (long long)count);
    sites->n = count;
    for (int64_t i = 0; i < count; i++)
        sites->gap[i] = INFINITY;
    return UZ_OK;
}

void uz_put_normal(uz_contact_sites *sites, int64_t i, const double normal[3], int dim)
{
    double unit[3];
    if (uz_unit_normal(unit, normal, dim))
        memcpy(sites->normal + i * dim, unit, (size_t)dim * sizeof *unit);
}

static uz_status find_on_obstacle(uz_contact_sites *sites, const uz_body_model *model, const uz_group *group,
                                  const uz_contact *contact, int64_t k, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_obstacle *obstacle = NULL;
    uz_status status = uz_obstacle_new(&obstacle, contact, k, model->kind, err);
    for (int64_t i = 0; i < sites->n && status == UZ_OK; i++) {
        uz_gap at;
        status = uz_obstacle_gap(&at, obstacle, mesh->xyz + uz_group_node_at(group, i) * mesh->dim, err);
        if (status != UZ_OK)
            break;
        sites->gap[i] = at.gap;
        uz_put_normal(sites, i, at.normal, mesh->dim);
    }
    uz_obstacle_free(obstacle);
    return status;
}

uz_status uz_find_sites(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = UZ_OK;
    model->sites = uz_alloc_zero(scene->n_contacts, sizeof *model->sites);
    if (!model->sites)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contacts", (long long)scene->n_contacts);
    model->n_sites = scene->n_contacts;
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        const uz_contact *contact = &scene->contacts[k];
        const uz_group *group = uz_mesh_group(&model->mesh, contact->on, "/contacts", err);
        if (!group)
            return UZ_ERR_SCENE;
        if (contact->kind == UZ_OBSTACLE_PLANE)
            continue;
        status = make_sites(&model->sites[k], &model->mesh, uz_group_node_count(&model->mesh, group), err);
        if (status == UZ_OK && contact->kind == UZ_OBSTACLE_BODY)
            status = uz_find_pairs(&model->sites[k], model, group, contact, k, err);
        else if (status == UZ_OK)
            status = find_on_obstacle(&model->sites[k], model, group, contact, k, err);
    }
    return status;
}
