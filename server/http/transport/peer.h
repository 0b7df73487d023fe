/* peer.h: from where connections are open, whoever serves them now. */
#ifndef SERVER_HTTP_PEER_H
#define SERVER_HTTP_PEER_H

#include <stdbool.h>
#include <stddef.h>

struct sockaddr;
typedef struct peers peers;
typedef struct peer peer;

peers *peers_new(void); /* NULL: no memory */
void peers_free(peers *all);

/* One more connection from this address, the network of 64 bits of an IPv6 address, of which a client often has all
 * (RFC 6177), being one client (NULL or of another family than IP: from none). NULL: no memory. */
peer *peer_begin(peers *all, const struct sockaddr *from);
void peer_end(peer *p); /* NULL is fine */
/* What tells its client from others; returns its length, at most 16; 0: unknown. */
size_t peer_address(const peer *p, unsigned char out[16]);

/* How many there are; how many from this address. */
size_t peers_count(peers *all);
size_t peers_from(peers *all, const struct sockaddr *from);

#endif
