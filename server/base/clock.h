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

/* What is deleted for its age must not go because the clock on the wall was set wrong, by years at times: a clock that
 * follows that one while it goes, and where it jumps forward goes on at its own pace for a day, before it believes it.
 * Where it begins, more than a day after `newest`, the last thing that is known to have happened (0: nothing is), it is
 * a day after that. Begins zeroed; wall and monotonic are the two clocks now. Never later than the wall's. */
typedef struct {
    double at, monotonic, apart; /* apart: for how long it has not followed */
    bool begun;
} age_clock;
double age_clock_now(age_clock *c, double newest, double wall, double monotonic);

/* A condition for clock_wait, which never jumps as the clock on the wall may. */
void clock_condition(pthread_cond_t *condition);
/* Waits for the condition, under the lock, until that time on CLOCK_MONOTONIC; INFINITY: without end. False: the time
 * is over. */
bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, double until);

#endif
