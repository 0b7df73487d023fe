/* store.c: what is the same whatever engine keeps the jobs; every operation goes to the engine of the store. */
#include "store/blobs.h"
#include "store/engine_base.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

/* ---- jobs */

static const char *const STATUS_NAMES[] = {"accepted", "running", "successful", "failed", "dismissed"};
#define STATUS_COUNT (sizeof STATUS_NAMES / sizeof STATUS_NAMES[0])

const char *job_status_name(job_status status)
{
    return (size_t)status < STATUS_COUNT ? STATUS_NAMES[status] : "unknown";
}

void job_clear(job *j)
{
    if (!j)
        return;
    free(j->tags);
    free(j->summary);
    free(j->error);
    memset(j, 0, sizeof *j);
}

void store_cases_free(store_case *cases, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        free(cases[i].name);
        free(cases[i].summary);
    }
    free(cases);
}

/* ---- the store itself */

void store_base_begin(store *s, const store_engine *engine)
{
    *s = (store){.engine = engine};
    pthread_rwlock_init(&s->listener_lock, NULL);
    pthread_mutex_init(&s->message_lock, NULL);
    pthread_mutex_init(&s->node_lock, NULL);
}

void store_base_end(store *s)
{
    store_uploads_end(s);
    free(s->missing);
    pthread_mutex_destroy(&s->node_lock);
    pthread_mutex_destroy(&s->message_lock);
    pthread_rwlock_destroy(&s->listener_lock);
}

void store_close(store *s)
{
    if (s)
        s->engine->close(s);
}

void store_listen(store *s, store_listener *listener, void *ctx)
{
    pthread_rwlock_wrlock(&s->listener_lock);
    s->listener = listener;
    s->listener_ctx = ctx;
    pthread_rwlock_unlock(&s->listener_lock);
}

void store_tell(store *s, const char *id, bool waits, const char *gone)
{
    pthread_rwlock_rdlock(&s->listener_lock);
    if (s->listener)
        s->listener(s->listener_ctx, id, waits, gone);
    pthread_rwlock_unlock(&s->listener_lock);
}

void store_set_message(store *s, const char *cause)
{
    pthread_mutex_lock(&s->message_lock);
    snprintf(s->message, sizeof s->message, "%s", cause);
    pthread_mutex_unlock(&s->message_lock);
}

void store_message(store *s, char *buffer, size_t size)
{
    pthread_mutex_lock(&s->message_lock);
    snprintf(buffer, size, "%s", s->message);
    pthread_mutex_unlock(&s->message_lock);
}

/* ---- ids */

void store_next_id(uint64_t *last_ms, unsigned *sequence, char id[33])
{
    uint64_t random = 0, ms = (uint64_t)(clock_seconds(CLOCK_REALTIME) * 1e3) & 0xffffffffffffu;
    if (ms > *last_ms) {
        *last_ms = ms;
        *sequence = 0;
    } else if (++*sequence > 0xffff) {
        (*last_ms)++;
        *sequence = 0;
    }
    /* Time and counter alone make the id unique in its store; the random part keeps ids from being guessed. */
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random)
        random = ms * 0x9e3779b97f4a7c15u;
    snprintf(id, 33, "%012llx%04x%016llx", (unsigned long long)*last_ms, *sequence, (unsigned long long)random);
}

/* ---- what a submission is checked by */

kept_key store_kept_key(const store_request *request)
{
    kept_key key;
    const char *client = request->client ? request->client : "";
    snprintf(key.text, sizeof key.text, "%s%s%s", client, client[0] ? "\x1f" : "",
             request->idempotency_key ? request->idempotency_key : "");
    return key;
}

void store_say_quota(char *message, size_t size, const char *client, quota what)
{
    static const char *const WHAT[] = {
        [QUOTA_WAITING] = "jobs that wait as one owner may (--client-queue): try again when one of them has begun",
        [QUOTA_BYTES] = "bytes of requests, results and uploads as one owner may (--client-bytes): delete some",
        [QUOTA_SECONDS] = "seconds of workers today as one owner may (--client-seconds): try again tomorrow, in UTC"};
    snprintf(message, size, "\"%s\" has as many %s", client, WHAT[what]);
}

