/* triangulation.h: triangles in space that hang together: the closest point of them, and on which side of it one is.
 *
 * Triangles are joined where they share two corners, which have exactly the same coordinates. Normals follow from the
 * order of corners, and two triangles go along an edge that they share in opposite ways. */
#ifndef UZ_OBSTACLE_TRIANGULATION_H
#define UZ_OBSTACLE_TRIANGULATION_H

#include "obstacle/box_tree.h"

typedef struct {
    int64_t n, n_points;
    double *point;        /* n_points x 3 */
    int64_t *corner;      /* n x 3: points, counterclockwise seen from where the normal points */
    int64_t *beside;      /* n x 3: the triangle beyond the edge from corner k to the next one; -1: none, a rim */
    double *normal;       /* n x 3, unit; zero: the triangle has no area, and those beside it cover it */
    double *point_normal; /* n_points x 3: unit; the normals around a point, by their angles there; zero: on a rim */
    double *sagitta;      /* n: how far the curve that a triangle stands for is from it, by its turns, estimated */
    bool open;            /* does it have a rim? */
    uz_box_tree tree;
} uz_triangulation;

/* The corners of triangle i are (x, y, z)[3 i .. 3 i + 2], times scale. inside: all but what it encloses: normals of a
 * closed one then point into that. Refuses (UZ_ERR_SCENE) triangles that pass an edge the same way or of which more
 * than two share one, a closed part whose normals point inwards without `inside`, parts that contradict each other, and
 * an open one with `inside`. where: for refusals. O(n log n). Error also: UZ_ERR_MEMORY. */
uz_status uz_triangulation_init(uz_triangulation *out, int64_t n, const double *x, const double *y, const double *z,
                                double scale, bool inside, const char *where, uz_error *err);
void uz_triangulation_clear(uz_triangulation *t);

/* Where a closest point lies. */
typedef struct {
    int64_t triangle;
    int edge, corner; /* on the edge from that corner, at that corner; -1: not */
    double foot[3];
} uz_triangle_place;
/* False: the distance overflows. */
bool uz_triangulation_nearest(uz_triangle_place *out, const uz_triangulation *t, const double x[3]);

#endif
