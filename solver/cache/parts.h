/* parts.h: what setups share: the factor of a K that another contact set was solved with, and the ordering and symbolic
 * analysis of a pattern whose numbers have changed. */
#ifndef UZ_PARTS_H
#define UZ_PARTS_H

#include "cache/table.h"
#include "factor/factor.h"

/* What the table calls A (uz_table_name), or its digests. cache NULL is legal. UZ_ERR_MEMORY. */
uz_status uz_matrix_digest(uz_matrix_key *key, uz_cache *cache, const uz_csc *A, uz_error *err);
/* Of the pattern alone. */
uz_status uz_pattern_digest(char digest[65], const uz_csc *A, uz_error *err);

/* A factor and where it belongs. All zero: none. */
typedef struct {
    const uz_factor *factor;
    bool analysis_reused, factor_reused;
    uz_factor *own; /* without a cache */
    uz_cache *cache;
    uz_item *item;
} uz_shared_factor;

/* Asked before a factor is made, or one that is there is taken: what it returns, if not UZ_OK, ends the call. An order
 * that is there takes no seconds in `predicted`, whose factor_s is 0 where the factor is to be made, and `condensing`
 * is told where it is not. */
typedef uz_status (*uz_factor_accept)(void *ctx, const uz_factor_info *predicted, uz_error *err);

/* Finds a factor of K, one that ends with the contact's dofs (ascending) if it can, or makes one that does or that
 * serves `rows` rows on them as well (uz_analysis_create), with an analysis of the same pattern where there is one.
 * Where K is ill-conditioned only the factor is found that would be made. briefly: one that is made is as by
 * uz_factor_create_briefly; in a cache of its own. cache NULL: made, and freed on release; key is then not read.
 * Errors: uz_factor_create's. */
uz_status uz_shared_factor_get(uz_shared_factor *out, uz_cache *cache, const uz_matrix_key *key, const uz_csc *K,
                               const int64_t *dofs, int64_t n_dofs, int64_t rows, uz_ordering ordering, bool briefly,
                               uz_factor_accept accept, void *ctx, const uz_hooks *hooks, uz_error *err);
void uz_shared_factor_release(uz_shared_factor *shared);

#endif
