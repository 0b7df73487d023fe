/* clock.h: seconds on clocks that never go back. */
#ifndef UZ_CORE_CLOCK_H
#define UZ_CORE_CLOCK_H

#include <math.h>
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

/* Seconds of this thread that `work` takes: the least of `least` runs, or of up to `most` while these have taken less
 * than `enough` seconds. */
static inline double uz_least_seconds(void (*work)(void *ctx), void *ctx, int least, int most, double enough)
{
    double found = INFINITY;
    const double begun = uz_thread_seconds();
    for (int k = 0; k < most && (k < least || uz_thread_seconds() - begun < enough); k++) {
        const double start = uz_thread_seconds();
        work(ctx);
        found = fmin(found, uz_thread_seconds() - start);
    }
    return found;
}

#endif
