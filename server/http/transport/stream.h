/* stream.h: replies of Server-Sent Events (HTML Living Standard, section 9.2), whatever they are about.
 *
 * Nothing looks until the feed (work/feed.h) says that there is something to tell, the client leaves, the service ends
 * or a heartbeat is due. A stream waits for that without a thread (held.h); over TLS, whose state is libmicrohttpd's,
 * and for HTTP/1.0, in its connection's own. */
#ifndef SERVER_HTTP_STREAM_H
#define SERVER_HTTP_STREAM_H

#include "http/request.h"

/* The first member of each kind of stream. */
typedef struct event_stream {
    /* Called when there may be something to tell: sends some events by stream_say, or none; may set `ended`. False: the
     * stream can't go on. */
    bool (*look)(struct event_stream *s);
    double every_s; /* at least so long between two looks that found something; 0: none */
    /* Private to stream.c. */
    api *context;
    const http_request *rq; /* lives as long as the reply */
    listener *listener;
    bool held;  /* a read without anything to tell returns */
    char *text; /* what is being sent */
    size_t len, at;
    double told, spoke; /* on deadlines_now's clock: the last event, the last byte */
    bool ended;
} event_stream;

/* Copies what the client says that it has seen, "" if it says nothing. */
void stream_last_seen(const http_request *rq, char *out, size_t size);
/* Adds an event; data must be on one line. False: no memory. */
bool stream_say(event_stream *s, const char *event, const char *id, const char *data);

/* Answers by the stream s (malloc'ed, look and every_s set), which listens to the job id, or with NULL to all jobs.
 * Owns s (NULL: no memory for it), also where it refuses: as many streams are open as may be. */
void stream_reply(api *context, http_request *rq, event_stream *s, const char *id, http_reply *reply);

#endif
