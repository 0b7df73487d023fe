/* clock.h: seconds on clocks that never go back. */
#ifndef UZ_CORE_CLOCK_H
#define UZ_CORE_CLOCK_H

#include <time.h>

static inline double uz_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* That this thread had a processor: what others do on the machine is not in it. */
static inline double uz_thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
