/* Matrices and vectors as Matrix Market text that reads back bit for bit. */
#include "uzawa.h"

#include "core/error.h"
#include "text/buffer.h"

#include <math.h>

/* The longest line: two 19-digit numbers, a double of 24 characters, two blanks, LF and NUL. */
enum { LINE_ROOM = 40 + UZ_DOUBLE_ROOM };

uz_status uz_mm_write(char **text, size_t *len, const uz_csc *A, uz_mm_symmetry symmetry, uz_error *err)
{
    uz_buffer out = {0};
    char line[LINE_ROOM];
    const bool lower = symmetry == UZ_MM_SYMMETRIC;
    uz_status status = UZ_OK;
    *text = NULL;
    *len = 0;
    uz_error_reset(err);
    if (lower && A->rows != A->cols)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a symmetric matrix is square");
    uz_buffer_print(&out, "%%%%MatrixMarket matrix coordinate real %s\n%lld %lld %lld\n",
                    lower ? "symmetric" : "general", (long long)A->rows, (long long)A->cols,
                    (long long)(A->ptr ? A->ptr[A->cols] : 0));
    for (int64_t j = 0; status == UZ_OK && A->ptr && j < A->cols; j++)
        for (int64_t k = A->ptr[j]; status == UZ_OK && !out.failed && k < A->ptr[j + 1]; k++) {
            const int64_t row = A->idx[k];
            if (lower && row < j)
                status =
                    uz_fail(err, UZ_ERR_ARGUMENT, "", "a symmetric matrix is written from its lower triangle only");
            else if (!isfinite(A->val[k]))
                status = uz_fail(err, UZ_ERR_NOT_FINITE, "",
                                 "entry (%lld, %lld) is not a finite number and cannot be written", (long long)row + 1,
                                 (long long)j + 1);
            if (status != UZ_OK)
                break;
            size_t used = uz_format_integer(line, (uint64_t)row + 1);
            line[used++] = ' ';
            used += uz_format_integer(line + used, (uint64_t)j + 1);
            line[used++] = ' ';
            used += uz_format_double(line + used, A->val[k]);
            line[used++] = '\n';
            uz_buffer_put(&out, line, used);
        }
    if (status == UZ_OK)
        return uz_buffer_finish(text, len, &out, err);
    uz_buffer_drop(&out);
    return status;
}

uz_status uz_mm_write_vector(char **text, size_t *len, const double *x, int64_t n, uz_error *err)
{
    uz_buffer out = {0};
    char line[LINE_ROOM];
    *text = NULL;
    *len = 0;
    uz_error_reset(err);
    if (n < 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a vector cannot have a negative length");
    uz_buffer_print(&out, "%%%%MatrixMarket matrix array real general\n%lld 1\n", (long long)n);
    for (int64_t i = 0; i < n && !out.failed; i++) {
        if (!isfinite(x[i])) {
            uz_buffer_drop(&out);
            return uz_fail(err, UZ_ERR_NOT_FINITE, "", "number %lld is not finite and cannot be written",
                           (long long)i + 1);
        }
        size_t used = uz_format_double(line, x[i]);
        line[used++] = '\n';
        uz_buffer_put(&out, line, used);
    }
    return uz_buffer_finish(text, len, &out, err);
}
