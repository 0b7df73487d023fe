/* housekeeping.c: what has to happen without anybody asking: what is old or too much goes. In a thread of its own, so
 * that a long deletion never keeps a lease from being renewed. */
#include "work/housekeeping.h"
#include "store/uploads.h"

#include <errno.h>

#define ROUND_S 1.0

static void tidy(work *w)
{
    store_collect_uploads(w->store, NULL);
}

void *housekeeping_loop(void *arg)
{
    work *w = arg;
    struct timespec deadline;
    pthread_mutex_lock(&w->lock);
    while (!w->finished) {
        work_deadline(&deadline, ROUND_S);
        if (pthread_cond_timedwait(&w->tick, &w->lock, &deadline) != ETIMEDOUT)
            continue;
        pthread_mutex_unlock(&w->lock);
        tidy(w);
        pthread_mutex_lock(&w->lock);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}
