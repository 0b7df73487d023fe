/* Compressed sparse columns: making them and multiplying with them. Everything here is O(entries + rows + cols). */
#include "uzawa.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <stdlib.h>
#include <string.h>

size_t uz_csc_bytes(const uz_csc *A)
{
    return A->ptr ? 8 * (size_t)(A->cols + 1) + 12 * (size_t)A->ptr[A->cols] : 0;
}

uz_status uz_csc_init(uz_csc *A, int64_t rows, int64_t cols, int64_t nnz, uz_error *err)
{
    uz_csc made = {.rows = rows, .cols = cols};
    memset(A, 0, sizeof *A);
    uz_error_reset(err);
    if (rows < 0 || cols < 0 || nnz < 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a matrix cannot have negative sizes");
    if (rows > INT32_MAX)
        return uz_fail(err, UZ_ERR_LIMIT, "", "a matrix of %lld rows: up to 2^31 - 1 are held", (long long)rows);
    if (cols == INT64_MAX)
        return uz_fail(err, UZ_ERR_MEMORY, "", "a matrix of %lld columns does not fit in memory", (long long)cols);
    made.ptr = uz_alloc_zero(cols + 1, sizeof *made.ptr);
    made.idx = uz_alloc_zero(nnz, sizeof *made.idx);
    made.val = uz_alloc_zero(nnz, sizeof *made.val);
    if (!made.ptr || !made.idx || !made.val) {
        uz_csc_clear(&made);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a matrix of %lld columns and %lld entries",
                       (long long)cols, (long long)nnz);
    }
    *A = made;
    return UZ_OK;
}

void uz_csc_clear(uz_csc *A)
{
    if (!A)
        return;
    uz_free_all(A->ptr, A->idx, A->val);
    memset(A, 0, sizeof *A);
}

uz_status uz_csc_copy(uz_csc *out, const uz_csc *A, uz_error *err)
{
    int64_t nnz = A->ptr ? A->ptr[A->cols] : 0; /* a zeroed matrix has no arrays and counts as empty */
    uz_csc made;
    memset(out, 0, sizeof *out);
    uz_status status = uz_csc_init(&made, A->rows, A->cols, nnz, err);
    if (status != UZ_OK)
        return status;
    if (A->ptr)
        memcpy(made.ptr, A->ptr, ((size_t)A->cols + 1) * sizeof *made.ptr);
    if (nnz > 0) {
        memcpy(made.idx, A->idx, (size_t)nnz * sizeof *made.idx);
        memcpy(made.val, A->val, (size_t)nnz * sizeof *made.val);
    }
    *out = made;
    return UZ_OK;
}

/* ptr[1 + k] holds the size of bucket k and ptr[0] = 0. Afterwards ptr[1 + k] is where bucket k starts: filling the
 * buckets with ptr[1 + k]++ then leaves the starts in ptr[k] and the total in ptr[count], without a second array. */
static void counts_to_starts(int64_t *ptr, int64_t count)
{
    int64_t start = 0;
    for (int64_t k = 1; k <= count; k++) {
        int64_t size = ptr[k];
        ptr[k] = start;
        start += size;
    }
}

uz_status uz_csc_transpose(uz_csc *out, const uz_csc *A, uz_error *err)
{
    int64_t nnz = A->ptr ? A->ptr[A->cols] : 0; /* a zeroed matrix has no arrays and counts as empty */
    uz_csc made;
    memset(out, 0, sizeof *out);
    uz_status status = uz_csc_init(&made, A->cols, A->rows, nnz, err);
    if (status != UZ_OK)
        return status;
    for (int64_t k = 0; k < nnz; k++)
        made.ptr[1 + A->idx[k]]++;
    counts_to_starts(made.ptr, A->rows);
    for (int64_t j = 0; nnz > 0 && j < A->cols; j++) {
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            int64_t at = made.ptr[1 + A->idx[k]]++;
            made.idx[at] = (int32_t)j;
            made.val[at] = A->val[k];
        }
    }
    *out = made;
    return UZ_OK;
}

