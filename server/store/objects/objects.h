/* objects.h: bytes in an object store with the S3 interface, each object under a name of its caller's: written whole,
 * read in ranges, removed. It knows nothing of jobs; who names an object, and when it may go, is the engine's business
 * (postgresql/objects.h).
 *
 * Requests are signed by libcurl (AWS Signature Version 4), and tried again where that may help: three times within
 * seconds. After a failure nobody asks for a moment, so that those who wait do not wait for the same. Functions may be
 * called from any thread and block until they are answered, for 5 s to be connected and half a minute in which nothing
 * moves. A failure leaves its cause in `cause`.
 *
 * Source: Amazon Simple Storage Service API Reference, version 2006-03-01: PutObject, GetObject, DeleteObject. */
#ifndef SERVER_STORE_OBJECTS_H
#define SERVER_STORE_OBJECTS_H

#include "store/store.h"

#define OBJECT_CAUSE 256
#define OBJECT_NAME  96        /* room for a name: letters, digits, "-" */
#define OBJECT_MOST  (4 << 20) /* bytes that callers put into one object: what a failed request sends again */

typedef struct {
    const char *url; /* http[s]://HOST[:PORT]/BUCKET[/PREFIX] */
    const char *region;
    /* One line "ACCESS_KEY_ID SECRET_ACCESS_KEY", which others must not be able to read; "": from the environment:
     * AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY. */
    const char *key_file;
    int64_t least;    /* what is smaller stays in the database */
    metrics *metrics; /* may be NULL */
} objects_options;

typedef struct objects objects;
/* Puts an object there, reads a part of it and removes it; NULL where any of that fails: message has the cause and a
 * remedy. */
objects *objects_open(const objects_options *options, char *message, size_t size);
void objects_close(objects *o); /* NULL is fine */
int64_t objects_least(const objects *o);

/* STORE_AWAY: it can't be had now, whatever the reason: who has the bytes tries again later. sha256: of the bytes, hex
 * digits. */
store_status objects_put(objects *o, const char *name, const void *data, size_t size, const char *sha256,
                         char cause[OBJECT_CAUSE]);
/* Exactly `size` bytes (not 0) from `at` on. STORE_DAMAGED: there is no such object, or it has not so many. Whether
 * they are what was put is for the caller to find. */
store_status objects_get(objects *o, const char *name, int64_t at, void *data, size_t size, char cause[OBJECT_CAUSE]);
/* STORE_OK also where there is none. */
store_status objects_remove(objects *o, const char *name, char cause[OBJECT_CAUSE]);

#endif
