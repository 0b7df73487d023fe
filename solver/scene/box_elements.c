/* box_elements.c: the cells of a box as elements, and the sides of the box as groups.
 *
 * A cell is one quadrilateral or hexahedron, or is cut into two triangles or six tetrahedra in the same way everywhere.
 * The tetrahedra are those of the Kuhn (Freudenthal) triangulation: one for each order of the axes, all sharing the
 * diagonal from the first to the last corner, so that neighbours cut their common face alike (Freudenthal,
 * "Simplizialzerlegungen von beschraenkter Flachheit", 1942). */
#include "scene/box.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdio.h>
#include <string.h>

enum { MOST_PARTS = 6, MOST_CORNERS = 8, MOST_NODES = 10, MOST_BOX_SIDES = 6 };

/* Corners of a cell in VTK order of quad4 and hex8, in cells. */
static const int CORNER[MOST_CORNERS][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

static const int WHOLE[MOST_PARTS][MOST_CORNERS] = {{0, 1, 2, 3, 4, 5, 6, 7}};
static const int TRIANGLES[MOST_PARTS][MOST_CORNERS] = {{0, 1, 2}, {0, 2, 3}};
static const int TETRAHEDRA[MOST_PARTS][MOST_CORNERS] = {{0, 1, 2, 6}, {0, 5, 1, 6}, {0, 3, 7, 6},
                                                         {0, 2, 3, 6}, {0, 4, 5, 6}, {0, 7, 4, 6}};

/* Ends of the edges that have a node in their middle, in the order of these nodes. */
static const int TRI_EDGES[][2] = {{0, 1}, {1, 2}, {2, 0}};
static const int QUAD_EDGES[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
static const int TET_EDGES[][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

/* How a cell is made of elements of one kind. */
typedef struct {
    int parts, corners, edges;
    const int (*part)[MOST_CORNERS];
    const int (*edge)[2];
} cell_cut;

static cell_cut cut_of(uz_element_kind kind)
{
    switch (kind) {
    case UZ_TRI3:
        return (cell_cut){2, 3, 0, TRIANGLES, NULL};
    case UZ_TRI6:
        return (cell_cut){2, 3, 3, TRIANGLES, TRI_EDGES};
    case UZ_QUAD8:
        return (cell_cut){1, 4, 4, WHOLE, QUAD_EDGES};
    case UZ_TET4:
        return (cell_cut){6, 4, 0, TETRAHEDRA, NULL};
    case UZ_TET10:
        return (cell_cut){6, 4, 6, TETRAHEDRA, TET_EDGES};
    case UZ_HEX8:
        return (cell_cut){1, 8, 0, WHOLE, NULL};
    default:
        return (cell_cut){1, 4, 0, WHOLE, NULL};
    }
}

int uz_box_parts(uz_element_kind kind)
{
    return cut_of(kind).parts;
}

/* Where the nodes of each part of a cell are in the lattice, from the first corner of the cell. */
static void list_places(int64_t place[MOST_PARTS][MOST_NODES][3], uz_element_kind kind)
{
    const cell_cut cut = cut_of(kind);
    const int order = uz_box_order(kind);
    for (int p = 0; p < cut.parts; p++)
        for (int c = 0; c < 3; c++) {
            for (int n = 0; n < cut.corners; n++)
                place[p][n][c] = order * CORNER[cut.part[p][n]][c];
            for (int n = 0; n < cut.edges; n++)
                place[p][cut.corners + n][c] = (place[p][cut.edge[n][0]][c] + place[p][cut.edge[n][1]][c]) / 2;
        }
}

/* The nodes of the elements of one cell; returns where the next ones go. */
static int64_t *fill_cell(int64_t *node, const uz_box *box, uz_element_kind kind,
                          int64_t place[MOST_PARTS][MOST_NODES][3], const int64_t cell[3])
{
    const int order = uz_box_order(kind), parts = uz_box_parts(kind), count = uz_element_node_count(kind);
    for (int p = 0; p < parts; p++)
        for (int n = 0; n < count; n++) {
            const int64_t *offset = place[p][n];
            const int64_t at[3] = {order * cell[0] + offset[0], order * cell[1] + offset[1],
                                   order * cell[2] + offset[2]};
            *node++ = uz_box_node(box, kind, at);
        }
    return node;
}

void uz_box_fill_elements(uz_mesh *mesh, const uz_box *box, uz_element_kind kind)
{
    int64_t place[MOST_PARTS][MOST_NODES][3] = {{{0}}}, *node = mesh->node;
    const int64_t layers = box->dim == 3 ? box->cells[2] : 1;
    const int count = uz_element_node_count(kind);
    list_places(place, kind);
    for (int64_t k = 0; k < layers; k++)
        for (int64_t j = 0; j < box->cells[1]; j++)
            for (int64_t i = 0; i < box->cells[0]; i++)
                node = fill_cell(node, box, kind, place, (int64_t[3]){i, j, box->dim == 3 ? k : 0});
    for (int64_t e = 0; e <= mesh->n_elements; e++)
        mesh->first[e] = count * e;
    memset(mesh->kind, (int)kind, (size_t)mesh->n_elements);
}

/* ---- sides of the box */

static const struct {
    const char *name;
    int axis;
    bool high;
} BOX_SIDES[MOST_BOX_SIDES] = {{"left", 0, false}, {"right", 0, true}, {"bottom", 1, false},
                               {"top", 1, true},   {"back", 2, false}, {"front", 2, true}};

/* The sides of a cell's elements on one side of the cell. */
typedef struct {
    int count, part[MOST_PARTS], side[MOST_PARTS];
} cell_side;

static cell_side list_cell_side(uz_element_kind kind, int axis, bool high)
{
    const cell_cut cut = cut_of(kind);
    const int corners = uz_face_corner_count(kind);
    cell_side out = {0};
    for (int p = 0; p < cut.parts; p++)
        for (int s = 0; s < uz_element_side_count(kind); s++) {
            const int *local;
            int on = 0;
            uz_element_side(&local, kind, s);
            for (int n = 0; n < corners; n++)
                on += CORNER[cut.part[p][local[n]]][axis] == (high ? 1 : 0);
            if (on == corners) {
                out.part[out.count] = p;
                out.side[out.count++] = s;
            }
        }
    return out;
}

/* A range of lattice points or cells: all of them in a plane across one axis. */
typedef struct {
    int64_t from[3], end[3];
} box_range;

static box_range range_across(const uz_box *box, int per_cell, int extra, int axis, bool high)
{
    box_range range = {{0, 0, 0}, {1, 1, 1}};
    for (int c = 0; c < box->dim; c++)
        range.end[c] = per_cell * box->cells[c] + extra;
    if (high)
        range.from[axis] = range.end[axis] - 1;
    else
        range.end[axis] = 1;
    return range;
}

static int64_t range_count(const box_range *range)
{
    int64_t count = 1;
    for (int c = 0; c < 3; c++)
        count *= range->end[c] - range->from[c];
    return count;
}

static void fill_side_nodes(uz_group *group, const uz_box *box, uz_element_kind kind, const box_range *range)
{
    for (int64_t k = range->from[2]; k < range->end[2]; k++)
        for (int64_t j = range->from[1]; j < range->end[1]; j++)
            for (int64_t i = range->from[0]; i < range->end[0]; i++)
                group->node[group->n_nodes++] = uz_box_node(box, kind, (int64_t[3]){i, j, k});
}

static void fill_side_faces(uz_group *group, const uz_box *box, uz_element_kind kind, const box_range *range,
                            const cell_side *on)
{
    const int parts = uz_box_parts(kind);
    for (int64_t k = range->from[2]; k < range->end[2]; k++)
        for (int64_t j = range->from[1]; j < range->end[1]; j++)
            for (int64_t i = range->from[0]; i < range->end[0]; i++)
                for (int s = 0; s < on->count; s++) {
                    const int64_t cell = (k * box->cells[1] + j) * box->cells[0] + i;
                    group->face[group->n_faces++] = (uz_face){cell * parts + on->part[s], on->side[s]};
                }
}

static uz_status fill_side(uz_group *group, const uz_box *box, uz_element_kind kind, int side, uz_error *err)
{
    const int axis = BOX_SIDES[side].axis;
    const bool high = BOX_SIDES[side].high;
    const box_range nodes = range_across(box, uz_box_order(kind), 1, axis, high);
    const box_range cells = range_across(box, 1, 0, axis, high);
    const cell_side on = list_cell_side(kind, axis, high);
    group->kind = UZ_GROUP_FACES;
    snprintf(group->name, sizeof group->name, "%s", BOX_SIDES[side].name);
    group->node = uz_alloc(range_count(&nodes), sizeof *group->node);
    group->face = uz_alloc(range_count(&cells) * on.count, sizeof *group->face);
    if (!group->node || !group->face)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the side \"%s\" of a box", group->name);
    fill_side_nodes(group, box, kind, &nodes);
    fill_side_faces(group, box, kind, &cells, &on);
    return UZ_OK;
}

uz_status uz_box_fill_groups(uz_mesh *mesh, const uz_box *box, uz_element_kind kind, uz_error *err)
{
    const int sides = 2 * box->dim;
    uz_status status = UZ_OK;
    mesh->groups = uz_alloc_zero(sides + 1, sizeof *mesh->groups);
    if (!mesh->groups)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the groups of a box");
    mesh->n_groups = sides + 1;
    for (int i = 0; i < sides && status == UZ_OK; i++)
        status = fill_side(&mesh->groups[i], box, kind, i, err);
    mesh->groups[sides].kind = UZ_GROUP_ELEMENTS;
    mesh->groups[sides].everything = true;
    snprintf(mesh->groups[sides].name, sizeof mesh->groups[sides].name, "all");
    return status;
}
