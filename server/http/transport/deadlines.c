/* deadlines.c: a thread that watches over all connections. */
#include "http/transport/deadlines.h"
#include "http/transport/transport.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

struct deadline {
    deadlines *all;
    deadline *previous, *next;
    double at, since; /* since: its phase, HEAD since the connection was last idle */
    int fd;
    void *owner;
    deadline_phase phase;
    bool spare, speak, expired;
};

struct deadlines {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    deadline *first;
    double wake_at; /* when the thread looks again */
    bool stop;
    char *last_words;
};

static void *watch(void *argument)
{
    deadlines *all = argument;
    pthread_mutex_lock(&all->mutex);
    while (!all->stop) {
        /* what is overdue is cut */
        const double now = clock_seconds(CLOCK_MONOTONIC);
        double earliest = INFINITY;
        for (deadline *d = all->first; d; d = d->next) {
            if (d->at <= now) {
                d->expired = true;
                d->at = INFINITY;
                if (d->speak)
                    (void)send(d->fd, all->last_words, strlen(all->last_words), MSG_DONTWAIT | MSG_NOSIGNAL);
                shutdown(d->fd, SHUT_RDWR);
            }
            earliest = fmin(earliest, d->at);
        }
        all->wake_at = earliest;
        clock_wait(&all->changed, &all->mutex, earliest);
    }
    pthread_mutex_unlock(&all->mutex);
    return NULL;
}

deadlines *deadlines_new(const char *last_words)
{
    deadlines *all = calloc(1, sizeof *all);
    char *words = strdup(last_words);
    if (!all || !words) {
        free(all);
        free(words);
        return NULL;
    }
    clock_condition(&all->changed);
    pthread_mutex_init(&all->mutex, NULL);
    all->wake_at = INFINITY;
    all->last_words = words;
    if (pthread_create(&all->thread, NULL, watch, all) != 0) {
        pthread_cond_destroy(&all->changed);
        pthread_mutex_destroy(&all->mutex);
        free(words);
        free(all);
        return NULL;
    }
    return all;
}

void deadlines_free(deadlines *all)
{
    if (!all)
        return;
    pthread_mutex_lock(&all->mutex);
    all->stop = true;
    pthread_cond_signal(&all->changed);
    pthread_mutex_unlock(&all->mutex);
    pthread_join(all->thread, NULL);
    pthread_cond_destroy(&all->changed);
    pthread_mutex_destroy(&all->mutex);
    free(all->last_words);
    free(all);
}

void deadlines_hear_no_more(deadlines *all)
{
    pthread_mutex_lock(&all->mutex);
    for (const deadline *d = all->first; d; d = d->next)
        shutdown(d->fd, SHUT_RD);
    pthread_mutex_unlock(&all->mutex);
}

deadline *deadlines_add(deadlines *all, int fd, double at, void *owner, bool spare)
{
    deadline *d = calloc(1, sizeof *d);
    if (!d)
        return NULL;
    *d = (deadline){
        .all = all, .at = at, .since = clock_seconds(CLOCK_MONOTONIC), .fd = fd, .owner = owner, .spare = spare};
    pthread_mutex_lock(&all->mutex);
    d->next = all->first;
    if (d->next)
        d->next->previous = d;
    all->first = d;
    if (at < all->wake_at)
        pthread_cond_signal(&all->changed);
    pthread_mutex_unlock(&all->mutex);
    return d;
}

void *deadlines_owner(deadlines *all, int fd)
{
    void *found = NULL;
    pthread_mutex_lock(&all->mutex);
    for (const deadline *d = all->first; d && !found; d = d->next)
        found = d->fd == fd ? d->owner : NULL;
    pthread_mutex_unlock(&all->mutex);
    return found;
}

void deadline_set(deadline *d, double at, deadline_phase phase, bool speak)
{
    pthread_mutex_lock(&d->all->mutex);
    if (!d->expired) {
        if (phase != d->phase)
            d->since = clock_seconds(CLOCK_MONOTONIC);
        d->phase = phase;
        d->at = at;
        d->speak = speak;
        if (at < d->all->wake_at)
            pthread_cond_signal(&d->all->changed);
    }
    pthread_mutex_unlock(&d->all->mutex);
}

bool deadlines_make_room(deadlines *all, struct sockaddr_storage *from, bool *spare)
{
    const double now = clock_seconds(CLOCK_MONOTONIC);
    double longest = -1.0;
    deadline *found = NULL;
    pthread_mutex_lock(&all->mutex);
    for (deadline *d = all->first; d; d = d->next) {
        const double waited = (now - d->since) * (d->phase == DEADLINE_HEAD ? 1.0 : 0.1);
        if (!d->expired && (d->phase == DEADLINE_HEAD || d->phase == DEADLINE_IDLE) && waited > longest) {
            longest = waited;
            found = d;
        }
    }
    if (found) {
        socklen_t len = sizeof *from;
        memset(from, 0, sizeof *from);
        getpeername(found->fd, (struct sockaddr *)from, &len);
        *spare = found->spare;
        found->expired = true;
        found->at = INFINITY;
        shutdown(found->fd, SHUT_RDWR);
    }
    pthread_mutex_unlock(&all->mutex);
    return found != NULL;
}

bool deadline_expired(deadline *d)
{
    pthread_mutex_lock(&d->all->mutex);
    bool expired = d->expired;
    pthread_mutex_unlock(&d->all->mutex);
    return expired;
}

void deadline_remove(deadline *d)
{
    if (!d)
        return;
    deadlines *all = d->all;
    pthread_mutex_lock(&all->mutex);
    if (d->previous)
        d->previous->next = d->next;
    else
        all->first = d->next;
    if (d->next)
        d->next->previous = d->previous;
    pthread_mutex_unlock(&all->mutex);
    free(d);
}
