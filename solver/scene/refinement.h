/* refinement.h: what the ways of refining a mesh have in common: its new nodes, its edges and faces by their nodes, and
 * the mesh that comes of it, with its groups. */
#ifndef UZ_SCENE_REFINEMENT_H
#define UZ_SCENE_REFINEMENT_H

#include "scene/mesh.h"

enum { UZ_LINK_NODES = 4 };

/* An edge, or a face of four corners. */
typedef struct {
    int64_t node[UZ_LINK_NODES]; /* its corners, ascending; -1 beyond them */
    int64_t middle;              /* node amid it, -1: none */
    int64_t users;               /* last entry of the list of elements that have or had it, -1: none */
    int64_t whole;               /* the edge or face that it is a part of; -1: none */
    bool split;
} uz_link;

typedef struct {
    int64_t element, before; /* before: the next entry of the list, -1: none */
} uz_link_user;

/* A mesh on the way to a finer one. It is zeroed, begun, published and ended. */
typedef struct {
    uz_mesh *mesh; /* as it was */
    int dim;
    uz_link *links;
    uz_link_user *users;
    double *xyz;
    int64_t *from_first, *from; /* of the new nodes, as in uz_mesh */
    double *from_share;
    int64_t *table; /* by hash of their nodes: 1 + number of a link, 0: none */
    int64_t nodes, n_links, n_users, n_from, slots;
    int64_t room_links, room_users, room_xyz, room_first, room_from, room_share;
    bool failed, too_many; /* no memory; more unknowns than a scene may have */
} uz_refinement;

/* The nodes of the mesh. False: no memory. */
bool uz_refinement_begin(uz_refinement *x, uz_mesh *mesh);

/* A node amid others, of which each has a share in it that is not 0: its number. Without room it is 0, and x says so.
 */
int64_t uz_refinement_node(uz_refinement *x, const int64_t *from, const double *share, int count);
/* The edge or face of these corners, made where it is not there: its number. Likewise. */
int64_t uz_refinement_link(uz_refinement *x, const int64_t *corner, int corners);
/* Lists an element as one that has the link. */
void uz_refinement_use(uz_refinement *x, int64_t link, int64_t element);

/* The mesh becomes `fine`, of which kind, first, node, part_of and hangs are made, and which takes all else. root: by
 * element of it the one that was given which it is a part of; side: UZ_ELEMENT_SIDES of each, by its own sides, the one
 * of the root's that this is a part of, -1: none. Where x fails, fine is freed and the mesh can only be cleared. */
void uz_refinement_publish(uz_refinement *x, uz_mesh *fine, const int64_t *root, const signed char *side);

/* Clears x and tells how it ended; listed: the list named elements that are there. UZ_ERR_ARGUMENT, _LIMIT, _MEMORY. */
uz_status uz_refinement_end(uz_refinement *x, bool listed, uz_error *err);

#endif
