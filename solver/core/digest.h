/* digest.h: SHA-256 of pieces of memory. */
#ifndef UZ_CORE_DIGEST_H
#define UZ_CORE_DIGEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct uz_digest uz_digest;
uz_digest *uz_digest_new(void); /* NULL: no memory */
/* Adds the length and then the bytes, so that pieces can't run into each other. */
void uz_digest_add(uz_digest *digest, const void *data, size_t len);
/* The same of a list, after how many it has; NULL: none. */
void uz_digest_add_list(uz_digest *digest, const void *list, int64_t count, size_t size);
/* Writes 64 hex digits and a NUL and frees the digest. False, and an empty text, when anything went wrong. */
bool uz_digest_end(uz_digest *digest, char hex[65]);

#endif
