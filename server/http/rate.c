/* rate.c: token buckets in sets, by a hash of the client. */
#include "http/rate.h"

#include <math.h>

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
    const double burst = 2.0 * r->per_s;
    rate_bucket *set = r->buckets[hashed % RATE_SETS], *b = NULL, *oldest = set;
    pthread_mutex_lock(&r->lock);
    /* the client's bucket, or the one of its set that was not used for longest, filled */
    for (size_t i = 0; i < RATE_WAYS && !b; i++) {
        if (set[i].key == hashed)
            b = &set[i];
        else if (set[i].key == 0 || (oldest->key != 0 && set[i].at < oldest->at))
            oldest = &set[i];
    }
    if (!b) {
        b = oldest;
        *b = (rate_bucket){.key = hashed, .left = burst, .at = now};
    }
    b->left = fmin(burst, b->left + fmax(0.0, now - b->at) * r->per_s);
    b->at = now;
    double wait = b->left >= 1.0 ? 0.0 : (1.0 - b->left) / r->per_s;
    if (wait == 0.0)
        b->left -= 1.0;
    pthread_mutex_unlock(&r->lock);
    return wait;
}
