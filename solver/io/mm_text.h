/* mm_text.h: a Matrix Market text while it is read, line by line. Private to the reader.
 *
 * Rules for lines, after NISTIR 5935 and the practice of the collections written in it: a line ends with LF, CR LF or
 * the end of the text; blanks are space and tab; a line whose first non-blank is % is a comment; comments and empty
 * lines may stand anywhere after the banner. The reader accepts lines longer than the report's 1024 characters. */
#ifndef UZ_LINALG_MM_TEXT_H
#define UZ_LINALG_MM_TEXT_H

#include "uzawa.h"

typedef struct {
    const char *at, *end;
    int64_t line;      /* 1-based, of `at` */
    int64_t size_line; /* of the size line, once it was read */
    uz_error *err;
} mm_text;

/* Fails at the current line; the message is `what`, the offending word and `remedy`. */
uz_status mm_fail(const mm_text *text, const char *what, const char *remedy);

/* Moves to the first word of the next line that has one; *found is false at the end of the text. */
uz_status mm_next_line(mm_text *text, bool *found);
/* Requires that nothing but blanks follows on this line, and moves behind its end. */
uz_status mm_end_line(mm_text *text);
/* The last line of the whole text: where a person looks for what is missing. */
int64_t mm_last_line(const mm_text *text);

/* A decimal count without a sign: -1 if there is none here, INT64_MAX if it is larger than that. */
int64_t mm_long_count(mm_text *text);

static inline bool mm_is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static inline bool mm_is_digit(char c)
{
    return (unsigned char)(c - '0') <= 9;
}

static inline void mm_skip_blanks(mm_text *text)
{
    while (text->at < text->end && mm_is_blank(*text->at))
        text->at++;
}

/* True where a word ends. A lone CR is found by mm_end_line. */
static inline bool mm_word_ends(const mm_text *text)
{
    return text->at == text->end || mm_is_blank(*text->at) || *text->at == '\n' || *text->at == '\r';
}

/* mm_long_count for the common short number. */
static inline int64_t mm_count(mm_text *text)
{
    const char *at = text->at, *limit = text->end - at > 18 ? at + 18 : text->end;
    int64_t value = 0;
    while (at < limit && mm_is_digit(*at))
        value = 10 * value + (*at++ - '0');
    if (at == text->at || (at < text->end && mm_is_digit(*at)))
        return mm_long_count(text);
    text->at = at;
    return value;
}

/* One number where a value must stand: finite, and whole if `integer`. */
uz_status mm_read_value(mm_text *text, bool integer, double *value);

/* The data lines of a coordinate text, up to the end of the text. A is an all-zero matrix of the announced shape with
 * arrays for `room` entries, which is at least as many as the text can hold or as the header announces. */
uz_status mm_read_coordinate(uz_csc *A, mm_text *text, const uz_mm_info *info, int64_t room);

/* After the last entry nothing but comments and empty lines may follow. */
uz_status mm_expect_end(mm_text *text, const uz_mm_info *info);
/* The text ended after `read` entries. */
uz_status mm_fail_missing(const mm_text *text, const uz_mm_info *info, int64_t read);

#endif
