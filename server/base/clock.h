/* clock.h: the time, in seconds. */
#ifndef SERVER_BASE_CLOCK_H
#define SERVER_BASE_CLOCK_H

#include <time.h>

/* CLOCK_REALTIME: since 1970; it may be set back. CLOCK_MONOTONIC: for how long something takes. */
static inline double clock_seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif
