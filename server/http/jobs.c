/* jobs.c: /v1/jobs and /v1/jobs/{id}. */
#include "codec/codec.h"
#include "http/jobs.h"
#include "http/api.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void reply_store_failure(api *context, store_status status, http_reply *reply)
{
    char cause[512] = "";
    problem_details problem;
    if (status == STORE_NOT_FOUND) {
        reply_refuse(reply, 404, "not_found", "Not found", "there is no job with this id");
    } else if (status == STORE_FULL) {
        reply->retry_after_s = 60;
        reply_refuse(reply, 507, "storage_full", "The disk is full",
                     "nothing was stored: delete ended jobs or free disk space, then try again");
    } else if (status == STORE_LOCKED) {
        reply->retry_after_s = 5;
        store_message(context->store, cause, sizeof cause);
        log_write(context->log, LOG_ERROR, "store_locked", (log_field[]){LOG_S("cause", cause), {0}});
        reply_refuse(reply, 503, "store_locked", "The store is in use",
                     "another program holds the database file: nothing was changed; try again later");
    } else if (status == STORE_BUSY) {
        reply->retry_after_s = 10;
        reply_refuse(reply, 503, "queue_full", "Too many jobs wait",
                     "as many jobs wait as this server lets (its option --max-queue): try again later");
    } else if (status == STORE_CONFLICT) {
        reply_refuse(reply, 409, "conflict", "The job's state does not allow this",
                     "the job changed meanwhile: look at its status and try again");
    } else if (status == STORE_DAMAGED) {
        store_message(context->store, cause, sizeof cause);
        log_write(context->log, LOG_ERROR, "stored_data_damaged",
                  (log_field[]){LOG_S("job", reply->job), LOG_S("cause", cause), {0}});
        codec_problem_damaged(&problem, reply->job ? reply->job : "");
        reply_problem(reply, &problem);
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
    if (status == STORE_OK && out->damaged) {
        job_clear(out);
        status = STORE_DAMAGED;
    }
    if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    return status == STORE_OK;
}

void jobs_check_still_there(api *context, const job *j, http_reply *reply)
{
    job now = {0};
    store_status status = reply->status == 200 ? store_get(context->store, j->id, &now) : STORE_OK;
    job_clear(&now);
    if (status == STORE_OK)
        return;
    reply->tag[0] = '\0';
    reply->tag_by_body = reply->takes_ranges = false;
    reply_store_failure(context, status, reply);
}

bool jobs_ended(const job *j)
{
    return j->status != JOB_ACCEPTED && j->status != JOB_RUNNING;
}

static void note_preference(const api *context, const http_request *rq, double seconds, http_reply *reply)
{
    if (request_wait(rq, -1, context->options.max_wait_s) >= 0)
        snprintf(reply->preference_applied, sizeof reply->preference_applied, "wait=%.0f", seconds);
}

static bool load_again(api *context, job *j, http_reply *reply)
{
    char id[sizeof j->id];
    memcpy(id, j->id, sizeof id);
    job_clear(j);
    store_status status = store_get(context->store, id, j);
    if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    return status == STORE_OK;
}

bool jobs_wait(api *context, http_request *rq, double otherwise, job *j, http_reply *reply)
{
    double seconds = request_wait(rq, otherwise, context->options.max_wait_s);
    if (seconds <= 0 || jobs_ended(j))
        return true;
    work_wait_for(context->work, j->id, seconds, rq->fd, transport_draining(context->server));
    note_preference(context, rq, seconds, reply);
    return load_again(context, j, reply);
}

/* So long a wait keeps its thread: a connection that has given it up ends with the reply (held.h). */
static const double SHORT_WAIT_S = 1.0;

void jobs_wait_then(api *context, http_request *rq, job *j, jobs_then then, http_reply *reply)
{
    double seconds = request_wait(rq, 0, context->options.max_wait_s), rest = fmax(seconds - SHORT_WAIT_S, 0.0);
    if (seconds <= 0 || jobs_ended(j)) {
        then(context, j, reply);
        return;
    }
    note_preference(context, rq, seconds, reply);
    if (work_wait_for(context->work, j->id, seconds - rest, rq->fd, transport_draining(context->server)) ||
        rest == 0.0 || !jobs_delay(context, rq, j->id, rest, then)) {
        if (load_again(context, j, reply))
            then(context, j, reply);
    }
}

void jobs_freshen(api *context, job *j)
{
    int progress;
    if (j->status == JOB_RUNNING && work_live(context->work, j->id, -1, &progress, NULL, NULL))
        j->progress = progress;
}

static void reply_job(api *context, int status, job *j, http_reply *reply)
{
    jobs_freshen(context, j);
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
        return problem_fill(problem, 400, "bad_idempotency_key", "The Idempotency-Key is malformed",
                            "give one Idempotency-Key of 1 to 255 printable ASCII characters");
    *key = strndup(field->value, field->value_len);
    if (!*key)
        return problem_fill(problem, 503, "no_memory", "Out of memory", "try again later");
    return true;
}

store_request jobs_request(const codec_request *request, const char *body, size_t len, const char *key)
{
    return (store_request){.body = body,
                           .body_len = len,
                           .tags = request->tags,
                           .idempotency_key = key,
                           .uploads = (const char(*)[65])request->uploads,
                           .n_uploads = request->n_uploads,
                           .priority = request->priority,
                           .queue_limit_s = request->queue_limit_s,
                           .webhook = request->webhook};
}

bool jobs_check_webhook(api *context, const char *url, problem_details *problem)
{
    const char *why;
    if (!url || webhooks_allow(context->webhooks, url, &why))
        return true;
    problem_fill(problem, 422, "webhook_not_allowed", "The webhook cannot be called", "/webhook/url: %s", why);
    strcpy(problem->pointer, "/webhook/url");
    return false;
}

bool jobs_store(api *context, http_request *rq, const store_request *request, job *out, http_reply *reply)
{
    bool repeated = false;
    problem_details problem;
    if (!jobs_check_webhook(context, request->webhook, &problem)) {
        reply_problem(reply, &problem);
        return false;
    }
    store_status status = store_submit(context->store, request, out, &repeated);
    if (status == STORE_CONFLICT)
        reply_refuse(reply, 422, "idempotency_key_reused", "The Idempotency-Key was used for another request",
                     "this key came before with a different body: use a new key for a new job");
    else if (status == STORE_NOT_FOUND)
        reply_refuse(reply, 422, "unknown_upload", "An upload is not there",
                     "an upload that the request names was deleted meanwhile: send it again");
    else if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    if (status != STORE_OK)
        return false;
    memcpy(rq->job_id, out->id, sizeof rq->job_id);
    if (!repeated)
        metrics_add(context->metrics, METRIC_SUBMITTED, 1);
    return true;
}

bool jobs_find_repeat(api *context, http_request *rq, const char *key, job *out)
{
    store_request request = {.body = rq->body ? rq->body : "", .body_len = rq->body_len, .idempotency_key = key};
    memset(out, 0, sizeof *out);
    if (!key || store_find_repeat(context->store, &request, out) != STORE_OK)
        return false;
    memcpy(rq->job_id, out->id, sizeof rq->job_id);
    return true;
}

void jobs_acknowledge(api *context, job *j, http_reply *reply)
{
    snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", j->id);
    reply_job(context, jobs_ended(j) ? 200 : 202, j, reply);
}

void jobs_store_and_wait(api *context, http_request *rq, const store_request *request, http_reply *reply)
{
    job j = {0};
    if (jobs_store(context, rq, request, &j, reply))
        jobs_wait_then(context, rq, &j, jobs_acknowledge, reply);
    job_clear(&j);
}

/* Bytes that assembly takes for each dof, about: a scene beyond the limit is not assembled only to say so. */
#define ASSEMBLY_BYTES 1000.0
/* Beyond it a prediction takes minutes. */
#define PREDICTED_MOST 4e6

void jobs_submit(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0}, ignored;
    codec_request request = {0};
    char *key = NULL;
    const char *validate = target_value(&rq->target, "validate");
    const bool validate_only = validate && strcmp(validate, "true") == 0;
    bool good = !validate || validate_only || strcmp(validate, "false") == 0;
    if (!good)
        problem_fill(&problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                     "validate must be true or false");
    good = good && jobs_read_key(rq, &key, &problem) &&
           codec_decode(&request, CODEC_SOLVE, rq->body ? rq->body : "", rq->body_len, context->store, &problem) &&
           start_check(context, &request, rq, &problem) && jobs_check_webhook(context, request.webhook, &problem);
    if (!good) {
        /* a problem, or the job that the request became when it came before */
        job j;
        if (!jobs_find_repeat(context, rq, validate_only ? NULL : key, &j))
            reply_problem(reply, &problem);
        else
            jobs_wait_then(context, rq, &j, jobs_acknowledge, reply);
        job_clear(&j);
    } else if (validate_only) {
        /* One prediction at a time: it takes memory and a processor that are counted for the workers. */
        uz_prediction predicted;
        uz_error err = {.status = UZ_OK};
        api_asker asker = {context, rq};
        const uz_hooks hooks = {.ctx = &asker, .cancelled = api_is_over};
        const size_t limit = request.settings.memory_limit = work_solve_bytes(context->work);
        int64_t m, n_u;
        bool known = false;
        if (!request.settings.semidefinite && codec_request_sizes(&request, &m, &n_u, &ignored) &&
            (double)n_u < PREDICTED_MOST && (limit == 0 || (double)n_u * ASSEMBLY_BYTES < (double)limit)) {
            pthread_mutex_lock(&context->predict_lock);
            uz_thread_init();
            known = !api_is_over(&asker) &&
                    uz_predict(&predicted, &request.problem, &request.settings, &hooks, &err) == UZ_OK;
            pthread_mutex_unlock(&context->predict_lock);
        }
        reply_json(reply, 200, codec_encode_valid(known ? &predicted : NULL));
    } else {
        codec_request_strip(&request); /* the worker decodes again: nothing decoded waits here while the client does */
        store_request stored = jobs_request(&request, rq->body, rq->body_len, key);
        jobs_store_and_wait(context, rq, &stored, reply);
    }
    codec_request_clear(&request);
    free(key);
}

/* -------------------------------------------------------------------- read */

static void reply_found(api *context, job *j, http_reply *reply)
{
    reply_job(context, 200, j, reply);
}

void jobs_get(api *context, http_request *rq, http_reply *reply)
{
    job j;
    reply->tag_by_body = true;
    if (jobs_load(context, rq, &j, reply))
        jobs_wait_then(context, rq, &j, reply_found, reply);
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
    if (status != STORE_OK && was != JOB_RUNNING) { /* one that runs is told, also where that can't be kept */
        reply_store_failure(context, status, reply);
        return;
    }
    if (was != JOB_ACCEPTED && was != JOB_RUNNING) {
        reply->status = 204;
        return;
    }
    if (was == JOB_ACCEPTED) /* the worker counts those that run */
        metrics_job(context->metrics, job_status_name(JOB_DISMISSED), NULL, 1);
    if (was == JOB_RUNNING && work_cancel(context->work, rq->job_id))
        work_wait(context->work, rq->job_id, DISMISS_WAIT_S);
    if (!jobs_load(context, rq, &j, reply))
        return;
    if (status != STORE_OK && !jobs_ended(&j))
        reply_store_failure(context, status, reply);
    else
        reply_job(context, 200, &j, reply);
    job_clear(&j);
}
