/* moving.h: contact where the answer itself moves the surfaces to. */
#ifndef UZ_MOVING_H
#define UZ_MOVING_H

#include "uzawa.h"

/* Goes on from the answer to a scene, found with its contacts as they are before anything moves, where the scene's
 * kinematics ask for that and the body is held by its supports: *result then becomes the answer at the place that it
 * leads to itself, or outcome and message say why there is none. Its summary's geometry says what was done.
 *   problem  without load cases
 *   started  uz_seconds() when the solve began, for the time limit
 * Errors: those of uz_solve_cases; *result stays. */
uz_status uz_solve_moving(uz_result **result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started, uz_error *err);

#endif
