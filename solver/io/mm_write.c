/* Matrices and vectors as Matrix Market text that reads back bit for bit. */
#include "uzawa.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Text that grows; bytes == NULL after a failed growth. */
typedef struct {
    char *bytes;
    size_t length, capacity;
} sheet;

/* The longest line: two 19-digit numbers, a double of 24 characters, two blanks, LF and NUL. */
enum { LINE_ROOM = 40 + UZ_DOUBLE_ROOM };

static bool sheet_room(sheet *s, size_t more)
{
    if (s->bytes && s->capacity - s->length >= more)
        return true;
    size_t capacity = s->capacity + s->capacity / 2 + more;
    char *grown = uz_realloc(s->bytes, (int64_t)capacity, 1);
    if (!grown)
        return false;
    s->bytes = grown;
    s->capacity = capacity;
    return true;
}

static void put_count(sheet *s, int64_t value)
{
    s->length += uz_format_integer(s->bytes + s->length, (uint64_t)value);
}

static void put_number(sheet *s, double value)
{
    s->length += uz_format_double(s->bytes + s->length, value);
}

static void put_text(sheet *s, const char *text)
{
    size_t length = strlen(text);
    memcpy(s->bytes + s->length, text, length);
    s->length += length;
}

static uz_status no_memory(uz_error *err)
{
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to write a Matrix Market text");
}

static uz_status put_entry(sheet *s, int64_t row, int64_t col, double value, uz_error *err)
{
    if (!isfinite(value))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "", "entry (%lld, %lld) is not a finite number and cannot be written",
                       (long long)row + 1, (long long)col + 1);
    if (!sheet_room(s, LINE_ROOM))
        return no_memory(err);
    put_count(s, row + 1);
    put_text(s, " ");
    put_count(s, col + 1);
    put_text(s, " ");
    put_number(s, value);
    put_text(s, "\n");
    return UZ_OK;
}

static uz_status put_header(sheet *s, const char *banner, int64_t rows, int64_t cols, int64_t entries, uz_error *err)
{
    if (!sheet_room(s, strlen(banner) + LINE_ROOM))
        return no_memory(err);
    put_text(s, banner);
    put_count(s, rows);
    put_text(s, " ");
    put_count(s, cols);
    if (entries >= 0) {
        put_text(s, " ");
        put_count(s, entries);
    }
    put_text(s, "\n");
    return UZ_OK;
}

/* Ends the text with a NUL and hands it over, or frees it if there was a failure. */
static uz_status publish(sheet *s, uz_status status, char **text, size_t *len, uz_error *err)
{
    if (status == UZ_OK && !sheet_room(s, 1))
        status = no_memory(err);
    if (status != UZ_OK) {
        free(s->bytes);
        return status;
    }
    s->bytes[s->length] = '\0';
    *text = s->bytes;
    *len = s->length;
    return UZ_OK;
}

static uz_status put_column(sheet *s, const uz_csc *A, int64_t j, bool lower, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t k = A->ptr[j]; status == UZ_OK && k < A->ptr[j + 1]; k++) {
        if (lower && A->idx[k] < j)
            return uz_fail(err, UZ_ERR_ARGUMENT, "", "a symmetric matrix is written from its lower triangle only");
        status = put_entry(s, A->idx[k], j, A->val[k], err);
    }
    return status;
}

uz_status uz_mm_write(char **text, size_t *len, const uz_csc *A, uz_mm_symmetry symmetry, uz_error *err)
{
    sheet s = {0};
    bool lower = symmetry == UZ_MM_SYMMETRIC;
    *text = NULL;
    *len = 0;
    uz_error_reset(err);
    if (lower && A->rows != A->cols)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a symmetric matrix is square");
    uz_status status = put_header(&s,
                                  lower ? "%%MatrixMarket matrix coordinate real symmetric\n"
                                        : "%%MatrixMarket matrix coordinate real general\n",
                                  A->rows, A->cols, A->ptr ? A->ptr[A->cols] : 0, err);
    for (int64_t j = 0; status == UZ_OK && A->ptr && j < A->cols; j++)
        status = put_column(&s, A, j, lower, err);
    return publish(&s, status, text, len, err);
}

uz_status uz_mm_write_vector(char **text, size_t *len, const double *x, int64_t n, uz_error *err)
{
    sheet s = {0};
    *text = NULL;
    *len = 0;
    uz_error_reset(err);
    if (n < 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a vector cannot have a negative length");
    uz_status status = put_header(&s, "%%MatrixMarket matrix array real general\n", n, 1, -1, err);
    for (int64_t i = 0; status == UZ_OK && i < n; i++) {
        if (!isfinite(x[i])) {
            status = uz_fail(err, UZ_ERR_NOT_FINITE, "", "number %lld is not finite and cannot be written",
                             (long long)i + 1);
        } else if (!sheet_room(&s, LINE_ROOM)) {
            status = no_memory(err);
        } else {
            put_number(&s, x[i]);
            put_text(&s, "\n");
        }
    }
    return publish(&s, status, text, len, err);
}
