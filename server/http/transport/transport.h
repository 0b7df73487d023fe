/* transport.h: HTTP without the service behind it: the server that reads requests and sends replies, and what whoever
 * answers (the routes) may read of a request and do with its reply. The only header of this folder that others include,
 * and the only folder that knows libmicrohttpd.
 *
 * bytes -> framing.c -> connection.c: the header block -> transport_handlers.admit -> the body, kept or passed on by
 * `take` -> `answer` -> negotiate.c (304, ranges, gzip) -> reply.c -> `account`. Each connection has a thread of its
 * own, so that a handler may block; a reply that only waits gives that thread back (held.h). deadlines.h ends
 * connections that are too slow. */
#ifndef SERVER_HTTP_TRANSPORT_H
#define SERVER_HTTP_TRANSPORT_H

#include "base/clock.h"
#include "base/log.h"
#include "base/problem_details.h"
#include "work/feed.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct transport transport;
struct sockaddr;

/* ---- header fields */

#define HEADERS_MAX 128
/* The largest header block, request line included: with HEADERS_MAX fields too there is room left for a reply. */
#define HEADER_BYTES (48 * 1024)

/* As received, in order; they live in the connection's buffer until the request completes. */
typedef struct {
    const char *name, *value;
    size_t name_len, value_len;
} header_field;
typedef struct {
    header_field fields[HEADERS_MAX];
    size_t count;
    bool overflow; /* there were more than HEADERS_MAX */
} header_list;

/* The first field of that name, NULL if there is none; *count (may be NULL) is how many there are. */
const header_field *header_find(const header_list *headers, const char *name, size_t *count);
/* RFC 9110 tokens; ASCII case is ignored. */
bool token_equal(const char *text, size_t len, const char *token);

/* ---- request target (RFC 9112, section 3.2) */

#define TARGET_MAX_PARAMETERS 16
#define TARGET_REPEATABLE     "tag" /* the only key that may come more than once */

typedef struct {
    char *text;       /* owns what the others point into */
    const char *path; /* decoded, begins with '/' */
    struct {
        const char *key, *value; /* decoded; value "" when there was no '=' */
    } parameters[TARGET_MAX_PARAMETERS];
    size_t count;
} target;

/* Takes origin form ("/v1/jobs?limit=5") and absolute form ("http://host/v1/jobs"). The raw target is read here and not
 * by libmicrohttpd, which cuts at an encoded NUL and keeps the last of two keys. False with a 400 (or 500 when there is
 * no memory): broken or NUL percent-encoding, control characters, a key twice, too many keys. */
bool target_parse(target *out, const char *raw, problem_details *problem);
void target_clear(target *t);
/* The value of a key, NULL if the key is absent. */
const char *target_value(const target *t, const char *key);

/* ---- reply */

#define REPLY_TAG 48 /* room for an entity tag without its quotes, in any coding, and a NUL */

/* A body that comes piece by piece. read blocks until it has written 1 to `size` bytes, and returns how many, or that
 * there are no more, or that there are no more although there should be. It is called in the connection's thread.
 * With the second part the reply can do without that thread (held.h). Private to this folder: routes use event_stream
 * and delayed_reply below. */
enum { REPLY_STREAM_ENDS = -1, REPLY_STREAM_BREAKS = -2 };
typedef struct {
    ptrdiff_t (*read)(void *ctx, char *out, size_t size);
    void (*free)(void *ctx);
    void *ctx;
    listener *listener; /* ctx's own: wakes whoever has to read */
    bool *held;         /* ctx's own; set: from now on read returns 0 instead of blocking; NULL: it can't */
    /* When to read again at the latest, on CLOCK_MONOTONIC; told: the listener was. */
    double (*due)(void *ctx, bool told);
    bool is_message; /* what read gives is the whole message, header fields included */
    /* Of such a source whose connection keeps its thread: waits here and puts the reply. */
    void (*answer)(void *ctx);
} reply_source;

