/* target.h: a request target (RFC 9112, section 3.2) as path and query parameters.
 * The raw target is read here and not by libmicrohttpd, which cuts at an encoded NUL and keeps the last of two keys. */
#ifndef SERVER_HTTP_TARGET_H
#define SERVER_HTTP_TARGET_H

#include "base/problem_details.h"

#include <stdbool.h>
#include <stddef.h>

#define TARGET_MAX_PARAMETERS 16
#define TARGET_REPEATABLE     "tag" /* the only key that may come more than once */

typedef struct {
    char *text;       /* owns what the others point into */
    const char *path; /* decoded, begins with '/' */
    struct {
        const char *key, *value; /* decoded; value "" when there was no '=' */
    } parameters[TARGET_MAX_PARAMETERS];
    size_t count;
} target;

/* Takes origin form ("/v1/jobs?limit=5") and absolute form ("http://host/v1/jobs"). False with a 400 (or 500 when
 * there is no memory): broken or NUL percent-encoding, control characters, a key twice, too many keys. */
bool target_parse(target *out, const char *raw, problem_details *problem);
void target_clear(target *t);

/* The value of a key, NULL if the key is absent. */
const char *target_value(const target *t, const char *key);

/* RFC 9110 tokens and lists, shared with the header readers. */
bool token_equal(const char *text, size_t len, const char *token); /* ASCII case is ignored */

#endif
