/* node_to_face.c: contact of the nodes of one part of the body with the faces of another (obstacle/projection.h): a row
 * for each node that meets a face, along the face's normal. */
#include "assembly/discretization.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/projection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uz_status copy_pairs(uz_contact_sites *sites, const uz_contact_input *in, const uz_contact_pair *pair,
                            int64_t count, uz_error *err)
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
        const uz_contact_pair *p =
            next < count && pair[next].node == uz_group_node_at(in->on, i) ? &pair[next++] : NULL;
        const int nodes = p ? p->count : 0;
        sites->first[i + 1] = sites->first[i] + nodes;
        if (!p)
            continue;
        sites->gap[i] = p->gap;
        sites->face[i] = p->face;
        uz_put_normal(sites, i, p->normal, in->model->mesh.dim);
        memcpy(sites->node + sites->first[i], p->master, (size_t)nodes * sizeof *p->master);
        memcpy(sites->weight + sites->first[i], p->weight, (size_t)nodes * sizeof *p->weight);
    }
    return UZ_OK;
}

static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    uz_contact_pair *pair = NULL;
    int64_t count = 0;
    uz_status status = uz_sites_of_nodes(sites, in, err);
    if (status == UZ_OK)
        status = uz_contact_pairs(&pair, &count, &in->model->mesh, in->on, in->with, in->index, in->rest != NULL, err);
    if (status == UZ_OK)
        status = copy_pairs(sites, in, pair, count, err);
    free(pair);
    return status;
}

const uz_contact_discretization uz_node_to_face = {.name = "node to face",
                                                   .places = uz_places_of_nodes,
                                                   .find = find,
                                                   .row = uz_row_of_sites,
                                                   .areas = uz_areas_of_nodes};
