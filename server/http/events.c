/* events.c: GET /v1/jobs/{id}/events.
 *
 * There are two kinds of events. "status" is the whole job, at the start and whenever its status changed; after the
 * last one the stream ends. "progress" is how far a running job is. Both are states, not steps: who was away gets the
 * present one, and an event's id names the state, so that one who saw it already (Last-Event-ID) does not get it
 * twice. */
#include "http/jobs.h"

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
        snprintf(out, size, "%d.running.%d.%.0f", j->attempts, j->progress, iteration);
    else
        snprintf(out, size, "%d.%s", j->attempts, job_status_name(j->status));
}

static bool look(event_stream *base)
{
    job_stream *s = (job_stream *)base;
    job j;
    int progress;
    int64_t count = 0;
    double *rows = NULL;
    const double *row = NULL; /* the newest of a job that runs here */
    char state[64];
    bool ok = store_get(s->context->store, s->id, &j) == STORE_OK; /* deleted meanwhile: nothing more to tell */
    if (!ok)
        return false;
    if (j.status == JOB_RUNNING &&
        work_live(s->context->work, j.id, (int64_t)fmax(s->iteration, -1.0), &progress, &rows, &count)) {
        j.progress = progress;
        if (count > 0)
            row = rows + (count - 1) * CODEC_HISTORY_COLUMNS;
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
        char *data = codec_encode_progress(j.progress, row);
        ok = stream_say(&s->base, "progress", s->last, data);
        free(data);
    }
    s->any = s->any || seen;
    s->status = j.status;
    free(rows);
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
        s->base.look = look;
        s->context = context;
        s->iteration = -1;
        memcpy(s->id, rq->job_id, sizeof s->id);
        memcpy(s->last, last, sizeof s->last);
    }
    stream_reply(rq, s ? &s->base : NULL, rq->job_id, reply);
}
