/* http.h: requests to the service over libcurl. The only file that includes curl.h is http.c.
 *
 * Who retries: this layer alone. A request that never reached the server is sent again until `patience_s` has passed;
 * one that may have reached it (reply lost, 429, 502, 503, 504) only if it is `repeatable`. */
#ifndef CLIENT_HTTP_H
#define CLIENT_HTTP_H

#include "files.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct client_http client_http;

typedef enum {
    CLIENT_HTTP_ANSWERED, /* a whole reply with any status */
    CLIENT_HTTP_UNREACHABLE,
    CLIENT_HTTP_DEADLINE, /* the deadline passed first */
    CLIENT_HTTP_MEMORY
} client_http_end;

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
} client_request;

typedef struct {
    long status;
    client_buffer body;
    double retry_after_s; /* from the reply's header, 0 if none */
    char message[320];    /* why there is no reply */
} client_reply;
void client_reply_clear(client_reply *reply);

/* NULL: message says what is wrong with the URL. The caller frees. */
client_http *client_http_open(const char *server, char *message, size_t size);
void client_http_close(client_http *http);
/* From now on: the bearer token to send (RFC 6750), and the file with the certificates (PEM) to trust for https instead
 * of the system's. NULL or "": none. Both must outlive http. */
void client_http_trust(client_http *http, const char *token, const char *ca_file);

/* Sends the request, again if need be. The caller clears *reply in every case. */
client_http_end client_http_send(client_http *http, client_reply *reply, const client_request *request);

/* Appends a path or query part, percent-escaped. */
bool client_http_append_escaped(client_buffer *to, const char *text);

double client_clock(void); /* seconds, monotonic */
void client_sleep(double seconds);

#endif
