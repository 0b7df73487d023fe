/* peer.h: from where connections are open, whoever serves them now. */
#ifndef SERVER_HTTP_PEER_H
#define SERVER_HTTP_PEER_H

#include <pthread.h>
#include <stddef.h>

struct sockaddr;
typedef struct {
    pthread_mutex_t lock; /* the list */
    struct peer *first;
    size_t count;
} peers;
typedef struct peer {
    peers *all;
    struct peer *previous, *next;
    unsigned char address[16]; /* what tells its client from others: len bytes; 0: unknown */
    size_t len;
} peer;

/* One more connection from this address, the network of 64 bits of an IPv6 address, of which a client often has all
 * (RFC 6177), being one client (NULL or of another family than IP: from none). NULL: no memory. */
peer *peer_begin(peers *all, const struct sockaddr *from);
void peer_end(peer *p); /* NULL is fine */

/* How many there are from this address; NULL: in all. */
size_t peers_count(peers *all, const struct sockaddr *from);

#endif
