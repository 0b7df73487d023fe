/* text.h: a growing text that is JSON most of the time. A failed allocation is remembered and reported once, at the
 * end; until then every call is a no-op. */
#ifndef SERVER_CODEC_TEXT_H
#define SERVER_CODEC_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct text {
    char *data; /* len bytes, not terminated until text_finish */
    size_t len, capacity;
    bool failed;
} text;

void text_bytes(text *t, const char *bytes, size_t n);
void text_put(text *t, const char *string); /* as it is; NULL puts nothing */
void text_format(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* JSON values: under a key of ours, in which nothing needs an escape, or as an item, key NULL. A comma is put first
 * where one is due: wherever neither '{', '[' nor ':' is the last byte. */
void text_open(text *t, const char *key, char bracket);         /* a value that begins with '{' or '[' */
void text_close(text *t, char bracket);                         /* '}' or ']' */
void text_string(text *t, const char *key, const char *string); /* UTF-8; NULL becomes null; bad UTF-8 becomes U+FFFD */
void text_integer(text *t, const char *key, int64_t value);
void text_number(text *t, const char *key, double value); /* shortest digits that read back; NaN and Inf become null */
void text_bool(text *t, const char *key, bool value);
void text_raw(text *t, const char *key, const char *json); /* JSON text embedded as it is; NULL becomes null */
void text_numbers(text *t, const char *key, const double *x, int64_t n); /* an array */
void text_integers(text *t, const char *key, const int64_t *x, int64_t n);
void text_key(text *t, const char *key); /* the comma and the key only: the caller writes the value */

/* The NUL-terminated text, owned by the caller; NULL if memory ran out. *len (may be NULL) without the NUL. */
char *text_finish(text *t, size_t *len);

#endif
