/* presence.h: from where connections are open, whoever serves them now. */
#ifndef SERVER_HTTP_PRESENCE_H
#define SERVER_HTTP_PRESENCE_H

#include <stdbool.h>
#include <stddef.h>

struct sockaddr;
typedef struct presences presences;
typedef struct presence presence;

presences *presences_new(void); /* NULL: no memory */
void presences_free(presences *all);

/* One more connection from this address, as rate.h counts them: one network of 64 bits is one client (NULL or of
 * another family than IP: from none). NULL: no memory. */
presence *presence_begin(presences *all, const struct sockaddr *from);
void presence_end(presence *p); /* NULL is fine */

/* How many there are; how many from this address. */
size_t presences_count(presences *all);
size_t presences_from(presences *all, const struct sockaddr *from);

#endif
