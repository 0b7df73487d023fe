/* Any bytes as Matrix Market text. What is accepted must be written, read back and be the same; what is refused must
 * say on which line, and both readers must agree about the text. */
#include "mm_text.h"

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

static void demand_valid(const uz_csc *A, const uz_mm_info *info)
{
    demand(A->rows == info->rows && A->cols == info->cols && A->ptr[0] == 0 && A->ptr[A->cols] == info->entries);
    for (int64_t j = 0; j < A->cols; j++) {
        int64_t above = info->symmetry == UZ_MM_SYMMETRIC ? j - 1 : -1;
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            demand(A->idx[k] > above && A->idx[k] < A->rows && isfinite(A->val[k]));
            above = A->idx[k];
        }
    }
}

static void demand_refusal(uz_status status, const uz_error *err)
{
    demand(err->status == status && err->message[0] && err->line >= 1);
    demand(status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED || status == UZ_ERR_NOT_FINITE ||
           status == UZ_ERR_LIMIT || status == UZ_ERR_SIZE);
}

static void demand_same_after_writing(const uz_csc *A, const uz_mm_info *info)
{
    char *text;
    size_t len;
    uz_csc back;
    uz_mm_info again;
    FILE *out = open_memstream(&text, &len);
    demand(out != NULL);
    mm_put_matrix(out, A, info->symmetry);
    demand(fclose(out) == 0);
    demand(uz_mm_read(&back, &again, text, len, 0, NULL) == UZ_OK);
    demand_valid(&back, &again);
    size_t nnz = (size_t)info->entries;
    demand(back.rows == A->rows && back.cols == A->cols && again.entries == info->entries);
    demand(memcmp(back.ptr, A->ptr, ((size_t)A->cols + 1) * sizeof *A->ptr) == 0);
    demand(memcmp(back.idx, A->idx, nnz * sizeof *A->idx) == 0);
    demand(memcmp(back.val, A->val, nnz * sizeof *A->val) == 0);
    uz_csc_clear(&back);
    free(text);
}

static void check_vector(const char *text, size_t size, uz_status matrix_status, const uz_mm_info *info)
{
    double *x;
    int64_t n;
    uz_error err;
    uz_status status = uz_mm_read_vector(&x, &n, text, size, MEMORY, &err);
    if (status != UZ_OK)
        demand_refusal(status, &err);
    if (matrix_status == UZ_OK && status == UZ_OK)
        demand(info->rows == 1 || info->cols == 1);
    if (matrix_status == UZ_ERR_FORMAT)
        demand(status != UZ_OK);
    free(x);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *text = (const char *)data;
    uz_csc A;
    uz_mm_info info;
    uz_error err;
    uz_status status = uz_mm_read(&A, &info, text, size, MEMORY, &err);
    if (status == UZ_OK) {
        demand_valid(&A, &info);
        demand_same_after_writing(&A, &info);
    } else {
        demand_refusal(status, &err);
    }
    check_vector(text, size, status, &info);
    uz_csc_clear(&A);
    return 0;
}
