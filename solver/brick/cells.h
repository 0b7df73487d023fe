/* cells.h: the original data of a brick (brick.h), for whoever starts from them. */
#ifndef UZ_BRICK_CELLS_H
#define UZ_BRICK_CELLS_H

#include "element/element.h"

enum { UZ_BRICK_NODES = 8, UZ_BRICK_DOFS = 24, UZ_BRICK_PARITIES = 8 };

/* Nodes x fastest, then y, z; cells likewise. */
typedef struct {
    int64_t cells[3], n_nodes, d;
    double cell[3];     /* size of one */
    const int64_t *dof; /* n_nodes x 3, borrowed: number of a free dof, negative: supported; ascending */
    double ke[UZ_BRICK_DOFS * UZ_BRICK_DOFS]; /* of a cell, nodes in VTK's order */
    uz_element element;                       /* what the cells are, for cells of other sizes; without xyz */
} uz_brick;

/* Of the nodes of a line, whose dofs are `dof`, those from *begin to *end - 1 have free dofs only, numbered one after
 * the other; all that do, or none. */
static inline void uz_brick_run(int64_t *begin, int64_t *end, const int64_t *dof, int64_t nodes)
{
    int64_t first = 0, last = nodes;
    while (first < last && (dof[3 * first] < 0 || dof[3 * first + 1] < 0 || dof[3 * first + 2] < 0))
        first++;
    while (first < last && (dof[3 * last - 3] < 0 || dof[3 * last - 2] < 0 || dof[3 * last - 1] < 0))
        last--;
    const bool whole = first < last && dof[3 * last - 1] - dof[3 * first] == 3 * (last - first) - 1;
    *begin = whole ? first : 0;
    *end = whole ? last : 0;
}

#endif
