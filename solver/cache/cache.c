/* cache.c: a byte-bounded, least-recently-used, reference-counted table of bodies. */
#include "cache/cache.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* In a list, most recently used first. body is NULL while its creator works; nobody but the creator then touches more
 * than `users`. */
typedef struct entry {
    char digest[65];
    uz_body *body;
    int64_t users, hits;
    struct entry *newer, *older;
} entry;

struct uz_cache {
    pthread_mutex_t mutex; /* guards everything below; held for list work only, never while a body is built */
    pthread_cond_t changed;
    entry *newest, *oldest;
    size_t bytes, max_bytes;
};

uz_cache *uz_cache_new(size_t max_bytes)
{
    uz_cache *cache = uz_alloc_zero(1, sizeof *cache);
    pthread_condattr_t attributes;
    if (!cache)
        return NULL;
    cache->max_bytes = max_bytes;
    pthread_mutex_init(&cache->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&cache->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    return cache;
}

static void unlink_entry(uz_cache *cache, entry *e)
{
    if (e->newer)
        e->newer->older = e->older;
    else
        cache->newest = e->older;
    if (e->older)
        e->older->newer = e->newer;
    else
        cache->oldest = e->newer;
    e->newer = e->older = NULL;
}

static void push_newest(uz_cache *cache, entry *e)
{
    e->older = cache->newest;
    if (cache->newest)
        cache->newest->newer = e;
    else
        cache->oldest = e;
    cache->newest = e;
}

static void drop(uz_cache *cache, entry *e)
{
    unlink_entry(cache, e);
    if (e->body)
        cache->bytes -= e->body->bytes;
    uz_body_free(e->body);
    free(e);
}

void uz_cache_free(uz_cache *cache)
{
    if (!cache)
        return;
    while (cache->newest)
        drop(cache, cache->newest);
    pthread_cond_destroy(&cache->changed);
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}

/* Frees unused bodies, oldest first, until the rest fits. */
static void evict(uz_cache *cache)
{
    entry *e = cache->oldest;
    while (e && cache->bytes > cache->max_bytes) {
        entry *newer = e->newer;
        if (e->users == 0)
            drop(cache, e);
        e = newer;
    }
}

static entry *find(uz_cache *cache, const char *digest)
{
    for (entry *e = cache->newest; e; e = e->older)
        if (strcmp(e->digest, digest) == 0)
            return e;
    return NULL;
}

/* Sleeps until the table changes, at most 20 ms so that a cancel is seen. */
static void wait_for_change(uz_cache *cache)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += 20000000;
    if (until.tv_nsec >= 1000000000) {
        until.tv_nsec -= 1000000000;
        until.tv_sec++;
    }
    pthread_cond_timedwait(&cache->changed, &cache->mutex, &until);
}

/* Either an entry with a body, its use counted (*create false), or a new empty one that the caller must fill. */
static uz_status reserve(entry **out, bool *create, uz_cache *cache, const char *digest, const uz_hooks *hooks,
                         uz_error *err)
{
    entry *e;
    *create = false;
    while ((e = find(cache, digest)) && !e->body) {
        if (uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while another job factors the same body");
        wait_for_change(cache);
    }
    if (!e) {
        e = uz_alloc_zero(1, sizeof *e);
        if (!e)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a cache entry");
        memcpy(e->digest, digest, sizeof e->digest);
        *create = true;
    } else {
        e->hits++;
        unlink_entry(cache, e);
    }
    push_newest(cache, e);
    e->users++;
    *out = e;
    return UZ_OK;
}

static uz_status fill(uz_cache *cache, entry *e, const uz_problem *problem, const uz_settings *settings,
                      const uz_hooks *hooks, uz_error *err)
{
    uz_body *body = NULL;
    uz_status status = uz_body_create(&body, problem, settings, hooks, err);
    pthread_mutex_lock(&cache->mutex);
    e->body = body;
    if (status == UZ_OK) {
        memcpy(body->digest, e->digest, sizeof body->digest);
        cache->bytes += body->bytes;
        evict(cache);
    } else {
        drop(cache, e);
    }
    pthread_cond_broadcast(&cache->changed);
    pthread_mutex_unlock(&cache->mutex);
    return status;
}

uz_status uz_cache_acquire(uz_body **body, bool *hit, uz_cache *cache, const uz_problem *problem,
                           const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    char digest[65];
    entry *e = NULL;
    bool create = true;
    *body = NULL;
    *hit = false;
    if (!cache)
        return uz_body_create(body, problem, settings, hooks, err);
    uz_status status = uz_body_digest(digest, problem, settings, err);
    if (status != UZ_OK)
        return status;
    pthread_mutex_lock(&cache->mutex);
    status = reserve(&e, &create, cache, digest, hooks, err);
    pthread_mutex_unlock(&cache->mutex);
    if (status == UZ_OK && create)
        status = fill(cache, e, problem, settings, hooks, err);
    if (status == UZ_OK) {
        *body = e->body;
        *hit = !create;
    }
    return status;
}

void uz_cache_release(uz_cache *cache, uz_body *body)
{
    if (!cache) {
        uz_body_free(body);
        return;
    }
    if (!body)
        return;
    pthread_mutex_lock(&cache->mutex);
    entry *e = find(cache, body->digest);
    if (e)
        e->users--;
    evict(cache);
    pthread_mutex_unlock(&cache->mutex);
}

uz_status uz_cache_list(uz_cache *cache, uz_cache_entry **entries, size_t *count, uz_error *err)
{
    *entries = NULL;
    *count = 0;
    uz_error_reset(err);
    pthread_mutex_lock(&cache->mutex);
    int64_t total = 0;
    for (entry *e = cache->newest; e; e = e->older)
        total += e->body != NULL;
    uz_cache_entry *list = uz_alloc_zero(total, sizeof *list);
    for (entry *e = cache->newest; list && e; e = e->older) {
        if (!e->body)
            continue;
        uz_cache_entry *to = &list[(*count)++];
        uz_dual_info dual = uz_dual_describe(e->body->dual);
        memcpy(to->digest, e->digest, sizeof to->digest);
        to->d = dual.d;
        to->m = dual.m;
        to->nnz = uz_factor_describe(e->body->factor).nnz;
        to->hits = e->hits;
        to->bytes = e->body->bytes;
    }
    pthread_mutex_unlock(&cache->mutex);
    *entries = list;
    return list ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to list the cache");
}
