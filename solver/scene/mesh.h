/* mesh.h: what a scene's body is made of: nodes, elements, and named groups of both. */
#ifndef UZ_SCENE_MESH_H
#define UZ_SCENE_MESH_H

#include "element/element_type.h"
#include "uzawa.h"

/* Most unknowns that a scene may have: beyond it no factor fits in the memory of one machine. */
#define UZ_SCENE_MAX_DOFS 20000000

typedef enum { UZ_GROUP_NODES, UZ_GROUP_FACES, UZ_GROUP_ELEMENTS } uz_group_kind;

/* A side of an element (an edge in 2D), numbered as in its uz_element_type: the element is on the left of an
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
    int64_t n_inner;              /* how many of them lie between two elements: `face` names the first of the two */
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
    double extent;    /* diagonal of the bounding box along the axes: for tolerances */
    int64_t n_unused; /* nodes of a file that no element uses: left out, and the others numbered anew in their order */
    int64_t n_given;  /* refined (bisect.h, subdivide.h): nodes from this one on lie amid others, ... */
    int64_t *from_first; /* ... node i amid those at from_first[i - n_given] to before from_first[i - n_given + 1] of */
    int64_t *from;
    double *from_share; /* and each of these, whose shape function is this there; the sum is 1 */
    /* Subdivided: n_nodes, nodes that an element which has the edge or face that they lie amid does not have. They go
     * where that goes, and none of those that they lie amid hangs itself. NULL: there are none. */
    unsigned char *hangs;
    int64_t *part_of;      /* refined: n_elements, the element before the last round that each is part of */
    unsigned char *inside; /* with `hangs`: n_elements, bits of its sides that lie within the body */
    uz_group *groups;
    int64_t n_groups;
} uz_mesh;

/* Nodes x fastest, row by row from the bottom, with the middles of edges in their places; elements by cells likewise.
 * A cell is one quadrilateral or hexahedron, two triangles, six tetrahedra. Groups: left and right (x), bottom and top
 * (y), in 3D back (lowest z) and front (highest z); all. `uniform` where all cells are equal and of one element.
 * Errors: UZ_ERR_SCENE or _NOT_FINITE at "/mesh/box/...". */
uz_status uz_mesh_from_box(uz_mesh *out, const uz_box *box, uz_error *err);

/* A mesh in numbers, checked: everything in range and finite, no element degenerate, inverted, concave at a corner or
 * there twice, no node without an element (those of a file are left out). Groups of one name become one: of elements if
 * any of them has some, else of faces, else of nodes. Added to them: "all", and "boundary" (the faces that belong to
 * one element only, by element) if no group is called so. dim: what the scene's model asks for.
 * Errors: UZ_ERR_SCENE or _NOT_FINITE at "/mesh/nodes/...", "/mesh/elements/...", "/mesh/groups/..." or "/mesh/gmsh".
 */
uz_status uz_mesh_from_given(uz_mesh *out, const uz_given_mesh *given, int dim, uz_error *err);

/* Faces (uz_face) by element, then by side, for qsort. */
int uz_face_order(const void *a, const void *b);

/* Adds the groups that the scene selects by where they are (select.c). Errors: UZ_ERR_SCENE at the selection's place,
 * _NOT_FINITE, _MEMORY. */
uz_status uz_mesh_select(uz_mesh *mesh, const uz_scene *scene, uz_error *err);

/* Adds the groups that contacts name together (uz_names). Errors: UZ_ERR_SCENE at "/contacts/i/on" or "with", _MEMORY.
 */
uz_status uz_mesh_join_groups(uz_mesh *mesh, const uz_scene *scene, uz_error *err);

/* The mesh of a scene, whatever it comes from, with the groups that it selects and those that its contacts name
 * together. */
uz_status uz_mesh_from_scene(uz_mesh *out, const uz_scene *scene, uz_error *err);
void uz_mesh_clear(uz_mesh *mesh);

/* What a new node of a refined mesh lies amid: how many nodes, and the shape function of each there. */
int uz_mesh_amid(const int64_t **from, const double **share, const uz_mesh *mesh, int64_t node);
/* The value there of what is between nodes as their shape functions are; value: by node, `stride` apart. */
double uz_mesh_value_amid(const uz_mesh *mesh, int64_t node, const double *value, int stride);
/* Does the node hang? */
static inline bool uz_mesh_hangs(const uz_mesh *mesh, int64_t node)
{
    return mesh->hangs && mesh->hangs[node];
}

/* The nodes of an element; *count of them. */
const int64_t *uz_mesh_element(const uz_mesh *mesh, int64_t element, int *count);
/* The mean place of all nodes, and twice the distance of the farthest one from there: a size that does not depend on
 * how the body stands, as `extent` does. */
void uz_mesh_middle(double middle[3], const uz_mesh *mesh);
double uz_mesh_size(const uz_mesh *mesh);
/* The elements around each node, ascending: around[first[node]] up to before first[node + 1]. first: n_nodes + 1;
 * around: as many as all elements have nodes. */
void uz_mesh_list_around(int64_t *first, int64_t *around, const uz_mesh *mesh);
/* The nodes of a face in its order, corners first, then middles of its edges: at most UZ_FACE_NODES. Returns how many.
 */
enum { UZ_FACE_NODES = UZ_SIDE_NODES };
int uz_mesh_face(int64_t node[UZ_FACE_NODES], const uz_mesh *mesh, uz_face face);

/* The group of that name, or NULL with UZ_ERR_SCENE at `where`, listing the names that there are. */
const uz_group *uz_mesh_group(const uz_mesh *mesh, const char *name, const char *where, uz_error *err);

/* Have two groups of faces one in common? 0 or 1; -1: no memory. */
int uz_groups_share_face(const uz_mesh *mesh, const uz_group *one, const uz_group *other);

/* How many nodes a group has, and the i-th of them, 0 <= i < count. */
int64_t uz_group_node_count(const uz_mesh *mesh, const uz_group *group);
int64_t uz_group_node_at(const uz_group *group, int64_t i);
/* The same of elements: none in a group of faces or nodes. */
int64_t uz_group_element_count(const uz_mesh *mesh, const uz_group *group);
int64_t uz_group_element_at(const uz_group *group, int64_t i);

#endif
