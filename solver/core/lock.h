/* lock.h: waiting for another thread's work only as long as there is leave to. */
#ifndef UZ_CORE_LOCK_H
#define UZ_CORE_LOCK_H

#include "core/hooks.h"

#include <pthread.h>

/* Locks the mutex, under which another thread may work for seconds; false, and not locked: leave (NULL: for ever) was
 * over first. It is asked every few milliseconds. */
bool uz_lock_while(pthread_mutex_t *mutex, const uz_leave *leave);

#endif
