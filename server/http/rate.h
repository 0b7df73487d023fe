/* rate.h: how often each client may ask: a token bucket for each of the clients seen last. Room is fixed: where it is
 * short, the client that was quiet longest is forgotten, and begins with a full bucket when it comes again. */
#ifndef SERVER_HTTP_RATE_H
#define SERVER_HTTP_RATE_H

#include "store/nodes.h"

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

enum { RATE_SETS = 1024, RATE_WAYS = 4 };

typedef struct {
    uint64_t key; /* 0: free */
    double left, at;
    char name[STORE_CLIENT]; /* what others know it by; "": it counts here only */
    int64_t used;            /* since rate_used told it */
    int64_t total;           /* of all daemons, as it was learnt last; -1: not yet */
} rate_bucket;

typedef struct {
    pthread_mutex_t lock; /* the buckets */
    double per_s;         /* so many requests per second, and twice as many at once */
    size_t next;          /* rate_used goes on from there */
    uint64_t seed;        /* random, so that nobody can choose who shares a set */
    rate_bucket buckets[RATE_SETS][RATE_WAYS];
} rate;

/* One request of the client key[0..len) at time `now`, seconds: 0 if it may go on, else seconds until one may. name: it
 * goes by that with other daemons too; NULL: it is of here only. */
double rate_take(rate *r, const char *name, const void *key, size_t len, double now);

/* Clients with a name that have asked within the last seconds, at most `most`, in turn;
 * and how often since it was learnt what others did. */
size_t rate_used(rate *r, store_rate *out, size_t most, double now);
/* What others have asked for is taken from the buckets too; a client that asks all at once waits for it later. */
void rate_learn(rate *r, const store_rate *list, size_t n);

#endif
