/* blobs.h: bytes that are kept beside the rows of a store, each under its SHA-256: the interface of such a place, for
 * who writes one and for uploads.c, which uses it.
 *
 *   - A blob is written, sealed and published. Until it is published nobody sees it; then it is durable under its id.
 *     Publishing an id that is there replaces it, which mends a damaged one.
 *   - The row that makes a blob count is committed after it was published, and deleted before it is removed: a blob
 *     without a row is what a crash left, and sweep removes it. Half-written ones go with it.
 *   - A blob never changes. One that is open stays readable after it was removed.
 *   - Calls may come from any thread, but a writer belongs to one. A failure leaves its cause in `cause`. */
#ifndef SERVER_STORE_BLOBS_H
#define SERVER_STORE_BLOBS_H

#include "store/uploads.h"

#define BLOB_CAUSE 256

typedef struct blobs blobs;
typedef struct blob_writer blob_writer;

typedef struct {
    /* STORE_FULL, STORE_ERROR. */
    store_status (*begin)(blobs *b, blob_writer **out, char cause[BLOB_CAUSE]);
    store_status (*write)(blob_writer *w, const void *data, size_t size, char cause[BLOB_CAUSE]);
    store_status (*seal)(blob_writer *w, char cause[BLOB_CAUSE]); /* all bytes are durable: publishing is quick */
    store_status (*publish)(blob_writer *w, const char *id, char cause[BLOB_CAUSE]);
    void (*end)(blob_writer *w); /* frees it, and removes what was not published */
    /* A descriptor for reading, which the caller closes; -1: errno, ENOENT where there is none, EHOSTUNREACH where the
     * place does not answer now. */
    int (*open)(blobs *b, const char *id);
    void (*remove)(blobs *b, const char *id); /* what it fails to remove sweep does */
    /* Removes half-written ones, and those that are not to be kept; while nobody writes. NULL: there are none. */
    void (*sweep)(blobs *b, bool (*keep)(void *ctx, const char *id), void *ctx);
    void (*close)(blobs *b); /* NULL: it belongs to the store */
} blob_operations;

/* What a place and a writer begin with. */
struct blobs {
    const blob_operations *does;
};
struct blob_writer {
    blobs *blobs;
};

/* Files in a folder, which is made with the first of them. NULL: no memory. */
blobs *blobs_in_folder(const char *folder);

/* For who opens a store: with its uploads at this place, which it takes over; removes what a crash left there. False:
 * message. store_uploads_end is fine also after a failure. */
bool store_uploads_begin(store *s, blobs *place, char *message, size_t size);
void store_uploads_end(store *s);

bool blob_is_id(const char *text);
/* STORE_OK where all that can be read at fd has this digest, else STORE_DAMAGED; STORE_ERROR: it can't be read. Reads
 * with read(), not by a mapping: a bad sector is an error then, and not a signal. */
store_status blob_check(int fd, const char *id);
/* All bytes, however often the system asks again; false: errno says why. */
bool blob_write_all(int fd, const void *data, size_t size);
/* Makes a file, or the entries of a folder (flags O_DIRECTORY), durable. */
bool blob_sync(const char *path, int flags);

#endif
