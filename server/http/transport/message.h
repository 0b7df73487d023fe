/* message.h: private to this folder: from what a handler has filled in to what is sent. */
#ifndef SERVER_HTTP_MESSAGE_H
#define SERVER_HTTP_MESSAGE_H

#include "http/transport/transport.h"

void reply_drop_body(http_reply *reply);
void reply_clear(http_reply *reply);

/* negotiate.c: turns the whole reply of a handler into what this request gets: conditional requests, ranges of bytes
 * and content codings (RFC 9110, sections 12 to 14). */
void negotiate(const http_request *rq, http_reply *reply);

/* Notes in the request what its reply says, and the other way round. */
void request_note_reply(http_request *rq);
/* The header fields in memory of their own, as the connection's buffer goes. False: no memory. */
bool request_keep_fields(http_request *rq);

/* Queues the reply on a connection and consumes it; false if that failed. */
struct MHD_Connection;
bool reply_send(struct MHD_Connection *connection, http_reply *reply);
/* The reply as a whole HTTP/1.1 message for a connection that then closes, where libmicrohttpd takes no reply: in the
 * middle of a chunked body, before the request is complete, and where the connection waits without it. chunked: its
 * head only, as the body comes in chunks. *len bytes and a NUL, malloc'ed; NULL: no memory. */
char *reply_message(const http_reply *reply, bool chunked, size_t *len);

#endif
