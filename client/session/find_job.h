/* find_job.h: jobs that are named by less than their whole id. */
#ifndef CLIENT_FIND_JOB_H
#define CLIENT_FIND_JOB_H

#include "session/session.h"

/* What options point to afterwards. */
enum { CLIENT_FOUND_JOBS = 2 + CLIENT_MAX_WORDS };
typedef struct {
    char id[CLIENT_FOUND_JOBS][33];
} client_found_jobs;

/* Wherever the command line names a job (its operand ID, --baseline, --with) by @last, the newest job, or by four and
 * more digits that its id begins or ends with, as the page shows it, the id takes their place. Only the newest 2,000
 * jobs are looked at. Errors, said: CLIENT_USAGE where several fit, CLIENT_REFUSED where none does, or as of
 * client_ask. Other words stay as they are. */
client_exit client_find_jobs(client_session *s, client_options *options, client_found_jobs *room);

#endif
