/* waiting.h: a reply that waits for a job to end (`Prefer: wait`), beyond the first moments without a thread (held.h).
 */
#ifndef SERVER_HTTP_WAITING_H
#define SERVER_HTTP_WAITING_H

#include "http/request.h"

/* Answers with the job as it is then. */
typedef void (*waiting_then)(api *context, job *j, http_reply *reply);

/* Puts a source into rq->reply that answers by `then` when the job has ended, or after so many seconds; its failures
 * are answered too. False: no memory. */
bool waiting_begin(api *context, http_request *rq, const char *id, double seconds, waiting_then then);

#endif
