/* setup_cache.h: bodies by digest. One creator per key while others wait for it. */
#ifndef UZ_SETUP_CACHE_H
#define UZ_SETUP_CACHE_H

#include "run/setup.h"

/* uz_cache_acquire for a body that is solved with these rows, and others (rows.h); NULL: none in particular. */
uz_status uz_cache_acquire_rows(uz_body **body, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                                const uz_candidates *wanted, const uz_settings *settings, const uz_hooks *hooks,
                                uz_error *err);
/* The body of the problem, from the cache or newly made; *reused tells what of it was there. cache NULL: newly made,
 * and freed by release. The caller releases *body with the same cache. A waiter whose hooks say cancelled gets
 * UZ_ERR_CANCELLED. */
uz_status uz_cache_acquire(uz_body **body, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                           const uz_settings *settings, const uz_hooks *hooks, uz_error *err);
void uz_cache_release(uz_cache *cache, uz_body *body);

#endif
