/* setup_cache.c: setups as objects of the table. */
#include "run/setup_cache.h"

#include "cache/table.h"
#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

static void destroy_setup(void *object)
{
    uz_setup_free(object);
}

uz_status uz_setup_acquire(uz_setup **setup, uz_reuse *reused, uz_cache *cache, const uz_problem *problem,
                           const uz_candidates *wanted, const uz_settings *settings, const uz_hooks *hooks,
                           uz_error *err)
{
    static const uz_reuse everything = {true, true, true, true}, nothing;
    uz_setup_key key;
    uz_item *item = NULL;
    bool create = true;
    uz_status status = UZ_OK;
    *setup = NULL;
    *reused = nothing;
    if (problem->kind == UZ_PROBLEM_SCENE && problem->scene.place) { /* made on that at no place, which it keeps */
        uz_problem rest = *problem;
        uz_setup *base;
        rest.scene.place = NULL;
        status = uz_setup_acquire(&base, reused, cache, &rest, NULL, settings, hooks, err);
        if (status != UZ_OK)
            return status;
        status = uz_setup_move(setup, base, problem, wanted, settings, hooks, err);
        if (status == UZ_OK)
            *reused = (*setup)->reused;
        else
            uz_setup_release(cache, base);
        return status;
    }
    if (settings->op == UZ_OPERATOR_DISTRIBUTED) /* its group ends with the call */
        cache = NULL;
    if (cache)
        status = uz_setup_digest(&key, problem, wanted, settings, cache, err);
    if (cache && status == UZ_OK)
        status = uz_table_acquire(&item, &create, cache, UZ_ITEM_SETUP, key.digest, hooks, err);
    if (status != UZ_OK)
        return status;
    if (!create) {
        *setup = uz_item_object(item);
        *reused = everything;
        return UZ_OK;
    }
    uz_setup *made;
    status = uz_setup_create(&made, problem, wanted, settings, err);
    if (status == UZ_OK)
        status = uz_setup_make_operator(made, problem, &key.K, settings, cache, hooks, err);
    if (status != UZ_OK) {
        uz_setup_free(made);
        if (item)
            uz_table_abandon(cache, item);
        return status;
    }
    made->item = item;
    if (item)
        uz_table_publish(cache, item, made, made->bytes, destroy_setup);
    *setup = made;
    *reused = made->reused;
    return UZ_OK;
}

void uz_setup_release(uz_cache *cache, uz_setup *setup)
{
    uz_setup *base = setup ? setup->base : NULL;
    if (!setup || !setup->item || base)
        uz_setup_free(setup);
    else
        uz_table_release(cache, setup->item);
    if (base)
        uz_setup_release(cache, base);
}

/* ---- what is cached, for people */

typedef struct {
    uz_cache_entry *list;
    const uz_factor **factors; /* of the entries before */
    size_t count, room;
} entries;

/* Without room for a list yet: counts. A factor that several setups share counts for the first of them. */
static void describe_one(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx)
{
    const uz_setup *setup = object;
    entries *to = ctx;
    if (!to->list) {
        to->room++;
        return;
    }
    if (to->count == to->room)
        return; /* came in since they were counted */
    const uz_factor_info factor = setup->factor ? uz_factor_describe(setup->factor) : (uz_factor_info){.nnz = 0};
    size_t first = 0;
    to->factors[to->count] = setup->factor;
    while (to->factors[first] != setup->factor)
        first++;
    uz_cache_entry *entry = &to->list[to->count];
    memcpy(entry->digest, digest, sizeof entry->digest);
    entry->d = setup->dual->d;
    entry->m = setup->dual->m;
    entry->nnz = factor.nnz;
    entry->hits = hits;
    entry->bytes = bytes + (first == to->count ? factor.bytes : 0);
    to->count++;
}

uz_status uz_cache_list(uz_cache *cache, uz_cache_entry **out, size_t *count, uz_error *err)
{
    entries found = {0};
    *out = NULL;
    *count = 0;
    uz_error_reset(err);
    uz_table_visit(cache, UZ_ITEM_SETUP, describe_one, &found);
    found.list = uz_alloc_zero((int64_t)found.room, sizeof *found.list);
    found.factors = uz_alloc_zero((int64_t)found.room, sizeof *found.factors);
    if (!found.list || !found.factors) {
        uz_free_all(found.list, found.factors);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to list the cache");
    }
    uz_table_visit(cache, UZ_ITEM_SETUP, describe_one, &found);
    free(found.factors);
    *out = found.list;
    *count = found.count;
    return UZ_OK;
}
