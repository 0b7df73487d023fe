/* held.h: connections that wait without a thread: event streams and long polls.
 *
 * libmicrohttpd runs each connection in a thread of its own (server.c), and a thread that sleeps keeps 150 kB. A reply
 * of which nothing is left but to wait therefore takes its socket along: the socket gets another descriptor, an
 * unconnected one takes the old number (dup2 is atomic), libmicrohttpd closes that and ends its thread, and one thread
 * here watches all sockets that were taken (epoll). It writes what their sources have to say, sees clients leave, and
 * closes: what libmicrohttpd may have read after the request is lost, so that such a reply is the last of its
 * connection and says so. 2,000 streams and 1,000 long polls keep 6 to 7 kB each (tests/soak/streams.py; 155 kB with a
 * thread each, 92 of them the thread-local data of OpenBLAS and METIS) and no processor time.
 *
 * The other way, MHD_suspend_connection, was tried with a handler that blocks for 1 ms, 64 clients and 2,000 streams on
 * 2 processors: 45 kB each (its buffers stay), and 23,000 requests per second by event threads and a pool of handlers
 * against 34,000 by a thread per connection. It also takes away the only way to tell which connection a refusal of
 * libmicrohttpd's own is about: connection_refuse. */
#ifndef SERVER_HTTP_HELD_H
#define SERVER_HTTP_HELD_H

#include "http/transport/transport.h"

typedef struct holder holder;

/* A connection that was held is over: its socket is closed, its source freed. Owns rq. Called in the holder's thread.
 * completed: everything was said. */
typedef void (*holder_over)(void *ctx, http_request *rq, bool completed);

/* patience_s: how long a client may take nothing of what it is sent. NULL: no memory, descriptors or threads. */
holder *holder_new(double patience_s, holder_over over, void *ctx);
/* Ends all connections, each after what its source still says at once. NULL is fine. */
void holder_free(holder *h);

/* Takes the socket fd, which is rq->fd, from whoever has it, and *source (its held is set); sends `head` first, and
 * what the source says in chunks (RFC 9112, section 7.1) if `chunked`. True: owns head, rq and what the source has, and
 * fd is another, unconnected socket. False: nothing has happened. */
bool holder_take(holder *h, int fd, http_request *rq, char *head, bool chunked, const reply_source *source);

#endif
