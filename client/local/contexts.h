/* contexts.h: services by name, in a file of the user's.
 *
 *     context = lab            the one that counts where none is named
 *     [lab]
 *     server = https://lab.example:8443
 *     token = ...
 *     ca = /etc/ssl/lab.pem
 *
 * A line that begins with '#' is a comment. The file is $XDG_CONFIG_HOME/uzawa/config, or ~/.config/uzawa/config; one
 * with a token in it must be nobody else's to read. */
#ifndef CLIENT_CONTEXTS_H
#define CLIENT_CONTEXTS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    char server[1024], token[1024], ca[1024]; /* "": not said */
} client_context;

/* name NULL: the file's own choice; where there is no file, or it chooses none, *out is empty. False: message. */
bool client_context_find(client_context *out, const char *name, char *message, size_t size);

#endif
