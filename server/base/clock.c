#include "base/clock.h"

#include <math.h>

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

double age_clock_now(age_clock *c, double newest, double wall, double monotonic)
{
    static const double FOLLOWS_S = 60.0, DOUBTS_S = 86400.0;
    const double passed = c->begun ? monotonic - c->monotonic : 0.0;
    if (!c->begun)
        c->at = newest > 0.0 ? fmin(wall, newest + DOUBTS_S) : wall;
    c->begun = true;
    c->monotonic = monotonic;
    c->at += passed;
    c->apart += passed;
    if (fabs(wall - c->at) <= FOLLOWS_S || wall < c->at || c->apart > DOUBTS_S) {
        c->at = wall;
        c->apart = 0.0;
    }
    return c->at;
}
