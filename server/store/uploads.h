/* uploads.h: texts that are sent once and named by their digest in many requests.
 *
 * An upload is a blob (blobs.h), named by the SHA-256 of its bytes, and a row that says it is complete. A job that uses
 * an upload keeps a reference until it is deleted; what no job uses goes by age, or to make room.
 *
 * Functions may be called from any thread, but a writer belongs to one. */
#ifndef SERVER_STORE_UPLOADS_H
#define SERVER_STORE_UPLOADS_H

#include "store/store.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define UPLOAD_ID_LEN 64 /* hex digits */

typedef struct {
    char id[UPLOAD_ID_LEN + 1];
    int64_t bytes, jobs;  /* jobs: of the client that refer to it */
    double created, used; /* used: last sent, or put into a job */
} upload_info;

typedef enum {
    UPLOAD_OK,
    UPLOAD_TOO_LARGE, /* beyond the limit of one */
    UPLOAD_NO_ROOM,   /* beyond the limit of all, and nothing can go */
    UPLOAD_QUOTA,     /* beyond what its client may have */
    UPLOAD_DISK_FULL, /* */
    UPLOAD_AWAY,      /* the database does not answer now, or another program holds it */
    UPLOAD_BAD_GZIP,  /* the bytes are not a gzip stream, or not a whole one */
    UPLOAD_FAILED     /* anything else: store_message says what */
} upload_status;

typedef struct upload_writer upload_writer;
typedef struct store_uploads store_uploads; /* what a store knows of its uploads */

/* Each client that has sent it has it; what others have of the same bytes is not told. In what follows a client is NULL
 * where it does not matter.
 *
 * NULL on failure: *status. gzip: what is written is compressed (RFC 1952) and kept decompressed. */
upload_writer *store_upload_begin(store *s, const char *client, bool gzip, upload_status *status);
upload_status store_upload_write(upload_writer *w, const void *data, size_t size);
/* Ends it and frees w, whatever happens. UPLOAD_OK: it is on disk; *known says that this client had it before. */
upload_status store_upload_end(upload_writer *w, upload_info *out, bool *known);
/* Leaves nothing behind. NULL is fine. */
void store_upload_abort(upload_writer *w);

/* STORE_NOT_FOUND where this client has none, also for an id that is no id. */
store_status store_upload_get(store *s, const char *id, const char *client, upload_info *out);
/* STORE_CONFLICT while a job of this client refers to it. */
store_status store_upload_delete(store *s, const char *id, const char *client);
/* A descriptor for reading that the caller closes; stays good if the upload is deleted. All of it is read first, and
 * STORE_DAMAGED where it is not what was sent any more, by its digest. */
store_status store_upload_open(store *s, const char *id, int *fd, int64_t *bytes);

/* The same for who checks it himself (blob_check): its bytes are not read. STORE_NOT_FOUND unless the request of this
 * job (NULL: of any, or none) names it. */
store_status store_upload_descriptor(store *s, const char *id, const char *of_job, int *fd, int64_t *bytes);

/* The bytes of an upload, checked like that, in memory for as long as they are looked at (mapped: pages that are read
 * come from the file). data is not NUL-terminated. */
typedef struct {
    const char *data;
    size_t len;
} upload_text;
store_status store_upload_text(store *s, const char *id, upload_text *out);
void store_upload_text_done(upload_text *text); /* zeroes it; a zeroed one is fine */

/* Deletes what no job uses and nobody used for limits.keep_s; *count (may be NULL) is how many. */
store_status store_collect_uploads(store *s, int64_t *count);

#endif
