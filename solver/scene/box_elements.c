/* box_elements.c: the cells of a box as elements, and the sides of the box as groups.
 * All cells are cut into elements in the same way. */
#include "scene/box.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"

#include <stdio.h>
#include <string.h>

enum { MOST_BOX_SIDES = 6 };

/* Corners of a cell in VTK order of quad4 and hex8, in cells. */
static const int CORNER[UZ_ELEMENT_CORNERS][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                  {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

int uz_box_places(int64_t place[UZ_ELEMENT_PARTS][UZ_ELEMENT_NODES][3], uz_element_kind kind)
{
    const uz_element_type *type = uz_element_type_of(kind), *linear = uz_element_type_of(type->linear);
    const int order = type->nodes > type->corners ? 2 : 1;
    for (int p = 0; p < linear->parts; p++)
        for (int c = 0; c < 3; c++) {
            for (int a = 0; a < type->corners; a++)
                place[p][a][c] = order * CORNER[linear->part[p][a]][c];
            for (int a = type->corners; a < type->nodes; a++) {
                const int *end = type->edge[a - type->corners];
                place[p][a][c] = (place[p][end[0]][c] + place[p][end[1]][c]) / 2;
            }
        }
    return linear->parts;
}

/* Layers of cells as the threads that share them see them. */
typedef struct {
    uz_mesh *mesh;
    const uz_box *box;
    uz_box_lattice lattice;
    int64_t place[UZ_ELEMENT_PARTS][UZ_ELEMENT_NODES][3], layers;
    int parts, count, shares; /* elements of a cell, nodes of an element */
} filling;

static void fill_layers(void *ctx, int share)
{
    const filling *f = ctx;
    const int64_t *cells = f->box->cells, first = f->layers * share / f->shares,
                  end = f->layers * (share + 1) / f->shares, of_layer = cells[0] * cells[1] * f->parts;
    const int order = f->lattice.order;
    int64_t *node = f->mesh->node + first * of_layer * f->count;
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j < cells[1]; j++)
            for (int64_t i = 0; i < cells[0]; i++)
                for (int p = 0; p < f->parts; p++)
                    for (int a = 0; a < f->count; a++) {
                        const int64_t *offset = f->place[p][a];
                        const int64_t at[3] = {order * i + offset[0], order * j + offset[1], order * k + offset[2]};
                        *node++ = uz_box_node(&f->lattice, at);
                    }
    for (int64_t e = first * of_layer; e < end * of_layer; e++)
        f->mesh->first[e] = f->count * e;
}

void uz_box_fill_elements(uz_mesh *mesh, const uz_box *box)
{
    const uz_element_kind kind = uz_box_element(box);
    filling f = {.mesh = mesh,
                 .box = box,
                 .lattice = uz_box_lattice_of(box),
                 .layers = box->dim == 3 ? box->cells[2] : 1,
                 .count = uz_element_node_count(kind)};
    f.parts = uz_box_places(f.place, kind);
    f.shares = f.layers < UZ_ASIDE_MOST ? (int)f.layers : UZ_ASIDE_MOST;
    uz_aside_share(fill_layers, &f, f.shares);
    mesh->first[mesh->n_elements] = f.count * mesh->n_elements;
    memset(mesh->kind, (int)kind, (size_t)mesh->n_elements);
}

/* ---- sides of the box */

static const struct {
    const char *name;
    int axis;
    bool high;
} BOX_SIDES[MOST_BOX_SIDES] = {{"left", 0, false}, {"right", 0, true}, {"bottom", 1, false},
                               {"top", 1, true},   {"back", 2, false}, {"front", 2, true}};

/* A range of lattice points or cells: all of them in a plane across one axis. */
typedef struct {
    int64_t from[3], end[3], count;
} box_range;

static box_range range_across(const uz_box *box, int per_cell, int extra, int axis, bool high)
{
    box_range range = {{0, 0, 0}, {1, 1, 1}, 1};
    for (int c = 0; c < box->dim; c++) {
        range.end[c] = per_cell * box->cells[c] + extra;
        if (c != axis)
            range.count *= range.end[c];
    }
    if (high)
        range.from[axis] = range.end[axis] - 1;
    else
        range.end[axis] = 1;
    return range;
}

static uz_status fill_side(uz_group *group, const uz_box *box, int number, uz_error *err)
{
    const int axis = BOX_SIDES[number].axis;
    const bool high = BOX_SIDES[number].high;
    const uz_element_kind kind = uz_box_element(box);
    const uz_element_type *type = uz_element_type_of(kind), *linear = uz_element_type_of(type->linear);
    const uz_box_lattice lattice = uz_box_lattice_of(box);
    const box_range nodes = range_across(box, lattice.order, 1, axis, high);
    const box_range cells = range_across(box, 1, 0, axis, high);
    uz_face on[UZ_ELEMENT_PARTS * UZ_ELEMENT_SIDES]; /* the sides of a cell's elements that are on that side of it */
    int count = 0;
    for (int p = 0; p < linear->parts; p++)
        for (int s = 0; s < type->sides; s++) {
            const uz_element_side *side = &type->side[s];
            int corners = 0;
            for (int n = 0; n < side->corners; n++)
                corners += CORNER[linear->part[p][side->node[n]]][axis] == (high ? 1 : 0);
            if (corners == side->corners)
                on[count++] = (uz_face){p, s};
        }
    group->kind = UZ_GROUP_FACES;
    snprintf(group->name, sizeof group->name, "%s", BOX_SIDES[number].name);
    group->node = uz_alloc(nodes.count, sizeof *group->node);
    group->face = uz_alloc(cells.count * count, sizeof *group->face);
    if (!group->node || !group->face)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the side \"%s\" of a box", group->name);
    for (int64_t k = nodes.from[2]; k < nodes.end[2]; k++)
        for (int64_t j = nodes.from[1]; j < nodes.end[1]; j++)
            for (int64_t i = nodes.from[0]; i < nodes.end[0]; i++) {
                const int64_t node = uz_box_node(&lattice, (int64_t[3]){i, j, k});
                if (node >= 0)
                    group->node[group->n_nodes++] = node;
            }
    for (int64_t k = cells.from[2]; k < cells.end[2]; k++)
        for (int64_t j = cells.from[1]; j < cells.end[1]; j++)
            for (int64_t i = cells.from[0]; i < cells.end[0]; i++)
                for (int s = 0; s < count; s++) {
                    const int64_t cell = (k * box->cells[1] + j) * box->cells[0] + i;
                    group->face[group->n_faces++] = (uz_face){cell * linear->parts + on[s].element, on[s].side};
                }
    return UZ_OK;
}

uz_status uz_box_fill_groups(uz_mesh *mesh, const uz_box *box, uz_error *err)
{
    const int sides = 2 * box->dim;
    uz_status status = UZ_OK;
    mesh->groups = uz_alloc_zero(sides + 1, sizeof *mesh->groups);
    if (!mesh->groups)
        return uz_no_memory(err, "the groups of a box");
    mesh->n_groups = sides + 1;
    for (int i = 0; i < sides && status == UZ_OK; i++)
        status = fill_side(&mesh->groups[i], box, i, err);
    mesh->groups[sides].kind = UZ_GROUP_ELEMENTS;
    mesh->groups[sides].everything = true;
    snprintf(mesh->groups[sides].name, sizeof mesh->groups[sides].name, "all");
    return status;
}
