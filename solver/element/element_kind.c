/* element_kind.c: names, sizes and sides of the elements. Nodes in VTK order: corners, then middles of the edges
 * (Schroeder, Martin, Lorensen, "The Visualization Toolkit", cell types). */
#include "element/element_kind.h"

#include <string.h>

enum { MOST_SIDES = 6, MOST_SIDE_NODES = 6 };

/* Each side with its corners first, then the middles of its edges in the same sense. */
typedef struct {
    const char *name;
    int dim, nodes, corners, sides, side_nodes, side_corners;
    int side[MOST_SIDES][MOST_SIDE_NODES];
} kind_of_element;

static const kind_of_element KINDS[UZ_ELEMENT_KINDS] = {
    [UZ_TRI3] = {"tri3", 2, 3, 3, 3, 2, 2, {{0, 1}, {1, 2}, {2, 0}}},
    [UZ_QUAD4] = {"quad4", 2, 4, 4, 4, 2, 2, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}},
    [UZ_TRI6] = {"tri6", 2, 6, 3, 3, 3, 2, {{0, 1, 3}, {1, 2, 4}, {2, 0, 5}}},
    [UZ_QUAD8] = {"quad8", 2, 8, 4, 4, 3, 2, {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}}},
    [UZ_TET4] = {"tet4", 3, 4, 4, 4, 3, 3, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}},
    [UZ_HEX8] = {"hex8",
                 3,
                 8,
                 8,
                 6,
                 4,
                 4,
                 {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}},
    [UZ_TET10] =
        {"tet10", 3, 10, 4, 4, 6, 3, {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}}},
};

const char *uz_element_name(uz_element_kind kind)
{
    return kind < UZ_ELEMENT_KINDS ? KINDS[kind].name : "unknown";
}

bool uz_element_parse(uz_element_kind *out, const char *name)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++)
        if (strcmp(KINDS[i].name, name) == 0) {
            *out = (uz_element_kind)i;
            return true;
        }
    return false;
}

int uz_element_dim(uz_element_kind kind)
{
    return KINDS[kind].dim;
}

int uz_element_node_count(uz_element_kind kind)
{
    return KINDS[kind].nodes;
}

int uz_element_side_count(uz_element_kind kind)
{
    return KINDS[kind].sides;
}

int uz_element_side(const int **local, uz_element_kind kind, int side)
{
    *local = KINDS[kind].side[side];
    return KINDS[kind].side_nodes;
}

int uz_element_corner_count(uz_element_kind kind)
{
    return KINDS[kind].corners;
}

int uz_face_corner_count(uz_element_kind kind)
{
    return KINDS[kind].side_corners;
}

bool uz_element_is_quadratic(uz_element_kind kind)
{
    return KINDS[kind].nodes > KINDS[kind].corners;
}
