/* mesh_error.h: what the mesh of a body under large deformation has lost, by estimate. */
#ifndef UZ_FINITE_MESH_ERROR_H
#define UZ_FINITE_MESH_ERROR_H

#include "assembly/assembly.h"

/* About ||u - u_h|| / ||u|| in the energy norm of the tangent at u_h, for the displacements u (n_nodes x dim) of an
 * equilibrium in the standard formulation; free_strain: n_elements, of the temperature, NULL: none. What
 * uz_estimate_mesh_error is of small deformation, which it becomes. 0 of a body that nothing strains; NaN when
 * there is no memory, the law has no energy somewhere, or strains are rounding. */
double uz_finite_mesh_error(const uz_body_model *model, const double *free_strain, const double *u);

#endif
