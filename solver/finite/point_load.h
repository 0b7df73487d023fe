/* point_load.h: forces and moments at points that go with a group of nodes, whatever this does.
 *
 * With shares s of the group (sum 1), r the places at rest from their centre and y the mean place where the body is, R
 * is the rotation that fits best, max sum s y . R r. The point is at y + R a, a its arm at rest: a function of
 * displacements that rigid motions take along, and by which a force F has the work F . (y + R a). Its derivative are
 * forces on nodes, f = s (F + m x R r), whose sum is F and whose moment about y is R a x F and, in the plane, the
 * moment that acts with it: B m = R a x F + M, B = tr(S) I - S, S = sum s y (R r)'. At small rotations they are those
 * of small deformation; of a rigid group the point goes with it as one of its own.
 *
 * The second derivative is that of the Lagrangian F . R a + m . sum s (R r x y) in y, R and m, the last two eliminated:
 * of rank six in space, two in the plane. A moment that keeps its direction has no work of its own in space. */
#ifndef UZ_FINITE_POINT_LOAD_H
#define UZ_FINITE_POINT_LOAD_H

#include "assembly/assembly.h"

/* f (n_nodes x dim) += load i, which is at a point, on the body displaced by u (n_nodes x dim). UZ_ERR_SCENE: the group
 * is one point or, in space, on a line, and has no rotation. */
uz_status uz_point_load(double *f, const uz_body_model *model, const uz_scene *scene, int64_t i, const double *u,
                        uz_error *err);
/* Takes its derivative, symmetric, off K of `tangent`, whose pattern has it. Not off K_fixed, by which supports move.
 */
uz_status uz_point_tangent(uz_body_model *tangent, const uz_scene *scene, int64_t i, const double *u, uz_error *err);

#endif
