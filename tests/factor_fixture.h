/* factor_fixture.h: what tests of the factor share. */
#ifndef TESTS_FACTOR_FIXTURE_H
#define TESTS_FACTOR_FIXTURE_H

#include "factor/factor.h"

/* A factor in one call, for tests that don't share an analysis. */
static inline uz_status factor_by(uz_factor **out, const uz_csc *K, const int64_t *last, int64_t n_last,
                                  uz_ordering ordering, size_t limit, uz_error *err)
{
    uz_analysis *analysis;
    *out = NULL;
    uz_status status = uz_analysis_create(&analysis, K, last, n_last, ordering, NULL, err);
    if (status == UZ_OK)
        status = uz_factor_create(out, K, analysis, limit, NULL, err);
    uz_analysis_free(analysis);
    return status;
}

/* The columns of N that have entries: dofs must have room for N->cols. Returns how many. */
static inline int64_t dofs_touched(int64_t *dofs, const uz_csc *N)
{
    int64_t count = 0;
    for (int64_t j = 0; j < N->cols; j++)
        if (N->ptr[j + 1] > N->ptr[j])
            dofs[count++] = j;
    return count;
}

#endif
