/* mesh_parts.h: which nodes of a mesh hang together, and what a straight way through the body leads to. */
#ifndef UZ_SCENE_MESH_PARTS_H
#define UZ_SCENE_MESH_PARTS_H

#include "scene/mesh.h"

/* Sets that are joined: of (as many as things, of[i] = i at first) leads from each to the least of its set. */
int64_t uz_join_root(int64_t *of, int64_t a);
void uz_join(int64_t *of, int64_t a, int64_t b);

/* part (n_nodes): the number of each node's connected part; parts are numbered by their first nodes. Returns how many,
 * -1: no memory. */
int64_t uz_mesh_number_parts(int64_t *part, const uz_mesh *mesh);

/* A body whose sides may touch each other. One thread at a time asks it. */
typedef struct uz_own_body uz_own_body;

/* For the sides of these two groups of faces; *out is NULL where no part of the body has sides in both, as then none
 * can be the back of another. mesh is kept: it outlives *out. The caller frees *out. Error: UZ_ERR_MEMORY. */
uz_status uz_own_body_new(uz_own_body **out, const uz_mesh *mesh, const uz_group *one, const uz_group *other,
                          uz_error *err);
void uz_own_body_free(uz_own_body *own);

/* What lies between x, on a side of element `from`, and y, on one of `to`, that is behind it? */
typedef enum {
    UZ_WAY_OVERLAP, /* two arms of one part that overlap, all the way within both; or the elements are of two parts */
    UZ_WAY_BACK,    /* elements all along: the two are front and back, however far apart */
    UZ_WAY_APART    /* the way leaves the body */
} uz_way;
/* NULL: UZ_WAY_OVERLAP. Allocates nothing. */
uz_way uz_own_body_way(uz_own_body *own, int64_t from, const double *x, int64_t to, const double *y);
/* Are two elements of one part? NULL: false. */
bool uz_own_body_same(const uz_own_body *own, int64_t from, int64_t to);

#endif
