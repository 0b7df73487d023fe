/* http.h: the daemon's HTTP side, start to stop. The only folder that knows libmicrohttpd.
 *
 * bytes -> framing (framing.h) -> target (target.h) -> route table (routes.c: all handlers, each in the file of its
 * subject) -> negotiation (negotiate.h) -> reply (reply.h). One thread per connection, so a handler may block, and none
 * for one that only waits (held.h); deadlines.h ends connections that are too slow. Handlers own nothing beyond their
 * request: the store and the workers own the jobs. */
#ifndef SERVER_HTTP_H
#define SERVER_HTTP_H

#include "codec/codec.h"
#include "http/auth.h"
#include "base/log.h"
#include "base/metrics.h"
#include "store/store.h"
#include "work/webhook.h"
#include "work/work.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct http_server http_server;

typedef struct {
    store *store;
    work *work;
    const webhooks *webhooks; /* NULL: there are none */
    server_log *log;
    metrics *metrics; /* may be NULL */
    auth *auth;       /* NULL: everybody may all */
} http_parts;

/* Certificate chain and key as PEM texts. */
typedef struct {
    char *cert, *key;
} http_tls;
/* Reads and checks both files; false with the reason in message. The caller clears *out. */
bool http_tls_read(http_tls *out, const char *cert_path, const char *key_path, char *message, size_t size);
void http_tls_clear(http_tls *tls); /* {NULL, NULL} is fine */

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

/* Opens a listening socket on "HOST:PORT" or "[IPv6]:PORT"; port 0 takes a free one. url becomes "SCHEME://HOST:PORT"
 * with the real port. -1 on failure with the reason in message. */
int http_listen(const char *host_port, const char *scheme, char *url, size_t url_size, char *message, size_t size);
/* True if others than this machine can reach the socket. */
bool http_is_public(int listen_fd);

/* Serves on listen_fd, which it owns from then on, also on failure. NULL on failure with the reason in message. */
http_server *http_start(int listen_fd, const http_parts *parts, const http_options *options, char *message,
                        size_t size);

/* From now on submissions are answered 503, /readyz too, and long polls end early; everything else goes on. */
void http_drain(http_server *server);

/* Ends every connection and frees the server. The work must have been stopped (not freed) before, so that no handler
 * waits in it. */
void http_stop(http_server *server);

#endif
