/* service.c: routes about the service itself: what is cached, whether it lives, what is valid, and its page. */
#include "codec/codec.h"
#include "codec/embedded.h"
#include "codec/text.h"
#include "http/api.h"
#include "http/page.h"
#include "options/options.h"
#include "store/nodes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void service_factors(api *context, http_request *rq, http_reply *reply)
{
    uz_cache_entry *entries = NULL;
    size_t count = 0;
    (void)rq;
    reply->tag_by_body = true;
    if (!work_factors(context->work, &entries, &count))
        reply_no_memory(reply);
    else
        reply_json(reply, 200, codec_encode_factors(entries, count, work_settings(context->work)->cache_bytes));
    free(entries);
}

/* Bounds that are no options: those of this folder. */
static const codec_limit FIXED[] = {
    {"max_header", "bytes", "request line and header fields of a request together", HEADER_BYTES},
    {"max_header_fields", "count", "header fields of a request", HEADERS_MAX},
    {"max_parameters", "count", "query parameters of a request", TARGET_MAX_PARAMETERS}};
enum { N_FIXED = sizeof FIXED / sizeof FIXED[0] };

void service_limits(api *context, http_request *rq, http_reply *reply)
{
    const size_t n = context->options.n_limits;
    text t = {0};
    (void)rq;
    text_open(&t, NULL, '{');
    text_open(&t, "limits", '{');
    for (size_t i = 0; i < n + N_FIXED; i++) {
        const codec_limit *one = i < n ? &context->options.limits[i] : &FIXED[i - n];
        text_open(&t, one->name, '{');
        text_number(&t, "value", one->value);
        text_string(&t, "unit", one->unit);
        text_string(&t, "description", one->meaning);
        text_close(&t, '}');
    }
    text_close(&t, '}');
    text_close(&t, '}');
    reply->tag_by_body = true;
    reply_json(reply, 200, text_finish(&t, NULL));
}

static int64_t count_alive(store *s)
{
    store_node *nodes;
    size_t count;
    int64_t alive = 0;
    if (store_nodes(s, &nodes, &count) != STORE_OK)
        return -1;
    for (size_t i = 0; i < count; i++)
        alive += nodes[i].alive;
    store_nodes_free(nodes, count);
    return alive;
}

void service_metrics(api *context, http_request *rq, http_reply *reply)
{
    const transport_counts counts = transport_count(context->server);
    metrics_now now = {.workers = work_settings(context->work)->workers,
                       .workers_busy = work_busy(context->work),
                       .connections = counts.connections,
                       .streams = counts.streams,
                       .body_bytes = counts.body_bytes,
                       .store_free_bytes = store_free_bytes(context->store),
                       .version = UZAWAD_VERSION};
    size_t len = 0;
    (void)rq;
    if (!context->metrics) {
        reply_refuse(reply, 404, "not_found", "Not found", "this server keeps no metrics");
        return;
    }
    int64_t stored[STORE_COUNTS];
    const bool answered = store_counts(context->store, stored) == STORE_OK;
    memcpy(now.jobs, stored, sizeof now.jobs);
    now.clients = stored[STORE_SHARES_WAITING];
    if (!answered)
        now.jobs[0] = -1;
    for (int i = JOB_ACCEPTED; i <= JOB_DISMISSED; i++)
        now.job_names[i] = job_status_name((job_status)i);
    now.draining = work_draining(context->work);
    now.nodes = count_alive(context->store);
    work_cached(context->work, &now.cache_entries, &now.cache_bytes);
    now.cache_max_bytes = work_settings(context->work)->cache_bytes;
    char *body = metrics_text(context->metrics, &now, &len);
    reply_text(reply, 200, "text/plain; version=0.0.4; charset=utf-8", body, len);
}

/* Alive: the process answers. A supervisor restarts it on anything else, which would not help a failing store, so a
 * store that does not answer only shows in the counts. */
void service_health(api *context, http_request *rq, http_reply *reply)
{
    int64_t counts[STORE_COUNTS] = {0};
    (void)rq;
    bool answered = store_counts(context->store, counts) == STORE_OK;
    reply_json(
        reply, 200,
        codec_encode_health(answered ? "ok" : "store_unavailable", counts, work_settings(context->work)->workers));
}

static const double READY_FOR_S = 1.0; /* so often at most it is tried, however many ask */

