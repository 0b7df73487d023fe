/* exchange.h: the dual problem solved exactly where rows depend on each other. */
#ifndef UZ_EXCHANGE_H
#define UZ_EXCHANGE_H

#include "core/hooks.h"
#include "dual/dual.h"
#include "law/law.h"

typedef enum {
    UZ_EXCHANGE_SOLVED,    /* the law holds, but for rounding */
    UZ_EXCHANGE_RAY,       /* `ray` seems to prove that the rows contradict */
    UZ_EXCHANGE_UNDECIDED, /* solved but for rows that contradict others by no more than rounding, or nearly so */
    UZ_EXCHANGE_STOPPED /* it had to stop, has done the work allowed, or rounding made the steps go round in circles */
} uz_exchange_end;

/* Which unknowns are exchanged. REACTIONS: of r, from no contact, M = D: each row that comes to touch is a step. GAPS:
 * of g, from contact everywhere, M = D^-1: each row that comes off is one. With z = -r and q = g0, or z = g and
 * q = -D^-1 g0, both are z >= 0, M z + q >= 0, z'(M z + q) = 0: what is said of reactions below goes for minus the
 * gaps, and what is said of gaps for minus the reactions. */
typedef enum { UZ_EXCHANGE_REACTIONS, UZ_EXCHANGE_GAPS } uz_exchange_side;

/* Goldfarb and Idnani's dual method (Math. Programming 27 (1983)) on psi: a penetrating row q is pressed, rows in
 * contact yielding so that their gaps stay closed, until its own gap closes, and then it joins them; a row in contact
 * whose reaction vanishes on the way is let go. Where q depends on the rows in contact its gap can't be closed that way
 * and only the exchange is left: so rows in contact are independent at all times. With none to let go, the direction is
 * a ray along which psi grows for ever. Every row that joins has raised psi, so no set of rows comes back, and there
 * are finitely many.
 *
 * Steps are of O(m |A|) flops for |A| rows in contact, with a cancellation point between them; a row that joins costs
 * one column of M. Memory: m |A| + |A|^2 doubles. Overwrites what the last apply left. */
typedef struct uz_exchange uz_exchange;

/* active (m, NULL: none): rows to begin with, of which an independent part that only presses is taken (GAPS: rows that
 * begin open). base (m, allowed; NULL: zero; REACTIONS only): reactions that are already in the load, whose g0 is the
 * gap that they leave: a correction is solved with the digits of its own size. law: one_sided. base, load, law,
 * stop: borrowed. *out NULL on success: the form has no D^-1 (GAPS), or it had to stop. Errors: UZ_ERR_MEMORY and those
 * of the form. */
uz_status uz_exchange_create(uz_exchange **out, uz_exchange_side side, const bool *active, const double *base,
                             const uz_law *law, uz_dual_load *load, const uz_stop *stop, uz_error *err);
void uz_exchange_free(uz_exchange *x);
/* Goes on until it is solved, or in all so many rows have joined or been let go, or so many entries of matrices been
 * passed. ray (m): out, UZ_EXCHANGE_RAY. */
uz_status uz_exchange_continue(uz_exchange_end *end, uz_exchange *x, int64_t most_steps, double most_work, double *ray,
                               uz_error *err);
/* What it has done so far: entries of matrices passed, and *steps. */
double uz_exchange_work(const uz_exchange *x, int64_t *steps);
/* active (m): the rows in contact. REACTIONS: s (m), the reactions are base + s; g (m), the gaps. GAPS: both are left
 * to who solves with these rows. */
void uz_exchange_read(double *s, double *g, bool *active, uz_exchange *x);

/* All of it at once, by reactions. active: in and out. steps: in, the most; out, how many. */
uz_status uz_exchange_run(uz_exchange_end *end, int64_t *steps, double *s, double *g, double *ray, bool *active,
                          const double *base, const uz_law *law, uz_dual_load *load, const uz_stop *stop,
                          uz_error *err);

#endif
