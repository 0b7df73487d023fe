/* jobs.c: /v1/jobs and /v1/jobs/{id}: one job, a list of them, and waiting for one to end (`Prefer: wait`). */
#include "codec/codec.h"
#include "http/api.h"
#include "http/jobs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

bool api_store_failed(api *context, problem_details *problem)
{
    char cause[512];
    store_message(context->store, cause, sizeof cause);
    log_write(context->log, LOG_ERROR, "store_error", (log_field[]){LOG_S("cause", cause), {0}});
    return problem_fill(problem, 500, "store_error", "The store failed", "the server's log has the cause");
}

void reply_store_failure(api *context, store_status status, http_reply *reply)
{
    static const struct {
        store_status status;
        int http, retry_after_s;
        const char *code, *title, *detail; /* detail NULL: what the store says */
    } FAILURES[] = {
        {STORE_NOT_FOUND, 404, 0, "not_found", "Not found", "there is no job with this id"},
        {STORE_FULL, 507, 60, "storage_full", "The disk is full",
         "nothing was stored: delete ended jobs or free disk space, then try again"},
        {STORE_LOCKED, 503, 5, "store_locked", "The store is in use",
         "another program holds the database: nothing was changed; try again later"},
        {STORE_AWAY, 503, 5, "store_unavailable", "The store does not answer",
         "the database can't be reached now: try again later, a submission with its Idempotency-Key"},
        {STORE_BUSY, 503, 10, "queue_full", "Too many jobs wait",
         "as many jobs wait as this server lets (its option --max-queue): try again later"},
        {STORE_QUOTA, 429, 60, "quota_exceeded", "The owner has as much as it may", NULL},
        {STORE_CONFLICT, 409, 0, "conflict", "The job's state does not allow this",
         "the job changed meanwhile: look at its status and try again"},
    };
    char cause[512];
    problem_details problem;
    store_message(context->store, cause, sizeof cause);
    if (status == STORE_LOCKED || status == STORE_AWAY)
        log_write(context->log, LOG_ERROR, status == STORE_LOCKED ? "store_locked" : "store_unavailable",
                  (log_field[]){LOG_S("cause", cause), {0}});
    for (size_t i = 0; i < sizeof FAILURES / sizeof FAILURES[0]; i++)
        if (FAILURES[i].status == status) {
            reply->retry_after_s = FAILURES[i].retry_after_s ? FAILURES[i].retry_after_s : reply->retry_after_s;
            reply_refuse(reply, FAILURES[i].http, FAILURES[i].code, FAILURES[i].title, "%s",
                         FAILURES[i].detail ? FAILURES[i].detail : cause);
            return;
        }
    if (status == STORE_DAMAGED) {
        log_write(context->log, LOG_ERROR, "stored_data_damaged",
                  (log_field[]){LOG_S("job", reply->job), LOG_S("cause", cause), {0}});
        codec_problem_damaged(&problem, reply->job ? reply->job : "");
    } else {
        api_store_failed(context, &problem);
    }
    reply_problem(reply, &problem);
}

bool jobs_load(api *context, http_request *rq, job *out, http_reply *reply)
{
    memset(out, 0, sizeof *out);
    snprintf(rq->job_id, sizeof rq->job_id, "%.32s", rq->name);
    store_status status = api_get_job(context, rq, rq->job_id, out);
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
    work_wait(context->work, j->id, seconds, rq->fd, transport_draining(context->server));
    if (request_wait(rq, -1, context->options.max_wait_s) >= 0)
        snprintf(reply->preference_applied, sizeof reply->preference_applied, "wait=%.0f", seconds);
    return load_again(context, j, reply);
}

/* A reply that waits. */
typedef struct {
    delayed_reply base;
    api *context;
    char id[33];
    jobs_then then;
    store_status status; /* of the last look at the job, and what it found */
    job found;
} waiting;

static bool waiting_ready(delayed_reply *d)
{
    waiting *w = (waiting *)d;
    job_clear(&w->found);
    w->status = work_look(w->context->work, w->id, &w->found);
    return w->status == STORE_NOT_FOUND || (w->status == STORE_OK && jobs_ended(&w->found));
}

static void waiting_make(delayed_reply *d, http_reply *reply)
{
    waiting *w = (waiting *)d;
    if (w->status == STORE_OK)
        w->then(w->context, &w->found, reply);
    else
        reply_store_failure(w->context, w->status, reply);
}

static void waiting_free(delayed_reply *d)
{
    waiting *w = (waiting *)d;
    job_clear(&w->found);
    free(w);
}

/* So long a wait keeps its thread: a connection that has given it up ends with the reply (held.h). */
static const double SHORT_WAIT_S = 1.0;

