/* cells.h: the original data of a brick (brick.h), for whoever starts from them. */
#ifndef UZ_BRICK_CELLS_H
#define UZ_BRICK_CELLS_H

#include "element/element.h"

/* Of a cell in space; in the plane there are fewer. */
enum { UZ_BRICK_NODES = 8, UZ_BRICK_DOFS = 24, UZ_BRICK_PARITIES = 8 };

/* Nodes x fastest, then y, z; cells likewise. */
typedef struct {
    /* 3; 2: a plane body. It lacks the axis in the middle, so that rows of its cells are layers: cells[1] and cell[1]
     * are 0, and the y of the body, its second component, is along the third axis. */
    int axes;
    int64_t cells[3], n_nodes, d;
    double cell[3];     /* size of one */
    const int64_t *dof; /* n_nodes x axes, borrowed: number of a free dof, negative: supported; ascending */
    double ke[UZ_BRICK_DOFS * UZ_BRICK_DOFS]; /* of a cell, uz_brick_dofs(axes) square, nodes in VTK's order */
    uz_element element;                       /* what the cells are, for cells of other sizes; without xyz */
} uz_brick;

/* Corners and dofs of a cell, and the parities of what these do. */
static inline int uz_brick_corners(int axes)
{
    return 1 << axes;
}
static inline int uz_brick_dofs(int axes)
{
    return axes << axes;
}
/* The axis along which a component of a displacement is. */
static inline int uz_brick_axis_of(int axes, int component)
{
    return component == axes - 1 ? 2 : component;
}

static inline bool uz_brick_holds(const int64_t *dof, int axes)
{
    return dof[0] < 0 || dof[1] < 0 || dof[axes - 1] < 0;
}

/* Of the nodes of a line, whose dofs are `dof`, those from *begin to *end - 1 have free dofs only, numbered one after
 * the other; all that do, or none. */
static inline void uz_brick_run(int64_t *begin, int64_t *end, const int64_t *dof, int64_t nodes, int axes)
{
    int64_t first = 0, last = nodes;
    while (first < last && uz_brick_holds(dof + axes * first, axes))
        first++;
    while (first < last && uz_brick_holds(dof + axes * (last - 1), axes))
        last--;
    const bool whole = first < last && dof[axes * last - 1] - dof[axes * first] == axes * (last - first) - 1;
    *begin = whole ? first : 0;
    *end = whole ? last : 0;
}

#endif
