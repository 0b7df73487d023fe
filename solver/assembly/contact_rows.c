/* contact_rows.c: the rows of N, and what each of them is in the mesh.
 *
 * A row is the gap of one node, g_i >= 0, and its reaction a force on that node, but on faces of eight nodes. There a
 * uniform pressure pulls at the corners (-1/12 of the face, while each middle has 1/3), and reactions of one sign could
 * not carry it. So the row of a middle between a and b is (g_i - s (g_a + g_b)) / (1 - 2 s), s = UZ_MIDDLE_SHARE: g as
 * the sum of transformed shape functions whose integrals are positive (see uz_side_positive_weights). What is linear
 * along the edge keeps its value, so that resultants and contact_pressure.c read a reaction as a force at its node. A
 * middle of which an end has no row keeps the row of its own gap, and so does one between whose ends a rigid obstacle
 * bows: where the face stays straight, its row would press from as far as s / (1 - 2 s) times what the ends' gaps are
 * beyond its own, and where only it touches, its reaction would pull at ends that touch nothing. In a refined mesh an
 * end may be such a middle itself, of a larger face; g_a then is its gap, not its row. */
#include "assembly/discretization.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bodies touch where their gap is less than this part of the places that it is the difference of: what rounding leaves
 * would press one on the other, or keep them apart. */
#define ROUNDED (2 * DBL_EPSILON)

/* What dof c of carrier k has in n . u (uz_followers). */
static double carried_share(const double *share, int64_t k, int c, const double n[3], int dim)
{
    double sum = 0;
    for (int i = 0; i < dim; i++)
        sum += n[i] * share[(k * dim + i) * dim + c];
    return sum;
}

bool uz_is_contact_row(const uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double share[3];
    const int64_t *from;
    const double *of;
    const int64_t carriers = uz_carriers(&from, &of, model, node);
    for (int64_t i = 0; i < carriers * dim; i++)
        if (model->dof[from[i / dim] * dim + i % dim] >= 0 &&
            fabs(carried_share(of, i / dim, (int)(i % dim), normal, dim)) > UZ_DEPENDENT)
            return true;
    if (carriers > 0)
        return false;
    for (int k = uz_mesh_hangs(&model->mesh, node) ? uz_mesh_amid(&from, &of, &model->mesh, node) : 0; k > 0; k--)
        if (uz_is_contact_row(model, from[k - 1], normal))
            return true;
    uz_free_shares(share, model, node, normal);
    for (int c = 0; c < dim; c++)
        if (fabs(share[c]) > UZ_DEPENDENT)
            return true;
    return false;
}

/* Does the row move any free dof? */
static bool moves_something(const uz_body_model *model, const uz_contact_row *row)
{
    for (int j = 0; j < row->slaves; j++)
        if (uz_is_contact_row(model, row->slave[j], row->normal))
            return true;
    for (int j = 0; j < row->masters; j++)
        if (uz_is_contact_row(model, row->master[j], row->normal))
            return true;
    return false;
}

static uz_status count_rows(int64_t *most_places, uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_contact_input in;
    uz_contact_row row;
    *most_places = model->m = model->n_pair_rows = 0;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_status status = uz_contact_input_of(&in, model, scene, k, err);
        if (status != UZ_OK)
            return status;
        const int64_t places = uz_discretization_of(in.contact)->places(&in);
        *most_places = places > *most_places ? places : *most_places;
        for (int64_t i = 0; i < places; i++) {
            if (!uz_contact_row_at(&row, &in, i) || !moves_something(model, &row))
                continue;
            model->m++;
            model->n_pair_rows += row.masters > 0 || row.slaves > 1;
        }
        if (model->m > UZ_SCENE_MAX_DOFS)
            return uz_fail(err, UZ_ERR_SCENE, "/contacts", "more than %d contact candidates; use fewer contacts",
                           UZ_SCENE_MAX_DOFS);
    }
    return UZ_OK;
}

/* N, the areas of one contact's places, and one double per node: zero between contacts. */
typedef struct {
    uz_entries N;
    double *area, *room;
} row_work;

