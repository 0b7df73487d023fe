/* evaluate.h: what an answer to a scene comes to, for its summary. */
#ifndef UZ_FIELDS_EVALUATE_H
#define UZ_FIELDS_EVALUATE_H

#include "assembly/assembly.h"
#include "post/ahead.h"
#include "uzawa.h"

/* Fills result->pressure, result->evaluation and the summary's force, max_pressure, discretization_error and
 * evaluation from result->u, r and mesh. scene: with the loads of the case; model: its body. Takes time in proportion
 * to the contact, the supports and loads, and two looks at each element. ahead: of the same answer and body; NULL:
 * nothing was computed ahead. UZ_ERR_MEMORY. */
uz_status uz_evaluate(uz_result *result, const uz_body_model *model, const uz_scene *scene, uz_ahead *ahead,
                      uz_error *err);

#endif
