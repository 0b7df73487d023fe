/* api.h: what every route has: the service's parts, the route table and the handlers. */
#ifndef SERVER_HTTP_API_H
#define SERVER_HTTP_API_H

#include "codec/codec.h"
#include "http/auth.h"
#include "http/http.h"
#include "http/rate.h"
#include "http/rates.h"
#include "http/transport/transport.h"
#include "store/store.h"
#include "work/webhook.h"
#include "work/work.h"

#include <pthread.h>
#include <semaphore.h>

/* What streams over all jobs share: the texts of the latest changes, each encoded once for all of them (events.c). */
#define TOLD_TEXTS 512
typedef struct {
    uint64_t number; /* of the change; 0: none */
    const char *event;
    char *data;
    char client[STORE_CLIENT]; /* whose job it is */
    bool nobodys;              /* it is gone, and that is told with a later change: whose it was is not known */
} told_text;

/* What handlers may use, the same for all requests. */
typedef struct api {
    store *store;
    work *work;
    server_log *log, *audit; /* audit may be NULL */
    metrics *metrics;
    const webhooks *webhooks; /* NULL: there are none */
    auth *auth;               /* NULL: everybody may all */
    rate rate;                /* per_s 0: no limit */
    rates *rates;             /* NULL: it counts for this daemon alone */
    http_options options;
    transport *server;
    uz_cache *meshes;           /* of uploads that requests have named; NULL: none are kept */
    sem_t turns;                /* so many replies may be computed at a time, the others wait: fields.c */
    pthread_mutex_t told_lock;  /* the next; taken before the store's and the workers' own */
    told_text told[TOLD_TEXTS]; /* of change n at n % TOLD_TEXTS */
    char run[17];               /* a random name of this run of the daemon */
    pthread_mutex_t ready_lock; /* the next two */
    double ready_until;         /* on CLOCK_MONOTONIC: until then ready_why is what /readyz says */
    char ready_why[64];         /* "": ready */
} api;

/* The daemon is about to end: nothing is waited for. */
bool api_draining(const api *context);

/* Whose jobs and uploads the request may see: a client, as the store takes it. */
const char *api_sees(const http_request *rq);
/* A job of those: STORE_NOT_FOUND also where it is another's. */
store_status api_get_job(api *context, const http_request *rq, const char *id, job *out);

/* Whoever waits for what is computed. */
typedef struct {
    api *context;
    const http_request *rq;
} api_asker;
/* Nobody would read the reply, or the daemon wants to end; asker: an api_asker, for the library's hooks. */
bool api_is_over(void *asker);

/* ---- before a body is read (admission.c, uploads.c): false with rq->refused */
bool admission_check(void *ctx, http_request *rq); /* ctx: the api, as below */
bool uploads_begin(api *context, http_request *rq);
/* A piece of the body; ctx: the api. */
bool uploads_take(void *ctx, http_request *rq, const char *data, size_t size);

/* ---- the route table (routes.c) */
typedef void (*route_handler)(api *context, http_request *rq, http_reply *reply);
typedef struct route {
    const char *method, *pattern;
    const char *const *parameters; /* known query keys, NULL-terminated */
    route_handler handler;
    bool streamed; /* the body is bytes of any type that go to disk as they come */
} route;

/* What a token must allow for this route. Whoever adds a route need not think of it: what changes something is for
 * `submit`, what only reads for `read`, /v1/admin/ and what is done to a node for `admin`. */
auth_scope route_scope(const route *r);

/* Sets rq->route and rq->name; otherwise 404, or 405 with what is allowed in allow. With rq->reply.cors, OPTIONS is
 * answered on every path that there is. */
bool route_find(http_request *rq, char *allow, size_t size, problem_details *problem);
/* 400 for a query key that the route does not know. */
bool route_check_parameters(const http_request *rq, problem_details *problem);

/* ---- handlers */
void jobs_submit(api *context, http_request *rq, http_reply *reply);
void jobs_list(api *context, http_request *rq, http_reply *reply);
void jobs_get(api *context, http_request *rq, http_reply *reply);
void jobs_request(api *context, http_request *rq, http_reply *reply);
void jobs_delete(api *context, http_request *rq, http_reply *reply);
void jobs_refine(api *context, http_request *rq, http_reply *reply);
void verify_submit(api *context, http_request *rq, http_reply *reply);
void decks_translate(api *context, http_request *rq, http_reply *reply);
void results_get(api *context, http_request *rq, http_reply *reply);
void results_get_arrays(api *context, http_request *rq, http_reply *reply);
void uploads_create(api *context, http_request *rq, http_reply *reply);
void uploads_get(api *context, http_request *rq, http_reply *reply);
void uploads_delete(api *context, http_request *rq, http_reply *reply);
void events_get(api *context, http_request *rq, http_reply *reply);
void events_get_all(api *context, http_request *rq, http_reply *reply);
void trade_get(api *context, http_request *rq, http_reply *reply);
void convergence_get(api *context, http_request *rq, http_reply *reply);
void whole_error_get(api *context, http_request *rq, http_reply *reply);
void service_limits(api *context, http_request *rq, http_reply *reply);
void nodes_list(api *context, http_request *rq, http_reply *reply);
void nodes_drain(api *context, http_request *rq, http_reply *reply);
void service_factors(api *context, http_request *rq, http_reply *reply);
void admin_check(api *context, http_request *rq, http_reply *reply);
void service_metrics(api *context, http_request *rq, http_reply *reply);
void service_health(api *context, http_request *rq, http_reply *reply);
void service_ready(api *context, http_request *rq, http_reply *reply);
void service_schema(api *context, http_request *rq, http_reply *reply);
void page_get(api *context, http_request *rq, http_reply *reply);

/* Logs why a store call failed with STORE_ERROR; *problem is a 500. Returns false. */
bool api_store_failed(api *context, problem_details *problem);
/* Fills a reply for a store call that failed, and logs what whoever runs the service must know. */
void reply_store_failure(api *context, store_status status, http_reply *reply);

#endif
