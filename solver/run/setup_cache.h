/* setup_cache.h: setups by digest. One creator per key while others wait for it. */
#ifndef UZ_SETUP_CACHE_H
#define UZ_SETUP_CACHE_H

#include "run/setup.h"

/* The setup of the problem, from the cache or newly made; *reused tells what of it was there. wanted: contact rows that
 * it has to have beside others (rows.h); NULL: none in particular. cache NULL, or the operator distributed: newly
 * made, and freed by release. The
 * caller releases *setup with the same cache. A waiter whose hooks say cancelled gets UZ_ERR_CANCELLED. */
uz_status uz_setup_acquire(uz_setup **setup, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                           const uz_candidates *wanted, const uz_settings *settings, const uz_hooks *hooks,
                           uz_error *err);
void uz_setup_release(uz_cache *cache, uz_setup *setup);

#endif
