/* box.c: the mesh of a rectangle or a cuboid: what may be asked for, where its grid lines are, its nodes. */
#include "scene/box.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uz_status fail_at(uz_error *err, uz_status status, const char *key, int i, const char *message)
{
    char where[96];
    snprintf(where, sizeof where, "/mesh/box/%s/%d", key, i);
    return uz_fail(err, status, where, "%s", message);
}

/* The name must be that of an element in the box's dimensions. Otherwise those that there are are listed, as "hex8,
 * tet4 or tet10": by family, each from few nodes to many. */
static uz_status check_element(const uz_box *box, uz_error *err)
{
    const uz_element_type *offered[UZ_ELEMENT_KINDS];
    char name[sizeof box->element + 1] = "", names[128] = "";
    uz_element_kind kind;
    size_t used = 0;
    int count = 0;
    memcpy(name, box->element, sizeof box->element);
    if (uz_element_parse(&kind, name) && uz_element_type_of(kind)->dim == box->dim)
        return UZ_OK;
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const uz_element_type *type = uz_element_types[k];
        int at = type->dim == box->dim ? count++ : 0;
        for (; at > 0; at--) {
            const uz_element_type *before = offered[at - 1];
            if (before->name[0] != type->name[0] ? before->name[0] < type->name[0] : before->nodes < type->nodes)
                break;
            offered[at] = before;
        }
        if (type->dim == box->dim)
            offered[at] = type;
    }
    for (int k = 0; k < count; k++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                 k == 0          ? ""
                                 : k < count - 1 ? ", "
                                                 : " or ",
                                 offered[k]->name);
    return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/element", "no element \"%.15s\" in a box of %d dimensions; use %s",
                   name, box->dim, names);
}

static bool is_graded(const uz_box *box, int axis)
{
    return box->grading[axis] != 0 && box->grading[axis] != 1 && box->cells[axis] > 1;
}

/* The share of the whole that lies before the i-th of cells + 1 grid lines. Cells grow by the factor
 * q = grading^(1 / (cells - 1)), so that it is (q^i - 1) / (q^cells - 1). */
static double share_before(const uz_box *box, int axis, int64_t i)
{
    const double n = (double)box->cells[axis];
    if (!is_graded(box, axis))
        return (double)i / n;
    const double growth = log(box->grading[axis]) / (n - 1);
    return i == box->cells[axis] ? 1 : expm1((double)i * growth) / expm1(n * growth);
}

static uz_status check_box(const uz_box *box, uz_error *err)
{
    if (box->automatic)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/cells", "the cells are still to be chosen: give their numbers");
    if (box->dim != 2 && box->dim != 3)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/size", "a box of %d dimensions; only 2 and 3 are built", box->dim);
    const uz_status status = check_element(box, err);
    if (status != UZ_OK)
        return status;
    for (int i = 0; i < box->dim; i++) {
        if (!isfinite(box->origin[i]))
            return fail_at(err, UZ_ERR_NOT_FINITE, "origin", i, "the origin is not a finite number");
        if (!isfinite(box->size[i]))
            return fail_at(err, UZ_ERR_NOT_FINITE, "size", i, "the size is not a finite number");
        if (box->size[i] <= 0)
            return fail_at(err, UZ_ERR_SCENE, "size", i, "the size of a box must be positive");
        if (!isfinite(box->grading[i]))
            return fail_at(err, UZ_ERR_NOT_FINITE, "grading", i, "the grading is not a finite number");
        if (box->grading[i] < 0)
            return fail_at(err, UZ_ERR_SCENE, "grading", i,
                           "the grading is the size of the last cell over that of the first: it must be positive");
    }
    for (int i = 0; i < box->dim; i++) {
        if (box->cells[i] < 1)
            return fail_at(err, UZ_ERR_SCENE, "cells", i, "a box needs at least one cell in each direction");
        if (box->cells[i] >= UZ_SCENE_MAX_DOFS)
            return fail_at(err, UZ_ERR_SCENE, "cells", i, "too many cells");
    }
    if (box->dim * uz_box_node_count(box) > UZ_SCENE_MAX_DOFS)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/box/cells",
                       "the box would have more than %d unknowns; use fewer cells", UZ_SCENE_MAX_DOFS);
    for (int i = 0; i < box->dim; i++) {
        const int64_t n = box->cells[i];
        const double ends = fmin(share_before(box, i, 1), 1 - share_before(box, i, n - 1));
        const double cell = box->size[i] * (is_graded(box, i) ? ends : 1 / (double)n);
        const double reach = fabs(box->origin[i]) + box->size[i];
        if (!isfinite(reach))
            return fail_at(err, UZ_ERR_NOT_FINITE, "size", i, "the box reaches beyond the largest number");
        if (!(cell > 1e-10 * reach)) /* double precision may put two grid lines on one place */
            return fail_at(err, UZ_ERR_SCENE, is_graded(box, i) ? "grading" : "origin", i,
                           "the cells are too small for their distance from zero to be told apart; "
                           "move the origin or use fewer cells");
    }
    return UZ_OK;
}

