/* deadlines.h: ends connections that take too long, whatever trickles in. libmicrohttpd's own timeout counts
 * inactivity only, so one header byte a second would hold a connection for ever.
 *
 * One thread watches all connections. An expired one is shut down (not closed: libmicrohttpd owns the descriptor and
 * notices). Lock: one mutex inside, taken last; nothing is called under it but send() without waiting and shutdown().
 */
#ifndef SERVER_HTTP_DEADLINES_H
#define SERVER_HTTP_DEADLINES_H

#include <stdbool.h>

typedef struct deadlines deadlines;
typedef struct deadline deadline; /* of one conn */

/* last_words: a whole HTTP message (copied) for a client whose request is cut off; may be "". NULL: no memory or no
 * thread. */
deadlines *deadlines_new(const char *last_words);
/* Stops the thread; every deadline must have been removed. */
void deadlines_free(deadlines *all);

/* Watches fd until `at`. owner: whose it is. spare: it is one more than there may be. NULL: no memory. */
deadline *deadlines_add(deadlines *all, int fd, double at, void *owner, bool spare);
/* The owner of the deadline of fd; NULL: none has it. */
void *deadlines_owner(deadlines *all, int fd);
/* What a connection does, from which follows what it is told when it expires, and when it has to go before that. */
typedef enum {
    DEADLINE_HEAD,  /* waits for the whole of a header block; so it begins */
    DEADLINE_IDLE,  /* waits for another request */
    DEADLINE_BODY,  /* the request comes: is told the last words */
    DEADLINE_SERVED /* is not waited for */
} deadline_phase;
/* INFINITY: not watched. speak: say the last words when it expires. */
void deadline_set(deadline *d, double at, deadline_phase phase, bool speak);
/* True once it has expired. */
bool deadline_expired(deadline *d);
/* Cuts, to make room for another, the connection that has waited for longest for a header block, or for another
 * request, which counts a tenth; its address is *from, and *spare whether it was one. False: none waits. */
struct sockaddr_storage;
bool deadlines_make_room(deadlines *all, struct sockaddr_storage *from, bool *spare);
/* All connections read as closed by their clients from now on; what is being sent to them goes on. */
void deadlines_hear_no_more(deadlines *all);
/* Before fd is closed. NULL is fine. */
void deadline_remove(deadline *d);

#endif
