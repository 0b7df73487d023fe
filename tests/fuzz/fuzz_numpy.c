/* Any bytes as a file of NumPy's. What is accepted must be in range, and be the same where it is written and read
 * again; what is refused must say why. */
#include "io/numpy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 1 << 24 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool condition)
{
    if (!condition)
        abort();
}

static void demand_refusal(uz_status status, const uz_error *err)
{
    demand(err->status == status && err->message[0] && strcmp(err->where, "/numpy") == 0);
    demand(status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED || status == UZ_ERR_NOT_FINITE ||
           status == UZ_ERR_LIMIT || status == UZ_ERR_SIZE);
}

static void check_matrix(const char *file, size_t size)
{
    uz_csc A;
    uz_mm_symmetry symmetry;
    uz_error err;
    const uz_status status = uz_matrix_read(&A, &symmetry, file, size, MEMORY, &err);
    if (status != UZ_OK) {
        demand_refusal(status, &err);
        demand(!A.ptr);
        return;
    }
    for (int64_t j = 0; j < A.cols; j++)
        for (int64_t k = A.ptr[j]; k < A.ptr[j + 1]; k++)
            demand(A.idx[k] >= 0 && A.idx[k] < A.rows && (k == A.ptr[j] || A.idx[k] > A.idx[k - 1]));
    uz_csc_clear(&A);
}

static void check_vector(const char *file, size_t size)
{
    double *x, *back;
    char *again;
    size_t len;
    int64_t n, n_back;
    int columns;
    uz_error err;
    const uz_status status = uz_vector_read(&x, &n, &columns, file, size, MEMORY, &err);
    if (status != UZ_OK) {
        demand_refusal(status, &err);
        demand(!x && n == 0);
        return;
    }
    for (int64_t i = 0; i < n; i++)
        demand(isfinite(x[i]));
    demand(columns == 0 || n % columns == 0);
    const uz_npz_array list[] = {
        {.name = "x", .x = x, .rows = n / (columns > 0 ? columns : 1), .columns = columns},
    };
    demand(uz_npz_write(&again, &len, list, 1, NULL) == UZ_OK);
    demand(uz_vector_read(&back, &n_back, &columns, again, len, 0, NULL) == UZ_OK && n_back == n);
    demand(memcmp(back, x, (size_t)n * sizeof *x) == 0);
    free(x);
    free(back);
    free(again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *file = (const char *)data;
    if (!npy_recognises(file, size) && !npz_recognises(file, size))
        return -1;
    check_matrix(file, size);
    check_vector(file, size);
    return 0;
}
