/* mesh_error.h: what the mesh of a body under large deformation has lost, by estimate. */
#ifndef UZ_FINITE_MESH_ERROR_H
#define UZ_FINITE_MESH_ERROR_H

#include "assembly/assembly.h"

/* *error: about ||u - u_h|| / ||u|| in the energy norm of the tangent at u_h, for the displacements u (n_nodes x dim)
 * of an equilibrium of the scene; free_strain: n_elements, of the temperature, NULL: none.
 * What uz_estimate_mesh_error is of small deformation, which it becomes. eta2: n_elements, what each has of the square
 * of the error, an energy; NULL: not wanted. 0 of a body that nothing strains; NaN where the law has no energy
 * somewhere, or strains are rounding. UZ_ERR_MEMORY: *error is NaN, too. */
uz_status uz_finite_mesh_error(double *error, double *eta2, const uz_body_model *model, const uz_scene *scene,
                               const double *free_strain, const double *u, uz_error *err);

/* *energy: the same estimate's eta^2 of own E(u) + times dE(u; z), dE the derivative of the strain along z (n_nodes x
 * dim), in the moduli at u, less what it is taken to hide: what uz_mesh_error_energy is of small strain, and likewise
 * the square of a seminorm in (own, times), of each element, too. eta2 (n_elements, NULL: not wanted): what each
 * element has of it. times 0: z is not read. UZ_ERR_MEMORY; where the law has no energy somewhere *energy is NaN. */
uz_status uz_finite_error_energy(double *energy, double *eta2, const uz_body_model *model, const double *free_strain,
                                 const double *u, const double *z, double own, double times, uz_error *err);

/* *half: half the work of the change of internal forces on the way from one displacement (n_nodes x dim) to another,
 * springs with it: about half the square of their distance in the norm of the tangent, however the body stands, as what
 * is released on the way to an equilibrium. Of small strain, which rotations add to, it would be another one. 0 where
 * elements are inverted at either. UZ_ERR_MEMORY. */
uz_status uz_finite_distance(double *half, const uz_body_model *model, const double *free_strain, const double *from,
                             const double *to, uz_error *err);

#endif
