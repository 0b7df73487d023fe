/* reply.h: what a handler answers, and the only functions that send it. */
#ifndef SERVER_HTTP_REPLY_H
#define SERVER_HTTP_REPLY_H

#include "problem_details.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    int status;
    const char *type; /* media type of body */
    char *body;       /* malloc'ed unless body_is_static */
    size_t len;
    bool body_is_static;
    bool cacheable;    /* the same for everybody until the daemon is replaced */
    bool close;        /* the connection ends with this reply */
    int retry_after_s; /* 0: none */
    char request_id[65], authenticate[112], location[64], preference_applied[32], allow[64];
} http_reply;

/* Takes ownership of text; NULL becomes a 500. */
void reply_json(http_reply *reply, int status, char *text);
void reply_text(http_reply *reply, int status, const char *type, char *text, size_t len);
/* Keeps what stands in the other members (allow, retry_after_s, ...). */
void reply_problem(http_reply *reply, const problem_details *problem);
void reply_refuse(http_reply *reply, int status, const char *code, const char *title, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
void reply_no_memory(http_reply *reply);
void reply_clear(http_reply *reply);

/* Queues the reply on a connection and consumes it; false if that failed. */
struct MHD_Connection;
bool reply_send(struct MHD_Connection *connection, http_reply *reply);
/* The reply as a whole HTTP/1.1 message for a connection that then closes, for the two cases where libmicrohttpd takes
 * no reply: in the middle of a chunked body, and before the request is complete. malloc'ed; NULL: no memory. */
char *reply_message(const http_reply *reply);

#endif
