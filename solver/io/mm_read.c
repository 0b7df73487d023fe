/* Matrix Market text as a matrix or a vector. */
#include "io/mm_text.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Without a limit from the caller an almost empty matrix may still take this much, and this much per byte of text,
 * for its column starts: enough for contact normals of 10^8 dofs in one line, and no way to ask for all memory. */
static const int64_t FREE_BYTES = INT64_C(1) << 30;
static const int64_t BYTES_PER_TEXT_BYTE = 64;

/* The shortest lines: "1 1 1" and "1", each with its end. */
enum { COORDINATE_LINE = 6, ARRAY_LINE = 2 };

/* How many entries to make room for: no more than are announced, and no more than the rest of the text can hold.
 * UZ_ERR_LIMIT: these, of 16 bytes each, and `slots` starts or numbers of 8 bytes may not be allocated for this text.
 */
static uz_status make_room(int64_t *room, const mm_text *text, const uz_mm_info *info, int64_t slots, size_t len,
                           size_t max_bytes)
{
    const int64_t line = info->format == UZ_MM_COORDINATE ? COORDINATE_LINE : ARRAY_LINE;
    const int64_t most = (int64_t)(text->end - text->at) / line + 1; /* the last line may lack its end */
    int64_t dense, bytes;
    *room = info->entries < most ? info->entries : most;
    if (slots >= 0 && !__builtin_mul_overflow(slots, 8, &dense) && !__builtin_add_overflow(dense, 16 * *room, &bytes) &&
        (max_bytes > 0 ? (uint64_t)bytes <= max_bytes : dense <= FREE_BYTES + BYTES_PER_TEXT_BYTE * (int64_t)len))
        return UZ_OK;
    return uz_fail_line(text->err, UZ_ERR_LIMIT, text->size_line,
                        "a %lld x %lld matrix with %lld entries takes more memory than is allowed here",
                        (long long)info->rows, (long long)info->cols, (long long)info->entries);
}

static uz_status read_body(uz_csc *A, mm_text *text, const uz_mm_info *info, int64_t room)
{
    uz_status status = uz_csc_init(A, info->rows, info->cols, room, text->err);
    if (status == UZ_OK && info->format == UZ_MM_COORDINATE)
        status = mm_read_coordinate(A, text, info, room);
    else if (status == UZ_OK) {
        /* Column by column, all rows or those from the diagonal down; a symmetric array is its lower triangle. */
        int64_t at = 0;
        for (int64_t j = 0; status == UZ_OK && j < A->cols; j++) {
            for (int64_t i = info->symmetry == UZ_MM_SYMMETRIC ? j : 0; status == UZ_OK && i < A->rows; i++) {
                double value = 0;
                bool found;
                status = mm_next_line(text, &found);
                if (status == UZ_OK && !found)
                    status = mm_fail_missing(text, info, at);
                if (status == UZ_OK)
                    status = mm_read_value(text, info->integer, &value);
                if (status == UZ_OK)
                    status = mm_end_line(text);
                if (status == UZ_OK && at == room)
                    status = uz_fail(text->err, UZ_ERR_INTERNAL, "", "more entries than the text has room for");
                if (status != UZ_OK)
                    break;
                A->idx[at] = i;
                A->val[at++] = value;
            }
            A->ptr[j + 1] = at;
        }
        if (status == UZ_OK)
            status = mm_expect_end(text, info);
    }
    if (status != UZ_OK)
        uz_csc_clear(A);
    return status;
}

static mm_text start_of(const char *text, size_t len, uz_error *err)
{
    const char *first = text ? text : ""; /* no bytes may come without an address */
    uz_error_reset(err);
    return (mm_text){.at = first, .end = first + len, .line = 1, .err = err};
}

uz_status uz_mm_read(uz_csc *out, uz_mm_info *info, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    mm_text t = start_of(text, len, err);
    uz_mm_info head = {0};
    uz_csc A = {0};
    memset(out, 0, sizeof *out);
    if (info)
        *info = head;
    uz_status status = mm_read_header(&t, &head);
    if (status != UZ_OK)
        return status;
    int64_t room;
    status = make_room(&room, &t, &head, head.cols + 1, len, max_bytes);
    if (status == UZ_OK)
        status = read_body(&A, &t, &head, room);
    if (status != UZ_OK)
        return status;
    *out = A;
    if (info)
        *info = head;
    return UZ_OK;
}

uz_status uz_mm_read_vector(double **out, int64_t *n, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    mm_text t = start_of(text, len, err);
    uz_mm_info head = {0};
    uz_csc A = {0};
    *out = NULL;
    *n = 0;
    uz_status status = mm_read_header(&t, &head);
    if (status != UZ_OK)
        return status;
    if (head.rows != 1 && head.cols != 1)
        return uz_fail_line(err, UZ_ERR_SIZE, t.size_line,
                            "a vector was expected, this matrix is %lld x %lld; send n x 1 or 1 x n",
                            (long long)head.rows, (long long)head.cols);
    const int64_t size = head.cols == 1 ? head.rows : head.cols, numbers = head.format == UZ_MM_COORDINATE ? size : 0;
    int64_t wanted, room;
    if (__builtin_add_overflow(head.cols, 1, &wanted) || __builtin_add_overflow(wanted, numbers, &wanted))
        wanted = -1;
    status = make_room(&room, &t, &head, wanted, len, max_bytes);
    if (status == UZ_OK)
        status = read_body(&A, &t, &head, room);
    if (status != UZ_OK)
        return status;
    /* The numbers of a matrix of one row or one column; an array's values are taken as they are. */
    double *x = A.val;
    if (head.format == UZ_MM_ARRAY) {
        A.val = NULL;
    } else {
        x = uz_alloc_zero(size, sizeof *x);
        for (int64_t j = 0; x && j < A.cols; j++)
            for (int64_t k = A.ptr[j]; k < A.ptr[j + 1]; k++)
                x[A.cols == 1 ? A.idx[k] : j] = A.val[k];
    }
    uz_csc_clear(&A);
    if (!x)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a vector of %lld numbers", (long long)size);
    *out = x;
    *n = size;
    return UZ_OK;
}
