#include "http/waiting.h"
#include "http/transport/deadlines.h"
#include "http/jobs.h"
#include "http/transport/negotiate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Every change of a job is told; should the store have failed when one looked, it is asked again after this. */
#define LOOK_AGAIN_S 15.0

typedef struct {
    api *context;
    http_request *rq;
    listener *listener;
    char id[33];
    double until;
    waiting_then then;
    store_status status; /* of the last look at the job, and what it found */
    job found;
    char *message;
    size_t len, at;
} waiting;

static void waiting_free(void *ctx)
{
    waiting *w = ctx;
    feed_unlisten(w->listener);
    job_clear(&w->found);
    free(w->message);
    free(w);
}

/* From the job that is_over looked at last. */
static void put_reply(waiting *w)
{
    http_reply *reply = &w->rq->reply;
    if (w->status == STORE_OK)
        w->then(w->context, &w->found, reply);
    else
        reply_store_failure(w->context, w->status, reply);
}

static bool is_over(waiting *w)
{
    job_clear(&w->found);
    w->status = store_get(w->context->store, w->id, &w->found);
    bool ended = w->status == STORE_NOT_FOUND || (w->status == STORE_OK && jobs_ended(&w->found));
    return ended || deadlines_now() >= w->until || atomic_load(&w->context->draining);
}

/* ---- without a thread */

static void do_nothing(void *ctx)
{
    (void)ctx;
}

static double waiting_due(void *ctx, bool told)
{
    const waiting *w = ctx;
    return told ? 0.0 : fmin(w->until, deadlines_now() + LOOK_AGAIN_S);
}

static void make_message(waiting *w)
{
    http_request *rq = w->rq;
    put_reply(w);
    negotiate(rq, &rq->reply);
    request_note_reply(rq);
    rq->reply.close = true;
    w->message = reply_message(&rq->reply, &w->len);
    reply_clear(&rq->reply);
}

static ptrdiff_t waiting_read(void *ctx, char *out, size_t size)
{
    waiting *w = ctx;
    if (!w->message) {
        if (!is_over(w))
            return 0;
        make_message(w);
    }
    if (!w->message)
        return REPLY_STREAM_BREAKS;
    size_t n = w->len - w->at < size ? w->len - w->at : size;
    memcpy(out, w->message + w->at, n);
    w->at += n;
    return n > 0 ? (ptrdiff_t)n : REPLY_STREAM_ENDS;
}

/* ---- with one */

static void waiting_answer(void *ctx)
{
    waiting *w = ctx;
    while (!is_over(w) && !request_client_gone(w->rq))
        feed_wait(w->listener, w->rq->fd, fmax(waiting_due(w, false) - deadlines_now(), 0.001));
    put_reply(w);
}

bool waiting_begin(api *context, http_request *rq, const char *id, double seconds, waiting_then then)
{
    waiting *w = calloc(1, sizeof *w);
    if (!w)
        return false;
    *w = (waiting){.context = context, .rq = rq, .until = deadlines_now() + seconds, .then = then};
    memcpy(w->id, id, sizeof w->id);
    w->listener = feed_listen(work_feed(context->work), id);
    if (!w->listener) {
        free(w);
        return false;
    }
    rq->reply.source = (reply_source){.read = waiting_read,
                                      .free = waiting_free,
                                      .ctx = w,
                                      .listener = w->listener,
                                      .hold = do_nothing,
                                      .due = waiting_due,
                                      .is_message = true,
                                      .answer = waiting_answer};
    return true;
}
