/* evaluate.h: what an answer to a scene comes to, for its summary. */
#ifndef UZ_FIELDS_EVALUATE_H
#define UZ_FIELDS_EVALUATE_H

#include "assembly/assembly.h"
#include "post/ahead.h"
#include "uzawa.h"

/* Fills result->pressure, result->evaluation and the summary's force, max_pressure, discretization_error and
 * evaluation from result->u, r, g and mesh. scene: with the loads of the case; model: its body. Takes time in
 * proportion to the contact, the supports and loads, and two looks at each element. ahead: of the same answer and body;
 * NULL: nothing was computed ahead. UZ_ERR_MEMORY. */
uz_status uz_evaluate(uz_result *result, const uz_body_model *model, const uz_scene *scene, uz_ahead *ahead,
                      uz_error *err);

/* The same of an answer of finite kinematics, with its contacts where it has gone: forces, areas and pressures are
 * those of the deformed body, what follows from the stiffness at rest is left out. inner: n_nodes x dim, forces of the
 * elements; energy: their strain energy. */
uz_status uz_evaluate_finite(uz_result *result, const uz_body_model *model, const uz_scene *scene, const double *inner,
                             double energy, uz_error *err);

/* The body with its nodes where u has taken them: a borrower of all but mesh.xyz, which the caller frees. */
uz_status uz_displaced(uz_body_model *out, const uz_body_model *model, const double *u, uz_error *err);

#endif
