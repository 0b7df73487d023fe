/* aside.h: further threads of the process, on which something is computed while its owner goes on with what does not
 * need it, or in parts with him.
 *
 * A process that wants the threads starts them once; in all others everything is computed on the thread that asks.
 * There is one task at a time and one share, whoever they are of. What is computed is the same on any thread. */
#ifndef UZ_CORE_ASIDE_H
#define UZ_CORE_ASIDE_H

#include <stdbool.h>

/* Threads that a share may run on, at most. */
enum { UZ_ASIDE_MOST = 16 };

typedef struct {
    void (*run)(void *ctx);
    void *ctx;
    enum { UZ_ASIDE_NEVER, UZ_ASIDE_WAITS, UZ_ASIDE_RUNS, UZ_ASIDE_DONE } state; /* zero at first, then aside.c's */
} uz_aside_task;

/* Starts threads until there are so many, the caller's own among them. Returns how many there are: fewer are no
 * failure. */
int uz_aside_begin(int threads);
/* How many of them may compute from now on, that of the caller among them: as there are idle processors. May be called
 * from any thread at any time. */
void uz_aside_allow(int threads);

/* Nothing is under way, and a task would be taken. */
bool uz_aside_is_idle(void);
/* Has run(ctx) called on another thread. False: nobody does, now or later. */
bool uz_aside_start(uz_aside_task *task);
/* Waits while the task runs; one that was not begun is taken back. True: it has run. It may be asked again. */
bool uz_aside_finish(uz_aside_task *task);

/* Threads that a share would find now, 1 to UZ_ASIDE_MOST. */
int uz_aside_threads(void);
/* Threads that there are, whether they may compute or not: shares find no more. */
int uz_aside_count(void);
/* Threads that shares since the last call had, at most: 1 where there was none. */
int uz_aside_used(void);
/* Calls run(ctx, part) for every part from 0 to parts - 1, some of them on other threads, one that has a task as soon
 * as that has ended, and comes back after all. Parts must not wait for each other: what a thread has not begun, the
 * caller does. */
void uz_aside_share(void (*run)(void *ctx, int part), void *ctx, int parts);

#endif