/* ---- the life of a job */

/* `out` and *repeated as a submission leaves them. */
static store_status publish_job(store_status status, job *out)
{
    if (status != STORE_OK)
        job_clear(out);
    return status;
}

store_status store_collect_objects(store *s, int64_t *count)
{
    *count = 0;
    return s->engine->collect ? s->engine->collect(s, count) : STORE_OK;
}

store_status store_tidy(store *s)
{
    return s->engine->tidy ? s->engine->tidy(s) : STORE_OK;
}

store_status store_submit(store *s, const store_request *request, job *out, bool *repeated)
{
    *out = (job){.progress = 0};
    *repeated = false;
    store_status status = publish_job(s->engine->submit(s, request, out, repeated), out);
    *repeated = *repeated && status == STORE_OK;
    return status;
}

store_status store_find_repeat(store *s, const store_request *request, job *out)
{
    *out = (job){.progress = 0};
    return publish_job(s->engine->find_repeat(s, request, out), out);
}

store_status store_claim(store *s, const char *owner, double lease_s, bool small, store_lease *lease, job *out,
                         char **body, size_t *body_len)
{
    *lease = (store_lease){.token = 0};
    snprintf(lease->owner, sizeof lease->owner, "%s", owner);
    *out = (job){.progress = 0};
    *body = NULL;
    *body_len = 0;
    pthread_mutex_lock(&s->node_lock);
    const bool drains = s->node.draining;
    pthread_mutex_unlock(&s->node_lock);
    if (drains)
        return STORE_NOT_FOUND;
    store_status status = publish_job(s->engine->claim(s, lease, lease_s, small, out, body, body_len), out);
    memcpy(lease->job, out->id, sizeof lease->job);
    if (status == STORE_OK)
        return STORE_OK;
    free(*body);
    *body = NULL;
    *body_len = 0;
    return status;
}

store_status store_renew(store *s, const store_lease *lease, int progress, bool *end)
{
    bool unused = false;
    const lease_use use = {.what = LEASE_RENEW,
                           .progress = progress < 0     ? 0
                                       : progress > 100 ? 100
                                                        : progress,
                           .end = end ? end : &unused};
    *use.end = false;
    return s->engine->use_lease(s, lease, &use);
}

store_status store_finish(store *s, const store_lease *lease, const store_outcome *outcome, double *finished)
{
    double unused = 0.0;
    finished = finished ? finished : &unused;
    *finished = 0.0;
    if (outcome->status == JOB_SUCCESSFUL || outcome->status == JOB_FAILED || outcome->status == JOB_DISMISSED)
        return s->engine->use_lease(s, lease,
                                    &(lease_use){.what = LEASE_FINISH, .outcome = outcome, .finished = finished});
    store_set_message(s, "a job cannot be finished with a status that is not an end");
    return STORE_ERROR;
}

store_status store_release(store *s, const store_lease *lease, bool counted)
{
    return s->engine->use_lease(s, lease, &(lease_use){.what = LEASE_RELEASE, .counted = counted});
}

store_status store_recover(store *s, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed)
{
    int64_t counts[2] = {0, 0};
    store_status status = s->engine->recover(s, max_attempts, error_json, &counts[0], &counts[1]);
    if (requeued)
        *requeued = status == STORE_OK ? counts[0] : 0;
    if (failed)
        *failed = status == STORE_OK ? counts[1] : 0;
    return status;
}

store_status store_expire(store *s, const char *error_json, int64_t *count)
{
    *count = 0;
    return s->engine->expire(s, error_json, count);
}

