/* semicoercive.h: bodies that only the obstacle holds.
 *
 * K is singular: its null space are the rigid-body motions that no support prevents. Where the load presses the body on
 * in all of them, the contact problem has one solution all the same. It is found in two phases, both on regular
 * problems that the ordinary pipeline solves and certifies (augment.h):
 *   - rounds of the proximal point method with soft springs on all rows, on one factor, until the active rows settle;
 *   - the exact augmentation on rows that press hard, which changes nothing once these rows are proved to be in contact
 *     (contact_proof.h): the bound on its error, in the norm of K + N'R N, is then one in the norm of K. */
#ifndef UZ_SEMICOERCIVE_H
#define UZ_SEMICOERCIVE_H

#include "uzawa.h"

/* The ordinary way refused a problem with this status, or (UZ_OK) has this result: is there a chance that only the
 * obstacle holds the body? Of a scene the null space of K is known from its mesh. Of matrices nobody can tell an
 * eigenvalue of 0 from a small or a negative one in double precision, so somebody has to say what K is meant to be:
 * then a refused K, or one of which little or nothing could be certified as rounding made its zero pivots positive. */
bool uz_may_be_semicoercive(uz_status refused, const uz_result *result, const uz_problem *problem,
                            const uz_settings *settings);

/* As uz_solve; started: uz_seconds() of its begin, from which the time limit counts. *err holds the refusal of the
 * ordinary way; it stays where this way has nothing better to say: K is not even semidefinite, or rows don't reach its
 * null space. UZ_ERR_FREE_BODY names the motion that the load does not press on; *out may then be
 * a result that says so in place of an answer (UZ_UNHELD). */
uz_status uz_solve_semicoercive(uz_result **out, const uz_problem *problem, const uz_settings *settings,
                                uz_cache *cache, const uz_hooks *hooks, uz_status refused, double started,
                                uz_error *err);

/* *out: the same result of a scene that was found to be so in another way, `why` being that refusal. */
uz_status uz_tell_unheld(uz_result **out, const uz_problem *problem, const uz_settings *settings, const uz_error *why,
                         double started, uz_error *err);

#endif
