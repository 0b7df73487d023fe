/* gmsh_text.c: words, bytes and sections of a Gmsh file. */
#include "io/gmsh.h"

#include "core/error.h"
#include "text/utf8.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* ---- failures */

uz_status gmsh_fail_at(const gmsh_text *text, const gmsh_text *place, uz_status status, const char *format, ...)
{
    char message[400];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    if (place->binary)
        return uz_fail(text->err, status, "", "at byte %lld of the file: %s", (long long)(place->at - place->begin),
                       message);
    return uz_fail_line(text->err, status, place->line, "%s", message);
}

/* ---- words */

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

static void skip_space(gmsh_text *text)
{
    for (; text->at < text->end && is_space(*text->at); text->at++)
        text->line += *text->at == '\n';
}

enum { SHOWN = 24 };

/* "expected a node number, found "abc"". */
static uz_status fail_word(gmsh_text *text, const char *what)
{
    char word[SHOWN + 1];
    size_t used = 0;
    for (const char *at = text->at; at < text->end && !is_space(*at) && used < SHOWN; at++)
        word[used++] = *at >= ' ' && *at <= '~' ? *at : '?';
    word[used] = '\0';
    if (used == 0)
        return gmsh_fail(text, UZ_ERR_FORMAT, "%s was expected, but the file ends", what);
    return gmsh_fail(text, UZ_ERR_FORMAT, "%s was expected, found \"%s\"", what, word);
}

static bool word_ends(const char *at, const gmsh_text *text)
{
    return at == text->end || is_space(*at);
}

uz_status gmsh_int_text(gmsh_text *text, int64_t *value, const char *what)
{
    skip_space(text);
    const char *at = text->at + (text->at < text->end && *text->at == '-'), *digits = at;
    int64_t number = 0;
    bool fits = true;
    for (; at < text->end && *at >= '0' && *at <= '9'; at++)
        fits =
            fits && !__builtin_mul_overflow(number, 10, &number) && !__builtin_add_overflow(number, *at - '0', &number);
    if (at == digits || !fits || !word_ends(at, text))
        return fail_word(text, what);
    *value = *text->at == '-' ? -number : number;
    text->at = at;
    return UZ_OK;
}

#define NOT_FINITE "a coordinate is not a finite number"

uz_status gmsh_real_text(gmsh_text *text, double *value)
{
    skip_space(text);
    const size_t used = uz_parse_double(value, text->at, (size_t)(text->end - text->at));
    const char *at = text->at + (text->at < text->end && (*text->at == '-' || *text->at == '+'));
    const bool named = used == 0 && text->end - at >= 3 && ((at[0] | 32) == 'n' || (at[0] | 32) == 'i') &&
                       (at[1] | 32) != 'o'; /* nan, inf */
    if (!named && (used == 0 || !word_ends(text->at + used, text)))
        return fail_word(text, "a number");
    if (named || !isfinite(*value))
        return gmsh_fail(text, UZ_ERR_NOT_FINITE, NOT_FINITE);
    text->at += used;
    return UZ_OK;
}

uz_status gmsh_quoted(gmsh_text *text, char out[64])
{
    skip_space(text);
    if (text->at == text->end || *text->at != '"')
        return fail_word(text, "a name in double quotes");
    const char *from = text->at + 1, *to = memchr(from, '"', (size_t)(text->end - from));
    const char *newline = memchr(from, '\n', (size_t)(text->end - from));
    if (!to || (newline && newline < to))
        return gmsh_fail(text, UZ_ERR_FORMAT, "the name of a physical group has no closing quote");
    const size_t len = (size_t)(to - from);
    if (len == 0 || len > 63)
        return gmsh_fail(text, UZ_ERR_UNSUPPORTED, "the name of a physical group has %zu bytes; names have 1 to 63",
                         len);
    for (size_t i = 0, step; i < len; i += step) {
        step = uz_utf8_length(from + i, len - i);
        if (step == 0 || (unsigned char)from[i] < 0x20 || from[i] == 0x7f)
            return gmsh_fail(text, UZ_ERR_UNSUPPORTED,
                             "the name of a physical group has a control character or is not UTF-8");
    }
    memcpy(out, from, len);
    out[len] = '\0';
    text->at = to + 1;
    return UZ_OK;
}

/* ---- bytes */

static uz_status take_bytes(gmsh_text *text, void *to, size_t size, const char *what)
{
    if ((size_t)(text->end - text->at) < size)
        return gmsh_fail(text, UZ_ERR_FORMAT, "%s was expected, but the file ends", what);
    memcpy(to, text->at, size);
    text->at += size;
    return UZ_OK;
}

