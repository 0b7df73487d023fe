/* discretization.c: which discretization a contact has, and what those have in common whose rows stand at nodes. */
#include "assembly/discretization.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const uz_contact_discretization *uz_discretization_of(const uz_contact *contact)
{
    if (contact->kind != UZ_OBSTACLE_BODY)
        return &uz_node_to_obstacle;
    return contact->between == UZ_CONTACT_SURFACES ? &uz_surface_to_surface : &uz_node_to_face;
}

uz_status uz_contact_input_of(uz_contact_input *in, const uz_body_model *model, const uz_scene *scene, int64_t index,
                              uz_error *err)
{
    const uz_contact *contact = &scene->contacts[index];
    *in = (uz_contact_input){.model = model, .contact = contact, .index = index};
    in->on = uz_mesh_group(&model->mesh, contact->on, "/contacts", err);
    if (!in->on)
        return UZ_ERR_SCENE;
    if (contact->kind != UZ_OBSTACLE_BODY)
        return UZ_OK;
    in->with = uz_mesh_group(&model->mesh, contact->with, UZ_PLACE("contacts", index, "with"), err);
    in->later = in->on == in->with && uz_may_be_finite(scene);
    return in->with ? UZ_OK : UZ_ERR_SCENE;
}

bool uz_contact_row_at(uz_contact_row *row, const uz_contact_input *in, int64_t place)
{
    const uz_contact_sites *sites = &in->model->sites[in->index];
    const bool found = uz_discretization_of(in->contact)->row(row, in, sites, place);
    row->place = sites->n > 0 ? in->model->place : NULL; /* a plane's row is the same everywhere */
    return found && !(row->slaves == 1 && uz_mesh_hangs(&in->model->mesh, row->slave[0]));
}

const uz_inner_place *uz_row_inner(const uz_body_model *model, int64_t row)
{
    const uz_contact_sites *sites = model->sites ? &model->sites[model->info.contact_of[row]] : NULL;
    const int64_t inner = sites ? model->row_place[row] - (sites->n - sites->n_inner) : -1;
    return sites && sites->n_inner > 0 && inner >= 0 ? &sites->inner[inner] : NULL;
}

uz_status uz_find_sites(uz_body_model *model, const uz_body_model *rest, const uz_scene *scene, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    uz_body_model there = *model;
    double *xyz = rest ? uz_alloc(n, sizeof *xyz) : NULL;
    uz_status status = UZ_OK;
    model->sites = uz_alloc_zero(scene->n_contacts, sizeof *model->sites);
    if (!model->sites || (rest && !xyz)) {
        free(xyz);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contacts", (long long)scene->n_contacts);
    }
    model->n_sites = scene->n_contacts;
    for (int64_t i = 0; i < n && rest; i++)
        xyz[i] = model->mesh.xyz[i] + model->place[i];
    there.mesh.xyz = rest ? xyz : there.mesh.xyz;
    there.sites = model->sites;
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        uz_contact_input in;
        status = uz_contact_input_of(&in, &there, scene, k, err);
        in.rest = rest;
        if (status == UZ_OK)
            status = uz_discretization_of(in.contact)->find(&model->sites[k], &in, err);
    }
    free(xyz);
    return status;
}

uz_status uz_sites_of_nodes(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    const int64_t count = uz_places_of_nodes(in);
    sites->gap = uz_alloc(count, sizeof *sites->gap);
    sites->normal = uz_alloc_zero(count * in->model->mesh.dim, sizeof *sites->normal);
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

bool uz_row_of_sites(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place)
{
    static const double whole = 1;
    const int dim = in->model->mesh.dim;
    const int64_t first = sites->first[place];
    *row = (uz_contact_row){.node = sites->at ? sites->at[place] : uz_group_node_at(in->on, place),
                            .face = sites->face[place],
                            .gap = sites->gap[place],
                            .slaves = 1,
                            .slave_share = &whole,
                            .masters = (int)(sites->first[place + 1] - first),
                            .master = sites->node + first,
                            .master_share = sites->weight + first};
    row->slave = &row->node;
    memcpy(row->normal, sites->normal + place * dim, (size_t)dim * sizeof *row->normal);
    return isfinite(row->gap);
}

int64_t uz_places_of_nodes(const uz_contact_input *in)
{
    return uz_group_node_count(&in->model->mesh, in->on);
}

/* What each node of eight-node faces has (room) of a constant pressure becomes what reactions that act as the rows of
 * contact_rows.c are have of it: an edge's ends take over a share of its middle's. A middle beside smaller faces is a
 * corner of theirs, and comes after their own middles. */
static bool share_middles(double *room, const uz_contact_input *in)
{
    const uz_mesh *mesh = &in->model->mesh;
    unsigned char *corner = uz_alloc_zero(mesh->n_nodes, 1), *done = uz_alloc_zero(mesh->n_nodes, 1);
    for (int pass = -1; pass < 2 && corner && done; pass++)
        for (int64_t e = 0; e < in->on->n_faces; e++) {
            int64_t node[UZ_FACE_NODES];
            const int count = uz_mesh_face(node, mesh, in->on->face[e]);
            for (int j = 0; j < 4 && pass < 0 && count == 8; j++)
                corner[node[j]] = 1;
            for (int j = 0; j < 4 && pass >= 0 && count == 8; j++) {
                const int64_t middle = node[4 + j];
                if (done[middle] || corner[middle] != pass || uz_mesh_hangs(mesh, middle))
                    continue;
                const double share = UZ_MIDDLE_SHARE * room[middle];
                room[node[j]] += share;
                room[node[(j + 1) % 4]] += share;
                room[middle] -= 2 * share;
                done[middle] = 1;
            }
        }
    const bool known = corner && done;
    free(corner);
    free(done);
    return known;
}

void uz_leave_hanging(double *value, const uz_mesh *mesh)
{
    for (int64_t i = mesh->n_given; i < mesh->n_nodes && mesh->hangs; i++) {
        const int64_t *from;
        const double *share;
        const int count = mesh->hangs[i] && value[i] != 0 ? uz_mesh_amid(&from, &share, mesh, i) : 0;
        for (int k = 0; k < count; k++)
            value[from[k]] += share[k] * value[i];
        value[i] = mesh->hangs[i] ? 0 : value[i];
    }
}

/* What a consistent constant pressure gives each node of a face: nothing to the corners of a flat tri6 face, where it
 * must not be what rounding leaves, as reactions are divided by it. */
bool uz_areas_of_nodes(double *area, const uz_contact_input *in)
{
    const int64_t count = uz_places_of_nodes(in);
    const bool hangs = in->model->mesh.hangs != NULL;
    bool known = true;
    for (int64_t e = 0; e < in->on->n_faces; e++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES], w[UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, in->model, in->on->face[e]);
        if (hangs)
            uz_side_weights(w, &side);
        else
            uz_side_positive_weights(w, &side);
        const double whole = uz_side_area(&side);
        for (int a = 0; a < side.nodes; a++)
            in->room[node[a]] += fabs(w[a]) > 1e-12 * whole ? w[a] : 0;
    }
    if (hangs) {
        uz_leave_hanging(in->room, &in->model->mesh);
        known = share_middles(in->room, in);
    }
    for (int64_t i = 0; i < count; i++)
        area[i] = in->room[uz_group_node_at(in->on, i)];
    for (int64_t i = 0; i < count; i++)
        in->room[uz_group_node_at(in->on, i)] = 0;
    return known;
}
