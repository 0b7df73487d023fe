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
    UZ_EXCHANGE_STOPPED    /* it had to stop, or rounding made the steps go round in circles */
} uz_exchange_end;

/* Goldfarb and Idnani's dual method (Math. Programming 27 (1983)) on psi: a penetrating row q is pressed, rows in
 * contact yielding so that their gaps stay closed, until its own gap closes, and then it joins them; a row in contact
 * whose reaction vanishes on the way is let go. Where q depends on the rows in contact its gap can't be closed that way
 * and only the exchange is left: so rows in contact are independent at all times. With none to let go, the direction is
 * a ray along which psi grows for ever. Every row that joins has raised psi, so no set of rows comes back, and there
 * are finitely many.
 *
 * active (m): in, rows to begin with, of which an independent part that only presses is taken; out, the rows in
 * contact. base (m, allowed; NULL: zero): reactions that are already in the load, whose g0 is the gap that they leave:
 * a correction is solved with the digits of its own size. law: one_sided. s (m): out; the reactions are base + s.
 * g (m): out. steps: in, the most; out, how often a row joined or was let go. ray (m): UZ_EXCHANGE_RAY. Has a
 * cancellation point between steps of O(m |A|). A row that joins costs one uz_dual_load_column; memory is
 * m |A| + |A|^2 doubles for |A| rows in contact. Overwrites what the last apply left. */
uz_status uz_exchange_run(uz_exchange_end *end, int64_t *steps, double *s, double *g, double *ray, bool *active,
                          const double *base, const uz_law *law, uz_dual_load *load, const uz_stop *stop,
                          uz_error *err);

#endif
