/* auth.h: who may do what, by bearer tokens (RFC 6750).
 *
 * A token file has lines "name scope secret [owner=NAME] [until=DATE]" and comments that begin with '#'. Scopes are
 * read, submit and admin, each with all that those before it allow; an admin sees everybody's jobs and uploads, others
 * see their owner's. The owner is the name where it is not said: several tokens of one owner are a team, or an old and
 * a new one of which both are good for a while. A secret has 16 to 128 characters of [A-Za-z0-9-._~+/=], and the file
 * may have its digest in its place ("sha256:" and 64 digits). Only that is kept, and every token is compared in full,
 * so that time tells nothing of how much of a guess was right. */
#ifndef SERVER_HTTP_AUTH_H
#define SERVER_HTTP_AUTH_H

#include <stdbool.h>
#include <stddef.h>

typedef enum { SCOPE_NONE, SCOPE_READ, SCOPE_SUBMIT, SCOPE_ADMIN } auth_scope;
extern const char *const AUTH_SCOPES[]; /* their names */

typedef struct auth auth;
/* Reads the file. NULL with the reason, which names file and line, in message. */
auth *auth_new(const char *path, char *message, size_t size);
void auth_free(auth *a); /* NULL is fine */
/* Reads the file again; false with the reason, and the tokens stay as they were. From any thread. */
bool auth_reload(auth *a, char *message, size_t size);
/* Who has a token. */
typedef struct {
    char name[64], owner[64]; /* of the token; "": there is none with that secret */
    auth_scope scope;         /* SCOPE_NONE: it is not known, or expired */
    bool expired;
} auth_identity;
/* Of the token with this secret, at the time now in Unix seconds. From any thread. */
auth_identity auth_check(auth *a, const char *secret, size_t len, double now);

#endif