/* `factor` times the normal on the free dofs of a node. */
static void add_entries(uz_entries *N, const uz_body_model *model, int64_t row, int64_t node, const double normal[3],
                        double factor)
{
    const int dim = model->mesh.dim;
    double share[3];
    const int64_t *from;
    const double *of;
    const int64_t carriers = uz_carriers(&from, &of, model, node);
    for (int64_t i = 0; i < carriers * dim; i++) {
        const int64_t dof = model->dof[from[i / dim] * dim + i % dim];
        const double part = dof < 0 ? 0 : carried_share(of, i / dim, (int)(i % dim), normal, dim);
        if (fabs(part) > 16 * DBL_EPSILON && factor != 0)
            uz_entries_add(N, row, dof, factor * part);
    }
    if (carriers > 0)
        return;
    for (int k = uz_mesh_hangs(&model->mesh, node) ? uz_mesh_amid(&from, &of, &model->mesh, node) : 0; k > 0; k--)
        add_entries(N, model, row, from[k - 1], normal, factor * of[k - 1]);
    uz_free_shares(share, model, node, normal);
    for (int c = 0; c < dim; c++)
        if (share[c] != 0 && factor != 0)
            uz_entries_add(N, row, model->dof[node * dim + c], factor * share[c]);
}

static uz_status add_contact(uz_body_model *model, row_work *work, int64_t *row, const uz_scene *scene, int64_t k,
                             uz_error *err)
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    uz_contact_input in;
    uz_contact_row r;
    const uz_status status = uz_contact_input_of(&in, model, scene, k, err);
    if (status != UZ_OK)
        return status;
    const uz_contact_discretization *discretization = uz_discretization_of(in.contact);
    in.room = work->room;
    if (!discretization->areas(work->area, &in))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the areas of %lld nodes", (long long)model->mesh.n_nodes);
    for (int64_t i = 0; i < discretization->places(&in); i++) {
        if (!uz_contact_row_at(&r, &in, i) || !moves_something(model, &r))
            continue;
        info->contact_node[*row] = r.node;
        info->contact_area[*row] = work->area[i];
        info->contact_of[*row] = k;
        model->row_place[*row] = i;
        info->contact_face[2 * *row] = r.masters > 0 ? r.face.element : -1;
        info->contact_face[2 * *row + 1] = r.masters > 0 ? r.face.side : -1;
        memcpy(info->contact_normal + *row * dim, r.normal, (size_t)dim * sizeof *r.normal);
        for (int j = 0; j < r.slaves; j++)
            add_entries(&work->N, model, *row, r.slave[j], r.normal, -r.slave_share[j]);
        for (int j = 0; j < r.masters; j++)
            add_entries(&work->N, model, *row, r.master[j], r.normal, r.master_share[j]);
        (*row)++;
    }
    return UZ_OK;
}

/* ---- middles of eight-node faces */

static bool has_eight_nodes(const uz_mesh *mesh, uz_face face)
{
    return uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side].nodes == 8;
}

/* Of the rows at an end of an edge, -1 or the first of them, the one whose normal is nearest to that of a row. */
static int64_t row_along(const uz_body_model *model, const int64_t *next, int64_t at_end, int64_t row)
{
    const int dim = model->mesh.dim;
    const double *normal = model->info.contact_normal;
    double most = -2;
    int64_t found = -1;
    for (int64_t i = at_end; i >= 0; i = next[i]) {
        double along = 0;
        for (int c = 0; c < dim; c++)
            along += normal[i * dim + c] * normal[row * dim + c];
        found = along > most ? i : found;
        most = fmax(most, along);
    }
    return found;
}

/* Rows [first, end) are those of contact k. row_of: room for a number by node, or by place; next: by row. */
static void list_ends(uz_body_model *model, const uz_group *group, int64_t *row_of, int64_t *next, int64_t k,
                      int64_t first, int64_t end)
{
    const uz_contact_sites *sites = &model->sites[k];
    if (sites->ends) { /* places say what they are between */
        for (int64_t p = 0; p < sites->n; p++)
            row_of[p] = -1;
        for (int64_t row = first; row < end; row++)
            row_of[model->row_place[row]] = row;
        for (int64_t row = first; row < end; row++) {
            const int64_t *place = sites->ends + 2 * model->row_place[row];
            if (place[0] < 0 || row_of[place[0]] < 0 || row_of[place[1]] < 0)
                continue;
            model->row_ends[2 * row] = row_of[place[0]];
            model->row_ends[2 * row + 1] = row_of[place[1]];
        }
        return;
    }
    const int64_t nodes = uz_group_node_count(&model->mesh, group);
    for (int64_t i = 0; i < nodes; i++)
        row_of[uz_group_node_at(group, i)] = -1;
    for (int64_t row = first; row < end; row++) { /* several of a node that flanks of a groove hold */
        int64_t *head = &row_of[model->info.contact_node[row]];
        if (uz_row_inner(model, row))
            continue;
        next[row] = *head;
        *head = row;
    }
    for (int64_t f = 0; f < group->n_faces; f++) {
        int64_t node[UZ_FACE_NODES];
        if (!has_eight_nodes(&model->mesh, group->face[f]))
            continue;
        uz_mesh_face(node, &model->mesh, group->face[f]);
        for (int j = 0; j < 4; j++)
            for (int64_t row = row_of[node[4 + j]]; row >= 0; row = next[row]) {
                const int64_t place = model->row_place[row];
                if (sites->bows && place < nodes && sites->bows[place])
                    continue;
                const int64_t a = row_along(model, next, row_of[node[j]], row);
                const int64_t b = row_along(model, next, row_of[node[(j + 1) % 4]], row);
                if (a >= 0 && b >= 0) {
                    model->row_ends[2 * row] = a;
                    model->row_ends[2 * row + 1] = b;
                }
            }
    }
}

