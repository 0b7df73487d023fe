/* How fast Matrix Market text is read. */
#include "bench/bench.h"

#include "mm_text.h"

#include <stdlib.h>
#include <time.h>

enum { DOFS = 200000, PER_COLUMN = 15, RUNS = 5 };

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Values with all their digits, over many magnitudes, as assembled stiffness matrices have them. */
static double some_value(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    double unit = (double)(*state >> 11) / 9007199254740992.0;
    return (unit - 0.5) * (double)(1u << (*state >> 3 & 31));
}

/* Lower triangle of a banded matrix. */
static uz_status banded(uz_csc *A)
{
    uint64_t state = 1;
    int64_t at = 0;
    uz_status status = uz_csc_init(A, DOFS, DOFS, (int64_t)DOFS * PER_COLUMN, NULL);
    for (int64_t j = 0; status == UZ_OK && j < DOFS; j++) {
        for (int64_t i = j; i < DOFS && i < j + (int64_t)PER_COLUMN * 7; i += 7) {
            A->idx[at] = (int32_t)i;
            A->val[at++] = some_value(&state);
        }
        A->ptr[j + 1] = at;
    }
    return status;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_read_rate(const char *text, size_t len)
{
    double rates[RUNS];
    for (int run = 0; run < RUNS; run++) {
        uz_csc A;
        double start = seconds();
        if (uz_mm_read(&A, NULL, text, len, 0, NULL) != UZ_OK)
            return 0.0;
        rates[run] = 1e-6 * (double)len / (seconds() - start);
        uz_csc_clear(&A);
    }
    qsort(rates, RUNS, sizeof rates[0], compare);
    return rates[RUNS / 2];
}

double bench_mm_rate(void)
{
    uz_csc A = {0};
    char *text = NULL;
    size_t len = 0;
    double rate = 0.0;
    FILE *out = open_memstream(&text, &len);
    if (out && banded(&A) == UZ_OK)
        mm_put_matrix(out, &A, UZ_MM_SYMMETRIC);
    if (out && fclose(out) == 0 && A.ptr)
        rate = median_read_rate(text, len);
    free(text);
    uz_csc_clear(&A);
    return rate;
}
