/* infeasible.h: the proof that no displacement meets all conditions h - N u >= 0.
 *
 * A ray is y <= 0 (m) with N'y = 0 and h'y > 0: for a feasible u, y'(h - N u) would be at most 0, and it is h'y > 0
 * (Farkas). With N'y = 0 to rounding only, |y'N u| <= ||N'y||_1 ||u||_inf, so every feasible u, if any, is at least
 * h'y / ||N'y||_1 large: the proof holds for all displacements below that radius. */
#ifndef UZ_INFEASIBLE_H
#define UZ_INFEASIBLE_H

#include "uzawa.h"

/* The radius (length; INFINITY for an exact ray) within which y proves that nothing is feasible; 0: it proves nothing.
 * Twofold precision, original data. N: m x d. */
double uz_ray_radius(const double *y, const uz_csc *N, const double *h);

/* How large displacements of this problem are at all, from its gaps: max over rows of (|h_i| + |g_i|) / max_j |N_ij|.
 * Rows of zeros don't count. */
double uz_gap_length(const uz_csc *N, const double *h, const double *g, double *row_room);

/* A radius this many times the problem's own lengths is a proof. */
#define UZ_RAY_FACTOR 1e6

#endif