static uz_status find_ends(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    bool any = false;
    int64_t most = model->mesh.n_nodes, row = 0;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        const uz_group *group =
            uz_mesh_group(&model->mesh, scene->contacts[k].on, "/contacts", err); /* it was checked */
        const uz_contact_sites *sites = &model->sites[k];
        for (int64_t p = 0; sites->ends && p < sites->n && !any; p++)
            any = sites->ends[2 * p] >= 0;
        for (int64_t f = 0; !sites->ends && f < group->n_faces && !any; f++)
            any = has_eight_nodes(&model->mesh, group->face[f]);
        most = sites->n > most ? sites->n : most;
    }
    if (!any)
        return UZ_OK;
    int64_t *row_of = uz_alloc(most, sizeof *row_of), *next = uz_alloc(model->m, sizeof *next);
    model->row_ends = uz_alloc(2 * model->m, sizeof *model->row_ends);
    if (row_of && next && model->row_ends) {
        memset(model->row_ends, 0xff, (size_t)(2 * model->m) * sizeof *model->row_ends);
        for (int64_t k = 0; k < scene->n_contacts; k++) {
            const int64_t first = row;
            while (row < model->m && model->info.contact_of[row] == k)
                row++;
            const uz_group *group = uz_mesh_group(&model->mesh, scene->contacts[k].on, "/contacts", err);
            list_ends(model, group, row_of, next, k, first, row);
        }
    }
    const bool room = row_of && next && model->row_ends;
    free(row_of);
    free(next);
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
}

/* Adds the shares of their ends to the rows of middles. Entries come row by row. */
static bool blend_entries(uz_entries *N, const uz_body_model *model)
{
    const double scale = 1 / (1 - 2 * UZ_MIDDLE_SHARE);
    int64_t *start = uz_alloc_zero(model->m + 1, sizeof *start);
    if (!start)
        return false;
    for (int64_t q = 0; q < N->n; q++)
        start[N->row[q] + 1] = q + 1;
    for (int64_t i = 0; i < model->m; i++) {
        start[i + 1] = start[i + 1] > start[i] ? start[i + 1] : start[i];
        for (int64_t q = start[i]; q < start[i + 1] && model->row_ends[2 * i] >= 0; q++)
            N->val[q] *= scale;
    }
    for (int64_t i = 0; i < model->m; i++)
        for (int k = 0; k < 2 && model->row_ends[2 * i] >= 0; k++) {
            const int64_t end = model->row_ends[2 * i + k];
            const double plain = model->row_ends[2 * end] >= 0 ? 1 : scale; /* a middle's own entries are scaled */
            for (int64_t q = start[end]; q < start[end + 1]; q++)
                uz_entries_add(N, i, N->col[q], -UZ_MIDDLE_SHARE * plain * N->val[q]);
        }
    free(start);
    return true;
}

void uz_row_forces(double *f, const uz_body_model *model, const double *r)
{
    for (int64_t i = 0; i < model->m; i++)
        f[i] = r[i];
    for (int64_t i = 0; i < model->m && model->row_ends; i++)
        if (model->row_ends[2 * i] >= 0)
            f[i] = r[i] / (1 - 2 * UZ_MIDDLE_SHARE);
    for (int64_t i = 0; i < model->m && model->row_ends; i++)
        for (int k = 0; k < 2 && model->row_ends[2 * i] >= 0; k++)
            f[model->row_ends[2 * i + k]] -= UZ_MIDDLE_SHARE * (r[i] / (1 - 2 * UZ_MIDDLE_SHARE));
}

