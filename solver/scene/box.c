/* box.c: the mesh of a rectangle. */
#include "scene/mesh.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIM = 2, CORNERS = 4, SIDES = 4 };

static uz_status fail_at(uz_error *err, uz_status status, const char *key, int i, const char *message)
{
    char where[96];
    snprintf(where, sizeof where, "/mesh/box/%s/%d", key, i);
    return uz_fail(err, status, where, "%s", message);
}

static uz_status check_kind(const uz_box *box, uz_error *err)
{
    if (box->dim != DIM)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/size", "a box of %d dimensions; only 2 are built", box->dim);
    if (strncmp(box->element, "quad4", sizeof box->element) != 0)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/element", "no element \"%.15s\" in a box; use quad4",
                       box->element);
    return UZ_OK;
}

static uz_status check_lengths(const uz_box *box, uz_error *err)
{
    for (int i = 0; i < DIM; i++) {
        if (!isfinite(box->origin[i]))
            return fail_at(err, UZ_ERR_NOT_FINITE, "origin", i, "the origin is not a finite number");
        if (!isfinite(box->size[i]))
            return fail_at(err, UZ_ERR_NOT_FINITE, "size", i, "the size is not a finite number");
        if (box->size[i] <= 0)
            return fail_at(err, UZ_ERR_SCENE, "size", i, "the size of a box must be positive");
    }
    return UZ_OK;
}

static uz_status check_cells(const uz_box *box, uz_error *err)
{
    int64_t dofs = DIM;
    for (int i = 0; i < DIM; i++) {
        if (box->cells[i] < 1)
            return fail_at(err, UZ_ERR_SCENE, "cells", i, "a box needs at least one cell in each direction");
        if (box->cells[i] >= UZ_SCENE_MAX_DOFS)
            return fail_at(err, UZ_ERR_SCENE, "cells", i, "too many cells");
        if (__builtin_mul_overflow(dofs, box->cells[i] + 1, &dofs) || dofs > UZ_SCENE_MAX_DOFS)
            return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/cells",
                           "the box would have more than %d unknowns; use fewer cells", UZ_SCENE_MAX_DOFS);
    }
    return UZ_OK;
}

/* i-th of cells + 1 grid lines; both ends are exact up to one rounding. */
static double grid_line(const uz_box *box, int axis, int64_t i)
{
    return box->origin[axis] + box->size[axis] * ((double)i / (double)box->cells[axis]);
}

/* Far from the origin of the axes, double precision may put two grid lines on one place. */
static uz_status check_spacing(const uz_box *box, uz_error *err)
{
    for (int axis = 0; axis < DIM; axis++) {
        double cell = box->size[axis] / (double)box->cells[axis];
        double reach = fabs(box->origin[axis]) + box->size[axis];
        if (!isfinite(reach))
            return fail_at(err, UZ_ERR_NOT_FINITE, "size", axis, "the box reaches beyond the largest number");
        if (!(cell > 1e-10 * reach))
            return fail_at(err, UZ_ERR_SCENE, "origin", axis,
                           "the cells are too small for their distance from zero to be told apart; "
                           "move the origin or use fewer cells");
    }
    return UZ_OK;
}

static void fill_nodes(double *xyz, const uz_box *box)
{
    for (int64_t j = 0; j <= box->cells[1]; j++)
        for (int64_t i = 0; i <= box->cells[0]; i++) {
            *xyz++ = grid_line(box, 0, i);
            *xyz++ = grid_line(box, 1, j);
        }
}

static void fill_elements(uz_mesh *mesh, const uz_box *box)
{
    const int64_t row = box->cells[0] + 1;
    int64_t *node = mesh->node;
    for (int64_t j = 0; j < box->cells[1]; j++)
        for (int64_t i = 0; i < box->cells[0]; i++) {
            int64_t first = j * row + i;
            *node++ = first;
            *node++ = first + 1;
            *node++ = first + row + 1;
            *node++ = first + row;
        }
    for (int64_t e = 0; e <= mesh->n_elements; e++)
        mesh->first[e] = CORNERS * e;
    memset(mesh->kind, UZ_QUAD4, (size_t)mesh->n_elements);
}

