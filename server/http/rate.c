/* rate.c: token buckets in sets, by a hash of the client. */
#include "http/rate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Not 0. */
static uint64_t hash(const rate *r, const void *key, size_t len)
{
    /* FNV-1a with a seed, and the finishing steps of MurmurHash3 (both public domain algorithms). */
    uint64_t hashed = r->seed ^ 0xcbf29ce484222325u;
    for (size_t i = 0; i < len; i++)
        hashed = (hashed ^ ((const unsigned char *)key)[i]) * 0x100000001b3u;
    hashed = (hashed ^ (hashed >> 33)) * 0xff51afd7ed558ccdu;
    hashed = (hashed ^ (hashed >> 33)) * 0xc4ceb9fe1a85ec53u;
    hashed ^= hashed >> 33;
    return hashed ? hashed : 1;
}

double rate_take(rate *r, const char *name, const void *key, size_t len, double now)
{
    const uint64_t hashed = hash(r, key, len);
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
        *b = (rate_bucket){.key = hashed, .left = burst, .at = now, .total = -1};
        snprintf(b->name, sizeof b->name, "%s", name ? name : "");
    }
    b->left = fmin(burst, b->left + fmax(0.0, now - b->at) * r->per_s);
    b->at = now;
    double wait = b->left >= 1.0 ? 0.0 : (1.0 - b->left) / r->per_s;
    if (wait == 0.0) {
        b->left -= 1.0;
        b->used++;
    }
    pthread_mutex_unlock(&r->lock);
    return wait;
}

/* ---- with other daemons */

#define RECENT_S 5.0

size_t rate_used(rate *r, store_rate *out, size_t most, double now)
{
    size_t n = 0;
    rate_bucket *all = &r->buckets[0][0];
    pthread_mutex_lock(&r->lock);
    for (size_t k = 0; k < RATE_SETS * RATE_WAYS && n < most; k++) {
        rate_bucket *b = &all[(r->next + k) % (RATE_SETS * RATE_WAYS)];
        if (b->key == 0 || !b->name[0] || now - b->at > RECENT_S)
            continue;
        out[n] = (store_rate){.used = b->used};
        memcpy(out[n++].client, b->name, sizeof b->name);
        if (n == most)
            r->next = (size_t)(b - all) + 1;
    }
    pthread_mutex_unlock(&r->lock);
    return n;
}

void rate_learn(rate *r, const store_rate *list, size_t n)
{
    const double burst = 2.0 * r->per_s;
    pthread_mutex_lock(&r->lock);
    for (size_t i = 0; i < n; i++) {
        const uint64_t hashed = hash(r, list[i].client, strlen(list[i].client));
        for (size_t k = 0; k < RATE_WAYS; k++) {
            rate_bucket *b = &r->buckets[hashed % RATE_SETS][k];
            if (b->key != hashed || !b->name[0])
                continue;
            const int64_t others = list[i].total - list[i].used - b->total;
            if (b->total >= 0 && others > 0) /* less: the count began anew */
                b->left = fmax(-burst, b->left - (double)others);
            b->used -= list[i].used;
            b->total = list[i].total;
        }
    }
    pthread_mutex_unlock(&r->lock);
}
