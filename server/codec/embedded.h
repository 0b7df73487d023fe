/* embedded.h: the schema files, put into the program at build time. */
#ifndef SERVER_EMBEDDED_H
#define SERVER_EMBEDDED_H

#include <stddef.h>

typedef struct {
    const char *name; /* "request.json"; "openapi.json": with all others in it (schemas/bundle.awk) */
    const char *text; /* not NUL-terminated */
    size_t len;
} embedded_file;

size_t embedded_count(void);
embedded_file embedded_at(size_t i); /* {NULL, NULL, 0} past the end */

#endif
