/* jobs.c: /v1/jobs and /v1/jobs/{id}. */
#include "codec/codec.h"
#include "http/deadlines.h"
#include "http/jobs.h"
#include "http/problem.h"
#include "http/request.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void reply_store_failure(api *context, store_status status, http_reply *reply)
{
    char cause[512] = "";
    if (status == STORE_NOT_FOUND) {
        reply_refuse(reply, 404, "not_found", "Not found", "there is no job with this id");
    } else if (status == STORE_FULL) {
        reply->retry_after_s = 60;
        reply_refuse(reply, 507, "storage_full", "The disk is full",
                     "nothing was stored: delete ended jobs or free disk space, then try again");
    } else if (status == STORE_CONFLICT) {
        reply_refuse(reply, 409, "conflict", "The job's state does not allow this",
                     "the job changed meanwhile: look at its status and try again");
    } else {
        store_message(context->store, cause, sizeof cause);
        log_write(context->log, LOG_ERROR, "store_error", (log_field[]){LOG_S("cause", cause), {0}});
        reply_refuse(reply, 500, "store_error", "The store failed", "the server's log has the cause");
    }
}

bool jobs_load(api *context, http_request *rq, job *out, http_reply *reply)
{
    memset(out, 0, sizeof *out);
    snprintf(rq->job_id, sizeof rq->job_id, "%.32s", rq->name);
    store_status status = store_get(context->store, rq->job_id, out);
    if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    return status == STORE_OK;
}

bool jobs_ended(const job *j)
{
    return j->status != JOB_ACCEPTED && j->status != JOB_RUNNING;
}

/* Waits in slices, so that a thread does not outlive its client for long. */
static void wait_for_end(api *context, const http_request *rq, const char *id, double seconds)
{
    const double slice_s = 1.0;
    double end = deadlines_now() + seconds;
    for (double left = seconds; left > 0; left = end - deadlines_now())
        if (work_wait(context->work, id, fmin(left, slice_s)) || atomic_load(&context->draining) ||
            request_client_gone(rq))
            return;
}

bool jobs_wait(api *context, http_request *rq, double otherwise, job *j, http_reply *reply)
{
    double seconds = request_wait(rq, otherwise, context->max_wait_s);
    if (seconds <= 0 || jobs_ended(j))
        return true;
    wait_for_end(context, rq, j->id, seconds);
    if (request_wait(rq, -1, context->max_wait_s) >= 0)
        snprintf(reply->preference_applied, sizeof reply->preference_applied, "wait=%.0f", seconds);
    char id[sizeof j->id];
    memcpy(id, j->id, sizeof id);
    job_clear(j);
    store_status status = store_get(context->store, id, j);
    if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    return status == STORE_OK;
}

/* A running job's progress lives in the worker; the store has the one of the last lease. */
static void freshen(api *context, job *j)
{
    int progress;
    if (j->status == JOB_RUNNING && work_live(context->work, j->id, -1, &progress, NULL, NULL))
        j->progress = progress;
}

static void reply_job(api *context, int status, job *j, http_reply *reply)
{
    freshen(context, j);
    reply_json(reply, status, codec_encode_job(j));
}

/* ------------------------------------------------------------------ submit */

/* A key is kept as sent: 1 to 255 printable ASCII characters. */
bool jobs_read_key(const http_request *rq, char **key, problem_details *problem)
{
    size_t count;
    const header_field *field = header_find(&rq->headers, "Idempotency-Key", &count);
    *key = NULL;
    if (!field)
        return true;
    bool valid = count == 1 && field->value_len >= 1 && field->value_len <= 255;
    for (size_t i = 0; valid && i < field->value_len; i++)
        valid = field->value[i] >= 0x20 && field->value[i] <= 0x7e;
    if (!valid)
        return http_problem(problem, 400, "bad_idempotency_key", "The Idempotency-Key is malformed",
                            "give one Idempotency-Key of 1 to 255 printable ASCII characters");
    *key = strndup(field->value, field->value_len);
    if (!*key)
        return http_problem(problem, 503, "no_memory", "Out of memory", "try again later");
    return true;
}

static bool read_validate(const http_request *rq, bool *only, problem_details *problem)
{
    const char *text = target_value(&rq->target, "validate");
    *only = text && strcmp(text, "true") == 0;
    if (text && !*only && strcmp(text, "false") != 0)
        return http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                            "validate must be true or false");
    return true;
}

