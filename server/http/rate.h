/* rate.h: how often each client may ask: a token bucket for each of the clients seen last. Room is fixed: where it is
 * short, the client that was quiet longest is forgotten, and begins with a full bucket when it comes again. */
#ifndef SERVER_HTTP_RATE_H
#define SERVER_HTTP_RATE_H

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

enum { RATE_SETS = 1024, RATE_WAYS = 4 };

typedef struct {
    uint64_t key; /* 0: free */
    double left, at;
} rate_bucket;

typedef struct {
    pthread_mutex_t lock; /* the buckets */
    double per_s;         /* so many requests per second, and twice as many at once */
    uint64_t seed;        /* random, so that nobody can choose who shares a set */
    rate_bucket buckets[RATE_SETS][RATE_WAYS];
} rate;

/* One request of the client key[0..len) at time `now`, seconds: 0 if it may go on, else seconds until one may. */
double rate_take(rate *r, const void *key, size_t len, double now);

#endif
