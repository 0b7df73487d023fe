/* element_private.h: what the files of this folder share. */
#ifndef UZ_ELEMENT_PRIVATE_H
#define UZ_ELEMENT_PRIVATE_H

#include "element/element.h"

#include <float.h>

/* The sine of the least angle, in the sense of Hadamard's inequality, that is more than rounding. */
#define UZ_FLAT (64 * DBL_EPSILON)

/* J[axis][x]: derivatives of position by the reference coordinates, from those of the shape functions. */
void uz_jacobian(double J[3][3], const uz_element *element, double local[UZ_ELEMENT_NODES][3]);

/* The radius at a point with these shape functions; at most UZ_AXIS of the largest it counts as on the axis. */
double uz_ring_radius(double *largest, const uz_element *element, const double *N);

/* mean[node][direction]: the derivatives' mean over the volume, so that the mean dilatation is their sum with u; of a
 * ring with N / r in the radial one. Returns the volume. */
double uz_mean_gradients(double mean[UZ_ELEMENT_NODES][3], const uz_element *element);

/* The incompatible modes of quad4 and hex8, 1 - xi_m^2 for each axis m, in the modification of Taylor, Beresford and
 * Wilson, "A non-conforming element for stress analysis", Int. J. Numer. Meth. Engng 10 (1976): their derivatives by x
 * are taken with the Jacobian of the centre, scaled by the ratio of determinants, so that each has mean zero and
 * constant strain stays exact on distorted elements. grad[mode][direction], dim modes. */
void uz_mode_gradients(double grad[3][3], double centre[3][3], double centre_det, int dim, const double point[3],
                       double det);
/* inverse and determinant of the Jacobian at the origin of the reference coordinates. */
double uz_centre_jacobian(double inverse[3][3], const uz_element *element);

/* Internal parameters from displacements: internal = - A^-1 (coupling) u, see stiffness.c. */
void uz_internal_parameters(double internal[UZ_ELEMENT_INTERNAL], const uz_element *element, const double *u);

#endif