uz_status uz_csc_from_triplets(uz_csc *out, int64_t rows, int64_t cols, int64_t count, const int64_t *row,
                               const int64_t *col, const double *val, uz_error *err)
{
    uz_csc made = {0};
    int64_t *order = NULL, *start = NULL;
    memset(out, 0, sizeof *out);
    uz_error_reset(err);
    if (count < 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a negative number of triplets");
    for (int64_t k = 0; k < count; k++)
        if (row[k] < 0 || row[k] >= rows || col[k] < 0 || col[k] >= cols)
            return uz_fail(err, UZ_ERR_ARGUMENT, "", "triplet %lld at (%lld, %lld) is outside the %lld x %lld matrix",
                           (long long)k, (long long)row[k], (long long)col[k], (long long)rows, (long long)cols);
    uz_status status = uz_csc_init(&made, rows, cols, count, err);
    if (status != UZ_OK || count == 0)
        goto done;
    order = uz_alloc(count, sizeof *order);
    start = rows < INT64_MAX ? uz_alloc_zero(rows + 1, sizeof *start) : NULL;
    if (!order || !start) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to sort %lld entries", (long long)count);
        goto done;
    }
    /* order[0..count) lists the triplets by ascending row, in the order given within a row. start: rows + 1, zero. */
    for (int64_t k = 0; k < count; k++)
        start[1 + row[k]]++;
    counts_to_starts(start, rows);
    for (int64_t k = 0; k < count; k++)
        order[start[1 + row[k]]++] = k;
    for (int64_t k = 0; k < count; k++)
        made.ptr[1 + col[k]]++;
    counts_to_starts(made.ptr, made.cols);
    for (int64_t k = 0; k < count; k++) {
        int64_t at = made.ptr[1 + col[order[k]]]++;
        made.idx[at] = (int32_t)row[order[k]];
        made.val[at] = val[order[k]];
    }
    /* Entries that stand next to each other with the same row are added up; the arrays keep their room. */
    for (int64_t j = 0, to = 0, from = 0; j < cols; j++) {
        const int64_t first = to, end = made.ptr[j + 1];
        for (; from < end; from++) {
            if (to > first && made.idx[to - 1] == made.idx[from]) {
                made.val[to - 1] += made.val[from];
            } else {
                made.idx[to] = made.idx[from];
                made.val[to++] = made.val[from];
            }
        }
        made.ptr[j + 1] = to;
    }
done:
    uz_free_all(order, start);
    if (status == UZ_OK)
        *out = made;
    else
        uz_csc_clear(&made);
    return status;
}

void uz_csc_gaxpy(double *y, const uz_csc *A, double alpha, const double *x)
{
    for (int64_t j = 0; j < A->cols; j++) {
        double factor = alpha * x[j];
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++)
            y[A->idx[k]] += A->val[k] * factor;
    }
}

void uz_csc_gaxpy_t(double *y, const uz_csc *A, double alpha, const double *x)
{
    for (int64_t j = 0; j < A->cols; j++) {
        double sum = 0.0;
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++)
            sum += A->val[k] * x[A->idx[k]];
        y[j] += alpha * sum;
    }
}

void uz_csc_symv(double *y, const uz_csc *A, double alpha, const double *x)
{
    uz_csc_symv_columns(y, A, alpha, x, 0, A->cols);
}

void uz_csc_symv_columns(double *y, const uz_csc *A, double alpha, const double *x, int64_t begin, int64_t end)
{
    for (int64_t j = begin; j < end; j++) {
        double factor = alpha * x[j], sum = 0.0;
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            int64_t i = A->idx[k];
            if (i == j) {
                sum += A->val[k] * x[j];
            } else {
                y[i] += A->val[k] * factor;
                sum += A->val[k] * x[i];
            }
        }
        y[j] += alpha * sum;
    }
}

int64_t uz_csc_seek(const uz_csc *A, int64_t row, int64_t column)
{
    int64_t low = A->ptr[column], left = A->ptr[column + 1] - low;
    while (left > 1) { /* a choice of numbers, not of ways: which half it is cannot be foretold */
        const int64_t half = left / 2;
        low += A->idx[low + half - 1] < row ? half : 0;
        left -= half;
    }
    return low + (left == 1 && A->idx[low] < row);
}

int64_t uz_csc_find(const uz_csc *A, int64_t row, int64_t column)
{
    const int64_t k = uz_csc_seek(A, row, column);
    return k < A->ptr[column + 1] && A->idx[k] == row ? k : -1;
}

bool uz_csc_is_single(const uz_csc *A)
{
    bool *seen = A->ptr[A->cols] == A->rows ? uz_alloc_zero(A->rows, sizeof *seen) : NULL, single = seen != NULL;
    for (int64_t k = 0; single && k < A->rows; k++) {
        single = !seen[A->idx[k]];
        seen[A->idx[k]] = true;
    }
    free(seen);
    return single;
}

bool uz_entries_add(uz_entries *to, int64_t row, int64_t col, double value)
{
    if (to->n == to->room && !to->failed) {
        int64_t room[3] = {to->room, to->room, to->room};
        to->failed = !uz_grow(&to->row, to->n, 1, &room[0], sizeof *to->row) ||
                     !uz_grow(&to->col, to->n, 1, &room[1], sizeof *to->col) ||
                     !uz_grow(&to->val, to->n, 1, &room[2], sizeof *to->val);
        to->room = to->failed ? to->room : room[0];
    }
    if (to->failed)
        return false;
    to->row[to->n] = row;
    to->col[to->n] = col;
    to->val[to->n++] = value;
    return true;
}

uz_status uz_csc_from_entries(uz_csc *out, int64_t rows, int64_t cols, uz_entries *from, uz_error *err)
{
    const uz_status status =
        from->failed ? uz_fail(err, UZ_ERR_MEMORY, "", "no memory for more than %lld entries", (long long)from->n)
                     : uz_csc_from_triplets(out, rows, cols, from->n, from->row, from->col, from->val, err);
    uz_entries_clear(from);
    return status;
}

void uz_entries_clear(uz_entries *entries)
{
    uz_free_all(entries->row, entries->col, entries->val);
    *entries = (uz_entries){.n = 0};
}
