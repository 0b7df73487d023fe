/* events.c: GET /v1/jobs/{id}/events: Server-Sent Events (HTML Living Standard, section 9.2).
 *
 * A stream has two kinds of events. "status" is the whole job, at the start and whenever its status changed; after the
 * last one the stream ends. "progress" is how far a running job is. Both are states, not steps: who was away gets the
 * present one, and an event's id names the state, so that one who saw it already (Last-Event-ID) does not get it twice.
 *
 * A stream runs in its connection's own thread, as every reply does: libmicrohttpd suspends connections only in modes
 * where many share a thread, and there its messages no longer tell which connection they are about, by which bad
 * framing is answered (daemon.c). Streams may therefore take only a share of all connections. */
#include "http/deadlines.h"
#include "http/jobs.h"
#include "http/problem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOOK_S      0.25 /* a stream looks at its job so often */
#define HEARTBEAT_S 15.0 /* a comment, so that proxies see life and a client that left is noticed */

typedef struct {
    api *context;
    const http_request *rq; /* lives as long as the reply */
    char id[33], last[64];  /* last: the state that the client has seen */
    job_status status;
    bool any, ended;  /* a status was sent; the last one was */
    double iteration; /* the last that the client has seen */
    double spoke;     /* on deadlines_now's clock */
    char *text;       /* what is being sent */
    size_t len, at;
} stream;

static void stream_free(void *ctx)
{
    stream *s = ctx;
    atomic_fetch_sub(&s->context->streams, 1);
    free(s->text);
    free(s);
}

/* ---- events */

/* The name of a state. */
static void name_state(char *out, size_t size, const job *j, double iteration)
{
    if (j->status == JOB_RUNNING)
        snprintf(out, size, "%d.running.%d.%.0f", j->attempts, j->progress, iteration);
    else
        snprintf(out, size, "%d.%s", j->attempts, job_status_name(j->status));
}

/* False: no memory. */
static bool say(stream *s, const char *event, const char *data)
{
    int len = asprintf(&s->text, "event: %s\nid: %s\ndata: %s\n\n", event, s->last, data ? data : "");
    s->text = len < 0 || !data ? NULL : s->text;
    s->len = s->text ? (size_t)len : 0;
    s->at = 0;
    s->spoke = deadlines_now();
    return s->text != NULL;
}

static bool say_status(stream *s, const job *j)
{
    char *data = codec_encode_job(j);
    bool ok = say(s, "status", data);
    free(data);
    s->any = true;
    s->status = j->status;
    s->ended = jobs_ended(j);
    return ok;
}

static bool say_progress(stream *s, const job *j, const double *row)
{
    char *data = codec_encode_progress(j->progress, row);
    bool ok = say(s, "progress", data);
    free(data);
    return ok;
}

/* The progress of a job that runs here, and its newest row in *row, or NULL; the caller frees *rows. */
static void look_at_run(const stream *s, job *j, double **rows, const double **row)
{
    int progress;
    int64_t count = 0;
    *rows = NULL;
    *row = NULL;
    if (j->status != JOB_RUNNING ||
        !work_live(s->context->work, j->id, (int64_t)fmax(s->iteration, -1.0), &progress, rows, &count))
        return;
    j->progress = progress;
    if (count > 0)
        *row = *rows + (count - 1) * CODEC_HISTORY_COLUMNS;
}

/* Prepares the next event if there is one to tell; false: the stream can't go on. */
static bool look(stream *s)
{
    job j;
    double *rows;
    const double *row;
    char state[64];
    bool ok = store_get(s->context->store, s->id, &j) == STORE_OK; /* deleted meanwhile: nothing more to tell */
    if (!ok)
        return false;
    look_at_run(s, &j, &rows, &row);
    s->iteration = row ? row[0] : s->iteration;
    name_state(state, sizeof state, &j, s->iteration);
    bool seen = strcmp(state, s->last) == 0;
    snprintf(s->last, sizeof s->last, "%s", state);
    if (!seen && (!s->any || j.status != s->status))
        ok = say_status(s, &j);
    else if (!seen && j.status == JOB_RUNNING)
        ok = say_progress(s, &j, row);
    s->any = s->any || seen;
    s->status = j.status;
    free(rows);
    job_clear(&j);
    return ok;
}

/* ---- the reply's reader */

static ptrdiff_t take(stream *s, char *out, size_t size)
{
    size_t n = s->len - s->at < size ? s->len - s->at : size;
    memcpy(out, s->text + s->at, n);
    s->at += n;
    if (s->at == s->len) {
        free(s->text);
        s->text = NULL;
    }
    return (ptrdiff_t)n;
}

static ptrdiff_t heartbeat(stream *s, char *out, size_t size)
{
    static const char COMMENT[] = ":\n\n";
    if (size < sizeof COMMENT)
        return REPLY_STREAM_ENDS;
    s->spoke = deadlines_now();
    memcpy(out, COMMENT, sizeof COMMENT - 1);
    return sizeof COMMENT - 1;
}

/* Blocks until there is something to send. */
static ptrdiff_t stream_read(void *ctx, char *out, size_t size)
{
    stream *s = ctx;
    for (;;) {
        if (s->text)
            return take(s, out, size);
        if (s->ended || atomic_load(&s->context->draining))
            return REPLY_STREAM_ENDS;
        if (request_client_gone(s->rq) || !look(s))
            return REPLY_STREAM_BREAKS;
        if (s->text)
            continue;
        if (deadlines_now() - s->spoke > HEARTBEAT_S)
            return heartbeat(s, out, size);
        work_wait(s->context->work, s->id, LOOK_S); /* returns at once when the job ends */
    }
}

/* ---- the route */

static bool take_place(api *context, http_reply *reply)
{
    if (atomic_fetch_add(&context->streams, 1) < context->max_streams)
        return true;
    atomic_fetch_sub(&context->streams, 1);
    reply->retry_after_s = 5;
    reply_refuse(reply, 503, "too_many_streams", "Too many event streams at once",
                 "at most %u may be open: close some, or ask for the job with \"Prefer: wait=N\"",
                 context->max_streams);
    return false;
}

/* The state that a client which comes again has seen; "": it says none. */
static void read_last(const http_request *rq, char *out, size_t size)
{
    const header_field *field = header_find(&rq->headers, "Last-Event-ID", NULL);
    out[0] = '\0';
    if (field && field->value_len < size) {
        memcpy(out, field->value, field->value_len);
        out[field->value_len] = '\0';
    }
}

void events_get(api *context, http_request *rq, http_reply *reply)
{
    job j;
    char last[64], state[64] = "";
    read_last(rq, last, sizeof last);
    if (!jobs_load(context, rq, &j, reply))
        return;
    bool ended = jobs_ended(&j);
    name_state(state, sizeof state, &j, 0);
    job_clear(&j);
    if (ended && strcmp(state, last) == 0) {
        reply->status = 204; /* tells an EventSource not to come again */
        return;
    }
    if (!take_place(context, reply))
        return;
    stream *s = calloc(1, sizeof *s);
    if (!s) {
        atomic_fetch_sub(&context->streams, 1);
        reply_no_memory(reply);
        return;
    }
    *s = (stream){.context = context, .rq = rq, .iteration = -1, .spoke = deadlines_now()};
    memcpy(s->id, rq->job_id, sizeof s->id);
    memcpy(s->last, last, sizeof s->last);
    reply_stream(reply, 200, "text/event-stream", (reply_source){stream_read, stream_free, s});
}
