/* smooth_shape.h: which smooth surface do the nodes of a mesh lie on? */
#ifndef UZ_OBSTACLE_SMOOTH_SHAPE_H
#define UZ_OBSTACLE_SMOOTH_SHAPE_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    UZ_SMOOTH_NONE,
    UZ_SMOOTH_PLANE,
    UZ_SMOOTH_SPHERE,
    UZ_SMOOTH_CYLINDER,
    UZ_SMOOTH_CONE,
    UZ_SMOOTH_TORUS
} uz_smooth_kind;

typedef struct {
    uz_smooth_kind kind;
    double point[3];      /* the centre; a point of the axis or plane */
    double axis[3];       /* unit, not of a sphere; of a plane its normal */
    double radius, slope; /* of a cone radius + slope * (distance from `point` along the axis) */
    double tube;          /* of a torus the radius of its section, whose centre is `radius` off the axis */
} uz_smooth_shape;

/* The simplest of these shapes on which all n points lie (n x 3), to a millionth of its radius, and whose normals are
 * the given ones (n x 3, unit), roughly. By Gauss and Newton's method from what the normals say. */
uz_smooth_shape uz_smooth_shape_of(const double *xyz, const double *normal, int64_t n);

/* From x to the nearest point of the shape, and the unit normal there (NULL: not wanted), away from its centre or
 * axis. UZ_SMOOTH_NONE: zero, and `normal` stays as it is. */
void uz_smooth_nearest(double offset[3], double normal[3], const uz_smooth_shape *shape, const double x[3]);

/* What of a surface of no such shape lies about a node: the quadric z = c . (x, y, xx, xy, yy, xz, yz, zz) through it,
 * in coordinates along t and n from `at`, in units of `size`. Every sphere, cylinder, cone, ellipsoid is one. */
typedef struct {
    double at[3], t[2][3], n[3], size, c[8];
} uz_smooth_patch;

/* By least squares from n nodes about it, xyz (n x 3), near ones weighing more; normal: roughly that of the surface at
 * the node. False: too few nodes. */
bool uz_smooth_patch_fit(uz_smooth_patch *out, const double at[3], const double normal[3], const double *xyz, int n);

/* From x along the patch's n to the quadric, and the quadric's unit normal there, on the side of n. */
double uz_smooth_patch_height(double normal[3], const uz_smooth_patch *patch, const double x[3]);
/* The discriminant of the equation for that height, quadratic in x along the patch's plane and 1 at its node: the
 * quadric is neither above nor below x where it is negative, and turns away from the plane where it is 0. */
double uz_smooth_patch_discriminant(const uz_smooth_patch *patch, const double x[3]);

#endif
