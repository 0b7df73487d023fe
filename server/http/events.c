/* events.c: what happens to jobs, as Server-Sent Events.
 *
 * GET /v1/jobs/{id}/events has two kinds of events. "status" is the whole job, at the start and whenever its status
 * changed; after the last one the stream ends. "progress" is how far a running job is.
 *
 * GET /v1/events is for a list that is to stay as it is in the store. "job": a job as a list shows it, whenever it was
 * created or its status or progress changed. "deleted": the id of one that is gone. "reset": load the list (again): it
 * comes first on a stream that does not go on from another one, and where changes were missed. Of several changes of
 * one job in quick succession only the last is told. An event's id is the number of its change in this run of the
 * daemon; a stream that comes again with it (Last-Event-ID) goes on from there.
 *
 * All are states, not steps: who was away gets the present one, and an event's id names the state, so that one who saw
 * it already (Last-Event-ID) does not get it twice. */
#include "http/jobs.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    event_stream base;
    api *context;
    char id[33], last[64]; /* last: the state that the client has seen */
    job_status status;
    bool any;         /* a status was sent */
    double iteration; /* the last that the client has seen */
} job_stream;

/* The name of a state. */
static void name_state(char *out, size_t size, const job *j, double iteration)
{
    if (j->status == JOB_RUNNING)
        snprintf(out, size, "%d.running.%d.%" PRId64 ".%.0f", j->attempts, j->progress, j->grid.number, iteration);
    else
        snprintf(out, size, "%d.%s", j->attempts, job_status_name(j->status));
}

static bool look_at_job(event_stream *base)
{
    job_stream *s = (job_stream *)base;
    job j;
    int progress;
    work_history live = {.rows = NULL};
    const double *row = NULL; /* the newest of a job that runs here */
    char state[64];
    bool ok = store_get(s->context->store, s->id, &j) == STORE_OK; /* deleted meanwhile: nothing more to tell */
    if (!ok)
        return false;
    if (j.status == JOB_RUNNING &&
        work_live(s->context->work, j.id, &progress, NULL, (int64_t)fmax(s->iteration, -1.0), &live)) {
        j.progress = progress;
        work_grid(s->context->work, j.id, &j.grid);
        if (live.count > 0)
            row = live.rows + (live.count - 1) * CODEC_HISTORY_COLUMNS;
    }
    s->iteration = row ? row[0] : s->iteration;
    name_state(state, sizeof state, &j, s->iteration);
    bool seen = strcmp(state, s->last) == 0;
    snprintf(s->last, sizeof s->last, "%s", state);
    if (!seen && (!s->any || j.status != s->status)) {
        char *data = codec_encode_job(&j);
        ok = stream_say(&s->base, "status", s->last, data);
        free(data);
        s->any = true;
        s->base.ended = jobs_ended(&j);
    } else if (!seen && j.status == JOB_RUNNING) {
        char *data = codec_encode_progress(j.progress, &j.grid, row);
        ok = stream_say(&s->base, "progress", s->last, data);
        free(data);
    }
    s->any = s->any || seen;
    s->status = j.status;
    free(live.rows);
    job_clear(&j);
    return ok;
}

void events_get(api *context, http_request *rq, http_reply *reply)
{
    job j;
    char last[64], state[64] = "";
    stream_last_seen(rq, last, sizeof last);
    if (!jobs_load(context, rq, &j, reply))
        return;
    bool ended = jobs_ended(&j);
    name_state(state, sizeof state, &j, 0);
    job_clear(&j);
    if (ended && strcmp(state, last) == 0) {
        reply->status = 204; /* tells an EventSource not to come again */
        return;
    }
    job_stream *s = calloc(1, sizeof *s);
    if (s) {
        s->base.look = look_at_job;
        s->context = context;
        s->iteration = -1;
        memcpy(s->id, rq->job_id, sizeof s->id);
        memcpy(s->last, last, sizeof s->last);
    }
    stream_reply(rq, s ? &s->base : NULL, rq->job_id, reply);
}

/* ---- of all jobs */

#define EVERY_S 0.1 /* a stream tells at most so often */
#define AT_ONCE 64  /* changes that are told together */

typedef struct {
    event_stream base;
    api *context;
    char client[STORE_CLIENT]; /* whose jobs are told, unless all are */
    bool all;
    uint64_t seen; /* the number up to which all is told */
    bool reset;    /* that it must be told first */
} all_stream;

/* ---- a stream */

static bool say(all_stream *s, const char *event, uint64_t number, const char *data)
{
    char id[64];
    snprintf(id, sizeof id, "%s.%" PRIu64, s->context->run, number);
    return stream_say(&s->base, event, id, data);
}

static bool look_at_all(event_stream *base)
{
    all_stream *s = (all_stream *)base;
    api *context = s->context;
    feed_change changes[AT_ONCE];
    size_t count;
    uint64_t seen;
    const uint64_t after = s->reset ? UINT64_MAX : s->seen; /* the first is the number of no change */
    if (!feed_since(work_feed(context->work), after, changes, AT_ONCE, &count, &seen)) {
        s->seen = seen;
        s->reset = false;
        return say(s, "reset", s->seen, "{}");
    }
    bool ok = true;
    pthread_mutex_lock(&context->told_lock);
    for (size_t i = 0; ok && i < count; i++) {
        const feed_change *change = &changes[i];
        told_text *text = &context->told[change->number % TOLD_TEXTS];
        if (text->number != change->number) { /* what has become of the job; a later state has a change told after it */
            job j = {0};
            char *data = NULL;
            const store_status status = store_get(context->store, change->id, &j);
            free(text->data);
            text->event = status == STORE_NOT_FOUND ? "deleted" : "job";
            if (status == STORE_NOT_FOUND && asprintf(&data, "{\"id\": \"%s\"}", change->id) < 0)
                data = NULL;
            if (status == STORE_OK) {
                jobs_freshen(context, &j);
                data = codec_encode_job(&j);
            }
            text->nobodys = status == STORE_NOT_FOUND && !change->deleted;
            snprintf(text->client, sizeof text->client, "%s", status == STORE_OK ? j.client : change->client);
            job_clear(&j);
            text->data = data; /* NULL: no memory, or the store failed */
            text->number = data ? change->number : 0;
        }
        ok = text->number > 0;
        if (ok && (s->all || (!text->nobodys && strcmp(text->client, s->client) == 0)))
            ok = say(s, text->event, change->number, text->data);
    }
    pthread_mutex_unlock(&context->told_lock);
    s->seen = seen;
    return ok;
}

void events_get_all(api *context, http_request *rq, http_reply *reply)
{
    char last[64];
    const size_t run = strlen(context->run);
    all_stream *s = calloc(1, sizeof *s);
    stream_last_seen(rq, last, sizeof last);
    const char *number = last + run + 1; /* of the change that the client has seen, if it is one of this run */
    if (s) {
        s->base.look = look_at_all;
        s->context = context;
        s->base.every_s = EVERY_S;
        s->all = rq->sees_all;
        memcpy(s->client, rq->client, sizeof s->client);
        s->reset = strncmp(last, context->run, run) != 0 || last[run] != '.' || strlen(number) < 1 ||
                   strlen(number) > 18 || number[strspn(number, "0123456789")];
        s->seen = s->reset ? 0 : strtoull(number, NULL, 10);
    }
    stream_reply(rq, s ? &s->base : NULL, NULL, reply);
}
