/* housekeeping.h: the thread that ends what waits too long and deletes what is kept too long. */
#ifndef SERVER_WORK_HOUSEKEEPING_H
#define SERVER_WORK_HOUSEKEEPING_H

#include "work/internal.h"

/* Says how this daemon is, for who looks at all of them, and asks whether it is to claim jobs. */
void housekeeping_report(work *w);

/* The body of the thread; ends with w->finished. */
void *housekeeping_loop(void *arg);

#endif
