/* reply.h: what a handler answers, and the only functions that send it. */
#ifndef SERVER_HTTP_REPLY_H
#define SERVER_HTTP_REPLY_H

#include "base/problem_details.h"

#include <stdbool.h>
#include <stddef.h>

/* A body that comes piece by piece. read blocks until it has written 1 to `size` bytes, and returns how many, or that
 * there are no more, or that there are no more although there should be. It is called in the connection's thread.
 * With the second part the reply can do without that thread (held.h). */
enum { REPLY_STREAM_ENDS = -1, REPLY_STREAM_BREAKS = -2 };
typedef struct {
    ptrdiff_t (*read)(void *ctx, char *out, size_t size);
    void (*free)(void *ctx);
    void *ctx;
    struct listener *listener; /* ctx's own: wakes whoever has to read */
    void (*hold)(void *ctx);   /* from now on read returns 0 instead of blocking; NULL: it can't */
    /* When to read again at the latest, on deadlines_now's clock; told: the listener was. */
    double (*due)(void *ctx, bool told);
    bool is_message; /* what read gives is the whole message, header fields included */
    /* Of such a source whose connection keeps its thread: waits here and puts the reply. */
    void (*answer)(void *ctx);
} reply_source;

#define REPLY_TAG 48 /* room for an entity tag without its quotes, in any coding, and a NUL */

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
    bool cors, preflight;    /* replies depend on the origin; this one says what may be asked */
    bool has_file;           /* the body is the file fd, len bytes of it from offset on; body is NULL */
    int fd;
    size_t offset;
    reply_source source; /* read NULL: none; then body is NULL */
    const char *job;     /* the id of the job that the request is about, "": none; lives as long as the request */
    char request_id[65], authenticate[112];
    char location[96], preference_applied[32], allow[64];
} http_reply;

void reply_drop_body(http_reply *reply);
/* Takes ownership of body. */
void reply_replace_body(http_reply *reply, char *body, size_t len);

/* Takes ownership of text; NULL becomes a 500. */
void reply_json(http_reply *reply, int status, char *text);
void reply_text(http_reply *reply, int status, const char *type, char *text, size_t len);
/* Keeps what stands in the other members (allow, retry_after_s, ...). */
/* Takes ownership of fd. */
void reply_file(http_reply *reply, int status, const char *type, int fd, size_t len);
/* Takes ownership of source.ctx, also where it fails. */
void reply_stream(http_reply *reply, int status, const char *type, reply_source source);
void reply_problem(http_reply *reply, const problem_details *problem);
void reply_refuse(http_reply *reply, int status, const char *code, const char *title, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
void reply_no_memory(http_reply *reply);
void reply_clear(http_reply *reply);

/* Queues the reply on a connection and consumes it; false if that failed. */
struct MHD_Connection;
bool reply_send(struct MHD_Connection *connection, http_reply *reply);
/* The reply as a whole HTTP/1.1 message for a connection that then closes, where libmicrohttpd takes no reply: in the
 * middle of a chunked body, before the request is complete, and where the connection waits without it. *len bytes and a
 * NUL, malloc'ed; NULL: no memory. */
char *reply_message(const http_reply *reply, size_t *len);
/* The head of such a message, whose body comes in chunks. */
char *reply_head(const http_reply *reply);

#endif
