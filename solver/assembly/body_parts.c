#include "assembly/body_parts.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/mesh_parts.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool uz_reject_rows(double *v, const double *basis, int64_t rank, int64_t n)
{
    double square = 0;
    for (int twice = 0; twice < 2; twice++)
        for (int64_t i = 0; i < rank; i++) {
            double dot = 0;
            for (int64_t k = 0; k < n; k++)
                dot += v[k] * basis[i * n + k];
            for (int64_t k = 0; k < n; k++)
                v[k] -= dot * basis[i * n + k];
        }
    for (int64_t k = 0; k < n; k++)
        square += v[k] * v[k];
    const double length = sqrt(square);
    for (int64_t k = 0; k < n && length > UZ_DEPENDENT; k++)
        v[k] /= length;
    return length > UZ_DEPENDENT;
}

void uz_extend_rows(double rows[][UZ_MOTIONS], int *n, const double v[UZ_MOTIONS])
{
    if (*n == UZ_MOTIONS)
        return;
    memcpy(rows[*n], v, sizeof rows[*n]);
    *n += uz_reject_rows(rows[*n], rows[0], *n, UZ_MOTIONS);
}

double uz_part_size(const uz_part *p)
{
    double size = 0;
    for (int c = 0; c < 3; c++)
        size = hypot(size, p->high[c] - p->low[c]);
    return size > 0 ? 0.5 * size : 1;
}

static void place_in_part(double place[3], const uz_part *p, const double *x, int dim)
{
    for (int c = 0; c < 3; c++) {
        const double centre = 0.5 * p->low[c] + 0.5 * p->high[c];
        place[c] = c < dim ? (x[c] - centre) / uz_part_size(p) : 0;
    }
}

void uz_place_in_part(double place[3], const uz_part *p, const uz_mesh *mesh, int64_t node)
{
    place_in_part(place, p, mesh->xyz + node * mesh->dim, mesh->dim);
}

/* This combination of motions is held. */
static void hold_row(uz_parts *parts, uz_part *p, const double row[UZ_MOTIONS])
{
    double allowed[UZ_MOTIONS] = {0};
    if (p->rank == parts->motions)
        return;
    for (int k = 0; k < parts->motions; k++)
        for (int c = 0; c < UZ_MOTIONS; c++)
            allowed[c] += parts->unit[k][c] * row[c];
    uz_extend_rows(p->held, &p->rank, allowed);
}

void uz_hold_part_at(uz_parts *parts, uz_part *p, const double *x, const double *n)
{
    double at[3], row[UZ_MOTIONS] = {0};
    if (p->rank == parts->motions)
        return;
    place_in_part(at, p, x, parts->dim);
    memcpy(row, n, (size_t)parts->dim * sizeof *n);
    uz_cross3(row + 3, at, row);
    hold_row(parts, p, row);
}

void uz_hold_part(uz_parts *parts, const uz_mesh *mesh, int64_t node, const double *n)
{
    uz_hold_part_at(parts, &parts->list[parts->of[node]], mesh->xyz + node * mesh->dim, n);
}

/* The motions of rigid groups that supports prescribe. */
static void hold_rigid(uz_parts *parts, const uz_body_model *model)
{
    const int dim = parts->dim;
    for (int64_t g = 0; g < model->n_rigid; g++) {
        const uz_rigid_group *group = &model->rigid[g];
        uz_part *p = &parts->list[parts->of[group->anchor[0]]];
        for (int c = 0; c < 2 * dim; c++) {
            const int64_t node = group->anchor[c / dim], dof = node < 0 ? UZ_NO_DOF : model->dof[node * dim + c % dim];
            double row[UZ_MOTIONS] = {0};
            if (dof >= 0 || dof == UZ_NO_DOF)
                continue;
            row[c < dim ? c : dim == 2 ? 5 : c] = 1;
            if (c < dim)
                uz_hold_part_at(parts, p, group->point, row);
            else
                hold_row(parts, p, row);
        }
    }
}

static void join(int64_t *to, int64_t i, int64_t k)
{
    while (to[i] != i)
        i = to[i];
    while (to[k] != k)
        k = to[k];
    to[i > k ? i : k] = i > k ? k : i;
}

/* What a rigid group has nodes of is one part, and so is what is tied. False: no memory. */
static bool join_parts(uz_parts *parts, const uz_body_model *model)
{
    int64_t *to = uz_alloc(parts->count, sizeof *to), kept = 0;
    for (int64_t i = 0; to && i < parts->count; i++)
        to[i] = i;
    for (int64_t g = 0; to && g < model->n_rigid; g++)
        for (int64_t a = 0; a < model->mesh.n_nodes; a++)
            if (model->rigid_of[a] == g + 1)
                join(to, parts->of[a], parts->of[model->rigid[g].anchor[0]]);
    const uz_csc *tied = &model->tied.share;
    for (int64_t a = 0; to && tied->ptr && a < model->mesh.n_nodes; a++)
        for (int64_t q = tied->ptr[a]; q < tied->ptr[a + 1]; q++)
            join(to, parts->of[a], parts->of[tied->idx[q]]);
    for (int64_t i = 0; to && i < parts->count; i++) /* those before have their new numbers already */
        to[i] = to[i] == i ? kept++ : to[to[i]];
    for (int64_t a = 0; to && a < model->mesh.n_nodes; a++)
        parts->of[a] = to[parts->of[a]];
    parts->count = kept;
    free(to);
    return to != NULL;
}

