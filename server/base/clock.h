/* clock.h: the time, in seconds, and waiting for it. */
#ifndef SERVER_BASE_CLOCK_H
#define SERVER_BASE_CLOCK_H

#include <pthread.h>
#include <stdbool.h>
#include <time.h>

/* CLOCK_REALTIME: since 1970; it may be set back. CLOCK_MONOTONIC: for how long something takes. */
static inline double clock_seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* A condition for clock_wait, which never jumps as the clock on the wall may. */
void clock_condition(pthread_cond_t *condition);
/* Waits for the condition, under the lock, until that time on CLOCK_MONOTONIC; INFINITY: without end. False: the time
 * is over. */
bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, double until);

#endif
