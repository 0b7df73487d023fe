/* buffer.h: a growing text. A failed allocation is remembered and told once, by uz_buffer_finish; until then every call
 * does nothing. A zeroed struct is empty. */
#ifndef UZ_CORE_BUFFER_H
#define UZ_CORE_BUFFER_H

#include "uzawa.h"

typedef struct {
    char *data;
    size_t len, capacity;
    bool failed;
} uz_buffer;

void uz_buffer_put(uz_buffer *buffer, const void *bytes, size_t len);
/* One printf of less than 1000 bytes. */
void uz_buffer_print(uz_buffer *buffer, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Text in which <, >, & and " are written as XML entities. */
void uz_buffer_put_escaped(uz_buffer *buffer, const char *text);
/* Base64 of bytes (RFC 4648, section 4). */
void uz_buffer_put_base64(uz_buffer *buffer, const void *bytes, size_t len);

/* *text is NUL-terminated and the caller's; the buffer is empty afterwards. UZ_ERR_MEMORY. */
uz_status uz_buffer_finish(char **text, size_t *len, uz_buffer *buffer, uz_error *err);
void uz_buffer_drop(uz_buffer *buffer);

#endif
