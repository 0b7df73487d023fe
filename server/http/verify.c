/* verify.c: POST /v1/verify: a job like any other, whose result is the answer to the call where it comes in time. */
#include "http/jobs.h"

#include <stdlib.h>

static const double VERIFY_WAIT_S = 30.0; /* where the request does not say; openapi.json says so */

static void reply_end(api *context, job *j, http_reply *reply)
{
    problem_details error = {0};
    if (!jobs_ended(j))
        jobs_acknowledge(context, j, reply);
    else if (j->status != JOB_FAILED) {
        if (results_exist(j, reply))
            results_reply(context, j, reply);
    } else if (j->error && codec_decode_problem(&error, j->error) && error.status >= 400) {
        reply_problem(reply, &error); /* what kept the answer from being certified is an error in the request */
    } else {
        reply_refuse(reply, 500, "internal", "A fault of this service", "the job failed and left no reason");
    }
}

void verify_submit(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    codec_request request = {0};
    job j = {0};
    char *key = NULL;
    if (!jobs_read_key(rq, &key, &problem) ||
        !codec_decode(&request, CODEC_VERIFY, rq->body ? rq->body : "", rq->body_len, context->store, &problem)) {
        if (!jobs_find_repeat(context, rq, key, &j))
            reply_problem(reply, &problem);
        else if (jobs_wait(context, rq, VERIFY_WAIT_S, &j, reply))
            reply_end(context, &j, reply);
        goto done;
    }
    codec_request_strip(&request);
    store_request stored = jobs_request(&request, rq->body, rq->body_len, key);
    if (jobs_store(context, rq, &stored, &j, reply) && jobs_wait(context, rq, VERIFY_WAIT_S, &j, reply))
        reply_end(context, &j, reply);
done:
    job_clear(&j);
    codec_request_clear(&request);
    free(key);
}
