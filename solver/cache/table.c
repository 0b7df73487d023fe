#include "cache/table.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* In a list, most recently used first. object is NULL while its creator works; nobody but the creator then touches more
 * than `users`. */
struct uz_item {
    uz_item_kind kind;
    char digest[65];
    void *object;
    void (*destroy)(void *object);
    size_t bytes; /* counted in the table's, also while they are only expected */
    int64_t users, hits;
    uz_item *newer, *older;
};

struct uz_cache {
    pthread_mutex_t
        mutex; /* guards everything below; held for list work only, never while an object is made or freed */
    pthread_cond_t changed;
    uz_item *newest, *oldest;
    size_t bytes, max_bytes;
    uz_csc named; /* borrowed, never read; val NULL: none */
    uz_matrix_key name;
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

static void unlink_item(uz_cache *cache, uz_item *item)
{
    if (item->newer)
        item->newer->older = item->older;
    else
        cache->newest = item->older;
    if (item->older)
        item->older->newer = item->newer;
    else
        cache->oldest = item->newer;
    item->newer = item->older = NULL;
}

static void push_newest(uz_cache *cache, uz_item *item)
{
    item->older = cache->newest;
    if (cache->newest)
        cache->newest->newer = item;
    else
        cache->oldest = item;
    cache->newest = item;
}

static void use(uz_cache *cache, uz_item *item)
{
    item->users++;
    item->hits++;
    unlink_item(cache, item);
    push_newest(cache, item);
}

static uz_item *take_out(uz_cache *cache, uz_item *item, uz_item *before)
{
    unlink_item(cache, item);
    cache->bytes -= item->bytes;
    item->older = before;
    return item;
}

/* Takes unused objects out, oldest first, until the rest fits: meshes, which are soon read again, then all. They are a
 * list by `older`. A mesh in use would be in memory without a cache too: nothing makes room for it but other meshes. */
static uz_item *evict(uz_cache *cache)
{
    uz_item *out = NULL;
    size_t most = cache->max_bytes;
    for (int all = 0; all < 2; all++) {
        for (uz_item *item = cache->oldest, *newer; item && cache->bytes > most; item = newer) {
            newer = item->newer;
            if (item->users == 0 && (all || item->kind == UZ_ITEM_MESH))
                out = take_out(cache, item, out);
        }
        for (const uz_item *item = cache->oldest; item; item = item->newer)
            most += item->users > 0 && item->kind == UZ_ITEM_MESH ? item->bytes : 0;
    }
    return out;
}

/* Without the mutex: an object that goes may give back uses of others. */
static void destroy_all(uz_item *list)
{
    while (list) {
        uz_item *next = list->older;
        if (list->object)
            list->destroy(list->object);
        free(list);
        list = next;
    }
}

/* Setups first: they hold uses of factors, which an empty table would not find. */
void uz_cache_free(uz_cache *cache)
{
    if (!cache)
        return;
    cache->max_bytes = 0;
    while (cache->newest) {
        uz_item *list = evict(cache);
        if (!list) /* only items of no bytes, or in use against the contract, are left */
            list = cache->newest, unlink_item(cache, list);
        destroy_all(list);
    }
    pthread_cond_destroy(&cache->changed);
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}

uz_status uz_table_acquire(uz_item **item, bool *create, uz_cache *cache, uz_item_kind kind, const char digest[65],
                           const uz_hooks *hooks, uz_error *err)
{
    uz_status status = UZ_OK;
    uz_item *found;
    *item = NULL;
    *create = false;
    pthread_mutex_lock(&cache->mutex);
    for (;;) {
        found = cache->newest;
        while (found && !(found->kind == kind && strcmp(found->digest, digest) == 0))
            found = found->older;
        if (!found || found->object)
            break;
        if (uz_cancelled(hooks)) {
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while another job factors the same body");
            goto done;
        }
        struct timespec until; /* its creator works; 20 ms at most, so that a cancel is seen */
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_nsec += 20000000;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        pthread_cond_timedwait(&cache->changed, &cache->mutex, &until);
    }
    if (found) {
        use(cache, found);
    } else if (!(found = uz_alloc_zero(1, sizeof *found))) {
        status = uz_no_memory(err, "a cache entry");
    } else {
        found->kind = kind;
        memcpy(found->digest, digest, sizeof found->digest);
        found->users = 1;
        push_newest(cache, found);
        *create = true;
    }
    *item = found;
done:
    pthread_mutex_unlock(&cache->mutex);
    return status;
}

void uz_table_forget(uz_cache *cache, uz_item_kind kind)
{
    uz_item *out = NULL;
    pthread_mutex_lock(&cache->mutex);
    for (uz_item *item = cache->oldest, *newer; item; item = newer) {
        newer = item->newer;
        if (item->users == 0 && item->kind == kind)
            out = take_out(cache, item, out);
    }
    pthread_mutex_unlock(&cache->mutex);
    destroy_all(out);
}

void uz_table_expect(uz_cache *cache, uz_item *item, size_t bytes)
{
    pthread_mutex_lock(&cache->mutex);
    cache->bytes += bytes - item->bytes;
    item->bytes = bytes;
    uz_item *out = evict(cache);
    pthread_mutex_unlock(&cache->mutex);
    destroy_all(out);
}

void uz_table_publish(uz_cache *cache, uz_item *item, void *object, size_t bytes, void (*destroy)(void *object))
{
    pthread_mutex_lock(&cache->mutex);
    item->object = object;
    item->destroy = destroy;
    cache->bytes += bytes - item->bytes;
    item->bytes = bytes;
    uz_item *out = evict(cache);
    pthread_cond_broadcast(&cache->changed);
    pthread_mutex_unlock(&cache->mutex);
    destroy_all(out);
}

void uz_table_abandon(uz_cache *cache, uz_item *item)
{
    pthread_mutex_lock(&cache->mutex);
    cache->bytes -= item->bytes;
    unlink_item(cache, item);
    pthread_cond_broadcast(&cache->changed);
    pthread_mutex_unlock(&cache->mutex);
    free(item);
}

void uz_table_release(uz_cache *cache, uz_item *item)
{
    if (!item)
        return;
    pthread_mutex_lock(&cache->mutex);
    item->users--;
    uz_item *out = evict(cache);
    pthread_mutex_unlock(&cache->mutex);
    destroy_all(out);
}

uz_item *uz_table_search(uz_cache *cache, uz_item_kind kind, bool (*fits)(const void *object, void *ctx), void *ctx)
{
    pthread_mutex_lock(&cache->mutex);
    uz_item *item = cache->newest;
    while (item && !(item->kind == kind && item->object && fits(item->object, ctx)))
        item = item->older;
    if (item)
        use(cache, item);
    pthread_mutex_unlock(&cache->mutex);
    return item;
}

void uz_table_name(uz_cache *cache, const uz_csc *A, const uz_matrix_key *key)
{
    pthread_mutex_lock(&cache->mutex);
    cache->named = *A;
    cache->name = *key;
    pthread_mutex_unlock(&cache->mutex);
}

bool uz_table_find_name(uz_matrix_key *key, uz_cache *cache, const uz_csc *A)
{
    if (!cache)
        return false;
    pthread_mutex_lock(&cache->mutex);
    const bool found = A->val && A->val == cache->named.val && A->ptr == cache->named.ptr && A->idx == cache->named.idx;
    if (found)
        *key = cache->name;
    pthread_mutex_unlock(&cache->mutex);
    return found;
}

void *uz_item_object(const uz_item *item)
{
    return item->object;
}

void uz_table_visit(uz_cache *cache, uz_item_kind kind,
                    void (*visit)(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx),
                    void *ctx)
{
    pthread_mutex_lock(&cache->mutex);
    for (const uz_item *item = cache->newest; item; item = item->older)
        if (item->kind == kind && item->object)
            visit(item->object, item->digest, item->hits, item->bytes, ctx);
    pthread_mutex_unlock(&cache->mutex);
}
