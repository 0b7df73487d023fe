/* http.h: requests to the service over libcurl. The only file that includes curl.h is http.c.
 *
 * Who retries: this layer alone. A request that never reached the server is sent again until `patience_s` has passed;
 * one that may have reached it (reply lost, 429, 502, 503, 504) only if it is `repeatable`. */
#ifndef CLIENT_HTTP_H
#define CLIENT_HTTP_H

#include "local/files.h"

#include <stdbool.h>
#include <stddef.h>
#include <time.h>

typedef struct client_http client_http;

typedef enum {
    CLIENT_HTTP_ANSWERED, /* a whole reply with any status */
    CLIENT_HTTP_UNREACHABLE,
    CLIENT_HTTP_DEADLINE,    /* the deadline passed first */
    CLIENT_HTTP_INTERRUPTED, /* the watch said so */
    CLIENT_HTTP_MEMORY
} client_http_end;

/* Why there is no reply. */
typedef enum {
    CLIENT_CAUSE_NONE,
    CLIENT_CAUSE_NAME,        /* the host's name is not known */
    CLIENT_CAUSE_CONNECTION,  /* nobody listens there, or a firewall */
    CLIENT_CAUSE_CERTIFICATE, /* not one that is trusted, or of another host, or out of date */
    CLIENT_CAUSE_TLS,
    CLIENT_CAUSE_SILENCE,
    CLIENT_CAUSE_OTHER
} client_http_cause;

/* Looked after while a request is under way, and between attempts. */
typedef struct {
    int fd;                   /* to be read by `woken` when it is readable; -1: none */
    bool (*woken)(void *ctx); /* true: give up, CLIENT_HTTP_INTERRUPTED */
    void (*tick)(void *ctx);  /* some four times a second; NULL: none */
    void *ctx;
} client_http_watch;

#define CLIENT_HTTP_MAX_HEADERS 4
typedef struct {
    const char *method, *path;                    /* path begins with '/', its parts are escaped already */
    const char *headers[CLIENT_HTTP_MAX_HEADERS]; /* "Name: value"; unused ones NULL */
    const char *body;                             /* NULL: none */
    const char *body_type;                        /* "Content-Type: ..." of the body; NULL: JSON */
    size_t body_len;
    bool repeatable;
    double patience_s; /* see above; 0: one attempt */
    double silence_s;  /* a reply may stay away this long before the connection counts as lost */
    double deadline;   /* client_clock time; INFINITY: none */
    /* If not NULL it gets the body of a 2xx reply as it comes, in place of reply.body; false: enough, which ends the
     * request with CLIENT_HTTP_ANSWERED. */
    bool (*take)(void *ctx, const char *bytes, size_t count);
    void *take_ctx;
    bool certificate; /* tell about the server's in the reply */
} client_request;

typedef struct {
    long status;
    client_buffer body;
    double retry_after_s; /* from the reply's header, 0 if none */
    char message[320];    /* why there is no reply */
    client_http_cause cause;
    int attempts;
    time_t date;      /* of the reply's header, -1 if none */
    char address[64]; /* that answered */
    time_t cert_until;
    char cert_subject[128]; /* "": not asked for, or no TLS */
} client_reply;
void client_reply_clear(client_reply *reply);

/* A connection to the service at the URL. token: the bearer token to send (RFC 6750); ca_file: with the certificates
 * (PEM) to trust for https instead of the system's; NULL or "": none, else both must outlive it. NULL: message says
 * what is wrong with the URL. The caller frees. */
client_http *client_http_open(const char *server, const char *token, const char *ca_file, char *message, size_t size);
void client_http_close(client_http *http);

/* From now on; NULL: none. Must outlive http. */
void client_http_set_watch(client_http *http, const client_http_watch *watch);

/* Sends the request, again if need be. The caller clears *reply in every case. */
client_http_end client_http_send(client_http *http, client_reply *reply, const client_request *request);

/* Appends a path or query part, percent-escaped. */
bool client_http_append_escaped(client_buffer *to, const char *text);

double client_clock(void); /* seconds, monotonic */
/* Sleeps, with an eye on the watch. False: that said to give up. */
bool client_http_pause(client_http *http, double seconds);

#endif
