/* feed.h: which job changed when, and those who wait to hear of it.
 *
 * Changes are numbered from 1 in the order in which they were told; the last FEED_KEPT are kept. A change says only
 * that a job was created, has another status or progress, or was deleted: what it is now stands in the store, so that
 * who hears of it late reads the present state and nothing is told from two sources. Changes are told after they were
 * committed. Any thread may call; the one lock inside is taken last. */
#ifndef SERVER_WORK_FEED_H
#define SERVER_WORK_FEED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FEED_KEPT 4096 /* a power of 2 */

typedef struct feed feed;
typedef struct listener listener;

typedef struct {
    uint64_t number;
    char id[33];
    bool deleted;
    char client[64]; /* of one that was deleted */
} feed_change;

feed *feed_new(void);    /* NULL: no memory */
void feed_free(feed *f); /* nobody listens any more; NULL is fine */

/* deleted_of: whose job it was, which is not known from the store any more; NULL: it is not gone. */
void feed_changed(feed *f, const char *id, const char *deleted_of);
/* The same of a change that is not the job's end, for which those who wait for that need not look. */
void feed_goes_on(feed *f, const char *id);
/* Something that only those who follow this job want to know: no number, and nothing that is kept. */
void feed_moved(feed *f, const char *id);
/* Everybody looks again. */
void feed_wake_all(feed *f);

/* Listens to one job, or with id NULL to all, from now on. NULL: no memory. Freed by feed_unlisten (NULL is fine). */
listener *feed_listen(feed *f, const char *id);
/* Listens to what may be the end of a job, and has something at once where that was told after change number `after`.
 */
listener *feed_listen_end(feed *f, const char *id, uint64_t after);
void feed_unlisten(listener *l);
/* Returns when there was something since the last return, when the peer of the socket fd has closed it (-1: no socket)
 * or after so many seconds. True: there was something. One thread waits for one listener. */
bool feed_wait(listener *l, int fd, double seconds);
/* Can be read while there is something, for those who wait for many; feed_wait with 0 seconds then takes it. -1: this
 * one has none. */
int feed_descriptor(const listener *l);

/* The changes with numbers above `after`, the oldest first, at most `most`; of several of one job only the last (a few
 * earlier ones may be among them). *seen: the number up to which they go, from which the next call goes on. False: some
 * of them are not kept any more, or `after` is no number of this feed; *seen is the number of the last one, 0: there
 * was none. */
bool feed_since(feed *f, uint64_t after, feed_change *out, size_t most, size_t *count, uint64_t *seen);
/* The number of the last change. Whoever asks for it before he looks at a job misses no later end by feed_listen_end.
 */
uint64_t feed_last(feed *f);

#endif
