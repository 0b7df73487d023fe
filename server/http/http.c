/* http.c: the routes put behind the transport: start to stop. */
#include "http/http.h"
#include "http/api.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

/* ---- what the transport asks for */

static void on_answer(void *ctx, http_request *rq)
{
    rq->route->handler(ctx, rq, &rq->reply);
}

static void on_drop(void *ctx, http_request *rq)
{
    (void)ctx;
    store_upload_abort(rq->upload);
    rq->upload = NULL;
}

static void on_account(void *ctx, const http_request *rq, bool completed, bool expired)
{
    const api *context = ctx;
    const route *found = rq->route;
    char path[256];
    snprintf(path, sizeof path, "%.*s", (int)strcspn(rq->raw_target, "?"), rq->raw_target);
    for (char *at = path; *at; at++)
        if ((unsigned char)*at < 0x20 || (unsigned char)*at > 0x7e)
            *at = '?';
    /* what changed something, or was refused to whoever asked */
    const bool changes = strcmp(rq->method, "POST") == 0 || strcmp(rq->method, "DELETE") == 0;
    if (context->audit && ((changes && rq->status < 400) || rq->status == 401 || rq->status == 403)) {
        char address[INET6_ADDRSTRLEN] = "";
        unsigned char six[16] = {0};
        memcpy(six, rq->address, rq->address_len);
        if (rq->address_len > 0)
            inet_ntop(rq->address_len == 4 ? AF_INET : AF_INET6, six, address, sizeof address);
        log_write(context->audit, LOG_INFO, "audit",
                  (log_field[]){LOG_S("owner", rq->client),
                                LOG_S("token", rq->token),
                                LOG_S("address", address),
                                LOG_S("method", rq->method),
                                LOG_S("path", path),
                                LOG_I("status", rq->status),
                                LOG_S("job", rq->job_id),
                                LOG_S("upload", strlen(rq->name) == 64 ? rq->name : ""),
                                LOG_S("request", rq->id),
                                {0}});
    }
    if (context->options.access_log || rq->status >= 500) {
        const char *end = completed ? "complete" : expired ? "deadline" : "aborted";
        log_field fields[] = {LOG_S("method", rq->method),
                              LOG_S("path", path),
                              LOG_S("request", rq->id),
                              LOG_I("status", rq->status),
                              LOG_I("bytes", rq->reply_len),
                              LOG_N("seconds", clock_seconds(CLOCK_MONOTONIC) - rq->started),
                              LOG_S("job", rq->job_id),
                              LOG_S("token", rq->token),
                              LOG_S("end", end),
                              {0}};
        log_write(context->log, LOG_INFO, "request", fields);
    }
    metrics_request(context->metrics, found ? found->method : NULL, found ? found->pattern : NULL, rq->status,
                    clock_seconds(CLOCK_MONOTONIC) - rq->started);
}

/* ---- start to stop */

/* A mesh of two million tetrahedra. A request that names its file again is checked by this one. */
#define MESHES_KEPT ((size_t)128 << 20)

static void free_context(api *context)
{
    rates_stop(context->rates);
    uz_cache_free(context->meshes);
    sem_destroy(&context->turns);
    for (size_t i = 0; i < TOLD_TEXTS; i++)
        free(context->told[i].data);
    pthread_mutex_destroy(&context->told_lock);
    pthread_mutex_destroy(&context->rate.lock);
    pthread_mutex_destroy(&context->ready_lock);
    free(context);
}

bool http_start(http_server *out, int listen_fd, const http_parts *parts, const http_options *options, char *message,
                size_t size)
{
    api *context = calloc(1, sizeof *context);
    uint64_t random = 0;
    *out = (http_server){NULL, NULL};
    if (!context) {
        snprintf(message, size, "cannot start the HTTP server: out of memory");
        close(listen_fd);
        return false;
    }
    context->store = parts->store;
    context->work = parts->work;
    context->webhooks = parts->webhooks;
    context->log = parts->log;
    context->audit = parts->audit;
    context->metrics = parts->metrics;
    context->auth = parts->auth;
    context->options = *options;
    context->meshes = uz_cache_new(MESHES_KEPT);
    pthread_mutex_init(&context->ready_lock, NULL);
    pthread_mutex_init(&context->told_lock, NULL);
    sem_init(&context->turns, 0, (unsigned)work_settings(parts->work)->workers);
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random)
        random = (uint64_t)(clock_seconds(CLOCK_MONOTONIC) * 1e9);
    snprintf(context->run, sizeof context->run, "%016llx", (unsigned long long)random);
    pthread_mutex_init(&context->rate.lock, NULL);
    context->rate.per_s = options->max_client_rate > 0 ? options->max_client_rate : 0;
    if (getrandom(&context->rate.seed, sizeof context->rate.seed, 0) != (ssize_t)sizeof context->rate.seed)
        context->rate.seed = (uint64_t)(uintptr_t)context;
    context->rates = rates_start(context->store, &context->rate);
    const transport_handlers handlers = {.ctx = context,
                                         .admit = admission_check,
                                         .take = uploads_take,
                                         .answer = on_answer,
                                         .account = on_account,
                                         .drop = on_drop};
    const transport_options of_transport = {.log = parts->log,
                                            .feed = work_feed(parts->work),
                                            .body_budget =
                                                options->max_body < SIZE_MAX / 8 ? 8 * options->max_body : SIZE_MAX,
                                            .max_connections = options->max_connections,
                                            .max_client_connections = options->max_client_connections,
                                            .max_streams = options->max_streams,
                                            .request_deadline_s = options->request_deadline_s,
                                            .max_wait_s = options->max_wait_s,
                                            .cors = options->cors,
                                            .n_cors = options->n_cors,
                                            .tls = options->tls};
    if (!transport_start(&context->server, listen_fd, &handlers, &of_transport, message, size)) {
        free_context(context);
        return false;
    }
    *out = (http_server){context->server, context};
    return true;
}

bool api_draining(const api *context)
{
    return atomic_load(transport_draining(context->server));
}

const char *api_sees(const http_request *rq)
{
    return rq->sees_all ? NULL : rq->client;
}

store_status api_get_job(api *context, const http_request *rq, const char *id, job *out)
{
    const store_status status = store_get(context->store, id, out);
    if (status != STORE_OK || rq->sees_all || strcmp(out->client, rq->client) == 0)
        return status;
    job_clear(out);
    return STORE_NOT_FOUND;
}

bool api_is_over(void *asker)
{
    const api_asker *a = asker;
    return api_draining(a->context) || request_client_gone(a->rq);
}

void http_stop(http_server *server)
{
    if (!server->context)
        return;
    transport_stop(server->transport);
    free_context(server->context);
    *server = (http_server){NULL, NULL};
}
