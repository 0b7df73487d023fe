#include "http/transport/peer.h"

#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

/* The part of an address that names a client: IPv4, or the first 64 bits of IPv6, of which a client often has all
 * (RFC 6177). Returns its length, at most 16; 0: unknown. */
static size_t name_client(const struct sockaddr *address, unsigned char out[16])
{
    if (!address)
        return 0;
    if (address->sa_family == AF_INET) {
        memcpy(out, &((const struct sockaddr_in *)(const void *)address)->sin_addr, 4);
        return 4;
    }
    if (address->sa_family != AF_INET6)
        return 0;
    const struct in6_addr *six = &((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(six)) {
        memcpy(out, &six->s6_addr[12], 4);
        return 4;
    }
    memcpy(out, six->s6_addr, 8);
    return 8;
}

peer *peer_begin(peers *all, const struct sockaddr *from)
{
    peer *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->all = all;
    p->len = name_client(from, p->address);
    pthread_mutex_lock(&all->lock);
    p->next = all->first;
    if (p->next)
        p->next->previous = p;
    all->first = p;
    all->count++;
    pthread_mutex_unlock(&all->lock);
    return p;
}

void peer_end(peer *p)
{
    if (!p)
        return;
    peers *all = p->all;
    pthread_mutex_lock(&all->lock);
    if (p->previous)
        p->previous->next = p->next;
    else
        all->first = p->next;
    if (p->next)
        p->next->previous = p->previous;
    all->count--;
    pthread_mutex_unlock(&all->lock);
    free(p);
}

size_t peers_count(peers *all, const struct sockaddr *from)
{
    unsigned char address[16];
    size_t len = name_client(from, address), count = 0;
    pthread_mutex_lock(&all->lock);
    if (!from)
        count = all->count;
    for (const peer *p = len > 0 ? all->first : NULL; p; p = p->next)
        count += p->len == len && memcmp(p->address, address, len) == 0;
    pthread_mutex_unlock(&all->lock);
    return count;
}
