/* wait.c: those who wait for a job to end. */
#include "work/internal.h"

#include <poll.h>

/* Every change of a job is told; should a store have failed when one looked, it is asked again after this. */
#define LOOK_AGAIN_S 15.0

bool work_is_stopping(work *w)
{
    pthread_mutex_lock(&w->lock);
    bool stopping = w->stopping;
    pthread_mutex_unlock(&w->lock);
    return stopping;
}

store_status work_look(work *w, const char *id, job *out)
{
    return ends_find(w->ends, id, out) ? STORE_OK : store_get(w->store, id, out);
}

bool work_wait_since(work *w, const char *id, uint64_t since, double seconds, int fd, const atomic_bool *no_more,
                     job *found)
{
    struct pollfd client = {.fd = fd, .events = POLLRDHUP}; /* poll passes over a negative one */
    double until = clock_seconds(CLOCK_MONOTONIC) + seconds, left, look_at = clock_seconds(CLOCK_MONOTONIC);
    listener *l = feed_listen_end(w->feed, id, since); /* before the first look, so that no end is missed */
    bool ended = false, told = since == 0 || !l;
    look_at += LOOK_AGAIN_S;
    for (;;) {
        job j = {.progress = 0};
        const double now = clock_seconds(CLOCK_MONOTONIC);
        if (told || now >= look_at) {
            const store_status status = work_look(w, id, &j);
            ended = status == STORE_NOT_FOUND ||
                    (status == STORE_OK && j.status != JOB_ACCEPTED && j.status != JOB_RUNNING);
            look_at = now + LOOK_AGAIN_S;
        }
        if (ended && found)
            *found = j;
        else
            job_clear(&j);
        left = until - clock_seconds(CLOCK_MONOTONIC);
        if (!l || ended || left <= 0.0 || work_is_stopping(w) || poll(&client, 1, 0) > 0 ||
            (no_more && atomic_load(no_more)))
            break;
        told = feed_wait(l, fd, left < LOOK_AGAIN_S ? left : LOOK_AGAIN_S);
    }
    feed_unlisten(l);
    return ended;
}

bool work_wait(work *w, const char *id, double seconds, int fd, const atomic_bool *no_more)
{
    return work_wait_since(w, id, 0, seconds, fd, no_more, NULL);
}
