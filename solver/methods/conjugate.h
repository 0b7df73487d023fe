/* conjugate.h: projected conjugate gradients on the dual, one application of D per iteration.
 *
 * On the rows that press psi is maximized by conjugate gradients: the factor of the last direction and the
 * length of the step are the best ones, where Algorithm 2 has a fixed step and a momentum that grows with k. Where the
 * bounds come in the way, that point is the extrapolated rho from which a projected step is made, as in Algorithm 2:
 *
 *     tau = 1, rho = r   a plain step: r+ = P(r + alpha g)
 *     tau = 1 otherwise  the step ended at a bound: r+ = P(rho), unless psi(r) is better: then rho = r
 *     tau = 2            a conjugate step; r - rho is the last one's direction, 0: there is none
 *
 * psi never decreases, but by rounding. Rows come into contact by plain steps, when what they ask for is more than what
 * is left on the rows that press.
 *
 * Sources: Dostal and Schoeberl, Comput. Optim. Appl. 30 (2005) (MPRGP; the test of proportion, Gamma = 1); More and
 * Toraldo, SIAM J. Optim. 1 (1991) (projected steps of conjugate gradients); Kruzik, Horak, Cermak, Pospisil, Pecha,
 * Adv. Eng. Softw. 149 (2020) (the projected step where a bound is met); van der Vorst and Ye, SIAM J. Sci. Comput. 22
 * (2000) (D r made again now and then). */
#ifndef UZ_CONJUGATE_H
#define UZ_CONJUGATE_H

#include "methods/iterate.h"

/* *step_norm: ||r - P(r + alpha g)|| at the new r, in the caller's forces: the paper's ||rho - r|| where rho is r.
 * *restart: a direction was given up, or a step was not taken. */
uz_status uz_conjugate_step(uz_iterate *it, uz_dual_load *load, double *step_norm, bool *restart, uz_error *err);

/* Applies D to r: where a bound is `due`, which is of the r of the last apply, and every so
 * often, as D r is carried along from the directions and gathers rounding. */
uz_status uz_conjugate_settle(uz_iterate *it, uz_dual_load *load, bool due, uz_error *err);

/* The row of (u(r), r): rho is none of which there was a displacement. */
uz_status uz_conjugate_record(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                              bool restart, uz_error *err);

#endif
