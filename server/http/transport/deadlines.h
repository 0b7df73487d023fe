/* deadlines.h: ends connections that take too long, whatever trickles in. libmicrohttpd's own timeout counts
 * inactivity only, so one header byte a second would hold a connection for ever.
 *
 * One thread watches all connections. An expired one is shut down (not closed: libmicrohttpd owns the descriptor and
 * notices). Lock: one mutex inside, taken last; nothing is called under it but send() without waiting and shutdown().
 */
#ifndef SERVER_HTTP_DEADLINES_H
#define SERVER_HTTP_DEADLINES_H

#include <stdbool.h>
#include <stddef.h>

typedef struct deadlines deadlines;
typedef struct deadline deadline; /* of one conn */

/* last_words: a whole HTTP message (copied) for a client whose request is cut off; may be "". NULL: no memory or no
 * thread. */
deadlines *deadlines_new(const char *last_words);
/* Stops the thread; every deadline must have been removed. */
void deadlines_free(deadlines *all);

/* Watches fd until `at`. owner: whose it is. NULL: no memory. */
deadline *deadlines_add(deadlines *all, int fd, double at, void *owner);
/* The owner of the deadline of fd; NULL: none has it. */
void *deadlines_owner(deadlines *all, int fd);
/* INFINITY: not watched. speak: say the last words when it expires. */
void deadline_set(deadline *d, double at, bool speak);
/* True once it has expired. */
bool deadline_expired(deadline *d);
/* All connections read as closed by their clients from now on; what is being sent to them goes on. */
void deadlines_hear_no_more(deadlines *all);
/* Before fd is closed. NULL is fine. */
void deadline_remove(deadline *d);

#endif
