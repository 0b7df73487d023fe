/* aside.h: a second thread of the process, on which something can be computed while its owner goes on with what does
 * not need it.
 *
 * A process that wants the thread starts it once; in all others nothing is computed aside. There is one task at a time,
 * whoever it is of. What is computed is the same on either thread. */
#ifndef UZ_CORE_ASIDE_H
#define UZ_CORE_ASIDE_H

#include <stdbool.h>

typedef struct {
    void (*run)(void *ctx);
    void *ctx;
    enum { UZ_ASIDE_NEVER, UZ_ASIDE_WAITS, UZ_ASIDE_RUNS, UZ_ASIDE_DONE } state; /* zero at first, then aside.c's */
} uz_aside_task;

/* Starts the thread, at most once. False: there is none, which is no failure. */
bool uz_aside_begin(void);
/* Whether tasks are taken from now on: where a processor is idle. */
void uz_aside_allow(bool allowed);
/* Nothing is under way, and a task would be taken. */
bool uz_aside_is_idle(void);
/* Has run(ctx) called on that thread. False: nobody does, now or later. */
bool uz_aside_start(uz_aside_task *task);
/* Waits while the task runs; one that was not begun is taken back. True: it has run. It may be asked again. */
bool uz_aside_finish(uz_aside_task *task);

#endif