void uz_push_nodes(double *f, const uz_body_model *model, const double *force)
{
    const int dim = model->mesh.dim;
    for (int64_t i = 0; i < model->m; i++) {
        const uz_inner_place *inner = uz_row_inner(model, i);
        const uz_contact_sites *sites = &model->sites[model->info.contact_of[i]];
        const double *normal = model->info.contact_normal + dim * i;
        const int64_t place = model->row_place[i];
        for (int p = 0; p < dim * (inner ? inner->nodes : 1); p++)
            f[dim * (inner ? inner->node[p / dim] : model->info.contact_node[i]) + p % dim] +=
                (inner ? inner->share[p / dim] : 1) * force[i] * normal[p % dim];
        if (model->info.contact_face[2 * i] < 0)
            continue;
        for (int64_t q = sites->first[place]; q < sites->first[place + 1]; q++)
            for (int c = 0; c < dim; c++)
                f[dim * sites->node[q] + c] -= sites->weight[q] * force[i] * normal[c];
    }
}

void uz_blend_rows(double *gap, const uz_body_model *model)
{
    const int64_t *ends = model->row_ends;
    for (int pass = 0; pass < 2; pass++) /* first those of which an end is such a middle itself */
        for (int64_t i = 0; i < model->m && ends; i++) {
            if (ends[2 * i] < 0 || (ends[2 * ends[2 * i]] >= 0 || ends[2 * ends[2 * i + 1]] >= 0) != (pass == 0))
                continue;
            gap[i] = (gap[i] - UZ_MIDDLE_SHARE * (gap[ends[2 * i]] + gap[ends[2 * i + 1]])) / (1 - 2 * UZ_MIDDLE_SHARE);
        }
}

uz_status uz_build_contact_rows(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    row_work work = {.area = NULL};
    uz_mesh_info *info = &model->info;
    int64_t row = 0, most_places;
    model->law = &uz_law_frictionless;
    uz_status status = count_rows(&most_places, model, scene, err);
    if (status != UZ_OK)
        return status;
    info->contact_node = uz_alloc(model->m, sizeof *info->contact_node);
    info->contact_area = uz_alloc(model->m, sizeof *info->contact_area);
    info->contact_normal = uz_alloc(model->m * model->mesh.dim, sizeof *info->contact_normal);
    info->contact_of = uz_alloc(model->m, sizeof *info->contact_of);
    info->contact_face = uz_alloc(2 * model->m, sizeof *info->contact_face);
    model->row_place = uz_alloc(model->m, sizeof *model->row_place);
    work.area = uz_alloc(most_places, sizeof *work.area);
    work.room = uz_alloc_zero(model->mesh.n_nodes, sizeof *work.room);
    if (!info->contact_node || !info->contact_area || !info->contact_normal || !info->contact_of ||
        !info->contact_face || !model->row_place || !work.area || !work.room)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++)
        status = add_contact(model, &work, &row, scene, k, err);
    if (status == UZ_OK)
        status = find_ends(model, scene, err);
    if (status == UZ_OK && model->row_ends && !blend_entries(&work.N, model))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)model->m);
    if (status == UZ_OK)
        status = uz_csc_from_entries(&model->N, model->m, model->d, &work.N, err);
    uz_entries_clear(&work.N);
    free(work.area);
    free(work.room);
    return status;
}

/* ------------------------------------------------------------------ gaps */

/* What supports give a node (dim), along the axes, less the displacement at which the row is taken; free dofs are where
 * they were. */
static void prescribed_at(double u[3], const uz_body_model *model, const uz_contact_row *row, int64_t node,
                          const double *prescribed)
{
    const int dim = model->mesh.dim;
    const int64_t *from;
    const double *share;
    const bool carried = uz_have_carriers(model, &node, 1);
    if (carried)
        uz_carried(u, model, node, NULL, prescribed);
    for (int c = 0; c < dim && !carried; c++) {
        const int64_t dof = model->dof[node * dim + c];
        u[c] = dof < 0 && dof != UZ_NO_DOF ? prescribed[-1 - dof] : 0;
    }
    if (!carried)
        uz_from_frame(u, model, node);
    for (int k = uz_mesh_hangs(&model->mesh, node) && !carried ? uz_mesh_amid(&from, &share, &model->mesh, node) : 0;
         k > 0; k--) {
        double at[3];
        prescribed_at(at, model, &(uz_contact_row){.place = NULL}, from[k - 1], prescribed);
        for (int c = 0; c < dim; c++)
            u[c] += share[k - 1] * at[c];
    }
    /* What a group is given is a step from the place, what others are is from rest. */
    double rigid[3] = {0};
    if (model->turned)
        uz_rigid_part(rigid, model, node, model->place);
    for (int c = 0; c < dim && (model->turned || row->place); c++)
        u[c] += rigid[c] - (row->place ? model->place[node * dim + c] : 0);
}