void service_ready(api *context, http_request *rq, http_reply *reply)
{
    int64_t counts[STORE_COUNTS] = {0};
    char why[64] = "";
    (void)rq;
    reply->retry_after_s = 5;
    if (api_draining(context)) {
        reply_refuse(reply, 503, "draining", "The server is shutting down", "no new work is taken");
        return;
    }
    if (work_draining(context->work)) { /* others take its share */
        reply_refuse(reply, 503, "draining", "This node is drained",
                     "it runs no jobs until DELETE /v1/nodes/{name}/drain");
        return;
    }
    pthread_mutex_lock(&context->ready_lock);
    if (clock_seconds(CLOCK_MONOTONIC) >= context->ready_until) { /* what a job needs is tried */
        problem_details problem;
        const store_status status = store_try_write(context->store);
        const char *found = status == STORE_FULL ? "storage_full" : "store_unavailable";
        if (status == STORE_OK)
            found = work_solves(context->work) ? "" : "solver_unavailable";
        else
            api_store_failed(context, &problem);
        snprintf(context->ready_why, sizeof context->ready_why, "%s", found);
        context->ready_until = clock_seconds(CLOCK_MONOTONIC) + READY_FOR_S;
    }
    memcpy(why, context->ready_why, sizeof context->ready_why);
    pthread_mutex_unlock(&context->ready_lock);
    if (!why[0] && store_counts(context->store, counts) != STORE_OK)
        snprintf(why, sizeof why, "store_unavailable");
    if (strcmp(why, "solver_unavailable") == 0) {
        reply_refuse(reply, 503, why, "The solver does not answer", "a problem with a known answer was not solved");
    } else if (strcmp(why, "storage_full") == 0) {
        reply_refuse(reply, 503, why, "The disk is full",
                     "nothing can be stored: delete ended jobs or free disk space");
    } else if (why[0]) {
        reply_refuse(reply, 503, why, "The store does not answer", "the server's log has the cause");
    } else {
        reply->retry_after_s = 0;
        reply_json(reply, 200, codec_encode_health("ready", counts, work_settings(context->work)->workers));
    }
}

void service_schema(api *context, http_request *rq, http_reply *reply)
{
    const char *name = rq->name[0] ? rq->name : "openapi.json";
    (void)context;
    for (size_t i = 0; i < embedded_count(); i++) {
        const embedded_file file = embedded_at(i);
        if (strcmp(file.name, name) != 0)
            continue;
        reply->status = 200;
        reply->type = rq->name[0] ? "application/schema+json" : "application/json";
        reply->body = (char *)file.text; /* only read: body_is_static */
        reply->len = file.len;
        reply->body_is_static = true;
        reply->cacheable = true;
        reply->tag_by_body = true;
        return;
    }
    reply_refuse(reply, 404, "not_found", "Not found", "there is no schema of this name: /openapi.json refers to all");
}

/* ---- for administrators */

/* POST, because it costs as much as reading the whole file. */
void admin_check(api *context, http_request *rq, http_reply *reply)
{
    store_findings found;
    text t = {0};
    char line[512];
    (void)rq;
    store_status status = store_check(context->store, &found);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    if (found.findings[0])
        log_write(context->log, LOG_ERROR, "database_damaged", (log_field[]){LOG_S("findings", found.findings), {0}});
    text_open(&t, NULL, '{');
    text_bool(&t, "whole", found.findings[0] == '\0');
    text_open(&t, "findings", '[');
    for (const char *at = found.findings; *at;) { /* one a line */
        const size_t len = strcspn(at, "\n");
        snprintf(line, sizeof line, "%.*s", (int)len, at);
        text_string(&t, NULL, line);
        at += len + (at[len] == '\n');
    }
    text_close(&t, ']');
    text_integer(&t, "jobs", found.jobs);
    text_number(&t, "seconds", found.seconds);
    text_close(&t, '}');
    reply_json(reply, 200, text_finish(&t, NULL));
    free(found.findings);
}

/* ---- the web page. It needs no token: it is the same for everybody and asks for one itself. Its policy allows nothing
 * but its own files and this service, and no code or style within the document (W3C Content Security Policy 3). */

static const char POLICY[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; frame-ancestors 'none'; form-action 'none'";

void page_get(api *context, http_request *rq, http_reply *reply)
{
    const char *name = rq->name[0] ? rq->name : "index.html"; /* GET / */
    (void)context;
    page_file file;
    for (size_t i = 0; (file = page_file_at(i)).name; i++) {
        if (strcmp(file.name, name) != 0)
            continue;
        reply->status = 200;
        reply->type = file.type;
        reply->body = (char *)(uintptr_t)file.plain; /* only read: body_is_static */
        reply->len = file.plain_len;
        reply->body_is_static = true;
        reply->packed = file.gzip;
        reply->packed_len = file.gzip_len;
        reply->cacheable = true;
        reply->immutable = strcmp(name, "index.html") != 0; /* the other names have a hash of the content in them */
        reply->tag_by_body = true;
        reply->policy = POLICY;
        return;
    }
    reply_refuse(reply, 404, "not_found", "Not found", "the page has no file of this name");
}
