/* later.c: replies that are not made at once: Server-Sent Events, and replies that wait until they can be made. */
#include "http/transport/connection.h"
#include "http/transport/message.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define HEARTBEAT_S 15.0 /* a comment, so that proxies see life and a client that left is noticed */

static void stream_free(void *ctx)
{
    event_stream *s = ctx;
    feed_unlisten(s->listener);
    atomic_fetch_sub(&s->server->streams, 1);
    free(s->text);
    free(s);
}

void stream_last_seen(const http_request *rq, char *out, size_t size)
{
    const header_field *field = header_find(&rq->headers, "Last-Event-ID", NULL);
    out[0] = '\0';
    if (field && field->value_len < size) {
        memcpy(out, field->value, field->value_len);
        out[field->value_len] = '\0';
    }
}

bool stream_say(event_stream *s, const char *event, const char *id, const char *data)
{
    static const char FORM[] = "event: %s\nid: %s\ndata: %s\n\n";
    if (!data)
        return false;
    size_t more = sizeof FORM + strlen(event) + strlen(id) + strlen(data);
    char *grown = realloc(s->text, s->len + more);
    if (!grown)
        return false;
    s->text = grown;
    s->len += (size_t)snprintf(s->text + s->len, more, FORM, event, id, data);
    s->told = s->spoke = clock_seconds(CLOCK_MONOTONIC);
    return true;
}

/* ---- the reply's reader */

/* Blocks until there is something to send; does not where the stream is held. */
static ptrdiff_t stream_read(void *ctx, char *out, size_t size)
{
    event_stream *s = ctx;
    for (;;) {
        if (s->text) {
            size_t n = s->len - s->at < size ? s->len - s->at : size;
            memcpy(out, s->text + s->at, n);
            s->at += n;
            if (s->at == s->len) {
                free(s->text);
                s->text = NULL;
                s->len = s->at = 0;
            }
            return (ptrdiff_t)n;
        }
        if (s->ended || atomic_load(&s->server->draining))
            return REPLY_STREAM_ENDS;
        if (request_client_gone(s->rq) || !s->look(s))
            return REPLY_STREAM_BREAKS;
        if (s->text)
            continue;
        if (clock_seconds(CLOCK_MONOTONIC) - s->spoke >= HEARTBEAT_S) {
            static const char COMMENT[] = ":\n\n";
            if (size < sizeof COMMENT)
                return REPLY_STREAM_ENDS;
            s->spoke = clock_seconds(CLOCK_MONOTONIC);
            memcpy(out, COMMENT, sizeof COMMENT - 1);
            return sizeof COMMENT - 1;
        }
        if (s->held)
            return 0;
        /* Until there may be something to tell; what comes in quick succession is told together. */
        double due = s->spoke + HEARTBEAT_S - clock_seconds(CLOCK_MONOTONIC),
               pause = s->told + s->every_s - clock_seconds(CLOCK_MONOTONIC);
        if (feed_wait(s->listener, s->rq->fd, fmax(due, 0.001)))
            for (; pause > 0.0 && !request_client_gone(s->rq) && !atomic_load(&s->server->draining);
                 pause = s->told + s->every_s - clock_seconds(CLOCK_MONOTONIC))
                feed_wait(s->listener, s->rq->fd, pause);
    }
}

static double stream_due(void *ctx, bool told)
{
    const event_stream *s = ctx;
    if (!told)
        return s->spoke + HEARTBEAT_S;
    return atomic_load(&s->server->draining) ? 0.0 : s->told + s->every_s;
}

/* ---- the reply */

void stream_reply(http_request *rq, event_stream *s, const char *id, http_reply *reply)
{
    transport *server = rq->server;
    unsigned most = server->options.max_streams;
    if (!s) {
        reply_no_memory(reply);
        return;
    }
    if (atomic_fetch_add(&server->streams, 1) >= most) {
        atomic_fetch_sub(&server->streams, 1);
        free(s);
        reply->retry_after_s = 5;
        reply_refuse(reply, 503, "too_many_streams", "Too many event streams at once",
                     "at most %u may be open (the daemon's option --max-streams): close some, or ask for the job with "
                     "\"Prefer: wait=N\"",
                     most);
        return;
    }
    s->server = server;
    s->rq = rq;
    s->spoke = clock_seconds(CLOCK_MONOTONIC);
    s->listener = feed_listen(server->options.feed, id);
    if (s->listener) {
        reply_drop_body(reply);
        reply->status = 200;
        reply->type = "text/event-stream";
        reply->source = (reply_source){stream_read, stream_free, s, s->listener, &s->held, stream_due, false, NULL};
    } else {
        stream_free(s);
        reply_no_memory(reply);
    }
}

/* ---- a reply that waits until it can be made */

/* Every change is told; should a look have failed when there was one, it looks again after this. */
#define LOOK_AGAIN_S 15.0

static void delayed_free(void *ctx)
{
    delayed_reply *d = ctx;
    feed_unlisten(d->listener);
    free(d->message);
    d->free(d);
}

static bool is_over(delayed_reply *d)
{
    return d->ready(d) || clock_seconds(CLOCK_MONOTONIC) >= d->until || atomic_load(&d->server->draining);
}

/* ---- without a thread */

static double delayed_due(void *ctx, bool told)
{
    const delayed_reply *d = ctx;
    return told ? 0.0 : fmin(d->until, clock_seconds(CLOCK_MONOTONIC) + LOOK_AGAIN_S);
}

static ptrdiff_t delayed_read(void *ctx, char *out, size_t size)
{
    delayed_reply *d = ctx;
    if (!d->message) {
        if (!is_over(d))
            return 0;
        http_request *rq = d->rq;
        d->make(d, &rq->reply);
        negotiate(rq, &rq->reply);
        request_note_reply(rq);
        rq->reply.close = true;
        d->message = reply_message(&rq->reply, false, &d->len);
        reply_clear(&rq->reply);
    }
    if (!d->message)
        return REPLY_STREAM_BREAKS;
    size_t n = d->len - d->at < size ? d->len - d->at : size;
    memcpy(out, d->message + d->at, n);
    d->at += n;
    return n > 0 ? (ptrdiff_t)n : REPLY_STREAM_ENDS;
}

/* ---- with one */

static void delayed_answer(void *ctx)
{
    delayed_reply *d = ctx;
    while (!is_over(d) && !request_client_gone(d->rq))
        feed_wait(d->listener, d->rq->fd, fmax(delayed_due(d, false) - clock_seconds(CLOCK_MONOTONIC), 0.001));
    d->make(d, &d->rq->reply);
}

bool reply_delay(http_request *rq, delayed_reply *d, const char *id)
{
    d->server = rq->server;
    d->rq = rq;
    d->listener = feed_listen_end(rq->server->options.feed, id, UINT64_MAX); /* it looks first in any case */
    if (!d->listener)
        return false;
    rq->reply.source = (reply_source){.read = delayed_read,
                                      .free = delayed_free,
                                      .ctx = d,
                                      .listener = d->listener,
                                      .held = &d->held,
                                      .due = delayed_due,
                                      .is_message = true,
                                      .answer = delayed_answer};
    return true;
}
