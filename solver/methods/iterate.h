/* iterate.h: what the files of this folder share. */
#ifndef UZ_ITERATE_H
#define UZ_ITERATE_H

#include "methods/method.h"

/* Bounds the error of the answer that r (the one of the last apply) gives and keeps it if it is the best so far.
 * Overwrites gamma. */
uz_status uz_iterate_bound(uz_iterate *it, uz_dual_load *load, uz_method by, uz_error *err);

/* Row 0: applies D to the start and bounds it. */
uz_status uz_iterate_begin(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                           uz_error *err);
/* Appends the iterate's row to the history and tells the progress hook. Overwrites r_next and
 * gamma. */
uz_status uz_iterate_record(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                            double step_norm, bool restart, uz_error *err);
/* Goes back to the best answer's r, or to 0 where there is none: guesses that failed may have left r anywhere. D r is
 * not made. */
void uz_iterate_go_back(uz_iterate *it);
/* Makes the correction of the best answer (best_r) again; best_bound and the rest are then those of it. Uses r_next and
 * Dr_next. */
uz_status uz_iterate_bound_best(uz_iterate *it, uz_dual_load *load, uz_error *err);
/* After a projected step from rho to r_next: psi must curve by no more than 1/alpha along it (Beck and Teboulle 2009,
 * Lemma 2.3). true: it curves more, the step was too long. alpha is shortened to what was seen, and rho is r again. */
bool uz_iterate_shorten(uz_iterate *it);
void uz_iterate_swap(double **a, double **b);
/* The limits that every method honours: cancel, iterations, time. */
bool uz_should_stop(uz_end *end, const uz_iterate *it, const uz_method_options *options);

#endif
