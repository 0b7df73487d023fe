/* waiting.c: what a reply does that waits for a job to end (`Prefer: wait`). */
#include "http/jobs.h"

#include <stdlib.h>
#include <string.h>

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
    w->status = store_get(w->context->store, w->id, &w->found);
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

bool jobs_delay(api *context, http_request *rq, const char *id, double seconds, jobs_then then)
{
    waiting *w = calloc(1, sizeof *w);
    if (!w)
        return false;
    w->base = (delayed_reply){
        .ready = waiting_ready, .make = waiting_make, .free = waiting_free, .until = http_now() + seconds};
    w->context = context;
    w->then = then;
    memcpy(w->id, id, sizeof w->id);
    if (reply_delay(rq, &w->base, id))
        return true;
    free(w);
    return false;
}
