/* negotiate.h: conditional requests, ranges of bytes and content codings (RFC 9110, sections 12 to 14). */
#ifndef SERVER_HTTP_NEGOTIATE_H
#define SERVER_HTTP_NEGOTIATE_H

#include "http/request.h"

/* A tag from what a representation is made of; "" where it can't be made. */
void tag_make(char tag[REPLY_TAG], const char *const *parts, const size_t *lens, size_t count);

/* True, and the reply is a 304, if the client has what reply->tag names: then a handler need not make the body. */
bool reply_unchanged(const http_request *rq, http_reply *reply);

/* Turns the whole reply of a handler into what this request gets. */
void negotiate(const http_request *rq, http_reply *reply);

#endif
