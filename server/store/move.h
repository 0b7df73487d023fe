/* move.h: everything of a store brought over into another one, of another engine: jobs in any state, results, uploads,
 * keys, webhooks, owners. What an engine does for that is a table of its own (engine.h: moves). */
#ifndef SERVER_STORE_MOVE_H
#define SERVER_STORE_MOVE_H

#include "store/result_blobs.h"
#include "store/uploads.h"

/* A vector or a history of a job; name "": the history. */
typedef struct {
    int64_t number;
    char name[32];
} moved_blob;

/* A job as it stands in its rows. */
typedef struct {
    job job;
    double finished; /* also of a running one: when it was told to end */
    char *key;       /* kept_key (engine_base.h); NULL: none */
    double queue_until;
    char *share;
    bool small;
    int64_t bytes;
    char *contents; /* NULL: none were kept */
    char *uploads;  /* ids, each with a line feed behind it, sorted */
    char *url;      /* webhook; NULL: none */
    int64_t webhook_state, webhook_attempts;
    double webhook_next;
    moved_blob *blobs; /* sorted by number and name */
    size_t n_blobs;
} moved_job;
void moved_job_clear(moved_job *m);

typedef struct {
    upload_info info;
    char *clients; /* each with a line feed behind it, sorted */
} moved_upload;

/* Seconds of workers that an owner has had on a day. */
typedef struct {
    char name[STORE_CLIENT];
    int64_t day;
    double seconds;
} moved_client;

typedef struct {
    store_status (*read_job)(store *s, const char *id, moved_job *out);
    /* The first one whose id or name is not before `from`; STORE_NOT_FOUND: there is none. */
    store_status (*read_upload)(store *s, const char *from, moved_upload *out);
    store_status (*read_client)(store *s, const char *from, moved_client *out);
    /* In one transaction, with its request, cases and blobs as `from` has them. STORE_CONFLICT: it is there. NULL: such
     * a store is not moved into. */
    store_status (*put_job)(store *s, store *from, const moved_job *m);
    /* Times and owners of one whose bytes are there. */
    store_status (*put_upload)(store *s, const moved_upload *u);
    store_status (*put_client)(store *s, const moved_client *c);
} store_moves;

typedef struct {
    int64_t jobs, uploads;         /* in the store that is moved */
    int64_t jobs_new, uploads_new; /* that were not there before */
    int64_t bytes;                 /* of requests and results, and of uploads */
} move_report;

/* Moves all of `from`, which nobody else uses, and compares it with what is there then; what is there already stays, so
 * that a move that was cut off goes on. False with the cause in message: what was moved stays. */
bool store_move(store *from, store *to, move_report *out, char *message, size_t size);

#endif
