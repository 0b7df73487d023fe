/* delayed.c: a reply that waits until it can be made. */
#include "http/transport/connection.h"
#include "http/transport/message.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    return d->ready(d) || http_now() >= d->until || atomic_load(&d->server->draining);
}

/* ---- without a thread */

static void do_nothing(void *ctx)
{
    (void)ctx;
}

static double delayed_due(void *ctx, bool told)
{
    const delayed_reply *d = ctx;
    return told ? 0.0 : fmin(d->until, http_now() + LOOK_AGAIN_S);
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
        feed_wait(d->listener, d->rq->fd, fmax(delayed_due(d, false) - http_now(), 0.001));
    d->make(d, &d->rq->reply);
}

bool reply_delay(http_request *rq, delayed_reply *d, const char *id)
{
    d->server = rq->server;
    d->rq = rq;
    d->listener = feed_listen(rq->server->options.feed, id);
    if (!d->listener)
        return false;
    rq->reply.source = (reply_source){.read = delayed_read,
                                      .free = delayed_free,
                                      .ctx = d,
                                      .listener = d->listener,
                                      .hold = do_nothing,
                                      .due = delayed_due,
                                      .is_message = true,
                                      .answer = delayed_answer};
    return true;
}