double store_age_time(store *s, bool *held)
{
    const double wall = clock_seconds(CLOCK_REALTIME);
    double newest = 0.0;
    job *jobs = NULL;
    size_t count = 0;
    bool more;
    if (!s->ages.begun && store_list(s, &(store_query){.limit = 1}, &jobs, &count, &more) == STORE_OK && count > 0) {
        newest = fmax(jobs[0].created, jobs[0].finished);
        job_clear(jobs);
    }
    free(jobs);
    const double now = age_clock_now(&s->ages, newest, wall, clock_seconds(CLOCK_MONOTONIC));
    *held = now < wall;
    return now;
}

store_status store_retain(store *s, const store_retention *limits, int64_t *count)
{
    *count = 0;
    if (limits->keep_s <= 0 && limits->keep_jobs <= 0 && limits->keep_bytes <= 0)
        return STORE_OK;
    bool held;
    return s->engine->retain(s, limits, store_age_time(s, &held), count);
}

store_status store_dismiss(store *s, const char *id, job_status *was)
{
    *was = JOB_ACCEPTED;
    return s->engine->dismiss(s, id, was);
}

/* ---- reading */

store_status store_get(store *s, const char *id, job *out)
{
    *out = (job){.progress = 0};
    return publish_job(s->engine->get(s, id, out), out);
}

store_status store_list(store *s, const store_query *query, job **jobs, size_t *count, bool *more)
{
    store_query q = *query;
    q.limit = q.limit < 1 ? 1 : q.limit > 1000 ? 1000 : q.limit;
    size_t n = 0, room = (size_t)q.limit + 1; /* one more says whether there are others */
    *jobs = NULL;
    *count = 0;
    *more = false;
    job *found = calloc(room, sizeof *found);
    if (!found) {
        store_set_message(s, "no memory for a list of jobs");
        return STORE_ERROR;
    }
    store_status status = s->engine->list(s, &q, found, &n);
    *more = status == STORE_OK && n == room;
    *count = status != STORE_OK ? 0 : *more ? room - 1 : n;
    for (size_t i = *count; i < n; i++)
        job_clear(&found[i]);
    if (status == STORE_OK)
        *jobs = found;
    else
        free(found);
    return status;
}

store_status store_get_body(store *s, const char *id, char **body, size_t *len)
{
    *body = NULL;
    *len = 0;
    return s->engine->get_body(s, id, body, len);
}

store_status store_get_cases(store *s, const char *id, const char *name, store_case **cases, size_t *count)
{
    *cases = NULL;
    *count = 0;
    store_status status = s->engine->get_cases(s, id, name, cases, count);
    if (status == STORE_OK && name && *count == 0) { /* or has it another name now? */
        store_case *all;
        size_t n;
        status = store_get_cases(s, id, NULL, &all, &n);
        store_cases_free(all, n);
    } else if (status == STORE_OK && !name) {
        status = result_blobs_missing(s, &(result_key){.job = id}, (int64_t)*count);
    }
    if (status == STORE_OK)
        return STORE_OK;
    store_cases_free(*cases, *count);
    *cases = NULL;
    *count = 0;
    return status;
}

store_status store_counts(store *s, int64_t counts[STORE_COUNTS])
{
    memset(counts, 0, STORE_COUNTS * sizeof counts[0]);
    return s->engine->counts(s, counts);
}

/* ---- webhooks */

store_status store_webhook_next(store *s, const char *const *except, size_t n, webhook_due *out)
{
    *out = (webhook_due){.url = NULL};
    return s->engine->webhook_next(s, except, n, out);
}

store_status store_webhooks_open(store *s, bool *any)
{
    *any = false;
    return s->engine->webhooks_open(s, any);
}

store_status store_webhook_attempted(store *s, const webhook_due *due, webhook_end end, double delay_s, double silent_s)
{
    return s->engine->webhook_attempted(s, due, end, delay_s, silent_s);
}

/* ---- care */

store_status store_try_write(store *s)
{
    return s->engine->try_write(s);
}

int64_t store_free_bytes(store *s)
{
    return s->engine->free_bytes(s);
}

store_status store_check(store *s, store_findings *out)
{
    *out = (store_findings){.findings = NULL};
    return s->engine->check(s, out);
}
