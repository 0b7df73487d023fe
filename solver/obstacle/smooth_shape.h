/* smooth_shape.h: which smooth surface do the nodes of a mesh lie on? */
#ifndef UZ_OBSTACLE_SMOOTH_SHAPE_H
#define UZ_OBSTACLE_SMOOTH_SHAPE_H

#include <stdbool.h>
#include <stdint.h>

/* UZ_SMOOTH_NONE stands for a plane, too: facets of a plane are it. */
typedef enum { UZ_SMOOTH_NONE, UZ_SMOOTH_SPHERE, UZ_SMOOTH_CYLINDER, UZ_SMOOTH_CONE } uz_smooth_kind;

typedef struct {
    uz_smooth_kind kind;
    double point[3];      /* the centre; a point of the axis */
    double axis[3];       /* unit */
    double radius, slope; /* of a cone radius + slope * (distance from `point` along the axis) */
} uz_smooth_shape;

/* The simplest of these shapes on which all n points lie (n x 3), to a millionth of its radius; normals (n x 3, unit):
 * roughly those of the surface there. By Gauss and Newton's method from what the normals say. */
uz_smooth_shape uz_smooth_shape_of(const double *xyz, const double *normal, int64_t n);

/* From x to the nearest point of the shape, and the unit normal there (NULL: not wanted), away from its centre or
 * axis. UZ_SMOOTH_NONE: zero, and `normal` stays as it is. */
void uz_smooth_nearest(double offset[3], double normal[3], const uz_smooth_shape *shape, const double x[3]);

#endif
