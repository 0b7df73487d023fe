#include "base/clock.h"

#include <errno.h>

void clock_condition(pthread_cond_t *condition)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(condition, &attributes);
    pthread_condattr_destroy(&attributes);
}

bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, double until)
{
    static const double NEVER = 1e12; /* that many seconds fit into a time_t, and nobody waits for so long */
    if (!(until < NEVER))
        return pthread_cond_wait(condition, lock) == 0;
    struct timespec t = {.tv_sec = (time_t)until};
    t.tv_nsec = (long)((until - (double)t.tv_sec) * 1e9);
    return pthread_cond_timedwait(condition, lock, &t) != ETIMEDOUT;
}
