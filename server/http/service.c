/* service.c: routes about the service itself: what is cached, whether it lives, what is valid. */
#include "codec/codec.h"
#include "codec/embedded.h"
#include "http/request.h"

#include <stdlib.h>
#include <string.h>

void service_factors(api *context, http_request *rq, http_reply *reply)
{
    uz_cache_entry *entries = NULL;
    size_t count = 0;
    (void)rq;
    if (uz_cache_list(work_cache(context->work), &entries, &count, NULL) != UZ_OK)
        reply_no_memory(reply);
    else
        reply_json(reply, 200, codec_encode_factors(entries, count, work_cache_bytes(context->work)));
    free(entries);
}

void service_limits(api *context, http_request *rq, http_reply *reply)
{
    (void)rq;
    reply_json(reply, 200, codec_encode_limits(context->limits, context->n_limits));
}

static void reply_health(api *context, const char *status, const int64_t counts[5], http_reply *reply)
{
    reply_json(reply, 200, codec_encode_health(status, counts, work_workers(context->work)));
}

/* Alive: the process answers. A supervisor restarts it on anything else, which would not help a failing store, so a
 * store that does not answer only shows in the counts. */
void service_health(api *context, http_request *rq, http_reply *reply)
{
    int64_t counts[5] = {0};
    (void)rq;
    bool answered = store_counts(context->store, counts) == STORE_OK;
    reply_health(context, answered ? "ok" : "store_unavailable", counts, reply);
}

void service_ready(api *context, http_request *rq, http_reply *reply)
{
    int64_t counts[5] = {0};
    (void)rq;
    reply->retry_after_s = 5;
    if (atomic_load(&context->draining)) {
        reply_refuse(reply, 503, "draining", "The server is shutting down", "no new work is taken");
    } else if (store_counts(context->store, counts) != STORE_OK) {
        reply_refuse(reply, 503, "store_unavailable", "The store does not answer", "the server's log has the cause");
    } else {
        reply->retry_after_s = 0;
        reply_health(context, "ready", counts, reply);
    }
}

static bool reply_embedded(const char *name, const char *type, http_reply *reply)
{
    for (size_t i = 0; i < embedded_count(); i++) {
        embedded_file file = embedded_at(i);
        if (strcmp(file.name, name) != 0)
            continue;
        reply->status = 200;
        reply->type = type;
        reply->body = (char *)file.text; /* only read: body_is_static */
        reply->len = file.len;
        reply->body_is_static = true;
        reply->cacheable = true;
        return true;
    }
    reply_refuse(reply, 404, "not_found", "Not found", "there is no schema of this name: /openapi.json refers to all");
    return false;
}

void service_openapi(api *context, http_request *rq, http_reply *reply)
{
    (void)context;
    (void)rq;
    reply_embedded("openapi.json", "application/json", reply);
}

void service_schema(api *context, http_request *rq, http_reply *reply)
{
    (void)context;
    reply_embedded(rq->name, "application/schema+json", reply);
}
