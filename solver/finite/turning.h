/* turning.h: steps whose parts turn.
 *
 * With h the gradient of a step from F, and g = h F^-1 that where the body is, the step is made for the strain sym g;
 * taken straight on, what turns by w = skew g becomes longer by w'w / 2 as well. Turned it leads to R (I + sym g) F, R
 * the rotation of the polar decomposition of I + w, by the angle whose tangent is |w|: rotation and strain of J. Huang,
 * Y. Tong, K. Zhou, H. Bao and M. Desbrun, "Interactive shape interpolation through controllable dynamic deformation",
 * IEEE Trans. Vis. Comput. Graph. 17 (2011) 983-992. No displacement has just these gradients; that whose own are
 * nearest to them solves a linear problem, whose matrix is the metric. */
#ifndef UZ_FINITE_TURNING_H
#define UZ_FINITE_TURNING_H

#include "assembly/assembly.h"

/* Integrals of squares over the body, times the shear modulus. */
typedef struct {
    double turning; /* of w'w / 2 */
    double strain;  /* of sym g */
} uz_turning;

/* Of the step between two displacements (n_nodes x dim each), det F > 0 at the first; out: of all that is not within a
 * rigid group.
 *   near   n_nodes x dim, what is gone on from; NULL: the first
 *   force  n_nodes x dim, along the axes: integral mu (R (I + sym g) F - F') : grad v, F' that of `near`; of rings with
 *          u_r / r around them as the step has it */
void uz_turning_of(uz_turning *out, double *force, const uz_body_model *model, const double *from, const double *to,
                   const double *near);

/* K and K_fixed of `metric`, a copy of `model` as of uz_finite_tangent_of, become integral mu grad v : grad v. */
void uz_turning_metric(uz_body_model *metric, const uz_body_model *model);

#endif
