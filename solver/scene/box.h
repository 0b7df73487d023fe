/* box.h: the two halves of uz_mesh_from_box: the lattice of a box, and its elements and sides. */
#ifndef UZ_SCENE_BOX_H
#define UZ_SCENE_BOX_H

#include "scene/mesh.h"

/* The element of a checked box. */
uz_element_kind uz_box_element(const uz_box *box);
/* Steps of the lattice of nodes in each cell: 2 where edges have a node in their middle. */
int uz_box_order(uz_element_kind kind);
/* Elements in each cell. */
int uz_box_parts(uz_element_kind kind);
/* The number of a lattice point that is a node; at[2] = 0 in 2D. */
int64_t uz_box_node(const uz_box *box, uz_element_kind kind, const int64_t at[3]);

/* The lattice along an axis: order x cells + 1 coordinates, ascending; the caller frees them. NULL: no memory. */
double *uz_box_lines(const uz_box *box, int axis, int order);

void uz_box_fill_elements(uz_mesh *mesh, const uz_box *box, uz_element_kind kind);
uz_status uz_box_fill_groups(uz_mesh *mesh, const uz_box *box, uz_element_kind kind, uz_error *err);

#endif
