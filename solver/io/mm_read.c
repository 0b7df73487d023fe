/* Matrix Market text as a matrix or a vector.
 * Source: Boisvert, Pozo, Remington, The Matrix Market Exchange Formats: Initial Design, NISTIR 5935 (1996). */
#include "io/mm_text.h"

#include "core/alloc.h"
#include "core/error.h"

#include <string.h>
#include <strings.h>

/* ---- the banner and the size line */

typedef enum { OBJECT_MATRIX, OBJECT_VECTOR } object;
typedef enum { FIELD_REAL, FIELD_INTEGER, FIELD_COMPLEX, FIELD_PATTERN } field;
typedef enum { SYMMETRY_GENERAL, SYMMETRY_SYMMETRIC, SYMMETRY_SKEW, SYMMETRY_HERMITIAN } symmetry;

/* Words in the order of the enums above, and of uz_mm_format. */
static const char *const OBJECTS[] = {"matrix", "vector", NULL};
static const char *const FORMATS[] = {"coordinate", "array", NULL};
static const char *const FIELDS[] = {"real", "integer", "complex", "pattern", NULL};
static const char *const SYMMETRIES[] = {"general", "symmetric", "skew-symmetric", "hermitian", NULL};

static const char BANNER_REMEDY[] = "the first line is %%MatrixMarket matrix, then coordinate or array, then real or "
                                    "integer, then general or symmetric";

static size_t word_length(const mm_text *text)
{
    mm_text end = *text;
    while (!mm_word_ends(&end))
        end.at++;
    return (size_t)(end.at - text->at);
}

static uz_status read_word(mm_text *text, const char *const *words, const char *what, int *choice)
{
    mm_skip_blanks(text);
    size_t length = word_length(text);
    for (int k = 0; words[k]; k++) {
        if (length == strlen(words[k]) && strncasecmp(text->at, words[k], length) == 0) {
            text->at += length;
            *choice = k;
            return UZ_OK;
        }
    }
    return mm_fail(text, what, BANNER_REMEDY);
}

/* Reads one number of the size line into *size. */
static uz_status read_size(mm_text *text, const char *what, const char *remedy, int64_t *size)
{
    mm_skip_blanks(text);
    const char *start = text->at;
    *size = mm_count(text);
    if (*size < 0 || !mm_word_ends(text)) {
        text->at = start;
        return mm_fail(text, what, remedy);
    }
    if (*size == INT64_MAX)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "a size beyond the 63-bit integers; correct it");
    return UZ_OK;
}

static uz_status check_sizes(const mm_text *text, uz_mm_info *info)
{
    /* How many entries the shape can hold, at most INT64_MAX; for an array exactly as many are written. */
    const bool triangle = info->symmetry != UZ_MM_GENERAL, even = info->rows % 2 == 0;
    const int64_t half = triangle && even ? info->rows / 2 : info->rows;
    const int64_t other = !triangle ? info->cols : even ? info->rows + 1 : info->rows / 2 + 1;
    int64_t most;
    if (__builtin_mul_overflow(half, other, &most))
        most = INT64_MAX;
    if (info->symmetry == UZ_MM_SYMMETRIC && info->rows != info->cols)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line,
                            "a symmetric matrix is square, but this is %lld x %lld; correct the sizes or say general",
                            (long long)info->rows, (long long)info->cols);
    if (info->format == UZ_MM_ARRAY)
        info->entries = most;
    if (info->entries > most)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line,
                            "%lld entries announced, but a %lld x %lld %s matrix has only %lld places and each may be "
                            "written once; correct the size line",
                            (long long)info->entries, (long long)info->rows, (long long)info->cols,
                            SYMMETRIES[info->symmetry], (long long)most);
    return UZ_OK;
}

/* The banner and the size line. Leaves *text behind the size line. On success info->entries is what the text must
 * hold, checked against the shape but not against the length of the text. */
