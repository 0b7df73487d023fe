/* mesh.h: what a scene's body is made of: nodes, elements, and named groups of both. */
#ifndef UZ_SCENE_MESH_H
#define UZ_SCENE_MESH_H

#include "uzawa.h"

/* Most unknowns that a scene may have: beyond it no factor fits in the memory of one machine. */
#define UZ_SCENE_MAX_DOFS 20000000

typedef enum { UZ_GROUP_NODES, UZ_GROUP_FACES, UZ_GROUP_ELEMENTS } uz_group_kind;

/* A side of an element (an edge in 2D), numbered as uz_element_side gives its nodes: the element is on the left of an
 * edge, and the normal of a face by the right-hand rule points out of it. */
typedef struct {
    int64_t element;
    int side;
} uz_face;

/* A named part of the body. Its nodes once each, in ascending order. A group of faces has them in the order in which
 * they were given; the group of all elements has no lists: every node, every element. */
typedef struct {
    char name[64];
    uz_group_kind kind;
    bool everything;
    int64_t n_nodes, *node;
    int64_t n_faces;
    uz_face *face;                /* faces only */
    int64_t n_elements, *element; /* elements only, ascending */
} uz_group;

typedef struct {
    int dim;
    int64_t n_nodes, n_elements;
    double *xyz;         /* n_nodes x dim */
    unsigned char *kind; /* n_elements: uz_element_kind */
    int64_t *first;      /* n_elements + 1: nodes of element e are node[first[e]..first[e + 1]) */
    int64_t *node;
    bool uniform; /* every element is a box of size `cell` and of one kind: they share one stiffness matrix */
    double cell[3];
    double extent; /* diagonal of the bounding box */
    uz_group *groups;
    int64_t n_groups;
} uz_mesh;

/* Nodes x fastest, row by row from the bottom; elements likewise. Groups: left, right, bottom, top, all.
 * Errors: UZ_ERR_SCENE or _NOT_FINITE at "/mesh/box/...". */
uz_status uz_mesh_from_box(uz_mesh *out, const uz_box *box, uz_error *err);
void uz_mesh_clear(uz_mesh *mesh);

/* The nodes of an element; *count of them. */
const int64_t *uz_mesh_element(const uz_mesh *mesh, int64_t element, int *count);
/* The nodes of a face in its order, corners first, then middles of its edges: at most UZ_FACE_NODES. Returns how many.
 */
enum { UZ_FACE_NODES = 8 };
int uz_mesh_face(int64_t node[UZ_FACE_NODES], const uz_mesh *mesh, uz_face face);

/* Sides of an element; the local nodes of one of them, corners first: [2] or [3] in 2D, [3], [4] or [6] in 3D. */
int uz_element_side_count(uz_element_kind kind);
int uz_element_side(const int **local, uz_element_kind kind, int side);

/* The group of that name, or NULL with UZ_ERR_SCENE at `where`, listing the names that there are. */
const uz_group *uz_mesh_group(const uz_mesh *mesh, const char *name, const char *where, uz_error *err);

/* How many nodes a group has, and the i-th of them, 0 <= i < count. */
int64_t uz_group_node_count(const uz_mesh *mesh, const uz_group *group);
int64_t uz_group_node_at(const uz_group *group, int64_t i);
/* The same of elements: none in a group of faces or nodes. */
int64_t uz_group_element_count(const uz_mesh *mesh, const uz_group *group);
int64_t uz_group_element_at(const uz_group *group, int64_t i);

#endif
