/* contact_rows.c: the rows of N, and what each of them is in the mesh.
 *
 * A row is the gap of one node, g_i >= 0, and its reaction a force on that node, but on faces of eight nodes. There a
 * uniform pressure pulls at the corners (-1/12 of the face, while each middle has 1/3), and reactions of one sign could
 * not carry it. So the row of a middle between a and b is (g_i - s (g_a + g_b)) / (1 - 2 s), s = UZ_MIDDLE_SHARE: g as
 * the sum of transformed shape functions whose integrals are positive (see uz_side_positive_weights). What is linear
 * along the edge keeps its value, so that resultants and contact_pressure.c read a reaction as a force at its node. A
 * middle of which an end has no row keeps the row of its own gap. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool uz_is_contact_row(const uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double share[3];
    uz_free_shares(share, model, node, normal);
    for (int c = 0; c < dim; c++)
        if (fabs(share[c]) > UZ_DEPENDENT)
            return true;
    return false;
}

bool uz_contact_normal(double normal[3], const uz_body_model *model, const uz_scene *scene, int64_t k, int64_t i)
{
    const int dim = model->mesh.dim;
    const uz_contact_sites *sites = model->sites ? &model->sites[k] : NULL;
    if (!sites || sites->n == 0)
        return uz_unit_normal(normal, scene->contacts[k].normal, dim);
    normal[2] = 0;
    memcpy(normal, sites->normal + i * dim, (size_t)dim * sizeof *normal);
    return isfinite(sites->gap[i]);
}

/* A node of a contact's group on its obstacle. */
typedef struct {
    int64_t contact, place; /* the place-th of its group */
    int64_t node;
    double normal[3];
    int masters; /* nodes of the face that it meets: 0 on an obstacle */
    const int64_t *master;
    const double *weight;
} site;

/* Does the site move any free dof? *exists: does the node have a place on the obstacle at all? */
static bool find_site(site *s, bool *exists, const uz_body_model *model, const uz_scene *scene, const uz_group *group,
                      int64_t contact, int64_t place)
{
    *s = (site){.contact = contact, .place = place, .node = uz_group_node_at(group, place)};
    const uz_contact_sites *sites = model->sites ? &model->sites[contact] : NULL;
    *exists = uz_contact_normal(s->normal, model, scene, contact, place);
    if (!*exists)
        return false;
    if (sites && sites->first) {
        s->masters = (int)(sites->first[place + 1] - sites->first[place]);
        s->master = sites->node + sites->first[place];
        s->weight = sites->weight + sites->first[place];
    }
    bool moves = uz_is_contact_row(model, s->node, s->normal);
    for (int j = 0; j < s->masters && !moves; j++)
        moves = uz_is_contact_row(model, s->master[j], s->normal);
    return moves;
}

/* The group that can touch. The scene was checked. */
static const uz_group *contact_group(const uz_mesh *mesh, const uz_contact *contact, uz_error *err)
{
    return uz_mesh_group(mesh, contact->on, "/contacts", err);
}

/* How many rows, and at most how many entries. */
static uz_status count_rows(int64_t *entries, uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int dim = model->mesh.dim;
    bool exists;
    site s;
    *entries = model->m = model->n_pair_rows = 0;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group = contact_group(&model->mesh, &scene->contacts[k], err);
        if (!group)
            return UZ_ERR_SCENE;
        for (int64_t i = 0; i < uz_group_node_count(&model->mesh, group); i++) {
            if (!find_site(&s, &exists, model, scene, group, k, i))
                continue;
            model->m++;
            model->n_pair_rows += s.masters > 0;
            *entries += dim * (1 + s.masters);
        }
        if (model->m > UZ_SCENE_MAX_DOFS)
            return uz_fail(err, UZ_ERR_SCENE, "/contacts", "more than %d contact candidates; use fewer contacts",
                           UZ_SCENE_MAX_DOFS);
    }
    return UZ_OK;
}

/* N as triplets, and one double per node for tributary areas: zero between contacts. */
typedef struct {
    int64_t count, *row, *col;
    double *val, *area;
} row_work;

/* What a consistent constant pressure gives each node of a face: nothing to the corners of a flat tri6 face, where it
 * must not be what rounding leaves, as reactions are divided by it. */
static void spread_area(double *area, const uz_body_model *model, const uz_group *group)
{
    for (int64_t e = 0; e < group->n_faces; e++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES], w[UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, model, group->face[e]);
        uz_side_positive_weights(w, &side);
        const double whole = uz_side_area(&side);
        for (int a = 0; a < side.nodes; a++)
            area[node[a]] += fabs(w[a]) > 1e-12 * whole ? w[a] : 0;
    }
}