typedef struct {
    int status;
    const char *type; /* media type of body */
    char *body;       /* malloc'ed unless body_is_static */
    size_t len;
    bool body_is_static;
    bool cacheable;      /* the same for everybody until the daemon is replaced */
    bool close;          /* the connection ends with this reply */
    int retry_after_s;   /* 0: none */
    char tag[REPLY_TAG]; /* names the representation, "": no name */
    bool tag_by_body;    /* the name follows from the body: negotiate makes it */
    bool takes_ranges;   /* a part of it may be asked for */
    bool varies_by_coding, varies_by_type;
    bool gzip;          /* body is compressed */
    const char *packed; /* the gzip of a body that is static, packed_len bytes, static too; NULL: none was made */
    size_t packed_len;
    const char *policy; /* what a page may load and do (Content-Security-Policy); NULL: nothing */
    bool immutable;     /* what has this address never changes */
    char content_range[80];
    const char *cors_origin; /* a page of this origin may read the reply; NULL: none; lives as long as the server */
    bool secure;             /* comes by TLS: the browser is to come by no other way again */
    bool cors, preflight;    /* replies depend on the origin; this one says what may be asked */
    bool has_file;           /* the body is the file fd, len bytes of it from offset on; body is NULL */
    int fd;
    size_t offset;
    reply_source source; /* read NULL: none; then body is NULL */
    const char *job;     /* the id of the job that the request is about, "": none; lives as long as the request */
    char request_id[65], authenticate[112];
    char location[96], preference_applied[32], allow[64];
} http_reply;