bool jobs_store(api *context, http_request *rq, const store_request *request, job *out, http_reply *reply)
{
    bool repeated = false;
    store_status status = store_submit(context->store, request, out, &repeated);
    if (status == STORE_CONFLICT)
        reply_refuse(reply, 422, "idempotency_key_reused", "The Idempotency-Key was used for another request",
                     "this key came before with a different body: use a new key for a new job");
    else if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    if (status != STORE_OK)
        return false;
    memcpy(rq->job_id, out->id, sizeof rq->job_id);
    if (!repeated) {
        metrics_add(context->metrics, METRIC_SUBMITTED, 1);
        work_wake(context->work);
    }
    return true;
}

void jobs_acknowledge(api *context, job *j, http_reply *reply)
{
    snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", j->id);
    reply_job(context, jobs_ended(j) ? 200 : 202, j, reply);
}

static void submit(api *context, http_request *rq, const store_request *request, http_reply *reply)
{
    job j = {0};
    if (jobs_store(context, rq, request, &j, reply) && jobs_wait(context, rq, 0, &j, reply))
        jobs_acknowledge(context, &j, reply);
    job_clear(&j);
}

void jobs_submit(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    codec_request request = {0};
    char *key = NULL, *tags = NULL;
    bool validate_only;
    if (!read_validate(rq, &validate_only, &problem) || !jobs_read_key(rq, &key, &problem) ||
        !codec_decode_request(&request, rq->body ? rq->body : "", rq->body_len, &problem) ||
        !start_check(context, &request, rq, &problem)) {
        reply_problem(reply, &problem);
        goto done;
    }
    tags = request.tags;
    request.tags = NULL;
    codec_request_clear(&request); /* the worker decodes again: nothing decoded waits here while the client does */
    if (validate_only)
        reply_json(reply, 200, strdup("{\"valid\": true}\n"));
    else
        submit(context, rq, &(store_request){rq->body, rq->body_len, tags, key, NULL}, reply);
done:
    codec_request_clear(&request);
    free(tags);
    free(key);
}

/* -------------------------------------------------------------- list, read */

static bool is_id(const char *text)
{
    return strlen(text) == 32 && strspn(text, "0123456789abcdef") == 32;
}

static bool read_query(const http_request *rq, store_query *query, problem_details *problem)
{
    int64_t limit = 50;
    const char *status = target_value(&rq->target, "status");
    memset(query, 0, sizeof *query);
    query->tag = target_value(&rq->target, "tag");
    query->before = target_value(&rq->target, "cursor");
    query->by_status = status != NULL;
    if (status && !job_status_parse(&query->status, status))
        return http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                            "status must be accepted, running, successful, failed or dismissed");
    if (query->before && !is_id(query->before))
        return http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                            "cursor must be the \"next\" of an earlier page");
    if (!request_integer(rq, "limit", 1, 1000, &limit, problem))
        return false;
    query->limit = (int)limit;
    return true;
}

void jobs_list(api *context, http_request *rq, http_reply *reply)
{
    store_query query;
    problem_details problem;
    job *jobs = NULL;
    size_t count = 0;
    bool more = false;
    if (!read_query(rq, &query, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    store_status status = store_list(context->store, &query, &jobs, &count, &more);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    for (size_t i = 0; i < count; i++)
        freshen(context, &jobs[i]);
    reply_json(reply, 200, codec_encode_jobs(jobs, count, more));
    for (size_t i = 0; i < count; i++)
        job_clear(&jobs[i]);
    free(jobs);
}

void jobs_get(api *context, http_request *rq, http_reply *reply)
{
    job j;
    if (jobs_load(context, rq, &j, reply) && jobs_wait(context, rq, 0, &j, reply))
        reply_job(context, 200, &j, reply);
    job_clear(&j);
}

/* ----------------------------------------------------------------- dismiss */

/* A running job ends soon after it is told to; this much is worth waiting for, so that the answer says "dismissed". */
static const double DISMISS_WAIT_S = 0.25;

void jobs_delete(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    job_status was;
    snprintf(rq->job_id, sizeof rq->job_id, "%.32s", rq->name);
    store_status status = store_dismiss(context->store, rq->job_id, &was);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    if (was != JOB_ACCEPTED && was != JOB_RUNNING) {
        reply->status = 204;
        return;
    }
    if (was == JOB_RUNNING && work_cancel(context->work, rq->job_id))
        work_wait(context->work, rq->job_id, DISMISS_WAIT_S);
    if (jobs_load(context, rq, &j, reply))
        reply_job(context, 200, &j, reply);
    job_clear(&j);
}
