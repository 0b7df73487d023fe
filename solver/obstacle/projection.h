/* projection.h: contact between two deformable bodies, node to segment (2D) or face (3D).
 *
 * Each node of one body (the slave, group `on`) is projected on the faces of the other (the master, group `with`). The
 * foot x_m is the closest point; it has weights w_j at the nodes of its face (shape functions there, sum 1), and the
 * linear gap is
 *
 *     g(u) = gap + normal . (u_s - sum_j w_j u_mj) >= 0          for sliding that is small against a face
 *
 * The normal is that of the face itself at the foot, not one interpolated from averages at nodes: then x_s - x_m is
 * gap times normal, so that g is the distance to first order for every motion, rotations of both bodies together
 * leave it as it is, and the two contact forces have one line of action (no moment is left over). Where the foot is on
 * an edge or a corner between faces of the master the normal is along x_s - x_m, by the same token; where the node is
 * on that edge itself, the mean of the faces' normals, at corners weighted by their angles (Baerentzen and Aanaes,
 * "Signed distance computation using the angle weighted pseudonormal", IEEE TVCG 11 (2005) 243-253). */
#ifndef UZ_OBSTACLE_PROJECTION_H
#define UZ_OBSTACLE_PROJECTION_H

#include "scene/mesh.h"
#include "scene/mesh_parts.h"

/* A node beyond the border of the master has no row when it is outside by more than this part of the face's size. */
#define UZ_OVERHANG 0.05

/* One contact row. */
typedef struct {
    int64_t node;   /* of the slave */
    uz_face face;   /* of the master */
    int64_t number; /* of the face in its group */
    int count;      /* nodes of the face, in the order of uz_mesh_face */
    int64_t master[UZ_FACE_NODES];
    double weight[UZ_FACE_NODES];
    double local[2];  /* of the foot: edges in [-1, 1]; triangles x, y >= 0, x + y <= 1; quadrilaterals in [-1, 1]^2 */
    double normal[3]; /* unit, out of the master; the third is 0 in 2D */
    double gap;       /* (x_s - x_m) . normal; < 0: the bodies overlap */
    double size;      /* of the face: its longest edge */
} uz_contact_pair;

/* May the two touch? UZ_ERR_SCENE: `with` has no faces, or the two have a node in common, but no face. */
uz_status uz_contact_pair_check(const uz_mesh *mesh, const uz_group *on, const uz_group *with, int64_t index,
                                uz_error *err);

/* The place that a point of one body is at, whose other sides it may meet too: those that have none of its nodes, look
 * at it, and are not the back of what it is on, nor beyond that (scene/mesh_parts.h). */
typedef struct {
    uz_own_body *own; /* of the mesh; NULL: whatever is nearest is met */
    int64_t element;  /* which it is on */
    int nodes, normals;
    const int64_t *node;       /* those of its side, or itself */
    const double (*normal)[3]; /* of the sides around it, out of the body: one is enough that looks at what is met */
    bool (*may)(const void *ctx, int64_t node,
                int64_t number); /* of its first node and a face of the group; NULL: all */
    const void *ctx;
    double farthest; /* beyond it nothing is looked for, as where all around is the own back; 0: no limit */
} uz_own_place;

/* The rows of all nodes of `on` that face `with` (behind it, only those that look at it), in the order of the nodes
 * (ascending). O((n + f) log f) for n nodes within a few faces' size of f faces. `index` is the contact's place in the
 * scene, for pointers. own: own, may and ctx alone. may_miss: it is no error that no node faces `with`. The caller
 * frees *out with free(). Errors: UZ_ERR_SCENE ("/contacts/i/with": not faces; "/contacts/i/on": a node of the master
 * itself, or no node that faces it), UZ_ERR_MEMORY. */
uz_status uz_contact_pairs(uz_contact_pair **out, int64_t *count, const uz_mesh *mesh, const uz_group *on,
                           const uz_group *with, int64_t index, const uz_own_place *own, bool may_miss, uz_error *err);

/* The faces of a group, made ready for points from anywhere. */
typedef struct uz_faces uz_faces;

/* O(f log f). mesh and group are kept: they outlive it. The caller frees *out. Error: UZ_ERR_MEMORY. */
uz_status uz_faces_new(uz_faces **out, const uz_mesh *mesh, const uz_group *group, uz_error *err);
void uz_faces_free(uz_faces *faces);
/* The closest place to x (dim), which is at `own`, as the row of a node there, whose number stays 0. False: x lies
 * beyond the faces' border, or the face there has no normal. Allocates nothing. */
bool uz_faces_closest(uz_contact_pair *row, const uz_faces *faces, const double *x, const uz_own_place *own);

#endif
