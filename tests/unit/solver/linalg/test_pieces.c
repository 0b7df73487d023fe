/* Loops that threads share meet everything once, in an order that does not depend on how many there are. */
#include "core/alloc.h"
#include "core/aside.h"
#include "harness.h"
#include "linalg/pieces.h"

#include <stdlib.h>
#include <string.h>

enum { THREADS = 3, COLUMNS = 60000, BAND = 2000, EACH = 5 };

/* Of each row, the columns that it met, in order, in one number; of each column, how often it was run. */
typedef struct {
    const uz_csc *A;
    uint64_t *met;
    int *runs;
} meeting;

static void meet(void *ctx, int64_t begin, int64_t end)
{
    const meeting *x = ctx;
    for (int64_t j = begin; j < end; j++) {
        x->runs[j]++;
        for (int64_t k = x->A->ptr[j]; k < x->A->ptr[j + 1]; k++)
            x->met[x->A->idx[k]] = 31 * x->met[x->A->idx[k]] + (uint64_t)j + 1;
    }
}

/* Some columns have their diagonal only, some nothing; one in 5,000 has a row anywhere below. */
static uz_csc band_matrix(void)
{
    uz_csc A = {.rows = COLUMNS, .cols = COLUMNS};
    A.ptr = calloc(COLUMNS + 1, sizeof *A.ptr);
    A.idx = malloc((size_t)COLUMNS * EACH * sizeof *A.idx);
    CHECK(A.ptr && A.idx);
    for (int64_t j = 0; j < COLUMNS; j++) {
        int64_t k = A.ptr[j], row = j;
        for (int e = 0; e < (j % 11 == 0 ? 0 : j % 7 == 0 ? 1 : EACH) && row < COLUMNS; e++) {
            A.idx[k++] = (int32_t)row;
            row += j % 5000 == 1 ? (COLUMNS - j) / EACH + 1 : 1 + j * 7919 % (BAND / EACH);
        }
        A.ptr[j + 1] = k;
    }
    return A;
}

TEST(columns_that_threads_share_meet_rows_in_one_order)
{
    uz_csc A = band_matrix();
    uint64_t *met[2] = {calloc(COLUMNS, sizeof **met), calloc(COLUMNS, sizeof **met)};
    int *runs = calloc(COLUMNS, sizeof *runs);
    CHECK(met[0] && met[1] && runs);
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int threads = 1; threads <= THREADS; threads++) {
        memset(met[threads > 1], 0, COLUMNS * sizeof **met);
        uz_aside_allow(threads);
        (void)uz_aside_used();
        uz_by_columns(meet, &(meeting){&A, met[threads > 1], runs}, &A);
        CHECK_INT(uz_aside_used(), threads);
        CHECK(threads == 1 || memcmp(met[0], met[1], COLUMNS * sizeof **met) == 0);
        for (int64_t j = 0; j < COLUMNS; j++)
            CHECK_INT(runs[j], threads);
    }
    uz_aside_allow(1);
    uz_free_all(met[0], met[1], runs, A.ptr, A.idx);
}
