#include "text/buffer.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Room for `more` bytes and a NUL. */
static bool reserve(uz_buffer *buffer, size_t more)
{
    if (buffer->failed || more > SIZE_MAX / 4 - buffer->len) {
        buffer->failed = true;
        return false;
    }
    if (buffer->len + more < buffer->capacity)
        return true;
    const size_t capacity = buffer->capacity + buffer->capacity / 2 + more + 256;
    char *data = uz_realloc(buffer->data, (int64_t)capacity, 1);
    if (!data) {
        buffer->failed = true;
        return false;
    }
    buffer->data = data;
    buffer->capacity = capacity;
    return true;
}

void uz_buffer_put(uz_buffer *buffer, const void *bytes, size_t len)
{
    if (len == 0 || !reserve(buffer, len))
        return;
    memcpy(buffer->data + buffer->len, bytes, len);
    buffer->len += len;
}

void uz_buffer_print(uz_buffer *buffer, const char *format, ...)
{
    enum { MOST = 1000 };
    va_list args;
    if (!reserve(buffer, MOST))
        return;
    va_start(args, format);
    const int n = vsnprintf(buffer->data + buffer->len, MOST, format, args);
    va_end(args);
    if (n < 0 || n >= MOST)
        buffer->failed = true;
    else
        buffer->len += (size_t)n;
}

void uz_buffer_put_escaped(uz_buffer *buffer, const char *text)
{
    static const char SPECIAL[] = "<>&\"", *const ENTITY[] = {"&lt;", "&gt;", "&amp;", "&quot;"};
    while (*text) {
        const size_t plain = strcspn(text, SPECIAL);
        uz_buffer_put(buffer, text, plain);
        text += plain;
        if (*text) {
            const char *entity = ENTITY[strchr(SPECIAL, *text++) - SPECIAL];
            uz_buffer_put(buffer, entity, strlen(entity));
        }
    }
}

void uz_buffer_put_base64(uz_buffer *buffer, const void *bytes, size_t len)
{
    static const char DIGITS[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned char *in = bytes;
    if (!reserve(buffer, len / 3 * 4 + 4))
        return;
    char *out = buffer->data + buffer->len;
    for (size_t i = 0; i < len; i += 3) {
        const size_t left = len - i;
        const unsigned v =
            (unsigned)in[i] << 16 | (left > 1 ? (unsigned)in[i + 1] << 8 : 0U) | (left > 2 ? (unsigned)in[i + 2] : 0U);
        *out++ = DIGITS[v >> 18];
        *out++ = DIGITS[v >> 12 & 63];
        *out++ = left > 1 ? DIGITS[v >> 6 & 63] : '=';
        *out++ = left > 2 ? DIGITS[v & 63] : '=';
    }
    buffer->len = (size_t)(out - buffer->data);
}

uz_status uz_buffer_finish(char **text, size_t *len, uz_buffer *buffer, uz_error *err)
{
    *text = NULL;
    if (!reserve(buffer, 0)) {
        uz_buffer_drop(buffer);
        return uz_no_memory(err, "the text of a file");
    }
    buffer->data[buffer->len] = '\0';
    *text = buffer->data;
    if (len)
        *len = buffer->len;
    memset(buffer, 0, sizeof *buffer);
    return UZ_OK;
}

void uz_buffer_drop(uz_buffer *buffer)
{
    free(buffer->data);
    memset(buffer, 0, sizeof *buffer);
}
