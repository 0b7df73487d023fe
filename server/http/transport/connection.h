/* connection.h: private to this folder: the server object and one connection's state. */
#ifndef SERVER_HTTP_CONNECTION_H
#define SERVER_HTTP_CONNECTION_H

#include "http/transport/deadlines.h"
#include "http/transport/framing.h"
#include "http/transport/held.h"
#include "http/transport/peer.h"
#include "http/transport/transport.h"

#include <gnutls/gnutls.h>
#include <microhttpd.h>
#include <pthread.h>

/* Bytes of each connection's buffer, in which libmicrohttpd keeps the header block, 64 bytes for each of its fields and
 * the head of the reply, and the piece in which a body arrives. */
#define CONNECTION_MEMORY (64 * 1024)
/* Connections beyond the limit, where nobody can go: for health checks, everybody else is told 503 there. */
#define SPARE_CONNECTIONS 32
/* Slowest transfer that is waited for, bytes per second: the allowance that a body's length adds to a deadline. */
#define SLOWEST_RATE 100e3

struct transport {
    transport_handlers handlers;
    transport_options options;
    struct MHD_Daemon *daemon;
    deadlines *deadlines;
    holder *holder; /* NULL: every connection keeps its thread */
    peers peers;
    /* Certificates, the one in use last; those before it may be in use by connections. */
    pthread_mutex_t tls_lock;
    gnutls_certificate_credentials_t *credentials;
    size_t n_credentials;
    bool tls;              /* nothing can be written past libmicrohttpd */
    pthread_key_t current; /* the connection that this thread serves, once it has a request */
    bool check_layout;
    char id_prefix[17];       /* of the request ids made here; random */
    atomic_uint_fast64_t id;  /* the last one's number */
    atomic_uint connections;  /* of libmicrohttpd's */
    atomic_uint refusing;     /* those of them that it refuses by itself: transport_stop */
    atomic_uint streams;      /* open */
    atomic_size_t body_bytes; /* of all bodies in memory */
    atomic_bool draining, stopping;
    /* The thread's that accepts. */
    bool next_is_spare;    /* of the connection accepted last */
    double warned;         /* when it was last said that there are too many; on CLOCK_MONOTONIC */
    uint64_t cut, refused; /* since then: cut to make room, and not let in */
};

typedef struct {
    transport *server;
    deadline *deadline;
    http_request *request; /* NULL between requests, and when it is held without this connection */
    peer *place;
    int fd;
    bool refusing;
    bool spare; /* one more than there may be: for health checks */
    framing_layout layout;
    chunk_follower chunks;
    /* What libmicrohttpd has read ahead: bytes behind the header block, as long as a request is under way, then behind
     * the request; and how many it had read in all by then. */
    uint64_t ahead, read;
} connection;

/* Certificate and key as GnuTLS takes them, freed by the caller; false with the reason. */
bool http_tls_load(gnutls_certificate_credentials_t *out, const http_tls *tls, char *message, size_t size);

/* NULL: there was no memory for it; its requests are then refused. */
connection *connection_of(struct MHD_Connection *mhd);
/* Of libmicrohttpd, with the server as context: a connection begins or ends; a request has ended. */
void connection_notify(void *ctx, struct MHD_Connection *mhd, void **socket_context,
                       enum MHD_ConnectionNotificationCode code);
void connection_completed(void *ctx, struct MHD_Connection *mhd, void **request_context,
                          enum MHD_RequestTerminationCode code);

void connection_begin_request(connection *c, const char *raw_target);
/* The next three return false when the connection must be closed without a (further) reply. */
bool connection_headers(connection *c, struct MHD_Connection *mhd, const char *method, const char *version);
bool connection_body(connection *c, const char *data, size_t size);
bool connection_answer(connection *c, struct MHD_Connection *mhd);
/* Answers a request that libmicrohttpd is about to refuse with this status. */
void connection_refuse(connection *c, int status);

/* A request that was held, with its connection, is over: of the holder. ctx is the server. */
void connection_end_held(void *ctx, http_request *rq, bool completed);

#endif