/* The gap of a row with the prescribed displacements and zero for the free ones. The sum is also given in absolute
 * values: the size against which a rounding error is small. */
static double gap_at(double *scale, const uz_body_model *model, const uz_contact_row *row, const double *prescribed)
{
    const int dim = model->mesh.dim;
    double gap = row->gap, u[3], along[3];
    *scale = 0;
    memcpy(along, row->offset, sizeof along);
    for (int j = 0; j < row->slaves; j++) {
        const double *x = model->mesh.xyz + row->slave[j] * dim;
        prescribed_at(u, model, row, row->slave[j], prescribed);
        for (int c = 0; c < dim; c++) {
            const double from = j == 0 ? fabs(row->from[c]) : 0, share = row->slave_share[j];
            along[c] += share * u[c];
            *scale += (fabs(x[c]) + from + fabs(share * u[c])) * fabs(row->normal[c]);
        }
    }
    for (int c = 0; c < dim; c++)
        gap += along[c] * row->normal[c];
    for (int j = 0; j < row->masters; j++) {
        prescribed_at(u, model, row, row->master[j], prescribed);
        for (int c = 0; c < dim; c++) {
            gap -= row->master_share[j] * u[c] * row->normal[c];
            *scale += fabs(row->master_share[j] * u[c] * row->normal[c]);
        }
    }
    return gap;
}

/* A node without a row cannot give way: it must be outside, up to what is surely rounding or of no consequence. */
static uz_status check_held(const uz_body_model *model, const uz_contact_row *row, int64_t contact, double gap,
                            double scale, uz_error *err)
{
    char at[96];
    const double *x = model->mesh.xyz + row->node * model->mesh.dim;
    if (gap >= -1e-9 * model->mesh.extent - 1e-13 * scale)
        return UZ_OK;
    if (model->mesh.dim == 2)
        snprintf(at, sizeof at, "(%g, %g)", x[0], x[1]);
    else
        snprintf(at, sizeof at, "(%g, %g, %g)", x[0], x[1], x[2]);
    return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", contact, NULL),
                   "node %lld at %s is held by a support %g inside the obstacle and cannot give way; "
                   "move the obstacle, or let the node move along its normal",
                   (long long)row->node, at, -gap);
}

#define OTHER_BODY "the scene's contacts are not those of this body"

uz_status uz_initial_gaps(double *h, const double *prescribed, const uz_body_model *model, const uz_scene *scene,
                          uz_error *err)
{
    int64_t row = 0;
    uz_status status = UZ_OK;
    if (model->n_sites != scene->n_contacts)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", OTHER_BODY);
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        uz_contact_input in;
        status = uz_contact_input_of(&in, model, scene, k, err);
        const int64_t places = status == UZ_OK ? uz_discretization_of(in.contact)->places(&in) : 0;
        if (status == UZ_OK && model->sites[k].n > 0 && model->sites[k].n != places)
            return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", OTHER_BODY);
        for (int64_t i = 0; i < places && status == UZ_OK; i++) {
            double scale;
            uz_contact_row at;
            if (!uz_contact_row_at(&at, &in, i))
                continue;
            double gap = gap_at(&scale, model, &at, prescribed);
            if (at.masters > 0 && fabs(gap) <= ROUNDED * scale)
                gap = 0;
            if (!moves_something(model, &at))
                status =
                    model->turned && uz_is_rigid(model, at.node) ? UZ_OK : check_held(model, &at, k, gap, scale, err);
            else if (row == model->m)
                return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", OTHER_BODY);
            else
                h[row++] = gap;
        }
    }
    if (status == UZ_OK && row != model->m)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/contacts", OTHER_BODY);
    if (status == UZ_OK)
        uz_blend_rows(h, model);
    return status;
}
