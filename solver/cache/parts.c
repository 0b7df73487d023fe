#include "cache/parts.h"

#include "core/alloc.h"
#include "core/digest.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* What the table keeps of a factor. */
typedef struct {
    uz_factor *factor;
    char K[65];
    uz_ordering ordering; /* as asked for */
} kept_factor;

/* What is looked for. */
typedef struct {
    const uz_matrix_key *key;
    const uz_csc *K;
    const int64_t *dofs;
    int64_t n_dofs, rows;
    uz_ordering ordering;
    const uz_hooks *hooks;
    bool last; /* the contact, and not much else, has to come last: what is dense is as large as all that does */
} wanted;

uz_status uz_pattern_digest(char digest[65], const uz_csc *A, uz_error *err)
{
    const int64_t shape[2] = {A->rows, A->cols};
    uz_digest *pattern = uz_digest_new();
    if (pattern) {
        uz_digest_add(pattern, shape, sizeof shape);
        uz_digest_add(pattern, A->ptr, (size_t)(A->cols + 1) * sizeof *A->ptr);
        uz_digest_add(pattern, A->idx, (size_t)A->ptr[A->cols] * sizeof *A->idx);
    }
    return pattern && uz_digest_end(pattern, digest) ? UZ_OK : uz_no_memory(err, "a digest");
}

uz_status uz_matrix_digest(uz_matrix_key *key, uz_cache *cache, const uz_csc *A, uz_error *err)
{
    if (uz_table_find_name(key, cache, A))
        return UZ_OK;
    const uz_status status = uz_pattern_digest(key->pattern, A, err);
    uz_digest *values = status == UZ_OK ? uz_digest_new() : NULL;
    if (values) {
        uz_digest_add(values, key->pattern, sizeof key->pattern);
        uz_digest_add(values, A->val, (size_t)A->ptr[A->cols] * sizeof *A->val);
    }
    if (status != UZ_OK || (values && uz_digest_end(values, key->values)))
        return status;
    return uz_no_memory(err, "a digest of a matrix");
}

/* The key of an object that `first` (a digest), the ordering and the contact determine. */
static uz_status digest_with_order(char digest[65], const char *first, const wanted *w, uz_error *err)
{
    uz_digest *state = uz_digest_new();
    int ordering = (int)w->ordering;
    if (!state)
        return uz_no_memory(err, "a digest");
    uz_digest_add(state, first, 64);
    uz_digest_add(state, &ordering, sizeof ordering);
    uz_digest_add(state, w->dofs, (size_t)w->n_dofs * sizeof *w->dofs);
    uz_digest_add(state, &w->rows, sizeof w->rows);
    return uz_digest_end(state, digest) ? UZ_OK : uz_fail(err, UZ_ERR_INTERNAL, "", "hashing failed");
}

/* ---- analyses */

static void destroy_analysis(void *object)
{
    uz_analysis_free(object);
}

/* The analysis of this pattern: from the table, or made and kept there. */
static uz_status get_analysis(uz_item **item, bool *reused, uz_cache *cache, const wanted *w, uz_error *err)
{
    char digest[65];
    bool create = false;
    uz_analysis *analysis = NULL;
    uz_status status = digest_with_order(digest, w->key->pattern, w, err);
    if (status == UZ_OK)
        status = uz_table_acquire(item, &create, cache, UZ_ITEM_ANALYSIS, digest, w->hooks, err);
    *reused = status == UZ_OK && !create;
    if (status != UZ_OK || !create)
        return status;
    status = uz_analysis_create(&analysis, w->K, w->dofs, w->n_dofs, w->rows, w->ordering, w->hooks, err);
    if (status == UZ_OK) {
        uz_table_publish(cache, *item, analysis, uz_analysis_bytes(analysis), destroy_analysis);
    } else {
        uz_table_abandon(cache, *item);
        *item = NULL;
    }
    return status;
}

/* ---- factors */

static void destroy_factor(void *object)
{
    kept_factor *kept = object;
    uz_factor_free(kept->factor);
    free(kept);
}

/* What another order of elimination changes in an answer grows with the root of the condition in the energy norm: below
 * this an outcome might follow from what was solved before, and the factor has to be the request's own. */
#define SHARED_RCOND 1e-8

