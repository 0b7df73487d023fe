/* request.h: one request as a handler sees it; nothing of libmicrohttpd shows. */
#ifndef SERVER_HTTP_REQUEST_H
#define SERVER_HTTP_REQUEST_H

#include "codec/codec.h"
#include "http/auth.h"
#include "http/transport/framing.h"
#include "http/transport/reply.h"
#include "http/transport/target.h"
#include "base/log.h"
#include "base/metrics.h"
#include "store/store.h"
#include "store/uploads.h"
#include "work/webhook.h"
#include "work/work.h"

#include <pthread.h>
#include <stdatomic.h>

/* What handlers may use, the same for all requests. */
typedef struct {
    store *store;
    work *work;
    server_log *log;
    struct field_slots *fields;   /* turns of replies that are computed: fields.h */
    struct presences *presences;  /* the connections that are open */
    struct told_changes *told;    /* texts of the latest changes of jobs: all_events.h */
    char run[17];                 /* a random name of this run of the daemon */
    pthread_mutex_t predict_lock; /* holds nothing: predictions take turns */
    const webhooks *webhooks;     /* NULL: there are none */
    metrics *metrics;
    double max_wait_s;
    int64_t max_upload;      /* bytes, decompressed */
    const char *const *cors; /* n_cors origins whose pages may use the service; "*": all */
    size_t n_cors;
    unsigned max_streams; /* event streams open at once */
    atomic_uint streams;
    const codec_limit *limits; /* n_limits */
    size_t n_limits;
    atomic_bool draining;
    pthread_mutex_t ready_lock; /* the next two */
    double ready_until;         /* on deadlines_now's clock: until then ready_why is what /readyz says */
    char ready_why[64];         /* "": ready */
    atomic_size_t body_bytes;   /* of all bodies in memory */
} api;

typedef struct http_request {
    char *raw_target; /* as received */
    target target;
    header_list headers;
    framing framing;
    const struct route *route;
    char name[65];                  /* what stood for {id} or {name} in the path */
    char *body;                     /* NUL-terminated; NULL when empty */
    size_t body_len, body_capacity; /* body_len: as received, also of a body that is streamed */
    upload_writer *upload;          /* where the body of a streamed route goes */
    char id[65];                    /* X-Request-Id, the client's or our own */
    char token[64];                 /* the name of the token that it came with; "": none */
    int fd;                         /* to see whether the client is still there */
    /* For the access log and the connection's bookkeeping. */
    char method[16];
    double started; /* on deadlines_now's clock */
    int status;     /* of the reply; 0: none was sent */
    size_t reply_len;
    char job_id[33];
    bool begun;              /* the header block has been looked at */
    bool can_be_held;        /* its connection can do without libmicrohttpd (held.h) */
    char *kept_fields;       /* what `headers` points into, where that is not the connection's buffer */
    struct presence *place;  /* its connection's, where that is held */
    bool unread_body;        /* the reply was sent before the whole body was read */
    problem_details refused; /* status 0: none; otherwise the answer, known before the body was read */
    http_reply reply;
} http_request;

/* Seconds of `Prefer: wait=N` (RFC 7240), or `otherwise` when there is none; capped. */
double request_wait(const http_request *rq, double otherwise, double max_wait_s);
/* True if an Accept header field names the media type with a quality above 0, or a longer list does. */
bool request_accepts(const http_request *rq, const char *type);
/* True if Accept-Encoding names gzip, or all that it does not name, with a quality above 0. */
bool request_takes_gzip(const http_request *rq);
/* True if the body may be JSON: Content-Type absent, application/json or ...+json. */
bool request_is_json(const http_request *rq);
/* The client closed its end: an answer would reach nobody. */
bool request_client_gone(const http_request *rq);

/* Notes in the request what its reply says, and the other way round. */
void request_note_reply(http_request *rq);
/* The header fields in memory of their own, as the connection's buffer goes. False: no memory. */
bool request_keep_fields(http_request *rq);

/* Reads a decimal integer of the query in [least, most]; absent: *out is left. False with a 400. */
bool request_integer(const http_request *rq, const char *key, int64_t least, int64_t most, int64_t *out,
                     problem_details *problem);

/* ---- the route table (routes.c) */
typedef void (*route_handler)(api *context, http_request *rq, http_reply *reply);
typedef struct route {
    const char *method, *pattern;
    const char *const *parameters; /* known query keys, NULL-terminated */
    route_handler handler;
    bool streamed; /* the body is bytes of any type that go to disk as they come */
} route;

/* What a token must allow for this route. Whoever adds a route need not think of it: what changes something is for
 * `submit`, what only reads for `read`, /v1/admin/ for `admin`. */
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
void jobs_delete(api *context, http_request *rq, http_reply *reply);
void jobs_refine(api *context, http_request *rq, http_reply *reply);
void verify_submit(api *context, http_request *rq, http_reply *reply);
void results_get(api *context, http_request *rq, http_reply *reply);
void results_get_vtu(api *context, http_request *rq, http_reply *reply);
void results_get_surface(api *context, http_request *rq, http_reply *reply);
void results_get_picture(api *context, http_request *rq, http_reply *reply);
void uploads_create(api *context, http_request *rq, http_reply *reply);
void uploads_get(api *context, http_request *rq, http_reply *reply);
void uploads_delete(api *context, http_request *rq, http_reply *reply);
void events_get(api *context, http_request *rq, http_reply *reply);
void events_get_all(api *context, http_request *rq, http_reply *reply);
void history_get(api *context, http_request *rq, http_reply *reply);
void trade_get(api *context, http_request *rq, http_reply *reply);
void convergence_get(api *context, http_request *rq, http_reply *reply);
void history_get_csv(api *context, http_request *rq, http_reply *reply);
void service_limits(api *context, http_request *rq, http_reply *reply);
void service_factors(api *context, http_request *rq, http_reply *reply);
void admin_check(api *context, http_request *rq, http_reply *reply);
void service_metrics(api *context, http_request *rq, http_reply *reply);
void service_health(api *context, http_request *rq, http_reply *reply);
void service_ready(api *context, http_request *rq, http_reply *reply);
void service_openapi(api *context, http_request *rq, http_reply *reply);
void service_schema(api *context, http_request *rq, http_reply *reply);
void page_index(api *context, http_request *rq, http_reply *reply);
void page_part(api *context, http_request *rq, http_reply *reply);

/* Reads the job named in the path; false with a 404 or 500 in reply. */
bool jobs_load(api *context, http_request *rq, job *out, http_reply *reply);
/* Fills a reply for a store call that failed, and logs a STORE_ERROR. */
void reply_store_failure(api *context, store_status status, http_reply *reply);

#endif
