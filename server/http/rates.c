/* rates.c: what clients with a token ask of all daemons that share a store counts together. Each daemon has its own
 * buckets (rate.h), so that no request waits for the database; a thread tells it twice a second what was taken from
 * them, and takes what was asked of the others. */
#include "http/rates.h"
#include "base/clock.h"
#include "store/nodes.h"

#include <stdlib.h>

#define ROUND_S 0.5

enum { AT_ONCE = 256 }; /* clients; more have their turn later */

struct rates {
    store *store;
    rate *rate;
    pthread_t thread;
    pthread_mutex_t lock; /* stop */
    pthread_cond_t tick;
    bool stop;
};

static void exchange(rates *r, store_rate *list)
{
    const size_t n = rate_used(r->rate, list, AT_ONCE, clock_seconds(CLOCK_MONOTONIC));
    if (n > 0 && store_exchange_rates(r->store, list, n) == STORE_OK)
        rate_learn(r->rate, list, n);
}

static void *loop(void *ctx)
{
    rates *r = ctx;
    store_rate *list = malloc(AT_ONCE * sizeof *list);
    pthread_mutex_lock(&r->lock);
    while (!r->stop) {
        if (clock_wait(&r->tick, &r->lock, clock_seconds(CLOCK_MONOTONIC) + ROUND_S))
            continue;
        pthread_mutex_unlock(&r->lock);
        if (list)
            exchange(r, list);
        pthread_mutex_lock(&r->lock);
    }
    pthread_mutex_unlock(&r->lock);
    free(list);
    return NULL;
}

rates *rates_start(store *s, rate *of)
{
    rates *r = store_is_shared(s) && of->per_s > 0.0 ? calloc(1, sizeof *r) : NULL;
    if (!r)
        return NULL;
    r->store = s;
    r->rate = of;
    pthread_mutex_init(&r->lock, NULL);
    clock_condition(&r->tick);
    if (pthread_create(&r->thread, NULL, loop, r) == 0)
        return r;
    pthread_cond_destroy(&r->tick);
    pthread_mutex_destroy(&r->lock);
    free(r);
    return NULL;
}

void rates_stop(rates *r)
{
    if (!r)
        return;
    pthread_mutex_lock(&r->lock);
    r->stop = true;
    pthread_cond_signal(&r->tick);
    pthread_mutex_unlock(&r->lock);
    pthread_join(r->thread, NULL);
    pthread_cond_destroy(&r->tick);
    pthread_mutex_destroy(&r->lock);
    free(r);
}
