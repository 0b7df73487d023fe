/* fresh.c: pages that rows will be read into, touched while a process of a group has nothing else to do. A page that
 * the system has to find first is dear, above all on virtual machines (core/reserve.c), and the first process reads the
 * rows of all: what it waits for, all wait for. */
#include "worker.h"

#include "core/alloc.h"

#include <limits.h>
#include <stdlib.h>
#include <sys/mman.h>

#define SMALL_PAGE ((size_t)4096)
/* What is larger goes back to the system where it is freed. */
#define MOST (INT_MAX / 2)

/* The kernel is asked for pages and nothing is written: whoever has the room meanwhile loses nothing. */
static void *touch(void *arg)
{
    fresh_pages *fresh = arg;
    for (size_t at = 0; at < fresh->bytes && !atomic_load(&fresh->over); at += UZ_HUGE_PAGE)
        if (madvise(fresh->at + at, fresh->bytes - at < UZ_HUGE_PAGE ? fresh->bytes - at : UZ_HUGE_PAGE,
                    MADV_POPULATE_WRITE) != 0)
            break;
    return NULL;
}

/* A block that is freed at once stays in the heap (main.c), where the next ones are made of it, from its begin on. */
void fresh_begin(fresh_pages *fresh, int64_t bytes)
{
    fresh_end(fresh);
    bytes = bytes < MOST ? bytes : MOST;
    if (bytes < (int64_t)UZ_HUGE_PAGE)
        return;
    char *block = uz_alloc(bytes, 1);
    if (!block) /* as many as there will be, about: who needs them says so */
        return;
    fresh->at = block + (SMALL_PAGE - (uintptr_t)block % SMALL_PAGE) % SMALL_PAGE;
    fresh->bytes = (size_t)(bytes - (fresh->at - block)) / SMALL_PAGE * SMALL_PAGE;
    free(block);
    atomic_store(&fresh->over, false);
    fresh->runs = pthread_create(&fresh->thread, NULL, touch, fresh) == 0;
}

void fresh_end(fresh_pages *fresh)
{
    atomic_store(&fresh->over, true);
    if (fresh->runs)
        pthread_join(fresh->thread, NULL);
    fresh->runs = false;
}
