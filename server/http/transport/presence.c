#include "http/transport/presence.h"
#include "http/rate.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct presence {
    presences *all;
    presence *previous, *next;
    unsigned char address[16];
    size_t len;
};

struct presences {
    pthread_mutex_t lock;
    presence *first;
    size_t count;
};

presences *presences_new(void)
{
    presences *all = calloc(1, sizeof *all);
    if (all)
        pthread_mutex_init(&all->lock, NULL);
    return all;
}

void presences_free(presences *all)
{
    if (!all)
        return;
    pthread_mutex_destroy(&all->lock);
    free(all);
}

presence *presence_begin(presences *all, const struct sockaddr *from)
{
    presence *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->all = all;
    p->len = rate_address(from, p->address);
    pthread_mutex_lock(&all->lock);
    p->next = all->first;
    if (p->next)
        p->next->previous = p;
    all->first = p;
    all->count++;
    pthread_mutex_unlock(&all->lock);
    return p;
}

void presence_end(presence *p)
{
    if (!p)
        return;
    presences *all = p->all;
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

size_t presences_count(presences *all)
{
    pthread_mutex_lock(&all->lock);
    size_t count = all->count;
    pthread_mutex_unlock(&all->lock);
    return count;
}

size_t presences_from(presences *all, const struct sockaddr *from)
{
    unsigned char address[16];
    size_t len = rate_address(from, address), count = 0;
    pthread_mutex_lock(&all->lock);
    for (const presence *p = len > 0 ? all->first : NULL; p; p = p->next)
        count += p->len == len && memcmp(p->address, address, len) == 0;
    pthread_mutex_unlock(&all->lock);
    return count;
}