static bool fits(const void *object, void *ctx)
{
    const kept_factor *kept = object;
    const wanted *w = ctx;
    const uz_factor_info info = uz_factor_describe(kept->factor);
    return kept->ordering == w->ordering && strcmp(kept->K, w->key->values) == 0 && info.rcond >= SHARED_RCOND &&
           (!w->last || (info.n_last <= 2 * w->n_dofs + 256 && uz_factor_ends_with(kept->factor, w->dofs, w->n_dofs)));
}

/* Puts a factor into the place that was reserved for it, and owns it also on failure. */
static uz_status keep(uz_cache *cache, uz_item *item, uz_factor *factor, const wanted *w, uz_error *err)
{
    kept_factor *kept = uz_alloc_zero(1, sizeof *kept);
    if (!kept) {
        uz_factor_free(factor);
        return uz_no_memory(err, "a cache entry");
    }
    kept->factor = factor;
    kept->ordering = w->ordering;
    memcpy(kept->K, w->key->values, sizeof kept->K);
    uz_table_publish(cache, item, kept, uz_factor_describe(factor).bytes, destroy_factor);
    return UZ_OK;
}

uz_status uz_shared_factor_get(uz_shared_factor *out, uz_cache *cache, const uz_matrix_key *key, const uz_csc *K,
                               const int64_t *dofs, int64_t n_dofs, int64_t rows, uz_ordering ordering, bool briefly,
                               uz_factor_accept accept, void *ctx, const uz_hooks *hooks, uz_error *err)
{
    wanted w = {key, K, dofs, n_dofs, rows, ordering, hooks, .last = true};
    uz_item *item = NULL, *kept_analysis = NULL;
    uz_analysis *own_analysis = NULL;
    uz_factor *factor = NULL;
    bool create = true;
    memset(out, 0, sizeof *out);
    uz_status status = UZ_OK;
    if (cache) { /* one that is there, which ends with the contact if possible */
        item = uz_table_search(cache, UZ_ITEM_FACTOR, fits, &w);
        w.last = false;
        item = item ? item : uz_table_search(cache, UZ_ITEM_FACTOR, fits, &w);
        create = false;
    }
    if (cache &&
        !item) { /* or a place to fill, whose key is that of the contact: what is found there is what is made */
        char digest[65];
        status = digest_with_order(digest, key->values, &w, err);
        if (status == UZ_OK)
            status = uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, digest, hooks, err);
    }
    if (status != UZ_OK)
        return status;
    if (create) {
        status = cache ? get_analysis(&kept_analysis, &out->analysis_reused, cache, &w, err)
                       : uz_analysis_create(&own_analysis, K, dofs, n_dofs, rows, ordering, hooks, err);
        const uz_analysis *analysis = kept_analysis ? uz_item_object(kept_analysis) : own_analysis;
        if (status == UZ_OK) {
            uz_factor_info predicted = uz_analysis_describe(analysis);
            predicted.order_s = out->analysis_reused ? 0.0 : predicted.order_s;
            status = accept(ctx, &predicted, err);
            if (status == UZ_OK && cache)
                uz_table_expect(cache, item, predicted.bytes);
        }
        if (status == UZ_OK)
            status = (briefly ? uz_factor_create_briefly : uz_factor_create)(&factor, K, analysis, 0, hooks, err);
        uz_table_release(cache, kept_analysis);
        uz_analysis_free(own_analysis);
        if (status == UZ_OK && cache)
            status = keep(cache, item, factor, &w, err);
        if (status != UZ_OK && cache)
            uz_table_abandon(cache, item);
    } else {
        factor = ((kept_factor *)uz_item_object(item))->factor;
        uz_factor_info there;
        status = uz_factor_describe_for(&there, factor, dofs, n_dofs, rows, err);
        if (status == UZ_OK)
            status = accept(ctx, &there, err);
        out->analysis_reused = out->factor_reused = status == UZ_OK;
        if (status != UZ_OK)
            uz_table_release(cache, item);
    }
    if (status != UZ_OK)
        return status;
    out->factor = factor;
    out->own = cache ? NULL : factor;
    out->cache = cache;
    out->item = item;
    return UZ_OK;
}

void uz_shared_factor_release(uz_shared_factor *shared)
{
    uz_factor_free(shared->own);
    if (shared->item)
        uz_table_release(shared->cache, shared->item);
    memset(shared, 0, sizeof *shared);
}