void jobs_wait_then(api *context, http_request *rq, job *j, uint64_t since, jobs_then then, http_reply *reply)
{
    job found = {.progress = 0};
    double seconds = request_wait(rq, 0, context->options.max_wait_s), rest = fmax(seconds - SHORT_WAIT_S, 0.0);
    if (seconds <= 0 || jobs_ended(j)) {
        then(context, j, reply);
        return;
    }
    /* by the request's own preference: without one there is nothing to wait for */
    snprintf(reply->preference_applied, sizeof reply->preference_applied, "wait=%.0f", seconds);
    const bool ended = work_wait_since(context->work, j->id, since, seconds - rest, rq->fd,
                                       transport_draining(context->server), &found);
    if (found.id[0]) {
        job_clear(j);
        *j = found;
        then(context, j, reply);
        return;
    }
    waiting *w = ended || rest == 0.0 ? NULL : calloc(1, sizeof *w);
    if (w) {
        /* the reply comes from a source: when the job has ended, or the rest of the time is over */
        w->base = (delayed_reply){.ready = waiting_ready,
                                  .make = waiting_make,
                                  .free = waiting_free,
                                  .until = clock_seconds(CLOCK_MONOTONIC) + rest};
        w->context = context;
        w->then = then;
        memcpy(w->id, j->id, sizeof w->id);
        if (reply_delay(rq, &w->base, j->id))
            return;
        free(w);
    }
    if (load_again(context, j, reply))
        then(context, j, reply);
}

void jobs_freshen(api *context, job *j)
{
    int progress;
    if (j->status == JOB_RUNNING && work_live(context->work, j->id, &progress, NULL, -1, NULL)) {
        j->progress = progress;
        work_grid(context->work, j->id, &j->grid);
    }
}

static void reply_job(api *context, job *j, http_reply *reply)
{
    jobs_freshen(context, j);
    reply_json(reply, 200, codec_encode_job(j));
}

void jobs_acknowledge(api *context, job *j, http_reply *reply)
{
    snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", j->id);
    reply_job(context, j, reply);
    if (reply->status == 200 && !jobs_ended(j))
        reply->status = 202;
}

/* -------------------------------------------------------------------- read */

void jobs_get(api *context, http_request *rq, http_reply *reply)
{
    job j;
    const uint64_t since = feed_last(work_feed(context->work));
    reply->tag_by_body = true;
    if (jobs_load(context, rq, &j, reply))
        jobs_wait_then(context, rq, &j, since, reply_job, reply);
    job_clear(&j);
}

void jobs_request(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    char *body = NULL;
    size_t len = 0;
    reply->tag_by_body = true;
    if (jobs_load(context, rq, &j, reply)) {
        const store_status status = store_get_body(context->store, j.id, &body, &len);
        if (status == STORE_OK) {
            reply_text(reply, 200, "application/json", body, len);
            reply->takes_ranges = true; /* it never changes */
        } else {
            reply_store_failure(context, status, reply);
        }
        jobs_check_still_there(context, &j, reply);
    }
    job_clear(&j);
}

/* ----------------------------------------------------------------- dismiss */

/* A running job ends soon after it is told to; this much is worth waiting for, so that the answer says "dismissed". */
static const double DISMISS_WAIT_S = 0.4;

void jobs_delete(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    job_status was;
    snprintf(rq->job_id, sizeof rq->job_id, "%.32s", rq->name);
    store_status status = api_get_job(context, rq, rq->job_id, &j);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    jobs_freshen(context, &j);
    const bool meant =
        request_still_means(rq, codec_encode_job(&j), fmax(fmax(j.created, j.started), j.finished), reply);
    job_clear(&j);
    if (!meant)
        return;
    status = store_dismiss(context->store, rq->job_id, &was);
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
        work_wait(context->work, rq->job_id, DISMISS_WAIT_S, -1, NULL);
    if (!jobs_load(context, rq, &j, reply))
        return;
    if (status != STORE_OK && !jobs_ended(&j))
        reply_store_failure(context, status, reply);
    else
        reply_job(context, &j, reply);
    job_clear(&j);
}

/* -------------------------------------------------------------------- list */

/* ---- times */

