/* privileges.h: from root to an ordinary user. */
#ifndef SERVER_PRIVILEGES_H
#define SERVER_PRIVILEGES_H

#include <stdbool.h>
#include <stddef.h>

/* Becomes `user` with its groups for good; before threads start. Nothing to do where the process is this user already.
 * False with the reason in message. */
bool privileges_drop(const char *user, char *message, size_t size);

#endif
