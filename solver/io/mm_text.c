/* Lines, words and numbers of a Matrix Market text, and what to say where one is wrong. */
#include "io/mm_text.h"

#include "core/error.h"

#include <math.h>
#include <string.h>
#include <strings.h>

enum { SHOWN = 32 };

/* The word at the current place, for a message: cut short, and with anything but printable ASCII as '?'. */
static void copy_word(char word[SHOWN + 4], const mm_text *text)
{
    size_t length = 0;
    const char *at = text->at;
    while (at < text->end && length < SHOWN && !mm_is_blank(*at) && *at != '\n') {
        word[length++] = *at > ' ' && *at <= '~' ? *at : '?';
        at++;
    }
    bool more = length == SHOWN && at < text->end && !mm_is_blank(*at) && *at != '\n';
    strcpy(word + length, more ? "..." : "");
}

uz_status mm_fail(const mm_text *text, const char *what, const char *remedy)
{
    char word[SHOWN + 4];
    copy_word(word, text);
    if (text->at == text->end)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "%s, but the text ends; %s", what, remedy);
    if (!word[0])
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "%s, but the line ends; %s", what, remedy);
    if (word[0] == '?' && *text->at == '\r')
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "%s, but there is a carriage return; %s", what,
                            remedy);
    return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "%s, found \"%s\"; %s", what, word, remedy);
}

/* Takes LF or CR LF. A CR at the very end of the text counts as an end of line that was cut. */
static bool take_newline(mm_text *text)
{
    const char *at = text->at;
    if (at < text->end && *at == '\r')
        at++;
    if (at == text->end) {
        text->at = at;
        return true;
    }
    if (*at != '\n')
        return false;
    text->at = at + 1;
    text->line++;
    return true;
}

uz_status mm_next_line(mm_text *text, bool *found)
{
    *found = false;
    for (;;) {
        mm_skip_blanks(text);
        if (text->at == text->end)
            return UZ_OK;
        if (*text->at == '%') {
            const char *newline = memchr(text->at, '\n', (size_t)(text->end - text->at));
            const char *stop = newline ? newline : text->end;
            if (memchr(text->at, '\0', (size_t)(stop - text->at)))
                return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line, "a NUL byte in a comment; send text only");
            text->at = stop;
        } else if (!take_newline(text)) {
            *found = true;
            return UZ_OK;
        }
    }
}

uz_status mm_end_line(mm_text *text)
{
    mm_skip_blanks(text);
    if (take_newline(text))
        return UZ_OK;
    if (*text->at == '\r')
        return mm_fail(text, "the end of the line was expected", "end lines with LF or CR LF");
    return mm_fail(text, "the end of the line was expected", "write one entry per line and nothing after it");
}

int64_t mm_last_line(const mm_text *text)
{
    int64_t line = text->line;
    const char *at = text->at;
    while (at < text->end && (at = memchr(at, '\n', (size_t)(text->end - at))) != NULL) {
        line++;
        at++;
    }
    return line > 1 && text->end[-1] == '\n' ? line - 1 : line;
}

int64_t mm_long_count(mm_text *text)
{
    const char *start = text->at;
    int64_t value = 0;
    for (; text->at < text->end && mm_is_digit(*text->at); text->at++) {
        if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, *text->at - '0', &value))
            value = INT64_MAX;
    }
    return text->at == start ? -1 : value;
}

uz_status mm_read_value(mm_text *text, bool integer, double *value)
{
    const char *start = text->at;
    size_t used = uz_parse_double(value, start, (size_t)(text->end - start));
    bool whole = true;
    for (size_t k = integer && used > 0 && (*start == '-' || *start == '+'); integer && k < used; k++)
        whole = whole && mm_is_digit(start[k]);
    text->at += used;
    const bool number = used > 0 && mm_word_ends(text) && whole;
    if (number && isfinite(*value))
        return UZ_OK;
    text->at = start;
    /* What C programs print for values that are no numbers: a sign, then nan, nan(...), inf or infinity. */
    mm_text end = *text;
    if (end.at < end.end && (*end.at == '-' || *end.at == '+'))
        end.at++;
    const char *word = end.at;
    while (!mm_word_ends(&end))
        end.at++;
    const size_t length = (size_t)(end.at - word);
    char shown[SHOWN + 4];
    copy_word(shown, text);
    if (number || (length == 3 && (strncasecmp(word, "nan", 3) == 0 || strncasecmp(word, "inf", 3) == 0)) ||
        (length == 8 && strncasecmp(word, "infinity", 8) == 0) || (length > 4 && strncasecmp(word, "nan(", 4) == 0))
        return uz_fail_line(text->err, UZ_ERR_NOT_FINITE, text->line,
                            "\"%s\" is not a finite double; every value must be a number below 1.8e308 in size", shown);
    return mm_fail(text, integer ? "a whole number was expected" : "a number was expected",
                   integer ? "write digits only, or say real in the banner" : "write it like -1.5e-3");
}

uz_status mm_expect_end(mm_text *text, const uz_mm_info *info)
{
    bool found;
    uz_status status = mm_next_line(text, &found);
    if (status == UZ_OK && found)
        status = uz_fail_line(text->err, UZ_ERR_FORMAT, text->line,
                              "more than the %lld entries that the header announces; correct the size line or remove "
                              "the surplus",
                              (long long)info->entries);
    return status;
}

uz_status mm_fail_missing(const mm_text *text, const uz_mm_info *info, int64_t read)
{
    return uz_fail_line(text->err, UZ_ERR_FORMAT, mm_last_line(text),
                        "the text ends after %lld of the %lld entries that the header announces; send all of them or "
                        "correct the size line",
                        (long long)read, (long long)info->entries);
}
