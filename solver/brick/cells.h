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

#endif
