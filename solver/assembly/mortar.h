/* mortar.h: what the surface to surface discretization is made of, for mortar.c and the integration over surfaces.
 *
 * Two surfaces are integrated over together: at each point of a quadrature of the slave's there are the shape functions
 * of a slave side and of the master side across, a weight (area) and the gap between the two. mortar_plane.c finds such
 * points for edges; mortar.c makes rows of them, whatever they come from. */
#ifndef UZ_ASSEMBLY_MORTAR_H
#define UZ_ASSEMBLY_MORTAR_H

#include "assembly/discretization.h"

/* An edge (or face) of a surface. A place is a node of the slave with a normal of its own: where the surface turns by
 * more than the feature angle, a node has one for each side. */
typedef struct {
    uz_face face;
    int nodes;
    int64_t node[UZ_FACE_NODES], place[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    double tangent[2][2]; /* of an edge, at its ends: unit, of the smooth curve that the edges stand for */
    bool joined[2];       /* does that curve go on into a neighbour? */
} uz_mortar_side;

typedef struct {
    int64_t n, n_places;
    uz_mortar_side *side;
    int64_t *node;  /* n_places */
    double *normal; /* n_places x dim: out of the body */
} uz_mortar_surface;

typedef struct {
    int64_t slave, master; /* sides */
    double weight, gap;
    double N[UZ_FACE_NODES], M[UZ_FACE_NODES];
} uz_mortar_point;

typedef struct {
    int64_t n, room;
    uz_mortar_point *point; /* of one slave side after the other */
} uz_mortar_points;

void uz_mortar_surface_clear(uz_mortar_surface *surface);

/* The edges of a group with their tangents and places. UZ_ERR_MEMORY, or UZ_ERR_SCENE: an edge has no length. */
uz_status uz_mortar_plane_surface(uz_mortar_surface *out, const uz_contact_input *in, const uz_group *group,
                                  uz_error *err);
/* The points of two surfaces in the plane: segments between the master's nodes, projected along the slave's field of
 * normals, with four Gauss points each. The caller frees points->point also on failure (UZ_ERR_MEMORY). */
uz_status uz_mortar_plane_points(uz_mortar_points *points, const uz_contact_input *in, const uz_mortar_surface *slave,
                                 const uz_mortar_surface *master, uz_error *err);

#endif