void uz_parts_clear(uz_parts *parts)
{
    free(parts->list);
    free(parts->of);
}

void uz_parts_begin(uz_parts *parts, const uz_body_model *model)
{
    static const int plane[] = {0, 1, 5}, revolution[] = {1}, space[] = {0, 1, 2, 3, 4, 5};
    const bool axisymmetric = model->kind == UZ_AXISYMMETRIC;
    *parts = (uz_parts){.dim = model->mesh.dim};
    const int *which = parts->dim == 3 ? space : axisymmetric ? revolution : plane;
    parts->motions = parts->dim == 3 ? 6 : axisymmetric ? 1 : 3;
    for (int k = 0; k < parts->motions; k++)
        parts->unit[k][which[k]] = 1;
}

void uz_part_reach(uz_part *p, const uz_mesh *mesh, int64_t node)
{
    for (int c = 0; c < mesh->dim; c++) {
        const double at = mesh->xyz[node * mesh->dim + c];
        p->low[c] = at < p->low[c] ? at : p->low[c];
        p->high[c] = at > p->high[c] ? at : p->high[c];
    }
}

uz_status uz_list_parts(uz_parts *parts, const uz_mesh *mesh, uz_error *err)
{
    parts->list = parts->count >= 0 ? uz_alloc_zero(parts->count, sizeof *parts->list) : NULL;
    if (!parts->list)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the parts of %lld nodes", (long long)mesh->n_nodes);
    for (int64_t i = 0; i < parts->count; i++)
        for (int c = 0; c < mesh->dim; c++) {
            parts->list[i].low[c] = DBL_MAX;
            parts->list[i].high[c] = -DBL_MAX;
        }
    const int64_t step = mesh->uniform && mesh->n_nodes > 1 ? mesh->n_nodes - 1 : 1; /* a box has its corners */
    for (int64_t a = mesh->n_nodes - 1; a >= 0; a -= step) {
        uz_part *p = &parts->list[parts->of[a]];
        p->node = a;
        uz_part_reach(p, mesh, a);
    }
    return UZ_OK;
}

void uz_hold_by_supports(uz_parts *parts, const uz_body_model *model)
{
    static const double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const uz_mesh *mesh = &model->mesh;
    /* a held dof is a direction that supports hold; a spring holds its axes as stiffness */
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++) {
        const bool springs = model->spring && model->spring[i] > 0;
        if (model->dof[i] >= 0 && !springs)
            continue;
        const int64_t a = i / mesh->dim, c = i % mesh->dim;
        const double *Q = uz_node_frame(model, a);
        if (model->dof[i] < 0 && model->dof[i] != UZ_NO_DOF && !uz_is_rigid(model, a))
            uz_hold_part(parts, mesh, a, Q ? Q + c * mesh->dim : axis[c]);
        if (springs)
            uz_hold_part(parts, mesh, a, axis[c]);
    }
    hold_rigid(parts, model);
}

uz_status uz_find_parts(uz_parts *parts, const uz_body_model *model, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_parts_begin(parts, model);
    parts->of = uz_alloc(mesh->n_nodes, sizeof *parts->of);
    parts->count = parts->of ? uz_mesh_number_parts(parts->of, mesh) : -1;
    if (parts->count > 0 && (model->n_rigid > 0 || model->tied.share.ptr) && !join_parts(parts, model))
        parts->count = -1;
    const uz_status status = uz_list_parts(parts, mesh, err);
    if (status == UZ_OK)
        uz_hold_by_supports(parts, model);
    return status;
}

/* Translations are orthogonal to what is held and to every rotation; the rest is left for motions that rotate. */
int uz_free_motions(double mode[UZ_MOTIONS][UZ_MOTIONS], const uz_parts *parts, const uz_part *p)
{
    double rows[UZ_MOTIONS][UZ_MOTIONS];
    const int translations = parts->motions == 1 ? 1 : parts->dim;
    int n = p->rank, found;
    memcpy(rows, p->held, sizeof rows);
    for (int k = translations; k < parts->motions; k++)
        uz_extend_rows(rows, &n, parts->unit[k]);
    const int before = n;
    for (int k = 0; k < translations; k++)
        uz_extend_rows(rows, &n, parts->unit[k]);
    found = n - before;
    memmove(rows[p->rank], rows[before], (size_t)found * sizeof rows[0]);
    n = p->rank + found;
    for (int k = parts->motions - 1; k >= translations; k--)
        uz_extend_rows(rows, &n, parts->unit[k]);
    for (int k = 0; k < translations; k++) /* what rounding has hidden */
        uz_extend_rows(rows, &n, parts->unit[k]);
    n -= p->rank;
    memcpy(mode, rows[p->rank], (size_t)n * sizeof rows[0]);
    return n;
}
