/* stream.h: replies of Server-Sent Events (HTML Living Standard, section 9.2), whatever they are about.
 *
 * A stream runs in its connection's own thread, as every reply does, and sleeps there until the feed (work/feed.h) says
 * that there is something to tell, its client leaves, the service ends or a heartbeat is due: nothing looks meanwhile.
 *
 * libmicrohttpd can suspend connections only where many of them share a thread. This daemon does not run it so: a
 * handler may block there for all others (a commit waits for the disk, a prediction orders a matrix, a picture is
 * drawn), and the message by which it announces a refusal of its own, which daemon.c answers instead, does not say
 * there which connection it is about. What a sleeping thread costs instead, measured with 2,000 streams and 1,000 long
 * polls at once on 2 processors (tests/soak/streams.py): 150 kB of memory each, of which 92 kB are the thread-local
 * data of OpenBLAS (61 kB) and METIS (29 kB) that every thread of a program with them has; no processor time while
 * nothing happens; 0.03 s from a job's end to the first that is told and 0.35 s to the last; as many submissions per
 * second beside them as without. */
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