/* `factor` times the normal on the free dofs of a node. */
static void add_entries(row_work *work, const uz_body_model *model, int64_t row, int64_t node, const double normal[3],
                        double factor)
{
    const int dim = model->mesh.dim;
    double share[3];
    uz_free_shares(share, model, node, normal);
    for (int c = 0; c < dim; c++) {
        if (share[c] == 0 || factor == 0)
            continue;
        work->row[work->count] = row;
        work->col[work->count] = model->dof[node * dim + c];
        work->val[work->count++] = factor * share[c];
    }
}

static void add_row(uz_body_model *model, row_work *work, int64_t row, const site *s)
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    info->contact_node[row] = s->node;
    info->contact_area[row] = work->area[s->node];
    info->contact_of[row] = s->contact;
    info->contact_face[2 * row] = info->contact_face[2 * row + 1] = -1;
    if (s->masters > 0) {
        info->contact_face[2 * row] = model->sites[s->contact].face[s->place].element;
        info->contact_face[2 * row + 1] = model->sites[s->contact].face[s->place].side;
    }
    memcpy(info->contact_normal + row * dim, s->normal, (size_t)dim * sizeof *s->normal);
    add_entries(work, model, row, s->node, s->normal, -1);
    for (int j = 0; j < s->masters; j++)
        add_entries(work, model, row, s->master[j], s->normal, s->weight[j]);
}

static void add_contact(uz_body_model *model, row_work *work, int64_t *row, const uz_scene *scene,
                        const uz_group *group, int64_t k)
{
    const int64_t count = uz_group_node_count(&model->mesh, group);
    bool exists;
    site s;
    spread_area(work->area, model, group);
    for (int64_t i = 0; i < count; i++)
        if (find_site(&s, &exists, model, scene, group, k, i))
            add_row(model, work, (*row)++, &s);
    for (int64_t i = 0; i < count; i++)
        work->area[uz_group_node_at(group, i)] = 0;
}

static bool alloc_rows(uz_body_model *model, row_work *work, int64_t entries)
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    info->contact_node = uz_alloc(model->m, sizeof *info->contact_node);
    info->contact_area = uz_alloc(model->m, sizeof *info->contact_area);
    info->contact_normal = uz_alloc(model->m * dim, sizeof *info->contact_normal);
    info->contact_of = uz_alloc(model->m, sizeof *info->contact_of);
    info->contact_face = uz_alloc(2 * model->m, sizeof *info->contact_face);
    work->count = 0;
    work->row = uz_alloc(entries, sizeof *work->row);
    work->col = uz_alloc(entries, sizeof *work->col);
    work->val = uz_alloc(entries, sizeof *work->val);
    work->area = uz_alloc_zero(model->mesh.n_nodes, sizeof *work->area);
    return info->contact_node && info->contact_area && info->contact_normal && info->contact_of && info->contact_face &&
           work->row && work->col && work->val && work->area;
}

/* ---- middles of eight-node faces */

static bool has_eight_nodes(const uz_mesh *mesh, uz_face face)
{
    return uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side].nodes == 8;
}

/* Rows [first, end) are those of a contact's group. row_of: n_nodes. */
static void list_ends(uz_body_model *model, const uz_group *group, int64_t *row_of, int64_t first, int64_t end)
{
    for (int64_t i = 0; i < uz_group_node_count(&model->mesh, group); i++)
        row_of[uz_group_node_at(group, i)] = -1;
    for (int64_t row = first; row < end; row++)
        row_of[model->info.contact_node[row]] = row;
    for (int64_t f = 0; f < group->n_faces; f++) {
        int64_t node[UZ_FACE_NODES];
        if (!has_eight_nodes(&model->mesh, group->face[f]))
            continue;
        uz_mesh_face(node, &model->mesh, group->face[f]);
        for (int j = 0; j < 4; j++) {
            const int64_t row = row_of[node[4 + j]], a = row_of[node[j]], b = row_of[node[(j + 1) % 4]];
            if (row >= 0 && a >= 0 && b >= 0) {
                model->row_ends[2 * row] = a;
                model->row_ends[2 * row + 1] = b;
            }
        }
    }
}

