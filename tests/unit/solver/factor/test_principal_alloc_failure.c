/* Solving with part of a matrix, each allocation on the way failing once. Linked with malloc, calloc, realloc and free
 * wrapped; CHOLMOD's allocations come through here too. */
#include "failing_heap.h"

#include "factor/factor.h"
#include "factor_fixture.h"
#include "harness.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

#include <string.h>
#include <suitesparse/SuiteSparse_config.h>

__attribute__((constructor)) static void settle_process(void)
{
    uz_process_init(2);
    uz_thread_init();
    SuiteSparse_config.realloc_func = realloc;
    SuiteSparse_config.free_func = free;
}

/* Returns whether an allocation failed. */
static bool fail_at(const uz_csc *K, const bool *fixed, const uz_factor *factor, long n)
{
    uz_factor_workspace *ws = uz_factor_workspace_new();
    double *x = calloc((size_t)K->cols, sizeof *x);
    uz_principal *part = NULL;
    uz_error err = {0};
    CHECK(ws && x);
    x[0] = 1;
    heap_watch(n);
    uz_status status = uz_principal_create(&part, K, fixed, factor, ws, NULL, &err);
    if (status == UZ_OK && part)
        status = uz_principal_solve(x, part, &err);
    uz_principal_free(part);
    uz_factor_workspace_free(ws);
    heap.watching = false;
    CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "allocation %ld: %s", n, err.message);
    CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    free(x);
    return heap.failed;
}

/* Of so many dofs, each of which so many before and after it have to do with. */
static uz_csc band(int64_t n, int64_t width)
{
    double *K = vector(n * n);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < n; j++)
            K[i * n + j] = i == j ? 2.0 * (double)width + 1.0 : j - i <= width && i - j <= width ? -1.0 : 0.0;
    uz_csc A = csc_from_dense(K, n, n, true);
    free(K);
    return A;
}

static long fail_each(int64_t n, int64_t width)
{
    uz_csc K = band(n, width);
    uz_factor *factor = NULL;
    uz_error err = {0};
    bool *fixed = calloc((size_t)n, sizeof *fixed);
    for (int64_t i = 0; i < n; i++)
        fixed[i] = i % 3 > 0; /* so many that it is cheaper to factor the rest anew */
    CHECK_INT(factor_by(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
    long k = 0;
    while (k < 1000 && fail_at(&K, fixed, factor, k))
        k++;
    uz_factor_free(factor);
    uz_csc_clear(&K);
    free(fixed);
    return k;
}

TEST(a_part_of_a_narrow_band)
{
    CHECK(fail_each(400, 1) > 15);
}

/* With supernodes: CHOLMOD's substitution has two rooms, and would go on with the second one alone. */
TEST(a_part_of_a_wide_band)
{
    CHECK(fail_each(700, 300) > 15);
}
