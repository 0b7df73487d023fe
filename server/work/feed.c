#include "work/feed.h"

#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define BUCKETS 4096 /* a power of 2 */
/* Without a descriptor to be woken by a listener looks by itself, so often. */
#define LOOK_S 0.25

/* A listener waits for a descriptor, not for a condition, so that it sees its client leave in the same wait. */
struct listener {
    feed *feed;
    char id[33];   /* "": all jobs */
    bool of_end;   /* told only of what may be the job's end */
    int wake;      /* eventfd; -1: there was none to be had */
    bool signaled; /* wake was written since the last wait returned */
    listener **at, *next;
};

typedef struct {
    feed_change change;
    bool is_past; /* a later change of the same job is kept */
} kept_change;

struct feed {
    pthread_mutex_t lock;
    uint64_t last;
    kept_change kept[FEED_KEPT];  /* number n at n % FEED_KEPT */
    uint64_t newest[BUCKETS];     /* a change of one of the jobs with this hash: the newest */
    uint64_t ends[BUCKETS];       /* the same of those that may be an end */
    listener *listeners[BUCKETS]; /* to one job */
    listener *all;
};

/* FNV-1a. */
static size_t bucket(const char *id)
{
    uint32_t hash = 2166136261u;
    for (; *id; id++)
        hash = (hash ^ (unsigned char)*id) * 16777619u;
    return hash % BUCKETS;
}

feed *feed_new(void)
{
    feed *f = calloc(1, sizeof *f);
    if (f)
        pthread_mutex_init(&f->lock, NULL);
    return f;
}

void feed_free(feed *f)
{
    if (!f)
        return;
    pthread_mutex_destroy(&f->lock);
    free(f);
}

/* ---- telling */

/* Those who listen to this job; NULL: all of the list. goes_on: not those who wait for its end. Under the lock. */
static void wake(listener *first, const char *id, bool goes_on)
{
    for (listener *l = first; l; l = l->next) {
        if ((id && strcmp(l->id, id) != 0) || (goes_on && l->of_end))
            continue;
        if (!l->signaled && l->wake >= 0)
            eventfd_write(l->wake, 1);
        l->signaled = true;
    }
}

static void change(feed *f, const char *id, bool goes_on, const char *deleted_of)
{
    pthread_mutex_lock(&f->lock);
    uint64_t *newest = &f->newest[bucket(id)];
    kept_change *before = &f->kept[*newest % FEED_KEPT], *now = &f->kept[++f->last % FEED_KEPT];
    if (*newest > 0 && before->change.number == *newest && strcmp(before->change.id, id) == 0)
        before->is_past = true;
    *newest = now->change.number = f->last;
    if (!goes_on)
        f->ends[bucket(id)] = f->last;
    now->is_past = false;
    snprintf(now->change.id, sizeof now->change.id, "%s", id);
    now->change.deleted = deleted_of != NULL;
    snprintf(now->change.client, sizeof now->change.client, "%s", deleted_of ? deleted_of : "");
    wake(f->listeners[bucket(id)], id, goes_on);
    wake(f->all, NULL, false);
    pthread_mutex_unlock(&f->lock);
}

void feed_changed(feed *f, const char *id, const char *deleted_of)
{
    change(f, id, false, deleted_of);
}

void feed_goes_on(feed *f, const char *id)
{
    change(f, id, true, NULL);
}

void feed_moved(feed *f, const char *id)
{
    pthread_mutex_lock(&f->lock);
    wake(f->listeners[bucket(id)], id, true);
    pthread_mutex_unlock(&f->lock);
}

void feed_wake_all(feed *f)
{
    pthread_mutex_lock(&f->lock);
    for (size_t i = 0; i < BUCKETS; i++)
        wake(f->listeners[i], NULL, false);
    wake(f->all, NULL, false);
    pthread_mutex_unlock(&f->lock);
}

/* ---- listening */

static listener *listen_to(feed *f, const char *id, bool of_end, uint64_t after)
{
    listener *l = calloc(1, sizeof *l);
    if (!l)
        return NULL;
    l->feed = f;
    l->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    snprintf(l->id, sizeof l->id, "%s", id ? id : "");
    l->of_end = of_end;
    pthread_mutex_lock(&f->lock);
    l->signaled = of_end && f->ends[bucket(l->id)] > after;
    if (l->signaled && l->wake >= 0)
        eventfd_write(l->wake, 1);
    l->at = id ? &f->listeners[bucket(id)] : &f->all;
    l->next = *l->at;
    if (l->next)
        l->next->at = &l->next;
    *l->at = l;
    pthread_mutex_unlock(&f->lock);
    return l;
}

listener *feed_listen(feed *f, const char *id)
{
    return listen_to(f, id, false, 0);
}

listener *feed_listen_end(feed *f, const char *id, uint64_t after)
{
    return listen_to(f, id, true, after);
}

void feed_unlisten(listener *l)
{
    if (!l)
        return;
    pthread_mutex_lock(&l->feed->lock);
    *l->at = l->next;
    if (l->next)
        l->next->at = l->at;
    pthread_mutex_unlock(&l->feed->lock);
    if (l->wake >= 0)
        close(l->wake);
    free(l);
}

bool feed_wait(listener *l, int fd, double seconds)
{
    struct pollfd p[2] = {{.fd = l->wake, .events = POLLIN}, {.fd = fd, .events = POLLRDHUP}};
    double most = l->wake < 0 && seconds > LOOK_S ? LOOK_S : seconds;
    int ms = most > 0.0 ? (int)fmin(ceil(most * 1e3), 1e9) : 0; /* NaN: at once */
    poll(p, 2, ms); /* a signal handler's EINTR is as good as any other return */
    eventfd_t unused;
    pthread_mutex_lock(&l->feed->lock);
    bool was = l->signaled;
    l->signaled = false;
    if (was && l->wake >= 0)
        eventfd_read(l->wake, &unused);
    pthread_mutex_unlock(&l->feed->lock);
    return was;
}

int feed_descriptor(const listener *l)
{
    return l->wake;
}

/* ---- reading */

bool feed_since(feed *f, uint64_t after, feed_change *out, size_t most, size_t *count, uint64_t *seen)
{
    *count = 0;
    *seen = after;
    pthread_mutex_lock(&f->lock);
    bool known = after <= f->last && f->last - after <= FEED_KEPT;
    if (!known)
        *seen = f->last;
    while (known && *seen < f->last && *count < most) {
        const kept_change *one = &f->kept[++*seen % FEED_KEPT];
        if (!one->is_past)
            out[(*count)++] = one->change;
    }
    pthread_mutex_unlock(&f->lock);
    return known;
}

uint64_t feed_last(feed *f)
{
    pthread_mutex_lock(&f->lock);
    const uint64_t last = f->last;
    pthread_mutex_unlock(&f->lock);
    return last;
}
