/* mesh.h: what a scene's body is made of: nodes, elements, and named groups of both. */
#ifndef UZ_SCENE_MESH_H
#define UZ_SCENE_MESH_H

#include "uzawa.h"

/* Most unknowns that a scene may have: beyond it no factor fits in the memory of one machine. */
#define UZ_SCENE_MAX_DOFS 20000000

typedef enum {
    UZ_QUAD4 /* VTK order: the four corners, counter-clockwise */
} uz_element_kind;

typedef enum { UZ_GROUP_ELEMENTS, UZ_GROUP_EDGES } uz_group_kind;

/* A named part of the body. A group of edges has them in the order in which they follow each other, each with the
 * body on its left, and its nodes once each in ascending order. The group of all elements has no lists: every node. */
typedef struct {
    char name[64];
    uz_group_kind kind;
    int64_t n_nodes, *node; /* edges only */
    int64_t n_edges, *edge; /* edges only: pairs of nodes */
} uz_group;

typedef struct {
    int dim;
    int64_t n_nodes, n_elements;
    double *xyz; /* n_nodes x dim */
    uz_element_kind kind;
    int nodes_per_element;
    int64_t *element; /* n_elements x nodes_per_element */
    bool uniform;     /* every element is a rectangle of size `cell`: they share one stiffness matrix */
    double cell[3];
    double extent; /* diagonal of the bounding box */
    uz_group *groups;
    int64_t n_groups;
} uz_mesh;

/* Nodes x fastest, row by row from the bottom; elements likewise. Groups: left, right, bottom, top, all.
 * Errors: UZ_ERR_SCENE or _NOT_FINITE at "/mesh/box/...". */
uz_status uz_mesh_from_box(uz_mesh *out, const uz_box *box, uz_error *err);
void uz_mesh_clear(uz_mesh *mesh);

/* The group of that name, or NULL with UZ_ERR_SCENE at `where`, listing the names that there are. */
const uz_group *uz_mesh_group(const uz_mesh *mesh, const char *name, const char *where, uz_error *err);

/* How many nodes a group has, and the i-th of them, 0 <= i < count. */
int64_t uz_group_node_count(const uz_mesh *mesh, const uz_group *group);
int64_t uz_group_node_at(const uz_group *group, int64_t i);

#endif
