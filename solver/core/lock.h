/* lock.h: waiting for another thread's work only until it has to stop. */
#ifndef UZ_CORE_LOCK_H
#define UZ_CORE_LOCK_H

#include "core/hooks.h"

#include <pthread.h>

/* Locks the mutex, under which another thread may work for seconds; false, and not locked: it had to stop first.
 * A cancellation point every few milliseconds. */
bool uz_lock_while(pthread_mutex_t *mutex, const uz_stop *stop);

#endif
