/* quantities.h: intervals for the numbers that a scene is solved for. */
#ifndef UZ_QUANTITIES_H
#define UZ_QUANTITIES_H

#include "run/setup.h"

/* What is needed beside the answer. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_scene *scene; /* with the loads of the case */
    const uz_body_model *model;
    const uz_csc *K; /* those that `dual` is of: where springs on rows hold the body, with them */
    const uz_dual *dual;
    const double *weight;         /* m: of the springs on rows that K has; NULL: none */
    const uz_candidates *rows;    /* which of the model's rows the dual has; NULL, or in NULL: all */
    const double *h, *prescribed; /* of all rows; of supported dofs */
    const uz_stop *stop;
} uz_quantity_work;

/* Fills answer->evaluation's quantities; u, r, the certificate and the rest of the evaluation are there. Takes a solve
 * on the factor and two looks at each element for each of them. UZ_ERR_MEMORY, _SCENE (uz_functional_make). */
uz_status uz_find_quantities(uz_result *answer, const uz_quantity_work *work, uz_error *err);

#endif
