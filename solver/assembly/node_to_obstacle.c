/* node_to_obstacle.c: contact of nodes with a rigid obstacle: a row for each node, along the obstacle's normal. */
#include "assembly/discretization.h"

#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <math.h>
#include <string.h>

/* A plane has no sites: where it is belongs to the load. */
static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    uz_obstacle *obstacle = NULL;
    if (in->contact->kind == UZ_OBSTACLE_PLANE)
        return UZ_OK;
    uz_status status = uz_sites_of_nodes(sites, in, err);
    if (status == UZ_OK)
        status = uz_obstacle_new(&obstacle, in->contact, in->index, in->model->kind, err);
    for (int64_t i = 0; i < sites->n && status == UZ_OK; i++) {
        uz_gap at;
        status = uz_obstacle_gap(&at, obstacle, mesh->xyz + uz_group_node_at(in->on, i) * mesh->dim, err);
        if (status != UZ_OK)
            break;
        sites->gap[i] = at.gap;
        uz_put_normal(sites, i, at.normal, mesh->dim);
    }
    uz_obstacle_free(obstacle);
    return status;
}

static bool row(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place)
{
    static const double whole = 1;
    const uz_mesh *mesh = &in->model->mesh;
    *row = (uz_contact_row){.node = uz_group_node_at(in->on, place), .slaves = 1, .slave_share = &whole};
    row->slave = &row->node;
    if (sites->n > 0) {
        row->gap = sites->gap[place];
        memcpy(row->normal, sites->normal + place * mesh->dim, (size_t)mesh->dim * sizeof *row->normal);
        return isfinite(row->gap);
    }
    for (int c = 0; c < mesh->dim; c++) {
        row->from[c] = in->contact->point[c];
        row->offset[c] = mesh->xyz[row->node * mesh->dim + c] - row->from[c];
    }
    return uz_unit_normal(row->normal, in->contact->normal, mesh->dim);
}

const uz_contact_discretization uz_node_to_obstacle = {
    .name = "node to obstacle", .places = uz_places_of_nodes, .find = find, .row = row, .areas = uz_areas_of_nodes};
