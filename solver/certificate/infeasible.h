/* infeasible.h: the proof that no displacement meets all conditions h - N u >= 0.
 *
 * A ray is y <= 0 (m) with N'y = 0 and h'y > 0: for a feasible u, y'(h - N u) would be at most 0, and it is h'y > 0
 * (Farkas). With N'y = 0 to rounding only, |y'N u| <= ||N'y||_1 ||u||_inf, so every feasible u, if any, is at least
 * h'y / ||N'y||_1 large: the proof holds for all displacements below that radius. */
#ifndef UZ_INFEASIBLE_H
#define UZ_INFEASIBLE_H

#include "uzawa.h"

/* How large displacements of this problem are at all, from its gaps: max over rows of (|h_i| + |g_i|) / max_j |N_ij|.
 * Rows of zeros don't count. */
double uz_gap_length(const uz_csc *N, const double *h, const double *g, double *row_room);

/* Whether y is a proof that a user can rely on. A radius of UZ_RAY_FACTOR times the problem's own lengths is one. Where
 * all that is left of N'y is the rounding of y's doubles, the rows of the ray depend on each other as far as doubles
 * can say, and UZ_RAY_ROUNDED lengths do: the contradiction h'y is then about that many times the rounding of N'u. So
 * rows that contradict each other by 1e-13 of the lengths are told from those that touch.
 *   radius  out: the length within which y proves that nothing is feasible; INFINITY for an exact ray, 0: none
 *   length  uz_gap_length
 * Double-double precision, original data. N: m x d. */
#define UZ_RAY_FACTOR  1e6
#define UZ_RAY_ROUNDED 100.0
bool uz_ray_proves(double *radius, const double *y, const uz_csc *N, const double *h, double length);

#endif
