/* pairs.c: the nodes of contact groups on the faces of another part of the body. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/projection.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uz_status copy_pairs(uz_contact_sites *sites, const uz_mesh *mesh, const uz_group *group,
                            const uz_contact_pair *pair, int64_t count, uz_error *err)
{
    int64_t entries = 0, next = 0;
    for (int64_t p = 0; p < count; p++)
        entries += pair[p].count;
    sites->first = uz_alloc_zero(sites->n + 1, sizeof *sites->first);
    sites->node = uz_alloc(entries, sizeof *sites->node);
    sites->weight = uz_alloc(entries, sizeof *sites->weight);
    sites->face = uz_alloc_zero(sites->n, sizeof *sites->face);
    if (!sites->first || !sites->node || !sites->weight || !sites->face)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact of %lld nodes", (long long)sites->n);
    for (int64_t i = 0; i < sites->n; i++) {
        const uz_contact_pair *p = next < count && pair[next].node == uz_group_node_at(group, i) ? &pair[next++] : NULL;
        const int nodes = p ? p->count : 0;
        sites->first[i + 1] = sites->first[i] + nodes;
        if (!p)
            continue;
        sites->gap[i] = p->gap;
        sites->face[i] = p->face;
        uz_put_normal(sites, i, p->normal, mesh->dim);
        memcpy(sites->node + sites->first[i], p->master, (size_t)nodes * sizeof *p->master);
        memcpy(sites->weight + sites->first[i], p->weight, (size_t)nodes * sizeof *p->weight);
    }
    return UZ_OK;
}

uz_status uz_find_pairs(uz_contact_sites *sites, const uz_body_model *model, const uz_group *group,
                        const uz_contact *contact, int64_t k, uz_error *err)
{
    char where[96];
    uz_contact_pair *pair = NULL;
    int64_t count = 0;
    snprintf(where, sizeof where, "/contacts/%lld/with", (long long)k);
    const uz_group *with = uz_mesh_group(&model->mesh, contact->with, where, err);
    if (!with)
        return UZ_ERR_SCENE;
    uz_status status = uz_contact_pairs(&pair, &count, &model->mesh, group, with, k, err);
    if (status == UZ_OK)
        status = copy_pairs(sites, &model->mesh, group, pair, count, err);
    free(pair);
    return status;
}
