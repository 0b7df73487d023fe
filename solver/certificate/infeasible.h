/* infeasible.h: the proof that no displacement meets all conditions h - N u >= 0.
 *
 * A ray is y <= 0 (m) with N'y = 0 and h'y > 0: for a feasible u, y'(h - N u) would be at most 0, and it is h'y > 0
 * (Farkas 1902). With N'y = 0 to rounding only, |y'N u| <= ||N'y||_1 ||u||_inf, so that every feasible u has an entry
 * of at least h'y / ||N'y||_1: far away, but there may be one. What proves is an exact ray: one in rational numbers, of
 * the data as they stand in doubles. */
#ifndef UZ_INFEASIBLE_H
#define UZ_INFEASIBLE_H

#include "uzawa.h"

/* Is y worth a proof? In double-double precision, original data, N: m x d. How large displacements of this problem are
 * at all is taken from its gaps g: max over rows of (|h_i| + |g_i|) / max_j |N_ij|, but for rows of zeros. Where all
 * that is left of N'y is the rounding of y's doubles UZ_RAY_ROUNDED of these lengths without a feasible u are enough,
 * elsewhere UZ_RAY_FACTOR. row_room: m. */
#define UZ_RAY_FACTOR  1e6
#define UZ_RAY_ROUNDED 100.0
bool uz_ray_is_likely(const double *y, const uz_csc *N, const double *h, const double *g, double *row_room);

/* What y (m, <= 0) proves.
 *   y       in: a candidate; out, where *radius is INFINITY: an exact ray rounded to doubles, of the rows that
 *           contradict each other exactly
 *   radius  every feasible u has an entry of at least this; INFINITY: no u is feasible; 0: nothing is proved
 * The rows of y < 0 fall into parts that share no dof. In each the equations N'y = 0 are solved exactly by
 * fraction-free elimination (Bareiss, Math. Comp. 22 (1968)), the largest |y_i| from the others: an exact ray near y,
 * if there is one on these rows. A part that is too large for that is left out. Errors: UZ_ERR_MEMORY. */
uz_status uz_prove_ray(double *radius, double *y, const uz_csc *N, const double *h, uz_error *err);

#endif
