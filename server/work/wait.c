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

bool work_wait(work *w, const char *id, double seconds, int fd, const atomic_bool *no_more)
{
    struct pollfd client = {.fd = fd, .events = POLLRDHUP}; /* poll passes over a negative one */
    double until = clock_seconds(CLOCK_MONOTONIC) + seconds, left;
    listener *l = feed_listen(w->feed, id); /* before the first look, so that no end is missed */
    bool ended;
    for (;;) {
        job j;
        const store_status status = store_get(w->store, id, &j);
        ended =
            status == STORE_NOT_FOUND || (status == STORE_OK && j.status != JOB_ACCEPTED && j.status != JOB_RUNNING);
        job_clear(&j);
        left = until - clock_seconds(CLOCK_MONOTONIC);
        if (!l || ended || left <= 0.0 || work_is_stopping(w) || poll(&client, 1, 0) > 0 ||
            (no_more && atomic_load(no_more)))
            break;
        feed_wait(l, fd, left < LOOK_AGAIN_S ? left : LOOK_AGAIN_S);
    }
    feed_unlisten(l);
    return ended;
}
