/* jobs.h: what handlers about jobs share. */
#ifndef SERVER_HTTP_JOBS_H
#define SERVER_HTTP_JOBS_H

#include "http/api.h"

/* Reads the job named in the path; false with a 404 or 500 in reply. */
bool jobs_load(api *context, http_request *rq, job *out, http_reply *reply);
bool jobs_ended(const job *j);
/* A running job's progress lives in the worker; the store has the one of the last lease. */
void jobs_freshen(api *context, job *j);

/* For replies that were read from the store piece by piece: turns a 200 into a 404 if the job was deleted meanwhile, as
 * pieces may then be missing. */
void jobs_check_still_there(api *context, const job *j, http_reply *reply);

/* Waits as the request prefers, `otherwise` seconds where it does not say, and reads the job again; *j is replaced.
 * False with a failure in reply. */
bool jobs_wait(api *context, http_request *rq, double otherwise, job *j, http_reply *reply);
/* Answers with the job as it is then. */
typedef void (*jobs_then)(api *context, job *j, http_reply *reply);
/* Waits as the request prefers and answers by `then`; a longer wait goes on after the handler's return (transport.h),
 * so that then must not need what the handler has. since: as work_wait_since has it. */
void jobs_wait_then(api *context, http_request *rq, job *j, uint64_t since, jobs_then then, http_reply *reply);

/* Answers with the job: 200 where it has ended, else 202, and where it is. */
void jobs_acknowledge(api *context, job *j, http_reply *reply);

#endif
