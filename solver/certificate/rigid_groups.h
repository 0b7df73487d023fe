/* rigid_groups.h: of an answer of large deformation, whether rigid groups have kept their shape, and what turning them
 * does. By code of its own, but for what the dofs of a group are (assembly/rigid_place.c). */
#ifndef UZ_CERTIFICATE_RIGID_GROUPS_H
#define UZ_CERTIFICATE_RIGID_GROUPS_H

#include "certificate/finite.h"

/* How far a node of a rigid group is from where the motion of the group's anchors has it, or that motion from what is
 * prescribed of it, at the group's size: a length. */
double uz_rigid_groups_off(const uz_finite_answer *of);
/* The tangent gets what forces on the nodes of groups do as these turn. nodal (n_nodes x dim): loads less internal
 * forces; it becomes the gradient of the Lagrangian. UZ_ERR_MEMORY. */
uz_status uz_rigid_groups_bend(uz_body_model *tangent, double *nodal, const uz_finite_answer *of, uz_error *err);

#endif
