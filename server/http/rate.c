/* rate.c: token buckets in sets, by a hash of the client. */
#include "http/rate.h"

#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

enum { SETS = 1024, WAYS = 4 };

typedef struct {
    uint64_t key; /* 0: free */
    double left, at;
} bucket;

struct rate {
    pthread_mutex_t lock;
    double per_s, burst;
    uint64_t seed; /* so that nobody can choose who shares a set */
    bucket buckets[SETS][WAYS];
};

rate *rate_new(int per_s)
{
    rate *r = calloc(1, sizeof *r);
    if (!r)
        return NULL;
    pthread_mutex_init(&r->lock, NULL);
    r->per_s = per_s;
    r->burst = 2.0 * per_s;
    if (getrandom(&r->seed, sizeof r->seed, 0) != (ssize_t)sizeof r->seed)
        r->seed = (uint64_t)(uintptr_t)r;
    return r;
}

void rate_free(rate *r)
{
    if (!r)
        return;
    pthread_mutex_destroy(&r->lock);
    free(r);
}

double rate_take(rate *r, const void *key, size_t len, double now)
{
    /* FNV-1a with a seed, and the finishing steps of MurmurHash3 (both public domain algorithms). */
    uint64_t hashed = r->seed ^ 0xcbf29ce484222325u;
    for (size_t i = 0; i < len; i++)
        hashed = (hashed ^ ((const unsigned char *)key)[i]) * 0x100000001b3u;
    hashed = (hashed ^ (hashed >> 33)) * 0xff51afd7ed558ccdu;
    hashed = (hashed ^ (hashed >> 33)) * 0xc4ceb9fe1a85ec53u;
    hashed ^= hashed >> 33;
    hashed = hashed ? hashed : 1;
    bucket *set = r->buckets[hashed % SETS], *b = NULL, *oldest = set;
    pthread_mutex_lock(&r->lock);
    /* the client's bucket, or the one of its set that was not used for longest, filled */
    for (size_t i = 0; i < WAYS && !b; i++) {
        if (set[i].key == hashed)
            b = &set[i];
        else if (set[i].key == 0 || (oldest->key != 0 && set[i].at < oldest->at))
            oldest = &set[i];
    }
    if (!b) {
        b = oldest;
        *b = (bucket){.key = hashed, .left = r->burst, .at = now};
    }
    b->left = fmin(r->burst, b->left + fmax(0.0, now - b->at) * r->per_s);
    b->at = now;
    double wait = b->left >= 1.0 ? 0.0 : (1.0 - b->left) / r->per_s;
    if (wait == 0.0)
        b->left -= 1.0;
    pthread_mutex_unlock(&r->lock);
    return wait;
}
