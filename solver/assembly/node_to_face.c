/* node_to_face.c: contact of the nodes of one part of the body with the faces of another (obstacle/projection.h): a row
 * for each node that meets a face, along the face's normal. */
#include "assembly/mortar.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"
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

/* Where a surface may touch itself: each node of both surfaces is a slave of the sides that its own are slaves of. */
typedef struct {
    const uz_mortar_pair *pair;
    const uz_contact_sites *sites;
    uz_csc sides;    /* by columns: the sides of both surfaces around each node */
    int64_t *number; /* UZ_ELEMENT_SIDES of each element: which side of the pair it is */
} own_sides;

static int64_t number_of(const own_sides *own, uz_face face)
{
    return own->number[face.element * UZ_ELEMENT_SIDES + face.side];
}

static bool is_slave(const void *ctx, int64_t node, int64_t face)
{
    const own_sides *own = ctx;
    const int64_t j = number_of(own, own->pair->in->with->face[face]);
    bool both = false;
    for (int64_t q = own->sides.ptr[node]; q < own->sides.ptr[node + 1]; q++) {
        const int64_t i = own->sides.idx[q];
        if (own->pair->of[i] != (UZ_OF_ON | UZ_OF_WITH))
            continue;
        both = true;
        if (own->pair->of[j] == UZ_OF_WITH || uz_mortar_is_slave(own->sites, i, j))
            return true;
    }
    return !both;
}

static bool list_sides(own_sides *own, const uz_contact_input *in)
{
    const uz_mortar_surface *surface = &own->pair->surface;
    uz_entries all = {.n = 0};
    own->number = uz_alloc(in->model->mesh.n_elements * UZ_ELEMENT_SIDES, sizeof *own->number);
    for (int64_t i = 0; i < surface->n && own->number; i++) {
        own->number[surface->side[i].face.element * UZ_ELEMENT_SIDES + surface->side[i].face.side] = i;
        for (int a = 0; a < surface->side[i].nodes; a++)
            uz_entries_add(&all, i, surface->side[i].node[a], 0);
    }
    return uz_csc_from_entries(&own->sides, surface->n, in->model->mesh.n_nodes, &all, NULL) == UZ_OK && own->number;
}

static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    uz_contact_pair *pair = NULL;
    uz_mortar_pair both = {.in = in};
    own_sides own = {.pair = &both, .sites = sites};
    uz_own_place place = {.ctx = &own};
    int64_t count = 0;
    const int itself = in->on->kind == UZ_GROUP_FACES ? uz_groups_share_face(mesh, in->on, in->with) : 0;
    uz_status status = uz_contact_pair_check(mesh, in->on, in->with, in->index, err);
    if (status == UZ_OK)
        status = uz_sites_of_nodes(sites, in, err);
    if (status == UZ_OK && itself > 0) {
        status = uz_mortar_pair_make(&both, in, err);
        if (status == UZ_OK)
            status = uz_mortar_choose_slaves(sites, &both, err);
        place.may = is_slave;
    }
    if (status == UZ_OK && (itself < 0 || (itself > 0 && !list_sides(&own, in))))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact of a body with itself");
    if (status == UZ_OK)
        status = uz_own_body_new(&place.own, mesh, in->on, in->with, err);
    if (status == UZ_OK)
        status = uz_contact_pairs(&pair, &count, mesh, in->on, in->with, in->index, &place, in->rest != NULL, err);
    if (status == UZ_OK)
        status = copy_pairs(sites, in, pair, count, err);
    if (status == UZ_OK && itself > 0 && !(sites->of = uz_alloc_zero(sites->n, 1)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact of a body with itself");
    for (int64_t i = 0; i < sites->n && status == UZ_OK && itself > 0; i++)
        if (isfinite(sites->gap[i])) {
            const bool of_on = both.of[number_of(&own, sites->face[i])] & UZ_OF_ON;
            sites->of[i] = UZ_SLAVE_ON | (of_on ? UZ_MASTER_ON : 0);
        }
    uz_mortar_pair_clear(&both);
    uz_own_body_free(place.own);
    uz_csc_clear(&own.sides);
    free(own.number);
    free(pair);
    return status;
}

const uz_contact_discretization uz_node_to_face = {.name = "node to face",
                                                   .places = uz_places_of_nodes,
                                                   .find = find,
                                                   .row = uz_row_of_sites,
                                                   .areas = uz_areas_of_nodes};