static uz_status read_header(mm_text *text, uz_mm_info *info)
{
    static const char TAG[] = "%%MatrixMarket";
    struct {
        int object, format, field, symmetry;
    } b = {0};
    bool found = false;
    if (word_length(text) != sizeof TAG - 1 || strncasecmp(text->at, TAG, sizeof TAG - 1) != 0)
        return mm_fail(text, "this is not a Matrix Market text: %%MatrixMarket was expected", BANNER_REMEDY);
    text->at += sizeof TAG - 1;
    uz_status status = read_word(text, OBJECTS, "the banner's object must be matrix", &b.object);
    if (status == UZ_OK)
        status = read_word(text, FORMATS, "the banner's format must be coordinate or array", &b.format);
    if (status == UZ_OK)
        status = read_word(text, FIELDS, "the banner's field must be real or integer", &b.field);
    if (status == UZ_OK)
        status = read_word(text, SYMMETRIES, "the banner's symmetry must be general or symmetric", &b.symmetry);
    if (status != UZ_OK)
        return status;
    /* The report's table of kinds: a pattern has no values to fill an array or to change sign; only a complex matrix
     * can differ from its conjugate. */
    const bool exists = b.field == FIELD_PATTERN ? b.format == UZ_MM_COORDINATE && b.symmetry <= SYMMETRY_SYMMETRIC
                                                 : b.symmetry != SYMMETRY_HERMITIAN || b.field == FIELD_COMPLEX;
    const char *unsupported = b.object != OBJECT_MATRIX         ? OBJECTS[b.object]
                              : b.field > FIELD_INTEGER         ? FIELDS[b.field]
                              : b.symmetry > SYMMETRY_SYMMETRIC ? SYMMETRIES[b.symmetry]
                                                                : NULL;
    if (!exists)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "there is no %s %s %s matrix; %s", FORMATS[b.format],
                            FIELDS[b.field], SYMMETRIES[b.symmetry], BANNER_REMEDY);
    if (unsupported)
        return uz_fail_line(text->err, UZ_ERR_UNSUPPORTED, text->line,
                            "%s is not supported here; send a real or integer, general or symmetric matrix (a vector "
                            "as a matrix of one column)",
                            unsupported);
    status = mm_end_line(text);
    if (status == UZ_OK)
        status = mm_next_line(text, &found);
    if (status != UZ_OK)
        return status;
    if (!found)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, mm_last_line(text),
                            "the text ends before the size line; it follows the banner and the comments");
    *info = (uz_mm_info){
        .format = (uz_mm_format)b.format, .symmetry = (uz_mm_symmetry)b.symmetry, .integer = b.field == FIELD_INTEGER};
    text->size_line = text->line;
    const bool coordinate = info->format == UZ_MM_COORDINATE;
    const char *remedy = coordinate ? "the size line of a coordinate text is ROWS COLUMNS ENTRIES"
                                    : "the size line of an array text is ROWS COLUMNS";
    status = read_size(text, "a number of rows was expected", remedy, &info->rows);
    if (status == UZ_OK)
        status = read_size(text, "a number of columns was expected", remedy, &info->cols);
    if (status == UZ_OK && coordinate)
        status = read_size(text, "a number of entries was expected", remedy, &info->entries);
    if (status == UZ_OK)
        status = check_sizes(text, info); /* names the size line, so before the end of it is taken */
    return status == UZ_OK ? mm_end_line(text) : status;
}

/* ---- the whole */

/* Without a limit from the caller an almost empty matrix may still take this much, and this much per byte of text,
 * for its column starts: enough for contact normals of 10^8 dofs in one line, and no way to ask for all memory. */
static const int64_t FREE_BYTES = INT64_C(1) << 30;
static const int64_t BYTES_PER_TEXT_BYTE = 64;

/* The shortest lines: "1 1 1" and "1", each with its end. */
enum { COORDINATE_LINE = 6, ARRAY_LINE = 2 };

/* How many entries to make room for: no more than are announced, and no more than the rest of the text can hold.
 * UZ_ERR_LIMIT: these, of at most 16 bytes each, and `slots` starts or numbers of 8 bytes may not be allocated for this
 * text, or a uz_csc does not hold so many rows. */
static uz_status make_room(int64_t *room, const mm_text *text, const uz_mm_info *info, int64_t slots, size_t len,
                           size_t max_bytes)
{
    const int64_t line = info->format == UZ_MM_COORDINATE ? COORDINATE_LINE : ARRAY_LINE;
    const int64_t most = (int64_t)(text->end - text->at) / line + 1; /* the last line may lack its end */
    int64_t dense, bytes;
    if (info->rows > INT32_MAX)
        return uz_fail_line(text->err, UZ_ERR_LIMIT, text->size_line, "a matrix of %lld rows: up to 2^31 - 1 are held",
                            (long long)info->rows);
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
                A->idx[at] = (int32_t)i;
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

uz_status uz_mm_read(uz_csc *out, uz_mm_info *info, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    const char *first = text ? text : ""; /* no bytes may come without an address */
    mm_text t = {.at = first, .end = first + len, .line = 1, .err = err};
    uz_mm_info head = {0};
    uz_csc A = {0};
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    if (info)
        *info = head;
    uz_status status = read_header(&t, &head);
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
    const char *first = text ? text : ""; /* no bytes may come without an address */
    mm_text t = {.at = first, .end = first + len, .line = 1, .err = err};
    uz_mm_info head = {0};
    uz_csc A = {0};
    uz_error_reset(err);
    *out = NULL;
    *n = 0;
    uz_status status = read_header(&t, &head);
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
