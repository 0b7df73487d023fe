/* follower.h: loads that follow the body: forces at points (point_load.h), and pressures, which turn and grow with the
 * deformed sides that they act on.
 *
 * With x the places of a side's nodes, f_a = -p integral N_a n da over the deformed side. In plane stress a side has
 * the thickness that it had at rest. The derivative of f is symmetric as a whole where the sides close a volume, or
 * where the edges of the loaded surface are held or slide on planes of symmetry; else its skew part stands at these
 * edges alone (M. Schweizerhof and E. Ramm, "Displacement dependent pressure loads in nonlinear finite element
 * analyses", Computers & Structures 18 (1984) 1099-1114). */
#ifndef UZ_FINITE_FOLLOWER_H
#define UZ_FINITE_FOLLOWER_H

#include "assembly/assembly.h"

/* Does the scene have any? Its kinematics are finite. */
bool uz_has_followers(const uz_scene *scene);
/* f (n_nodes x dim) += their forces on the body displaced by u (n_nodes x dim). */
uz_status uz_follower_loads(double *f, const uz_body_model *model, const uz_scene *scene, const double *u,
                            uz_error *err);
/* Of their derivative in displacements: the symmetric part is taken off K and K_fixed of `tangent` (uz_finite_body; of
 * forces at points off K); *skew, n_nodes x dim square, by places in u, is the skew part: without entries where that is
 * none but for rounding. The caller clears *skew, also on failure. */
uz_status uz_follower_tangent(uz_body_model *tangent, uz_csc *skew, const uz_scene *scene, const double *u,
                              uz_error *err);

#endif