static uz_status find_ends(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    bool any = false;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group = contact_group(&model->mesh, &scene->contacts[k], err);
        for (int64_t f = 0; f < group->n_faces && !any; f++)
            any = has_eight_nodes(&model->mesh, group->face[f]);
    }
    if (!any)
        return UZ_OK;
    int64_t *row_of = uz_alloc(model->mesh.n_nodes, sizeof *row_of), row = 0;
    model->row_ends = uz_alloc(2 * model->m, sizeof *model->row_ends);
    if (row_of && model->row_ends) {
        memset(model->row_ends, 0xff, (size_t)(2 * model->m) * sizeof *model->row_ends);
        for (int64_t k = 0; k < scene->n_contacts; k++) {
            const int64_t first = row;
            while (row < model->m && model->info.contact_of[row] == k)
                row++;
            list_ends(model, contact_group(&model->mesh, &scene->contacts[k], err), row_of, first, row);
        }
    }
    const bool room = row_of && model->row_ends;
    free(row_of);
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
}

/* Room for so many entries. */
static bool grow_work(row_work *work, int64_t entries)
{
    int64_t *row = uz_realloc(work->row, entries, sizeof *row);
    work->row = row ? row : work->row;
    int64_t *col = uz_realloc(work->col, entries, sizeof *col);
    work->col = col ? col : work->col;
    double *val = uz_realloc(work->val, entries, sizeof *val);
    work->val = val ? val : work->val;
    return row && col && val;
}

/* Adds the shares of their ends to the rows of middles. Entries come row by row. */
static bool blend_entries(row_work *work, const uz_body_model *model)
{
    const double scale = 1 / (1 - 2 * UZ_MIDDLE_SHARE);
    int64_t *start = uz_alloc_zero(model->m + 1, sizeof *start), most = work->count;
    if (!start)
        return false;
    for (int64_t q = 0; q < work->count; q++)
        start[work->row[q] + 1] = q + 1;
    for (int64_t i = 0; i < model->m; i++) {
        start[i + 1] = start[i + 1] > start[i] ? start[i + 1] : start[i];
        for (int64_t q = start[i]; q < start[i + 1] && model->row_ends[2 * i] >= 0; q++)
            work->val[q] *= scale;
    }
    for (int64_t i = 0; i < 2 * model->m; i++)
        if (model->row_ends[i] >= 0)
            most += start[model->row_ends[i] + 1] - start[model->row_ends[i]];
    const bool room = grow_work(work, most);
    for (int64_t i = 0; i < model->m && room; i++)
        for (int k = 0; k < 2 && model->row_ends[2 * i] >= 0; k++) {
            const int64_t end = model->row_ends[2 * i + k];
            for (int64_t q = start[end]; q < start[end + 1]; q++) {
                work->row[work->count] = i;
                work->col[work->count] = work->col[q];
                work->val[work->count++] = -UZ_MIDDLE_SHARE * scale * work->val[q];
            }
        }
    free(start);
    return room;
}

void uz_row_forces(double *f, const uz_body_model *model, const double *r)
{
    memcpy(f, r, (size_t)model->m * sizeof *f);
    for (int64_t i = 0; i < model->m && model->row_ends; i++)
        if (model->row_ends[2 * i] >= 0) {
            f[i] = r[i] / (1 - 2 * UZ_MIDDLE_SHARE);
            f[model->row_ends[2 * i]] -= UZ_MIDDLE_SHARE * f[i];
            f[model->row_ends[2 * i + 1]] -= UZ_MIDDLE_SHARE * f[i];
        }
}

static void free_work(row_work *work)
{
    free(work->row);
    free(work->col);
    free(work->val);
    free(work->area);
}

uz_status uz_build_contact_rows(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    row_work work;
    int64_t row = 0, entries;
    model->law = &uz_law_frictionless;
    uz_status status = count_rows(&entries, model, scene, err);
    if (status != UZ_OK)
        return status;
    if (!alloc_rows(model, &work, entries)) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
        goto done;
    }
    for (int64_t k = 0; k < scene->n_contacts; k++)
        add_contact(model, &work, &row, scene, contact_group(&model->mesh, &scene->contacts[k], err), k);
    status = find_ends(model, scene, err);
    if (status == UZ_OK && model->row_ends && !blend_entries(&work, model))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
    if (status == UZ_OK)
        status = uz_csc_from_triplets(&model->N, model->m, model->d, work.count, work.row, work.col, work.val, err);
done:
    free_work(&work);
    return status;
}

/* ------------------------------------------------------------------ gaps */

