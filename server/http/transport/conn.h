/* conn.h: private to server/http: the server object and one connection's state. */
#ifndef SERVER_HTTP_CONN_H
#define SERVER_HTTP_CONN_H

#include "http/transport/deadlines.h"
#include "http/transport/held.h"
#include "http/http.h"
#include "http/transport/presence.h"
#include "http/rate.h"
#include "http/request.h"

#include <microhttpd.h>
#include <pthread.h>

/* Bytes of each connection's buffer, in which libmicrohttpd keeps the header block, 64 bytes for each of its fields and
 * the head of the reply, and the piece in which a body arrives. */
#define CONNECTION_MEMORY (64 * 1024)
/* The largest header block: with HEADERS_MAX fields too there is room left for a reply. */
#define HEADER_BYTES (48 * 1024)
/* All bodies in memory at once; a request beyond it is told to come back later. */
#define BODY_BUDGET(max_body) ((max_body) < SIZE_MAX / 8 ? 8 * (max_body) : SIZE_MAX)
/* Slowest transfer that is waited for, bytes per second: the allowance that a body's length adds to a deadline. */
#define SLOWEST_RATE 100e3

struct http_server {
    api context;
    http_options options;
    struct MHD_Daemon *daemon;
    deadlines *deadlines;
    holder *holder; /* NULL: every connection keeps its thread */
    auth *auth;
    rate *rate;            /* NULL: no limit */
    bool tls;              /* nothing can be written past libmicrohttpd */
    pthread_key_t current; /* the conn that this thread serves, once it has a request */
    bool check_layout;
    size_t body_budget;
    char id_prefix[17];      /* of the request ids made here; random */
    atomic_uint_fast64_t id; /* the last one's number */
    atomic_uint conns;       /* connections of libmicrohttpd's */
    atomic_uint refusing;    /* those of them that it refuses by itself: http_stop */
    atomic_bool stopping;
};

typedef struct {
    http_server *server;
    deadline *deadline;
    http_request *request; /* NULL between requests, and when it is held without this connection */
    presence *place;
    int fd;
    unsigned char address[16]; /* that counts for the rate */
    size_t address_len;
    bool refusing;
    framing_layout layout;
} conn;

/* NULL: no memory; the connection's requests are then refused. */
conn *conn_new(http_server *server, int fd, const struct sockaddr *address);
void conn_free(conn *c);

void conn_begin_request(conn *c, const char *raw_target);
/* The next three return false when the connection must be closed without a (further) reply. */
bool conn_headers(conn *c, struct MHD_Connection *mhd, const char *method, const char *version);
bool conn_body(conn *c, const char *data, size_t size);
bool conn_answer(conn *c, struct MHD_Connection *mhd);
/* Answers a request that libmicrohttpd is about to refuse with this status. */
void conn_refuse(conn *c, int status);
/* status: of the reply that libmicrohttpd made by itself, 0 if there was none. */
void conn_end_request(conn *c, unsigned status, bool completed);

/* A request that was held, with its connection, is over: of the holder. ctx is the server. */
void conn_end_held(void *ctx, http_request *rq, bool completed);

/* admission.c: everything that can be refused before the body is read; false with rq->refused and the header fields of
 * rq->reply. */
bool admit(conn *c);
/* Sets what the reply says to pages of other origins. */
void cors_find(http_server *server, http_request *rq);

#endif
