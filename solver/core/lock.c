#include "core/lock.h"

#include <time.h>

#define PATIENCE_NS 5000000

bool uz_lock_while(pthread_mutex_t *mutex, const uz_stop *stop)
{
    if (pthread_mutex_trylock(mutex) == 0)
        return true;
    if (!stop)
        return pthread_mutex_lock(mutex) == 0;
    while (!uz_stop_is_due(stop)) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until); /* the clock of timedlock */
        until.tv_nsec += PATIENCE_NS;
        if (until.tv_nsec >= 1000000000) {
            until.tv_nsec -= 1000000000;
            until.tv_sec++;
        }
        if (pthread_mutex_timedlock(mutex, &until) == 0)
            return true;
    }
    return false;
}