uz_status gmsh_int(gmsh_text *text, int64_t *value, const char *what)
{
    int32_t number = 0;
    if (!text->binary)
        return gmsh_int_text(text, value, what);
    const uz_status status = take_bytes(text, &number, sizeof number, what);
    *value = number;
    return status;
}

uz_status gmsh_size(gmsh_text *text, int64_t *value, const char *what)
{
    const gmsh_text before = *text;
    const uz_status status =
        text->binary ? take_bytes(text, value, sizeof *value, what) : gmsh_int_text(text, value, what);
    if (status == UZ_OK && *value < 0)
        return gmsh_fail_at(text, &before, UZ_ERR_FORMAT, "%s was expected, found %lld", what, (long long)*value);
    return status;
}

uz_status gmsh_reals(gmsh_text *text, int count, double *xyz)
{
    double value = 0;
    uz_status status = UZ_OK;
    for (int i = 0; i < count && status == UZ_OK; i++) {
        const gmsh_text before = *text;
        double *to = xyz ? &xyz[i] : &value;
        status = text->binary ? take_bytes(text, to, sizeof *to, "a coordinate") : gmsh_real_text(text, to);
        if (status == UZ_OK && !isfinite(*to))
            status = gmsh_fail(&before, UZ_ERR_NOT_FINITE, NOT_FINITE);
    }
    return status;
}

uz_status gmsh_count(const gmsh_text *text, int64_t count, size_t each, const char *what)
{
    if (count >= 0 && (uint64_t)count <= (size_t)(text->end - text->at) / each)
        return UZ_OK;
    return gmsh_fail(text, UZ_ERR_FORMAT, "%lld %s are announced, but the rest of the file has %zu bytes",
                     (long long)count, what, (size_t)(text->end - text->at));
}

/* ---- sections */

uz_status gmsh_head_4(gmsh_text *text, int version, int64_t *blocks, int64_t *count, const char *const what[3])
{
    int64_t ends;
    uz_status status = gmsh_size(text, blocks, what[0]);
    if (status == UZ_OK)
        status = gmsh_size(text, count, what[1]);
    for (int i = 0; i < 2 && version == 41 && status == UZ_OK; i++)
        status = gmsh_size(text, &ends, what[2]);
    return status;
}

uz_status gmsh_end_line(gmsh_text *text)
{
    while (text->at < text->end && (*text->at == ' ' || *text->at == '\t' || *text->at == '\r'))
        text->at++;
    if (text->at == text->end)
        return UZ_OK;
    if (*text->at != '\n')
        return fail_word(text, "the end of the line");
    text->at++;
    text->line++;
    return UZ_OK;
}

uz_status gmsh_section(gmsh_text *text, char name[GMSH_NAME])
{
    size_t used = 0;
    name[0] = '\0';
    skip_space(text);
    if (text->at == text->end)
        return UZ_OK;
    if (*text->at != '$')
        return fail_word(text, "a section such as $Nodes");
    for (const char *at = text->at + 1; !word_ends(at, text) && used < GMSH_NAME - 8; at++)
        name[used++] = *at;
    name[used] = '\0';
    if (used == 0 || !word_ends(text->at + 1 + used, text) || memchr(name, '\0', used))
        return fail_word(text, "the name of a section");
    text->at += 1 + used;
    return gmsh_end_line(text);
}

uz_status gmsh_section_end(gmsh_text *text, const char *name)
{
    char end[GMSH_NAME + 8];
    const int len = snprintf(end, sizeof end, "$End%s", name);
    skip_space(text);
    if ((size_t)(text->end - text->at) < (size_t)len || memcmp(text->at, end, (size_t)len) != 0 ||
        !word_ends(text->at + len, text))
        return fail_word(text, end);
    text->at += len;
    return UZ_OK;
}

uz_status gmsh_skip_section(gmsh_text *text, const char *name)
{
    char end[GMSH_NAME + 8];
    const int len = snprintf(end, sizeof end, "$End%s", name);
    const char *at = memmem(text->at, (size_t)(text->end - text->at), end, (size_t)len);
    if (!at)
        return gmsh_fail(text, UZ_ERR_FORMAT, "the section $%.*s has no end; %s is missing", GMSH_NAME, name, end);
    for (; text->at < at; text->at++)
        text->line += *text->at == '\n';
    return gmsh_section_end(text, name);
}