/* ---- nodes: points of a lattice, see uz_box_lattice */

uz_element_kind uz_box_element(const uz_box *box)
{
    char name[sizeof box->element + 1] = "";
    uz_element_kind kind = UZ_QUAD4;
    memcpy(name, box->element, sizeof box->element);
    uz_element_parse(&kind, name);
    return kind;
}

uz_box_lattice uz_box_lattice_of(const uz_box *box)
{
    const uz_element_type *type = uz_element_type_of(uz_box_element(box));
    int64_t place[UZ_ELEMENT_PARTS][UZ_ELEMENT_NODES][3];
    uz_box_lattice out = {.order = type->nodes > type->corners ? 2 : 1};
    const int parts = uz_box_places(place, uz_box_element(box));
    for (int p = 0; p < parts && out.order == 2; p++)
        for (int a = 0; a < type->nodes; a++)
            out.node[place[p][a][2] % 2][place[p][a][1] % 2][place[p][a][0] % 2] = true;
    out.whole = true;
    for (int i = 0; i < 1 << box->dim && out.order == 2; i++)
        out.whole = out.whole && out.node[i >> 2][i >> 1 & 1][i & 1];
    for (int z = 0; z < 2; z++) {
        for (int y = 0; y < 2; y++)
            out.row[z][y] = out.whole
                                ? out.order * box->cells[0] + 1
                                : (out.node[z][y][0] ? box->cells[0] + 1 : 0) + (out.node[z][y][1] ? box->cells[0] : 0);
        out.plane[z] = out.whole ? (out.order * box->cells[1] + 1) * out.row[z][0]
                                 : (box->cells[1] + 1) * out.row[z][0] + box->cells[1] * out.row[z][1];
    }
    return out;
}

int64_t uz_box_node(const uz_box_lattice *lattice, const int64_t at[3])
{
    if (lattice->whole)
        return at[2] * lattice->plane[0] + at[1] * lattice->row[0][0] + at[0];
    const int x = (int)(at[0] % 2), y = (int)(at[1] % 2), z = (int)(at[2] % 2);
    if (!lattice->node[z][y][x])
        return -1;
    return (at[2] + 1) / 2 * lattice->plane[0] + at[2] / 2 * lattice->plane[1] + (at[1] + 1) / 2 * lattice->row[z][0] +
           at[1] / 2 * lattice->row[z][1] + (lattice->node[z][y][!x] ? at[0] : at[0] / 2);
}

double uz_box_node_count(const uz_box *box)
{
    const uz_box_lattice lattice = uz_box_lattice_of(box);
    double count = 0;
    for (int i = 0; i < 1 << box->dim; i++) {
        double nodes = 1;
        for (int axis = 0; axis < box->dim; axis++)
            nodes *= (i >> axis & 1) ? (double)box->cells[axis] : (double)box->cells[axis] + 1;
        if (i == 0 || (lattice.order == 2 && (lattice.whole || lattice.node[i >> 2][i >> 1 & 1][i & 1])))
            count += nodes;
    }
    return count;
}

