/* jobs.h: what the handlers of jobs, results, refine and verify share. */
#ifndef SERVER_HTTP_JOBS_H
#define SERVER_HTTP_JOBS_H

#include "codec/codec.h"
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
 * so that then must not need what the handler has. */
void jobs_wait_then(api *context, http_request *rq, job *j, jobs_then then, http_reply *reply);

/* Puts a source into rq->reply that answers by `then` when the job has ended, or after so many seconds; its failures
 * are answered too. False: no memory. */
bool jobs_delay(api *context, http_request *rq, const char *id, double seconds, jobs_then then);

/* NULL in *key: none was given; freed by the caller. False with a 400. */
bool jobs_read_key(const http_request *rq, char **key, problem_details *problem);

/* What the store keeps of a decoded request, and of its body and key, which must outlive it. */
store_request jobs_request(const codec_request *request, const char *body, size_t len, const char *key);

/* url NULL: there is none. False: a 422. */
bool jobs_check_webhook(api *context, const char *url, problem_details *problem);

/* Stores a request and tells the workers. False with a failure in reply; the caller clears *out. */
bool jobs_store(api *context, http_request *rq, const store_request *request, job *out, http_reply *reply);

/* Stores a request, waits as it prefers and answers with the job. */
void jobs_store_and_wait(api *context, http_request *rq, const store_request *request, http_reply *reply);

/* True with *out if the request came before with this key (NULL: none) and this body. Then it is answered as it was,
 * also where it would be refused now: what it names may be gone since, or a limit lower. The caller clears *out. */
bool jobs_find_repeat(api *context, http_request *rq, const char *key, job *out);

/* Answers with the job: 200 where it has ended, else 202, and where it is. */
void jobs_acknowledge(api *context, job *j, http_reply *reply);

/* What a request says of the job it starts from, against the store. False: *problem. */
bool start_check(api *context, const codec_request *request, const http_request *rq, problem_details *problem);

/* False with a 409 that says why there is no answer. */
bool results_exist(const job *j, http_reply *reply);
/* Answers with the default fields of the result, as GET /v1/jobs/{id}/result does. */
void results_reply(api *context, const job *j, http_reply *reply);

/* Appends up to some names of cases to the detail, quoted: `Its cases: "a", "b", ... (5 in all).` Before them `Did you
 * mean "x"?` if a case has a name close to the wrong one; NULL: none was given. */
void cases_list(problem_details *problem, const char *wrong, const store_case *cases, size_t count);

#endif