/* A time of RFC 3339, "2026-01-31T12:00:00.5Z", as Unix seconds. */
static bool parse_time(const char *text, double *out)
{
    static const char FORM[] = "dddd-dd-ddTdd:dd:dd";
    struct tm t = {0}, back;
    double fraction = 0;
    for (size_t i = 0; FORM[i]; i++)
        if (FORM[i] == 'd' ? text[i] < '0' || text[i] > '9' : (text[i] & ~0x20) != (FORM[i] & ~0x20))
            return false;
    sscanf(text, "%4d-%2d-%2d%*c%2d:%2d:%2d", &t.tm_year, &t.tm_mon, &t.tm_mday, &t.tm_hour, &t.tm_min, &t.tm_sec);
    const char *at = text + sizeof FORM - 1;
    size_t digits = *at == '.' ? strspn(at + 1, "0123456789") : 0;
    for (size_t i = digits; i > 0; i--)
        fraction = (fraction + (at[i] - '0')) / 10;
    if (*at == '.' && digits == 0)
        return false;
    at += digits ? digits + 1 : 0;
    t.tm_year -= 1900;
    t.tm_mon -= 1;
    struct tm asked = t;
    time_t seconds = timegm(&t);
    bool exists = gmtime_r(&seconds, &back) && back.tm_mon == asked.tm_mon && back.tm_mday == asked.tm_mday &&
                  back.tm_hour == asked.tm_hour && back.tm_min == asked.tm_min &&
                  asked.tm_sec < 61; /* no 30th of February */
    if (!exists)
        return false;
    /* the zone: "Z", "+hh:mm" or "-hh:mm" east of Greenwich; a '+' that was not escaped arrives as a space */
    int hours = 0, minutes = 0, used = 0;
    if (strcmp(at, "Z") != 0 && strcmp(at, "z") != 0 &&
        (!strchr("+- ", at[0]) || strspn(at + 1, "0123456789:") != 5 ||
         sscanf(at + 1, "%2d:%2d%n", &hours, &minutes, &used) != 2 || at[1 + used] || hours > 23 || minutes > 59))
        return false;
    const int zone = (at[0] == '-' ? -1 : 1) * (hours * 3600 + minutes * 60);
    *out = (double)seconds + fraction - zone;
    return true;
}

static bool read_time(const http_request *rq, const char *key, double *out, problem_details *problem)
{
    char text[160];
    const char *value = target_value(&rq->target, key);
    if (!value || parse_time(value, out)) {
        if (value) /* 0 in a query is no bound, and no job is as old as 1970 */
            *out = fmax(*out, 1e-3);
        return true;
    }
    snprintf(text, sizeof text, "%s must be a time of RFC 3339 such as 2026-01-31T12:00:00Z", key);
    return REFUSE_PARAMETER(problem, "%s", text);
}

/* ---- the query */

enum { LONGEST_NAME = 65 }; /* bytes, with the mark before it and the NUL behind */

/* name: where that of the jobs asked for is kept as the tag that it is. */
static bool read_query(const http_request *rq, store_query *query, char name[LONGEST_NAME], problem_details *problem)
{
    int64_t limit = 50;
    const char *status = target_value(&rq->target, "status"), *order = target_value(&rq->target, "order");
    memset(query, 0, sizeof *query);
    query->before = target_value(&rq->target, "cursor");
    query->by_status = status != NULL;
    query->ascending = order && strcmp(order, "asc") == 0;
    while (status && query->status <= JOB_DISMISSED && strcmp(job_status_name(query->status), status) != 0)
        query->status++;
    if (query->status > JOB_DISMISSED)
        return REFUSE_PARAMETER(problem, "status must be accepted, running, successful, failed or dismissed");
    if (query->before && !(strlen(query->before) == 32 && strspn(query->before, "0123456789abcdef") == 32))
        return REFUSE_PARAMETER(problem, "cursor must be the \"next\" of an earlier page");
    if (order && !query->ascending && strcmp(order, "desc") != 0)
        return REFUSE_PARAMETER(problem, "order must be desc (newest first) or asc");
    if (!request_integer(rq, "limit", 1, 1000, &limit, problem))
        return false;
    query->limit = (int)limit;
    if (!read_time(rq, "since", &query->since, problem) || !read_time(rq, "until", &query->until, problem))
        return false;
    for (size_t i = 0, count = 0; i < rq->target.count; i++) {
        const char *key = rq->target.parameters[i].key, *value = rq->target.parameters[i].value;
        const bool named = strcmp(key, "name") == 0;
        if (!named && strcmp(key, "tag") != 0)
            continue;
        if (count > STORE_MORE_TAGS)
            return REFUSE_PARAMETER(problem, "at most 4 tags may be asked for, a name among them");
        if (named && snprintf(name, LONGEST_NAME, CODEC_NAME_TAG "%s", value) >= LONGEST_NAME)
            return REFUSE_PARAMETER(problem, "name must be that of a job, of at most 63 bytes");
        *(count == 0 ? &query->tag : &query->more[count - 1]) = named ? name : value;
        count++;
    }
    return true;
}

void jobs_list(api *context, http_request *rq, http_reply *reply)
{
    store_query query;
    problem_details problem;
    job *jobs = NULL;
    size_t count = 0;
    bool more = false;
    char name[LONGEST_NAME];
    if (!read_query(rq, &query, name, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    query.client = api_sees(rq);
    store_status status = store_list(context->store, &query, &jobs, &count, &more);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    for (size_t i = 0; i < count; i++)
        jobs_freshen(context, &jobs[i]);
    reply->tag_by_body = true;
    reply_json(reply, 200, codec_encode_jobs(jobs, count, more));
    for (size_t i = 0; i < count; i++)
        job_clear(&jobs[i]);
    free(jobs);
}
