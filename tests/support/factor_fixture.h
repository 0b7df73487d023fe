/* factor_fixture.h: what tests of the factor share. */
#ifndef TESTS_FACTOR_FIXTURE_H
#define TESTS_FACTOR_FIXTURE_H

#include "factor/factor.h"
#include "qp_fixture.h"

/* A factor in one call, for tests that don't share an analysis. */
static inline uz_status factor_by(uz_factor **out, const uz_csc *K, const int64_t *last, int64_t n_last,
                                  uz_ordering ordering, size_t limit, uz_error *err)
{
    uz_analysis *analysis;
    *out = NULL;
    uz_status status = uz_analysis_create(&analysis, K, last, n_last, 0, ordering, NULL, err);
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

/* The five-point Laplacian of a w x h grid, in the lower triangle of a dense n x n block that starts at dof `first` of
 * a matrix of order `total`. */
static inline void add_grid(double *K, int64_t total, int64_t first, int64_t w, int64_t h)
{
    for (int64_t y = 0; y < h; y++)
        for (int64_t x = 0; x < w; x++) {
            int64_t i = first + y * w + x;
            K[i * total + i] = 4.1;
            if (x > 0)
                K[i * total + i - 1] = K[(i - 1) * total + i] = -1;
            if (y > 0)
                K[i * total + i - w] = K[(i - w) * total + i] = -1;
        }
}

static inline uz_csc grid(int64_t w, int64_t h)
{
    double *K = vector(w * h * w * h);
    add_grid(K, w * h, 0, w, h);
    uz_csc A = csc_from_dense(K, w * h, w * h, true);
    free(K);
    return A;
}

#endif
