/* box.h: the two halves of uz_mesh_from_box: the lattice of a box, and its elements and sides. */
#ifndef UZ_SCENE_BOX_H
#define UZ_SCENE_BOX_H

#include "scene/mesh.h"

/* The element of a checked box. */
uz_element_kind uz_box_element(const uz_box *box);

/* The points that nodes of a box may be at, `order` steps in each cell, x fastest: a lattice of every second point is
 * the corners of the cells, the others are middles of edges. Those that no element of the kind uses are left out: they
 * are alike in all cells, so that whether a point is a node follows from which of its three numbers are odd. */
typedef struct {
    int order;
    bool whole;         /* every point is a node */
    bool node[2][2][2]; /* [odd z][odd y][odd x]: is such a point a node? */
    int64_t row[2][2];  /* [odd z][odd y]: nodes of a row along x */
    int64_t plane[2];   /* [odd z]: nodes of a plane z = constant */
} uz_box_lattice;
uz_box_lattice uz_box_lattice_of(const uz_box *box);
/* The number of a point that is a node, -1 of others; at[2] = 0 in 2D. */
int64_t uz_box_node(const uz_box_lattice *lattice, const int64_t at[3]);
/* Nodes of a box, also of one that is too large. */
double uz_box_node_count(const uz_box *box);

/* The lattice along an axis: order x cells + 1 coordinates, ascending; the caller frees them. NULL: no memory. */
double *uz_box_lines(const uz_box *box, int axis, int order);

/* place[part][node]: where the nodes of each element of a cell are, in steps from its first corner; returns how many
 * elements. */
int uz_box_places(int64_t place[UZ_ELEMENT_PARTS][UZ_ELEMENT_NODES][3], uz_element_kind kind);
void uz_box_fill_elements(uz_mesh *mesh, const uz_box *box);
uz_status uz_box_fill_groups(uz_mesh *mesh, const uz_box *box, uz_error *err);

#endif
