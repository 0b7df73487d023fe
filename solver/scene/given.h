/* given.h: the steps of uz_mesh_from_given. */
#ifndef UZ_SCENE_GIVEN_H
#define UZ_SCENE_GIVEN_H

#include "scene/mesh.h"

enum { UZ_POINTER = 96 };

/* Most groups of a mesh. */
#define UZ_MESH_MAX_GROUPS 4096

/* Room for a body whose dim, n_nodes and n_elements are there, with `places` nodes of elements in all; its coordinates
 * are the first of *xyz (n_nodes x 3, of malloc), which becomes its own where they are all, and first[0] is 0. False:
 * no memory. */
bool uz_given_room(uz_given_mesh *given, double **xyz, int64_t places);
/* Do all nodes of elements lie in one plane z = constant, but for rounding? xyz: n_nodes x 3. */
bool uz_given_is_flat(const uz_given_mesh *given, const double *xyz);

/* Members that a group, empty at first, gets one by one; zeroed but for `to`. */
typedef struct {
    uz_given_group *to;
    int64_t room[4];
} uz_given_members;
typedef enum { UZ_GIVEN_ELEMENT, UZ_GIVEN_SIDE, UZ_GIVEN_NODES, UZ_GIVEN_WAYS } uz_given_way;
/* Adds an element, a side by its n nodes, or these. False: no memory, and what is there stays. */
bool uz_given_add(uz_given_members *members, uz_given_way way, int64_t element, const int64_t *node, int64_t n);

/* Refuses an element: "element 12 (quad4 with nodes 4, 7, 9, 3) WHAT; REMEDY" at "/mesh/elements/quad4/3", or where
 * the file is. */
enum { UZ_ELEMENT_TEXT = 160 };
uz_status uz_given_refuse(const uz_given_mesh *given, int64_t element, const char *what, const char *remedy,
                          uz_error *err);

/* Sizes, coordinates; kinds, node numbers and shapes of all elements. */
uz_status uz_given_check(const uz_given_mesh *given, int dim, uz_error *err);

/* The groups of a mesh whose nodes and elements are there. new_node: the number of each given node, -1: left out. */
uz_status uz_given_groups(uz_mesh *mesh, const uz_given_mesh *given, const int64_t *new_node, uz_error *err);

#endif
