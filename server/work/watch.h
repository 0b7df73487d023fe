/* watch.h: one job in a process that solves: what it asks is answered, what it does is told, and it obeys. */
#ifndef SERVER_WORK_WATCH_H
#define SERVER_WORK_WATCH_H

#include "work/internal.h"

typedef enum {
    WATCH_DONE,        /* *done says so; the outcome is in the outbox */
    WATCH_STOPPED,     /* killed, since it did not stop when it was told to */
    WATCH_KEPT,        /* killed: its time was over; *done says what it had kept in the outbox until then */
    WATCH_OVERDUE,     /* killed: its time was over, and it had no answer */
    WATCH_DIED,        /* of itself */
    WATCH_NOT_STARTED, /* the log says why */
    WATCH_NO_ROOM      /* no memory for the text */
} watch_end;

typedef struct {
    packet done, kept;   /* kept.kind: MESSAGE_KEPT, once it has kept something */
    double time_limit_s; /* OVERDUE: that was over */
    bool began;          /* OVERDUE: it had begun to iterate */
    int status;          /* DIED: as waitpid has it */
    bool out_of_memory;  /* DIED: of that */
} watch_report;

/* From the text to its end. body: freed; NULL: damaged. */
watch_end watch_job(worker *me, const job *claimed, char *body, size_t body_len, double queue_s, watch_report *out);

#endif
