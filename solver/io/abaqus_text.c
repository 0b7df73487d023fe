/* abaqus_text.c: lines, keywords and fields of an input file of Abaqus or CalculiX. */
#include "io/abaqus.h"

#include "core/error.h"
#include "text/utf8.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

uz_status abaqus_fail(const abaqus_text *text, uz_status status, const char *format, ...)
{
    char message[400];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    return uz_fail_line(text->err, status, text->number > 0 ? text->number : 1, "%s", message);
}

/* ---- lines */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

bool abaqus_next_line(abaqus_text *text)
{
    while (text->at < text->end) {
        const char *from = text->at, *newline = memchr(from, '\n', (size_t)(text->end - from));
        const char *to = newline ? newline : text->end;
        text->at = newline ? newline + 1 : text->end;
        text->number++;
        while (from < to && is_blank(*from))
            from++;
        while (to > from && is_blank(to[-1]))
            to--;
        if (from == to || (to - from >= 2 && from[0] == '*' && from[1] == '*'))
            continue;
        text->line = from;
        text->length = (size_t)(to - from);
        text->taken = 0;
        return true;
    }
    text->line = "";
    text->length = text->taken = 0;
    return false;
}

/* What shows in a message of bytes that may be anything. */
static const char *shown(char out[28], const char *from, size_t length)
{
    size_t used = 0;
    for (; used < length && used < 24; used++)
        out[used] = from[used] >= ' ' && from[used] <= '~' ? from[used] : '?';
    out[used] = '\0';
    return out;
}

/* ---- keywords */

/* Adds the fields of a line, without blanks around them and around "="; names in capitals. */
static bool add_fields(abaqus_keyword *to, const char *from, const char *end)
{
    bool value = false, quoted = false;
    for (; from < end; from++) {
        const char c = *from;
        const bool at_start = to->length == 0 || to->text[to->length - 1] == '\0' || to->text[to->length - 1] == '=';
        if (to->length + 2 >= sizeof to->text || c == '\0')
            return false;
        if (c == '"') {
            quoted = !quoted;
        } else if (!quoted && (c == ',' || c == '=')) {
            while (to->length > 0 && to->text[to->length - 1] == ' ')
                to->length--;
            to->text[to->length++] = c == '=' ? '=' : '\0';
            value = c == '=';
        } else if (quoted || !is_blank(c)) {
            to->text[to->length++] = value ? c : (char)toupper((unsigned char)c);
        } else if (!at_start && to->text[to->length - 1] != ' ') {
            to->text[to->length++] = ' ';
        }
    }
    to->text[to->length] = '\0';
    return !quoted;
}

uz_status abaqus_read_keyword(abaqus_keyword *out, abaqus_text *text)
{
    char word[28];
    bool more = true;
    *out = (abaqus_keyword){.line = text->number};
    for (const char *from = text->line + 1; more; from = text->line) {
        more = text->line[text->length - 1] == ',';
        if (!add_fields(out, from, text->line + text->length))
            return abaqus_fail(text, UZ_ERR_FORMAT, "the keyword \"%s\" has an open quote, a NUL or more than %d bytes",
                               shown(word, text->line, text->length), ABAQUS_KEYWORD - 2);
        if (more && !abaqus_next_line(text))
            return abaqus_fail(text, UZ_ERR_FORMAT, "a keyword ends in a comma, and so does the file");
    }
    return UZ_OK;
}

const char *abaqus_behind(const char *text, const char *name)
{
    for (;; text++, name++) {
        text += *text == ' '; /* one at most: abaqus_read_keyword */
        name += *name == ' ';
        if (*name == '\0')
            return text;
        if (*text != *name)
            return NULL;
    }
}

const char *abaqus_parameter(const abaqus_keyword *keyword, const char *name)
{
    for (size_t at = strlen(keyword->text) + 1; at < keyword->length; at += strlen(keyword->text + at) + 1) {
        const char *behind = abaqus_behind(keyword->text + at, name);
        if (behind && (*behind == '=' || *behind == '\0'))
            return behind + (*behind == '=');
    }
    return NULL;
}

uz_status abaqus_name(char out[ABAQUS_NAME], const abaqus_keyword *keyword, const char *parameter, bool needed,
                      const abaqus_text *text)
{
    const abaqus_text *place = ABAQUS_LINE(text, keyword->line);
    const char *value = abaqus_parameter(keyword, parameter);
    out[0] = '\0';
    if (!value && !needed)
        return UZ_OK;
    const size_t length = value ? strlen(value) : 0;
    if (length == 0 || length >= ABAQUS_NAME)
        return abaqus_fail(place, UZ_ERR_FORMAT, "*%.40s has no %s, or one of more than %d bytes", keyword->text,
                           parameter, ABAQUS_NAME - 1);
    for (size_t i = 0, step; i < length; i += step) {
        step = uz_utf8_length(value + i, length - i);
        if (step == 0 || uz_utf8_unsafe(value + i, length - i))
            return abaqus_fail(place, UZ_ERR_UNSUPPORTED, "a name has a control character or is not UTF-8");
    }
    memcpy(out, value, length + 1);
    return UZ_OK;
}

/* ---- fields */

bool abaqus_field(char field[ABAQUS_FIELD], abaqus_text *text)
{
    if (text->taken >= text->length)
        return false;
    const char *from = text->line + text->taken, *end = text->line + text->length;
    const char *comma = memchr(from, ',', (size_t)(end - from)), *to = comma ? comma : end;
    text->taken = (size_t)(to - text->line) + 1;
    while (from < to && (is_blank(*from) || *from == '"'))
        from++;
    while (to > from && (is_blank(to[-1]) || to[-1] == '"'))
        to--;
    size_t length = (size_t)(to - from);
    if (length >= ABAQUS_FIELD) /* no number and no name is as long: what is cut off is refused as neither */
        length = ABAQUS_FIELD - 1;
    memcpy(field, from, length);
    field[length] = '\0';
    return true;
}

uz_status abaqus_int(int64_t *value, const char *field, const char *what, const abaqus_text *text)
{
    char word[28];
    const char *at = field;
    int64_t number = 0;
    bool fits = true;
    for (; *at >= '0' && *at <= '9'; at++)
        fits =
            fits && !__builtin_mul_overflow(number, 10, &number) && !__builtin_add_overflow(number, *at - '0', &number);
    if (at == field || *at != '\0' || !fits)
        return abaqus_fail(text, UZ_ERR_FORMAT, "%s was expected, found \"%s\"", what,
                           shown(word, field, strlen(field)));
    *value = number;
    return UZ_OK;
}

/* Fortran writes 1.5D3 for 1.5E3. */
uz_status abaqus_real(double *value, const char *field, const char *what, const abaqus_text *text)
{
    char word[ABAQUS_FIELD], told[28];
    size_t length = strlen(field);
    for (size_t i = 0; i <= length; i++)
        word[i] = field[i] == 'd' || field[i] == 'D' ? 'e' : field[i];
    *value = 0;
    if (length > 0 && uz_parse_double(value, word, length) != length)
        return abaqus_fail(text, UZ_ERR_FORMAT, "%s was expected, found \"%s\"", what, shown(told, field, length));
    return isfinite(*value) ? UZ_OK : abaqus_fail(text, UZ_ERR_NOT_FINITE, "%s is not a finite number", what);
}
