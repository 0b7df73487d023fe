/* ahead.h: the estimate of the mesh's error of an answer, computed aside while the answer is being certified. */
#ifndef UZ_POST_AHEAD_H
#define UZ_POST_AHEAD_H

#include "assembly/assembly.h"
#include "uzawa.h"

typedef struct uz_ahead uz_ahead;

/* Begins it on the second thread for the free dofs u (d), which are copied; model and what scene refers to have to
 * outlive it. NULL: it is not done ahead, as nobody has time for it, the mesh is small or memory is short. */
uz_ahead *uz_ahead_start(const uz_body_model *model, const uz_scene *scene, const double *u, const double *prescribed);
/* What uz_estimate_mesh_error says of the displacements `nodal`. False: it was of others, or was not computed. */
bool uz_ahead_take(uz_ahead *ahead, double *error, uz_mesh_look *look, const double *nodal);
/* Waits where it runs; NULL is fine. */
void uz_ahead_free(uz_ahead *ahead);

#endif
