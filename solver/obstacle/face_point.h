/* face_point.h: the closest point of one face of an element. */
#ifndef UZ_OBSTACLE_FACE_POINT_H
#define UZ_OBSTACLE_FACE_POINT_H

#include "scene/mesh.h"

/* Where on the face: within it, on its edge k (from corner k to the next; 3D only), at its corner k. */
typedef enum { UZ_FACE_WITHIN, UZ_FACE_EDGE, UZ_FACE_CORNER } uz_face_place;

typedef struct {
    double local[2]; /* as in uz_contact_pair */
    double weight[UZ_FACE_NODES];
    double point[3];
    double normal[3]; /* of the face itself there, unit, out of its element; NaN where the face has none */
    double distance2; /* squared, from the origin */
    uz_face_place place;
    int which;
} uz_foot;

/* How many of a face's nodes are corners. */
int uz_face_corners(int dim, int count);

/* The point of the face closest to the origin. xyz: count x dim, nodes as uz_mesh_face gives them: edges of 2 or 3 in
 * 2D; triangles of 3 or 6, quadrilaterals of 4 or 8 in 3D. Curved faces are searched by Newton's method from the best
 * of a few samples: the closest point of faces that bend by less than a quarter turn. A foot within rounding of the
 * face's border is on it. */
void uz_face_closest(uz_foot *out, int dim, int count, const double *xyz);

#endif
