/* The banner and the size line of a Matrix Market text.
 * Source: Boisvert, Pozo, Remington, The Matrix Market Exchange Formats: Initial Design, NISTIR 5935 (1996). */
#include "io/mm_text.h"

#include "core/error.h"

#include <string.h>
#include <strings.h>

typedef enum { OBJECT_MATRIX, OBJECT_VECTOR } object;
typedef enum { FIELD_REAL, FIELD_INTEGER, FIELD_COMPLEX, FIELD_PATTERN } field;
typedef enum { SYMMETRY_GENERAL, SYMMETRY_SYMMETRIC, SYMMETRY_SKEW, SYMMETRY_HERMITIAN } symmetry;

/* Words in the order of the enums above, and of uz_mm_format. */
static const char *const OBJECTS[] = {"matrix", "vector", NULL};
static const char *const FORMATS[] = {"coordinate", "array", NULL};
static const char *const FIELDS[] = {"real", "integer", "complex", "pattern", NULL};
static const char *const SYMMETRIES[] = {"general", "symmetric", "skew-symmetric", "hermitian", NULL};

typedef struct {
    int object, format, field, symmetry;
} banner;

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

/* The report's table of kinds: a pattern has no values to fill an array or to change sign; only a complex matrix can
 * differ from its conjugate. */
static uz_status check_banner(const mm_text *text, const banner *b)
{
    const bool exists = b->field == FIELD_PATTERN ? b->format == UZ_MM_COORDINATE && b->symmetry <= SYMMETRY_SYMMETRIC
                                                  : b->symmetry != SYMMETRY_HERMITIAN || b->field == FIELD_COMPLEX;
    const char *unsupported = b->object != OBJECT_MATRIX         ? OBJECTS[b->object]
                              : b->field > FIELD_INTEGER         ? FIELDS[b->field]
                              : b->symmetry > SYMMETRY_SYMMETRIC ? SYMMETRIES[b->symmetry]
                                                                 : NULL;
    if (!exists)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "there is no %s %s %s matrix; %s", FORMATS[b->format],
                            FIELDS[b->field], SYMMETRIES[b->symmetry], BANNER_REMEDY);
    if (unsupported)
        return uz_fail_line(text->err, UZ_ERR_UNSUPPORTED, text->line,
                            "%s is not supported here; send a real or integer, general or symmetric matrix (a vector "
                            "as a matrix of one column)",
                            unsupported);
    return UZ_OK;
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

uz_status mm_read_header(mm_text *text, uz_mm_info *info)
{
    static const char TAG[] = "%%MatrixMarket";
    banner b = {0};
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
    if (status == UZ_OK)
        status = check_banner(text, &b);
    if (status == UZ_OK)
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
