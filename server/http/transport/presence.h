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

/* One more connection from this address, the network of 64 bits of an IPv6 address, of which a client often has all
 * (RFC 6177), being one client (NULL or of another family than IP: from none). NULL: no memory. */
presence *presence_begin(presences *all, const struct sockaddr *from);
void presence_end(presence *p); /* NULL is fine */
/* What tells its client from others; returns its length, at most 16; 0: unknown. */
size_t presence_address(const presence *p, unsigned char out[16]);

/* How many there are; how many from this address. */
size_t presences_count(presences *all);
size_t presences_from(presences *all, const struct sockaddr *from);

#endif