/* Points of the lattice along one axis: grid lines, and the middles between two. Once for all nodes: logarithms for
 * each of them would take longer than all the rest. */
double *uz_box_lines(const uz_box *box, int axis, int order)
{
    const int64_t count = axis < box->dim ? order * box->cells[axis] + 1 : 1;
    double *line = uz_alloc(count, sizeof *line);
    for (int64_t i = 0; line && axis < box->dim && i < count; i += order) /* both ends are exact up to one rounding */
        line[i] = box->origin[axis] + box->size[axis] * share_before(box, axis, i / order);
    for (int64_t i = 1; line && order == 2 && i < count; i += 2)
        line[i] = is_graded(box, axis)
                      ? 0.5 * (line[i - 1] + line[i + 1])
                      : box->origin[axis] + box->size[axis] * ((double)i / (double)(order * box->cells[axis]));
    return line;
}

static uz_status fill_nodes(uz_mesh *mesh, const uz_box *box, uz_error *err)
{
    const uz_box_lattice lattice = uz_box_lattice_of(box);
    const int64_t end[3] = {lattice.order * box->cells[0], lattice.order * box->cells[1],
                            box->dim == 3 ? lattice.order * box->cells[2] : 0};
    double *line[3], *xyz = mesh->xyz;
    for (int axis = 0; axis < 3; axis++)
        line[axis] = uz_box_lines(box, axis, lattice.order);
    const bool room = line[0] && line[1] && line[2];
    for (int64_t k = 0; k <= end[2] && room; k++)
        for (int64_t j = 0; j <= end[1]; j++)
            for (int64_t i = 0; i <= end[0]; i++) {
                if (!lattice.whole && !lattice.node[k % 2][j % 2][i % 2])
                    continue;
                *xyz++ = line[0][i];
                *xyz++ = line[1][j];
                if (box->dim == 3)
                    *xyz++ = line[2][k];
            }
    for (int axis = 0; axis < 3; axis++)
        free(line[axis]);
    return room ? UZ_OK : uz_no_memory(err, "the grid lines of a box");
}

/* ---- the whole */

uz_status uz_mesh_from_box(uz_mesh *out, const uz_box *box, uz_error *err)
{
    memset(out, 0, sizeof *out);
    uz_status status = check_box(box, err);
    if (status != UZ_OK)
        return status;
    const uz_element_type *type = uz_element_type_of(uz_box_element(box));
    int64_t cells = 1;
    out->dim = box->dim;
    out->uniform = type->nodes == type->corners && type->parts == 1;
    for (int axis = 0; axis < box->dim; axis++) {
        cells *= box->cells[axis];
        out->cell[axis] = box->size[axis] / (double)box->cells[axis];
        out->extent = axis == 0 ? box->size[0] : hypot(out->extent, box->size[axis]);
        out->uniform = out->uniform && !is_graded(box, axis);
    }
    out->n_nodes = (int64_t)uz_box_node_count(box);
    out->n_elements = cells * uz_element_type_of(type->linear)->parts;
    out->xyz = uz_alloc(out->n_nodes * box->dim, sizeof *out->xyz);
    out->kind = uz_alloc(out->n_elements, sizeof *out->kind);
    out->first = uz_alloc(out->n_elements + 1, sizeof *out->first);
    out->node = uz_alloc(out->n_elements * type->nodes, sizeof *out->node);
    if (!out->xyz || !out->kind || !out->first || !out->node)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mesh of %lld nodes", (long long)out->n_nodes);
    if (status == UZ_OK)
        status = fill_nodes(out, box, err);
    if (status == UZ_OK) {
        uz_box_fill_elements(out, box);
        status = uz_box_fill_groups(out, box, err);
    }
    if (status != UZ_OK)
        uz_mesh_clear(out);
    return status;
}