/* A side of the box: nodes first, first + stride, ..., and the sides numbered `side` of `n` elements from `element` on,
 * `step` apart. */
typedef struct {
    const char *name;
    int64_t first, stride, n, element, step;
    int side;
} box_side;

static uz_status fill_side(uz_group *group, const box_side *s, uz_error *err)
{
    group->kind = UZ_GROUP_FACES;
    snprintf(group->name, sizeof group->name, "%s", s->name);
    group->node = uz_alloc(s->n + 1, sizeof *group->node);
    group->face = uz_alloc(s->n, sizeof *group->face);
    if (!group->node || !group->face)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the side \"%s\" of a box", s->name);
    group->n_nodes = s->n + 1;
    group->n_faces = s->n;
    for (int64_t i = 0; i <= s->n; i++)
        group->node[i] = s->first + i * s->stride;
    for (int64_t i = 0; i < s->n; i++)
        group->face[i] = (uz_face){s->element + i * s->step, s->side};
    return UZ_OK;
}

static uz_status fill_groups(uz_mesh *mesh, const uz_box *box, uz_error *err)
{
    const int64_t nx = box->cells[0], ny = box->cells[1], row = nx + 1;
    const box_side sides[SIDES] = {{"left", 0, row, ny, 0, nx, 3},
                                   {"right", nx, row, ny, nx - 1, nx, 1},
                                   {"bottom", 0, 1, nx, 0, 1, 0},
                                   {"top", ny * row, 1, nx, (ny - 1) * nx, 1, 2}};
    uz_status status = UZ_OK;
    mesh->groups = uz_alloc_zero(SIDES + 1, sizeof *mesh->groups);
    if (!mesh->groups)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the groups of a box");
    mesh->n_groups = SIDES + 1;
    for (int i = 0; i < SIDES && status == UZ_OK; i++)
        status = fill_side(&mesh->groups[i], &sides[i], err);
    mesh->groups[SIDES].kind = UZ_GROUP_ELEMENTS;
    mesh->groups[SIDES].everything = true;
    snprintf(mesh->groups[SIDES].name, sizeof mesh->groups[SIDES].name, "all");
    return status;
}

static uz_status fill(uz_mesh *mesh, const uz_box *box, uz_error *err)
{
    mesh->dim = DIM;
    mesh->n_nodes = (box->cells[0] + 1) * (box->cells[1] + 1);
    mesh->n_elements = box->cells[0] * box->cells[1];
    mesh->uniform = true;
    mesh->extent = hypot(box->size[0], box->size[1]);
    for (int axis = 0; axis < DIM; axis++)
        mesh->cell[axis] = box->size[axis] / (double)box->cells[axis];
    mesh->xyz = uz_alloc(mesh->n_nodes * DIM, sizeof *mesh->xyz);
    mesh->kind = uz_alloc(mesh->n_elements, sizeof *mesh->kind);
    mesh->first = uz_alloc(mesh->n_elements + 1, sizeof *mesh->first);
    mesh->node = uz_alloc(mesh->n_elements * CORNERS, sizeof *mesh->node);
    if (!mesh->xyz || !mesh->kind || !mesh->first || !mesh->node)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mesh of %lld nodes", (long long)mesh->n_nodes);
    fill_nodes(mesh->xyz, box);
    fill_elements(mesh, box);
    return fill_groups(mesh, box, err);
}

uz_status uz_mesh_from_box(uz_mesh *out, const uz_box *box, uz_error *err)
{
    uz_status status;
    memset(out, 0, sizeof *out);
    if ((status = check_kind(box, err)) != UZ_OK || (status = check_lengths(box, err)) != UZ_OK ||
        (status = check_cells(box, err)) != UZ_OK || (status = check_spacing(box, err)) != UZ_OK)
        return status;
    status = fill(out, box, err);
    if (status != UZ_OK)
        uz_mesh_clear(out);
    return status;
}
