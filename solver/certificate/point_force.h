/* point_force.h: forces and moments at points that go with a group of nodes, as the certificate of large deformation
 * has them. */
#ifndef UZ_CERTIFICATE_POINT_FORCE_H
#define UZ_CERTIFICATE_POINT_FORCE_H

#include "certificate/finite.h"

/* f (n_nodes x dim) += their forces on the nodes where the answer has these; K of `tangent` -= the second derivative of
 * their work. */
uz_status uz_point_forces(double *f, uz_body_model *tangent, const uz_finite_answer *of, uz_error *err);

#endif
