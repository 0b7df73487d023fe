/* tags.h: adds tags to a request's text without reading the rest of it into memory a second time. */
#ifndef CLIENT_TAGS_H
#define CLIENT_TAGS_H

#include "local/files.h"

/* *out becomes `body` with the tags added to its top-level "tags" (made if absent; ones it has are not repeated).
 * Line numbers stay as they were, so that the server's errors point into the user's file. A body that is no JSON object
 * is copied as it is: the server says what is wrong with it. False: no memory; *out is then zero. */
bool client_tags_add(client_buffer *out, const client_buffer *body, const char *const *tags, int n_tags);

#endif
