/* text.c: a growing text; JSON values in it. */
#include "codec/text.h"
#include "text/utf8.h"
#include "uzawa.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Room for n more bytes and a NUL. */
static bool reserve(text *t, size_t n)
{
    size_t need = 0, capacity = t->capacity ? t->capacity : 256;
    if (t->failed || __builtin_add_overflow(t->len, n + 1, &need))
        t->failed = true;
    if (t->failed || need <= t->capacity)
        return !t->failed;
    while (capacity < need && capacity < SIZE_MAX / 2)
        capacity += capacity / 2;
    char *grown = realloc(t->data, capacity < need ? need : capacity);
    if (!grown) {
        t->failed = true;
        return false;
    }
    t->data = grown;
    t->capacity = capacity < need ? need : capacity;
    return true;
}

void text_bytes(text *t, const char *bytes, size_t n)
{
    if (n == 0 || !reserve(t, n))
        return;
    memcpy(t->data + t->len, bytes, n);
    t->len += n;
}

void text_put(text *t, const char *string)
{
    if (string)
        text_bytes(t, string, strlen(string));
}

void text_format(text *t, const char *format, ...)
{
    char line[512];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    if (n < 0 || (size_t)n >= sizeof line)
        t->failed = true;
    else
        text_bytes(t, line, (size_t)n);
}

void text_key(text *t, const char *key)
{
    const char last = t->len > 0 ? t->data[t->len - 1] : '[';
    if (last != '{' && last != '[' && last != ':')
        text_bytes(t, ",", 1);
    if (key) {
        text_bytes(t, "\"", 1);
        text_put(t, key);
        text_bytes(t, "\":", 2);
    }
}

void text_open(text *t, const char *key, char bracket)
{
    text_key(t, key);
    text_bytes(t, &bracket, 1);
}

void text_close(text *t, char bracket)
{
    text_bytes(t, &bracket, 1);
}

void text_string(text *t, const char *key, const char *string)
{
    static const char NAMED[] = "\b\f\n\r\t\"\\", NAMES[] = "bfnrt\"\\";
    const size_t len = string ? strlen(string) : 0;
    text_key(t, key);
    text_put(t, string ? "\"" : "null");
    for (size_t i = 0; i < len;) {
        const size_t step = uz_utf8_length(string + i, len - i);
        const unsigned char c = (unsigned char)string[i];
        const char *named = strchr(NAMED, c);
        if (step == 0)
            text_put(t, "\xef\xbf\xbd");
        else if (named)
            text_bytes(t, (char[2]){'\\', NAMES[named - NAMED]}, 2);
        else if (c < 0x20 || c == 0x7f)
            text_format(t, "\\u%04x", c);
        else
            text_bytes(t, string + i, step);
        i += step ? step : 1;
    }
    text_put(t, string ? "\"" : "");
}

void text_integer(text *t, const char *key, int64_t value)
{
    text_key(t, key);
    text_format(t, "%" PRId64, value);
}

void text_bool(text *t, const char *key, bool value)
{
    text_key(t, key);
    text_put(t, value ? "true" : "false");
}

void text_raw(text *t, const char *key, const char *json)
{
    text_key(t, key);
    text_put(t, json ? json : "null");
}

void text_number(text *t, const char *key, double value)
{
    text_key(t, key);
    if (!isfinite(value))
        text_put(t, "null");
    else if (reserve(t, UZ_DOUBLE_ROOM))
        t->len += uz_format_double(t->data + t->len, value);
}

void text_numbers(text *t, const char *key, const double *x, int64_t n)
{
    text_open(t, key, '[');
    for (int64_t i = 0; i < n && !t->failed; i++)
        text_number(t, NULL, x[i]);
    text_close(t, ']');
}

void text_integers(text *t, const char *key, const int64_t *x, int64_t n)
{
    text_open(t, key, '[');
    for (int64_t i = 0; i < n && !t->failed; i++)
        text_integer(t, NULL, x[i]);
    text_close(t, ']');
}

char *text_finish(text *t, size_t *len)
{
    if (reserve(t, 0))
        t->data[t->len] = '\0';
    else
        free(t->data);
    char *data = t->failed ? NULL : t->data;
    if (len)
        *len = data ? t->len : 0;
    *t = (text){0};
    return data;
}
