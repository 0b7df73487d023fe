/* steps.h: methods whose iterations are steps: the loop that they share, and what each of them fills in. */
#ifndef UZ_METHODS_STEPS_H
#define UZ_METHODS_STEPS_H

#include "methods/method.h"

/* A method whose iterations are steps with one application of D each fills these and runs by uz_steps_run, after
 * uz_steps_begin: the loop with its bounds, its limits and its search for rays is there. */
typedef struct uz_steps {
    /* One iteration: r, D r, rho, D rho and tau become the next ones. *step_norm: ||rho - r||, in the caller's forces,
     * NAN: no step was taken. *restart: what was carried along was given up. steps: these. */
    uz_status (*step)(const struct uz_steps *steps, uz_iterate *it, uz_dual_load *load, double *step_norm,
                      bool *restart, uz_error *err);
    /* After a step; due: a bound is. NULL: nothing to do. Else D r is carried along and gathers rounding: made again
     * here where it is time, and for the last bound of a run. */
    uz_status (*settle)(uz_iterate *it, uz_dual_load *load, bool due, uz_error *err);
    bool rho_is_r;           /* what is recorded is (u(r), r): rho is none of which there was a displacement */
    bool momentum, restarts; /* of gradient steps */
} uz_steps;

/* Where the iteration stands when its steps go on: row 0 and a bound where there is none yet, D prepared, a step size.
 */
uz_status uz_steps_begin(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                         uz_error *err);
uz_method_runner uz_steps_run;

#endif
