/* http.h: the daemon's HTTP side, start to stop: transport/ has the connections, and here are the routes.
 *
 * admission.c refuses what can be refused without the body; routes.c has the table of all handlers, each in the file of
 * its subject. Handlers own nothing beyond their request: the store and the workers own the jobs. */
#ifndef SERVER_HTTP_H
#define SERVER_HTTP_H

#include "codec/codec.h"
#include "base/log.h"
#include "base/metrics.h"
#include "http/auth.h"
#include "http/transport/transport.h"
#include "store/store.h"
#include "work/webhook.h"
#include "work/work.h"

#include <stdbool.h>
#include <stddef.h>

/* All NULL: it has not been started. transport_use_tls and transport_drain are for its owner too: once it drains,
 * submissions and /readyz are answered 503 and long polls end early; everything else goes on. */
typedef struct {
    transport *transport;
    struct api *context;
} http_server;

typedef struct {
    store *store;
    work *work;
    const webhooks *webhooks; /* NULL: there are none */
    server_log *log, *audit;  /* audit: who did what; may be NULL */
    metrics *metrics;         /* may be NULL */
    auth *auth;               /* NULL: everybody may all */
} http_parts;

typedef struct {
    size_t max_body;           /* bytes of one request's body */
    size_t max_upload;         /* bytes of one upload, as it is sent and after decompression */
    unsigned max_connections;  /* open at once */
    unsigned max_streams;      /* of them, event streams */
    double request_deadline_s; /* for a whole request, without the allowance for its body's length */
    const char *const *cors;   /* n_cors origins ("https://host[:port]" or "*") whose pages may use the service */
    size_t n_cors;
    double max_wait_s;               /* cap of Prefer: wait */
    unsigned max_client_connections; /* of one address; 0: no limit */
    int max_client_rate;             /* requests per second of one client; 0: no limit */
    const http_tls *tls;             /* NULL: plain HTTP; must outlive the server */
    bool access_log;                 /* a line for each request */
    const codec_limit *limits;       /* n_limits, for GET /v1/limits; they must outlive the server */
    size_t n_limits;
} http_options;

/* Serves on listen_fd, which it owns from then on, also on failure. False with the reason in message. */
bool http_start(http_server *out, int listen_fd, const http_parts *parts, const http_options *options, char *message,
                size_t size);

/* Ends every connection. The work must have been stopped (not freed) before, so that no handler waits in it. Nothing
 * happens where it has not been started. */
void http_stop(http_server *server);

#endif
