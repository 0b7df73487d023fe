/* projected.h: given rows as equations in conjugate gradients, whatever is in them: a multigrid on the displacements
 * that obey them.
 *
 * With A the active rows, W = diag(K)^-1 and G = A W A', sparse, which is factored,
 *
 *     Pi = I - W A' G^-1 A,     A Pi = 0,     M_A^-1 = Pi M^-1 Pi'
 *
 * is symmetric and positive definite on the displacements with A u = 0, and conjugate gradients that begin at A u = h_A
 * stay there (Gould, Hribar and Nocedal, SIAM J. Sci. Comput. 23 (2001)). */
#ifndef UZ_DUAL_PROJECTED_H
#define UZ_DUAL_PROJECTED_H

#include "dual/dual.h"

typedef struct uz_projected uz_projected;

/* mg: the multigrid for K; dual, K, active (m): borrowed. Rows that depend on each other to working precision are
 * obeyed as far as they agree (_release). *out NULL, UZ_OK: a row has no entries. UZ_ERR_MEMORY. */
uz_status uz_projected_create(uz_projected **out, const uz_multigrid *mg, const uz_dual *dual, const uz_csc *K,
                              const bool *active, const uz_hooks *hooks, uz_error *err);
void uz_projected_free(uz_projected *x);
size_t uz_projected_bytes(const uz_projected *x);
/* M_A: applied with a room of mg. */
const uz_multigrid *uz_projected_multigrid(const uz_projected *x);
/* u (d): moved by W so that A u = h_A; h (m). */
uz_status uz_projected_close(uz_projected *x, double *u, const double *h, uz_error *err);
/* r (m), 0 on other rows: the reactions with the least force - N'r in the norm of W; force (d) = K u - p. */
uz_status uz_projected_react(uz_projected *x, double *r, const double *force, uz_error *err);
/* Of rows that contradict others, by the gaps g of an answer u, those which it leaves open pull in r, as one of the
 * others is in their way. h, g, r (m), u (d); r NULL: none may be left out. false: they contradict, and that is no way
 * out. */
bool uz_projected_release(const uz_projected *x, double *r, const double *h, const double *u, const double *g);
/* |h_i| + sum of |N_ij u_j|, which a gap h_i - N_i u is rounded to some parts in 1e16 of. */
double uz_projected_scale(const uz_projected *x, int64_t i, const double *h, const double *u);

#endif
