/* files.h: local files, whole or not at all, and text of others made safe for a terminal. */
#ifndef CLIENT_FILES_H
#define CLIENT_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

/* A growing block of bytes, NUL-terminated whenever data is not NULL. Zero-initialise; free data with free(). */
typedef struct {
    char *data;
    size_t len, capacity;
} client_buffer;

/* False: no memory; what was there stays. */
bool client_buffer_append(client_buffer *buffer, const void *bytes, size_t count);

/* Reads a whole file, "-" for standard input. False: message says why. */
bool client_file_read(client_buffer *out, const char *path, char *message, size_t size);

/* Replaces `path` by the bytes: written beside it, synced and renamed, so that a reader never sees half a file.
 * "-" is standard output; what is no regular file (a pipe, /dev/null) is written to directly. */
bool client_file_write(const char *path, const char *bytes, size_t count, char *message, size_t size);

/* Writes text from elsewhere with every control character as '?', so that it can't steer the terminal. */
void client_print_safe(FILE *to, const char *text);

#endif
