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
    uz_factor_accept accept;
    void *ctx;
    const uz_hooks *hooks;
} wanted;

uz_status uz_matrix_digest(uz_matrix_key *key, const uz_csc *K, uz_error *err)
{
    int64_t shape[2] = {K->rows, K->cols};
    size_t nnz = (size_t)K->ptr[K->cols];
    uz_digest *pattern = uz_digest_new(), *values = uz_digest_new();
    bool ok = pattern && values;
    if (pattern) {
        uz_digest_add(pattern, shape, sizeof shape);
        uz_digest_add(pattern, K->ptr, (size_t)(K->cols + 1) * sizeof *K->ptr);
        uz_digest_add(pattern, K->idx, nnz * sizeof *K->idx);
        ok = uz_digest_end(pattern, key->pattern) && ok;
    }
    if (values) {
        uz_digest_add(values, key->pattern, pattern ? sizeof key->pattern : 0);
        uz_digest_add(values, K->val, nnz * sizeof *K->val);
        ok = uz_digest_end(values, key->values) && ok;
    }
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a digest of K");
}

/* The key of an object that `first` (a digest), the ordering and the contact determine. */
static uz_status digest_with_order(char digest[65], const char *first, const wanted *w, uz_error *err)
{
    uz_digest *state = uz_digest_new();
    int ordering = (int)w->ordering;
    if (!state)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a digest");
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

static uz_status analyze(uz_analysis **out, const wanted *w, uz_error *err)
{
    return uz_analysis_choose(out, w->K, w->dofs, w->n_dofs, w->rows, w->ordering, w->hooks, err);
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
    status = analyze(&analysis, w, err);
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

static uz_status factorize(uz_factor **out, const uz_analysis *analysis, const wanted *w, uz_error *err)
{
    uz_factor_info predicted = uz_analysis_describe(analysis);
    uz_status status = w->accept(w->ctx, &predicted, err);
    return status == UZ_OK ? uz_factor_create(out, w->K, analysis, 0, w->hooks, err) : status;
}

static uz_status make_kept(kept_factor **out, bool *analysis_reused, uz_cache *cache, const wanted *w, uz_error *err)
{
    uz_item *analysis = NULL;
    kept_factor *kept = uz_alloc_zero(1, sizeof *kept);
    if (!kept)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a cache entry");
    kept->ordering = w->ordering;
    memcpy(kept->K, w->key->values, sizeof kept->K);
    uz_status status = get_analysis(&analysis, analysis_reused, cache, w, err);
    if (status == UZ_OK)
        status = factorize(&kept->factor, uz_item_object(analysis), w, err);
    uz_table_release(cache, analysis);
    if (status == UZ_OK)
        *out = kept;
    else
        free(kept);
    return status;
}

static bool fits(const void *object, void *ctx)
{
    const kept_factor *kept = object;
    const wanted *w = ctx;
    return kept->ordering == w->ordering && strcmp(kept->K, w->key->values) == 0;
}

/* The contact, and not much else, comes last: what is dense is as large as all that does. */
static bool fits_best(const void *object, void *ctx)
{
    const kept_factor *kept = object;
    const wanted *w = ctx;
    int64_t count;
    uz_factor_last_dofs(kept->factor, &count);
    return fits(object, ctx) && count <= 2 * w->n_dofs + 256 && uz_factor_ends_with(kept->factor, w->dofs, w->n_dofs);
}

static uz_status get_shared(uz_shared_factor *out, uz_cache *cache, wanted *w, uz_error *err)
{
    char digest[65];
    bool create = false;
    kept_factor *kept = NULL;
    out->cache = cache;
    out->item = uz_table_search(cache, UZ_ITEM_FACTOR, fits_best, w);
    if (!out->item)
        out->item = uz_table_search(cache, UZ_ITEM_FACTOR, fits, w);
    if (!out->item) {
        uz_status status = digest_with_order(digest, w->key->values, w, err);
        if (status == UZ_OK)
            status = uz_table_acquire(&out->item, &create, cache, UZ_ITEM_FACTOR, digest, w->hooks, err);
        if (status == UZ_OK && create)
            status = make_kept(&kept, &out->analysis_reused, cache, w, err);
        if (status != UZ_OK && create) {
            uz_table_abandon(cache, out->item);
            out->item = NULL;
        }
        if (status != UZ_OK)
            return status;
        if (create)
            uz_table_publish(cache, out->item, kept, uz_factor_describe(kept->factor).bytes, destroy_factor);
    }
    kept = uz_item_object(out->item);
    if (!create) {
        uz_factor_info there = uz_factor_describe(kept->factor);
        uz_status status = w->accept(w->ctx, &there, err);
        if (status != UZ_OK) {
            uz_table_release(cache, out->item);
            out->item = NULL;
            return status;
        }
        out->analysis_reused = out->factor_reused = true;
    }
    out->factor = kept->factor;
    return UZ_OK;
}

uz_status uz_shared_factor_get(uz_shared_factor *out, uz_cache *cache, const uz_matrix_key *key, const uz_csc *K,
                               const int64_t *dofs, int64_t n_dofs, int64_t rows, uz_ordering ordering,
                               uz_factor_accept accept, void *ctx, const uz_hooks *hooks, uz_error *err)
{
    wanted w = {key, K, dofs, n_dofs, rows, ordering, accept, ctx, hooks};
    uz_analysis *analysis = NULL;
    memset(out, 0, sizeof *out);
    if (cache)
        return get_shared(out, cache, &w, err);
    uz_status status = analyze(&analysis, &w, err);
    if (status == UZ_OK)
        status = factorize(&out->own, analysis, &w, err);
    uz_analysis_free(analysis);
    out->factor = out->own;
    return status;
}

void uz_shared_factor_release(uz_shared_factor *shared)
{
    uz_factor_free(shared->own);
    if (shared->item)
        uz_table_release(shared->cache, shared->item);
    memset(shared, 0, sizeof *shared);
}
