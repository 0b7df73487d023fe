/* housekeeping.h: the thread that ends what waits too long and deletes what is kept too long. */
#ifndef SERVER_WORK_HOUSEKEEPING_H
#define SERVER_WORK_HOUSEKEEPING_H

#include "work/internal.h"

/* The body of the thread; ends with w->finished. */
void *housekeeping_loop(void *arg);

#endif