/* What supports give a node (dim), along the axes; free dofs are where they were. */
static void prescribed_at(double u[3], const uz_body_model *model, int64_t node, const double *prescribed)
{
    const int dim = model->mesh.dim;
    for (int c = 0; c < dim; c++) {
        const int64_t dof = model->dof[node * dim + c];
        u[c] = dof < 0 ? prescribed[-1 - dof] : 0;
    }
    uz_from_frame(u, model, node);
}

/* The gap of a site with the prescribed displacements and zero for the free ones: (x + u - point) . n of a plane. The
 * sum is also given in absolute values: the size against which a rounding error is small. */
static double gap_at(double *scale, const uz_body_model *model, const uz_contact *contact, const site *s,
                     const double *prescribed)
{
    const int dim = model->mesh.dim;
    const uz_contact_sites *sites = model->sites ? &model->sites[s->contact] : NULL;
    const bool plane = !sites || sites->n == 0;
    double gap = plane ? 0 : sites->gap[s->place], u[3];
    prescribed_at(u, model, s->node, prescribed);
    *scale = 0;
    for (int c = 0; c < dim; c++) {
        const double x = model->mesh.xyz[s->node * dim + c], from = plane ? contact->point[c] : 0;
        gap += ((plane ? x - from : 0) + u[c]) * s->normal[c];
        *scale += (fabs(x) + fabs(from) + fabs(u[c])) * fabs(s->normal[c]);
    }
    for (int j = 0; j < s->masters; j++) {
        prescribed_at(u, model, s->master[j], prescribed);
        for (int c = 0; c < dim; c++) {
            gap -= s->weight[j] * u[c] * s->normal[c];
            *scale += fabs(s->weight[j] * u[c] * s->normal[c]);
        }
    }
    return gap;
}

/* A node without a row cannot give way: it must be outside, up to what is surely rounding or of no consequence. */
static uz_status check_held(const uz_body_model *model, const site *s, double gap, double scale, uz_error *err)
{
    char where[96], at[96];
    const double *x = model->mesh.xyz + s->node * model->mesh.dim;
    if (gap >= -1e-9 * model->mesh.extent - 1e-13 * scale)
        return UZ_OK;
    snprintf(where, sizeof where, "/contacts/%lld", (long long)s->contact);
    if (model->mesh.dim == 2)
        snprintf(at, sizeof at, "(%g, %g)", x[0], x[1]);
    else
        snprintf(at, sizeof at, "(%g, %g, %g)", x[0], x[1], x[2]);
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "node %lld at %s is held by a support %g inside the obstacle and cannot give way; "
                   "move the obstacle, or let the node move along its normal",
                   (long long)s->node, at, -gap);
}

static uz_status other_body(uz_error *err)
{
    return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", "the scene's contacts are not those of this body");
}

static uz_status contact_gaps(double *h, int64_t *row, const double *prescribed, const uz_body_model *model,
                              const uz_scene *scene, int64_t k, uz_error *err)
{
    const uz_group *group = contact_group(&model->mesh, &scene->contacts[k], err);
    const int64_t count = group ? uz_group_node_count(&model->mesh, group) : 0;
    uz_status status = group ? UZ_OK : UZ_ERR_SCENE;
    if (model->sites && model->sites[k].n > 0 && model->sites[k].n != count)
        return other_body(err);
    for (int64_t i = 0; i < count && status == UZ_OK; i++) {
        bool exists;
        double scale;
        site s;
        const bool moves = find_site(&s, &exists, model, scene, group, k, i);
        const double gap = exists ? gap_at(&scale, model, &scene->contacts[k], &s, prescribed) : 0;
        if (!exists)
            continue;
        if (!moves)
            status = check_held(model, &s, gap, scale, err);
        else if (*row == model->m)
            return other_body(err);
        else
            h[(*row)++] = gap;
    }
    return status;
}

uz_status uz_initial_gaps(double *h, const double *prescribed, const uz_body_model *model, const uz_scene *scene,
                          uz_error *err)
{
    int64_t row = 0;
    uz_status status = UZ_OK;
    if (model->n_sites > 0 && model->n_sites != scene->n_contacts)
        return other_body(err);
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++)
        status = contact_gaps(h, &row, prescribed, model, scene, k, err);
    if (status == UZ_OK && row != model->m)
        return other_body(err);
    for (int64_t i = 0; status == UZ_OK && i < model->m && model->row_ends; i++)
        if (model->row_ends[2 * i] >= 0)
            h[i] = (h[i] - UZ_MIDDLE_SHARE * (h[model->row_ends[2 * i]] + h[model->row_ends[2 * i + 1]])) /
                   (1 - 2 * UZ_MIDDLE_SHARE);
    return status;
}
