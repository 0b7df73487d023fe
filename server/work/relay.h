/* relay.h: what a process that solves sees of the store: uploads and parts of earlier jobs, for which it asks the
 * daemon. Both sides of the conversation. */
#ifndef SERVER_WORK_RELAY_H
#define SERVER_WORK_RELAY_H

#include "store/store.h"
#include "work/message.h"
#include "work/segment.h"

/* The process's side: a store for one thread with uploads, vectors, histories and cases to be read, and no other
 * operation. Socket and inbox must outlive it; closed with store_close. NULL: no memory. */
store *relay_open(int socket, segment *inbox);

/* What a process may have: the uploads that the request of its job names, and parts of the job that this starts from.
 * Without a job: these uploads. */
typedef struct {
    const char *job;           /* may be NULL */
    char start[33];            /* "": it starts from none */
    const char (*uploads)[65]; /* n_uploads */
    size_t n_uploads;
} relay_rights;

/* start: what the text of a request names by the key "job", which nothing else in it has; "" where that is no id. */
void relay_find_start(char start[33], const char *request, size_t len);

/* The daemon's side: fills the ANSWER to an ASK of the process that has these rights; what is large goes
 * into the inbox from `at` on. *fd: a descriptor that goes with it, which the caller closes; -1: none. */
void relay_answer(packet *answer, int *fd, store *s, const relay_rights *of, const packet *ask, segment *inbox,
                  size_t at);

#endif