/* Each keeps what stands in the other members (allow, retry_after_s, ...). */
/* Takes ownership of text; NULL becomes a 503. */
void reply_json(http_reply *reply, int status, char *text);
void reply_text(http_reply *reply, int status, const char *type, char *text, size_t len);
/* Takes ownership of fd. */
void reply_file(http_reply *reply, int status, const char *type, int fd, size_t len);
void reply_problem(http_reply *reply, const problem_details *problem);
void reply_mistakes(http_reply *reply, char *text); /* 422 with this problem+json, which it takes */
void reply_refuse(http_reply *reply, int status, const char *code, const char *title, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
void reply_no_memory(http_reply *reply);

/* A tag from what a representation is made of; "" where it can't be made. */
void tag_make(char tag[REPLY_TAG], const char *const *parts, const size_t *lens, size_t count);

/* ---- request */

typedef struct http_request {
    transport *server;
    char *raw_target; /* as received */
    target target;
    header_list headers;
    bool chunked;              /* how the body comes */
    uint64_t length;           /* of the body when it is not chunked; 0 when there is none */
    char *body;                /* NUL-terminated; NULL when empty or streamed */
    size_t body_len;           /* as received, also of a body that is streamed */
    char id[65];               /* X-Request-Id, the client's or our own */
    int fd;                    /* to see whether the client is still there */
    unsigned char address[16]; /* what tells its client from others (peer.h), address_len bytes; 0: unknown */
    size_t address_len;
    bool spare; /* as many connections are open as may be: this one is for health checks */
    char method[16];
    double started; /* on CLOCK_MONOTONIC */
    /* Set by `admit`. */
    bool streamed;                /* the body goes to `take` as it comes */
    size_t body_limit;            /* bytes */
    problem_details refused;      /* status 0: none; otherwise the answer, known before the body was read */
    const struct route *route;    /* the handlers' own, as the next four */
    struct upload_writer *upload; /* where a streamed body goes */
    char name[65];                /* what stood for {id} or {name} in the path */
    char token[64];               /* the name of the token that it came with; "": none */
    char client[64];              /* whose it is: the owner of that token */
    char share[64];               /* whose share of the workers its jobs take: that owner, else its address */
    bool sees_all;                /* what others have too */
    char job_id[33];              /* the job that it is about; "": none */
    http_reply reply;
    int status; /* of the reply; 0: none was sent */
    size_t reply_len;
    /* Private to this folder. */
    size_t body_capacity;
    bool begun;         /* the header block has been looked at */
    bool can_be_held;   /* its connection can do without libmicrohttpd (held.h) */
    char *kept_fields;  /* what `headers` points into, where that is not the connection's buffer */
    struct peer *place; /* its connection's, where that is held */
    bool unread_body;   /* the reply was sent before the whole body was read */
} http_request;

/* Seconds of `Prefer: wait=N` (RFC 7240), or `otherwise` when there is none; capped. */
double request_wait(const http_request *rq, double otherwise, double max_wait_s);
/* True if an Accept header field names the media type with a quality above 0, or a longer list does. */
bool request_accepts(const http_request *rq, const char *type);
/* True if Accept-Encoding names gzip, or all that it does not name, with a quality above 0. */
bool request_takes_gzip(const http_request *rq);
/* What its Content-Type says of the body: application/json or application/...+json; a type that a browser lets any page
 * send without asking first (WHATWG Fetch, CORS-safelisted request-header), none, several or no type; or another. */
typedef enum { BODY_JSON, BODY_OTHER, BODY_OF_ANY_PAGE } body_type;
body_type request_body_type(const http_request *rq);
/* The client closed its end: an answer would reach nobody. */
bool request_client_gone(const http_request *rq);
/* False with a 400 that says what is wrong with the value of a parameter. */
#define REFUSE_PARAMETER(problem, ...)                                                                                 \
    problem_fill(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed", __VA_ARGS__)
/* Reads a decimal integer of the query in [least, most]; absent: *out is left. False with a 400. */
bool request_integer(const http_request *rq, const char *key, int64_t least, int64_t most, int64_t *out,
                     problem_details *problem);
/* True, and the reply is a 304, if the client has what reply->tag names: then a handler need not make the body. */
bool reply_unchanged(const http_request *rq, http_reply *reply);

/* For what changes something: whether it is still what the client saw, of which `body` is the JSON now, last changed at
 * that Unix time; by If-Match, or where there is none If-Unmodified-Since. body: freed; NULL: no memory. False with a
 * 412 or 503 in reply. */
bool request_still_means(const http_request *rq, char *body, double changed, http_reply *reply);

/* ---- replies of Server-Sent Events (HTML Living Standard, section 9.2), whatever they are about
 *
 * Nothing looks until the feed (work/feed.h) says that there is something to tell, the client leaves, the service ends
 * or a heartbeat is due. A stream waits for that without a thread (held.h); over TLS, whose state is libmicrohttpd's,
 * and for HTTP/1.0, in its connection's own. */

/* The first member of each kind of stream. */
typedef struct event_stream {
    /* Called when there may be something to tell: sends some events by stream_say, or none; may set `ended`. False: the
     * stream can't go on. */
    bool (*look)(struct event_stream *s);
    double every_s; /* at least so long between two looks that found something; 0: none */
    bool ended;
    /* Private to later.c. */
    transport *server;
    const http_request *rq; /* gone before the stream is freed */
    listener *listener;
    bool held;  /* a read without anything to tell returns */
    char *text; /* what is being sent */
    size_t len, at;
    double told, spoke; /* on CLOCK_MONOTONIC: the last event, the last byte */
} event_stream;

/* Copies what the client says that it has seen, "" if it says nothing. */
void stream_last_seen(const http_request *rq, char *out, size_t size);
/* Adds an event; data must be on one line. False: no memory. */
bool stream_say(event_stream *s, const char *event, const char *id, const char *data);
/* Answers by the stream s (malloc'ed, look and every_s set), which listens to the job id, or with NULL to all jobs.
 * Owns s (NULL: no memory for it), also where it refuses: as many streams are open as may be. */
void stream_reply(http_request *rq, event_stream *s, const char *id, http_reply *reply);

/* ---- replies that wait until they can be made, without a thread where the connection allows it */

/* The first member of each kind. */
typedef struct delayed_reply {
    /* Looks whether the reply can be made. */
    bool (*ready)(struct delayed_reply *d);
    /* Makes it from what `ready` saw last. */
    void (*make)(struct delayed_reply *d, http_reply *reply);
    /* Frees what d has, and d. */
    void (*free)(struct delayed_reply *d);
    double until; /* on CLOCK_MONOTONIC: then it is made in any case */
    /* Private to later.c. */
    transport *server;
    http_request *rq; /* gone before the reply is freed */
    listener *listener;
    bool held;
    char *message;
    size_t len, at;
} delayed_reply;

/* Answers by d, which looks whenever the feed tells of what may be the end of the job id. Owns d; false: no memory, and
 * d is as before. */
bool reply_delay(http_request *rq, delayed_reply *d, const char *id);

/* ---- the server */

/* Who answers. Called in a connection's thread, all but `account` and `drop` before the reply is sent. */
typedef struct {
    void *ctx;
    /* The header block has come: refuses what can be refused before the body is read. Sets what http_request says.
     * False: rq->refused, and header fields of rq->reply. */
    bool (*admit)(void *ctx, http_request *rq);
    /* A piece of the body of a streamed request. False: rq->refused. */
    bool (*take)(void *ctx, http_request *rq, const char *data, size_t size);
    /* The whole request has come: fills rq->reply. */
    void (*answer)(void *ctx, http_request *rq);
    /* The request is over. completed: the client got all of the reply; expired: a deadline ended it. */
    void (*account)(void *ctx, const http_request *rq, bool completed, bool expired);
    /* Drops what a request that goes has left, if anything. */
    void (*drop)(void *ctx, http_request *rq);
} transport_handlers;

/* Certificate chain and key as PEM texts. */
typedef struct {
    char *cert, *key;
} http_tls;
/* Reads and checks both files; false with the reason in message. The caller clears *out. */
bool http_tls_read(http_tls *out, const char *cert_path, const char *key_path, char *message, size_t size);
void http_tls_clear(http_tls *tls); /* {NULL, NULL} is fine */

typedef struct {
    server_log *log;
    feed *feed;               /* wakes streams and delayed replies */
    size_t body_budget;       /* bytes of all bodies in memory at once; a request beyond it is told to come back */
    unsigned max_connections; /* open at once */
    unsigned max_client_connections; /* of one address; 0: no limit */
    unsigned max_streams;            /* of them, event streams */
    double request_deadline_s;       /* for a whole request, without the allowance for its body's length */
    double max_wait_s;               /* the longest that a handler waits */
    const char *const *cors;         /* n_cors origins ("https://host[:port]" or "*") whose pages may read replies */
    size_t n_cors;
    const http_tls *tls; /* NULL: plain HTTP */
} transport_options;     /* what is pointed at must outlive the server */

/* Opens a listening socket on "HOST:PORT" or "[IPv6]:PORT"; port 0 takes a free one. url becomes "SCHEME://HOST:PORT"
 * with the real port. -1 on failure with the reason in message. */
int http_listen(const char *host_port, const char *scheme, char *url, size_t url_size, char *message, size_t size);
/* True if others than this machine can reach the socket. */
bool http_is_public(int fd);

/* Serves on listen_fd, which it owns from then on, also on failure. *out is set before the first request is read, so
 * that handlers may use it. False with the reason in message, and *out is NULL. */
bool transport_start(transport **out, int listen_fd, const transport_handlers *handlers,
                     const transport_options *options, char *message, size_t size);
/* Connections that begin from now on get this certificate; those that are open, and copies of the session, keep theirs.
 * False with the reason in message, and all stays as it was. */
bool transport_use_tls(transport *server, const http_tls *tls, char *message, size_t size);
/* Waits end early from now on; everything else goes on. */
void transport_drain(transport *server);
const atomic_bool *transport_draining(const transport *server);
/* Ends every connection and frees the server; no handler may wait for anything else any more. NULL is fine. */
void transport_stop(transport *server);

/* Now: connections, of them event streams, bytes of bodies in memory. */
typedef struct {
    unsigned connections, streams;
    size_t body_bytes;
} transport_counts;
transport_counts transport_count(transport *server);

#endif
