/* one_sided.h: the frictionless law as the certificate states it: r <= 0, g >= 0, r'g = 0.
 *
 * This is the certificate's own statement, on purpose beside law/frictionless.c: a certificate that asked the methods'
 * law whether their answer obeys it would certify a mistake in that law. What a new law needs here is its own proof:
 * which reactions are cut, what a gap violates, what the pair adds to the duality gap, and how a feasible v is found.
 */
#ifndef UZ_ONE_SIDED_H
#define UZ_ONE_SIDED_H

#include <stdbool.h>
#include <stdint.h>

/* Of one row: does it press, does it penetrate? false for NaN. */
static inline bool uz_row_presses(double r)
{
    return r < 0.0;
}

static inline bool uz_row_penetrates(double g)
{
    return g < 0.0;
}

/* Can y (m) be the direction of a ray, r + t y allowed for all t > 0? false where an entry is NaN. */
bool uz_is_ray_direction(const double *y, int64_t m);
/* Cuts r (m) to what the law allows; returns the norm of what was cut: the paper's e3. */
double uz_cut_reactions(double *r, int64_t m);
/* The norms of the gaps that penetrate (e2) and of the products r_i g_i (e4). */
double uz_penetration_norm(const double *g, int64_t m);
double uz_complementarity_norm(const double *r, const double *g, int64_t m);

#endif
