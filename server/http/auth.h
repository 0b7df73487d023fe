/* auth.h: who may do what, by bearer tokens (RFC 6750).
 *
 * A token file has lines "name scope secret" and comments that begin with '#'. Scopes are read, submit and admin, each
 * with all that those before it allow. A secret has 16 to 128 characters of [A-Za-z0-9-._~+/=]; only its SHA-256 is
 * kept, and every token is compared in full, so that time tells nothing of how much of a guess was right. */
#ifndef SERVER_HTTP_AUTH_H
#define SERVER_HTTP_AUTH_H

#include <stdbool.h>
#include <stddef.h>

typedef enum { SCOPE_NONE, SCOPE_READ, SCOPE_SUBMIT, SCOPE_ADMIN } auth_scope;
const char *auth_scope_name(auth_scope scope);

typedef struct auth auth;
/* Reads the file. NULL with the reason, which names file and line, in message. */
auth *auth_new(const char *path, char *message, size_t size);
void auth_free(auth *a); /* NULL is fine */
/* Reads the file again; false with the reason, and the tokens stay as they were. From any thread. */
bool auth_reload(auth *a, char *message, size_t size);
/* The scope of the token with this secret, and its name; SCOPE_NONE: there is none. From any thread. */
auth_scope auth_check(auth *a, const char *secret, size_t len, char name[64]);

#endif
