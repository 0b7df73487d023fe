/* setup_cache.c: bodies as objects of the table. */
#include "run/setup_cache.h"

#include "cache/table.h"
#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

static void destroy_body(void *object)
{
    uz_body_free(object);
}

/* Makes the body of a reserved item. */
static uz_status fill(uz_cache *cache, uz_item *item, const uz_problem *problem, const uz_candidates *wanted,
                      const uz_body_key *key, const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    uz_body *body = NULL;
    uz_status status = uz_body_create(&body, problem, wanted, key, settings, cache, hooks, err);
    if (status == UZ_OK) {
        body->item = item;
        uz_table_publish(cache, item, body, body->bytes, destroy_body);
    } else {
        uz_table_abandon(cache, item);
    }
    return status;
}

uz_status uz_cache_acquire(uz_body **body, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                           const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    return uz_cache_acquire_rows(body, reused, cache, problem, NULL, settings, hooks, err);
}

uz_status uz_cache_acquire_rows(uz_body **body, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                                const uz_candidates *wanted, const uz_settings *settings, const uz_hooks *hooks,
                                uz_error *err)
{
    static const uz_reuse everything = {true, true, true, true}, nothing;
    uz_body_key key;
    uz_item *item = NULL;
    bool create = true;
    *body = NULL;
    *reused = nothing;
    if (!cache)
        return uz_body_create(body, problem, wanted, NULL, settings, NULL, hooks, err);
    uz_status status = uz_body_digest(&key, problem, wanted, settings, err);
    if (status == UZ_OK)
        status = uz_table_acquire(&item, &create, cache, UZ_ITEM_BODY, key.digest, hooks, err);
    if (status == UZ_OK && create)
        status = fill(cache, item, problem, wanted, &key, settings, hooks, err);
    if (status != UZ_OK)
        return status;
    *body = uz_item_object(item);
    *reused = create ? (*body)->reused : everything;
    return UZ_OK;
}

void uz_cache_release(uz_cache *cache, uz_body *body)
{
    if (!cache)
        uz_body_free(body);
    else if (body)
        uz_table_release(cache, body->item);
}

/* ---- what is cached, for people */

typedef struct {
    uz_cache_entry *list;
    const uz_factor **factors; /* of the entries before */
    size_t count, room;
} entries;

static void count_one(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx)
{
    (void)object, (void)digest, (void)hits, (void)bytes;
    ((entries *)ctx)->room++;
}

/* A factor that several bodies share counts for the first of them. */
static size_t factor_bytes(entries *to, const uz_factor *factor)
{
    to->factors[to->count] = factor;
    for (size_t k = 0; k < to->count; k++)
        if (to->factors[k] == factor)
            return 0;
    return factor ? uz_factor_describe(factor).bytes : 0;
}

static void describe_one(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx)
{
    const uz_body *body = object;
    entries *to = ctx;
    if (to->count == to->room)
        return; /* came in since they were counted */
    const uz_dual *dual = body->dual;
    uz_cache_entry *entry = &to->list[to->count];
    memcpy(entry->digest, digest, sizeof entry->digest);
    entry->d = dual->d;
    entry->m = dual->m;
    entry->nnz = body->factor ? uz_factor_describe(body->factor).nnz : 0;
    entry->hits = hits;
    entry->bytes = bytes + factor_bytes(to, body->factor);
    to->count++;
}

uz_status uz_cache_list(uz_cache *cache, uz_cache_entry **out, size_t *count, uz_error *err)
{
    entries found = {0};
    *out = NULL;
    *count = 0;
    uz_error_reset(err);
    uz_table_visit(cache, UZ_ITEM_BODY, count_one, &found);
    found.list = uz_alloc_zero((int64_t)found.room, sizeof *found.list);
    found.factors = uz_alloc_zero((int64_t)found.room, sizeof *found.factors);
    if (!found.list || !found.factors) {
        free(found.list);
        free(found.factors);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to list the cache");
    }
    uz_table_visit(cache, UZ_ITEM_BODY, describe_one, &found);
    free(found.factors);
    *out = found.list;
    *count = found.count;
    return UZ_OK;
}
