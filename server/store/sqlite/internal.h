/* internal.h: what the files of the store share. */
#ifndef SERVER_STORE_SQLITE_INTERNAL_H
#define SERVER_STORE_SQLITE_INTERNAL_H

#include "store/sqlite/connection.h"
#include "store/store.h"
#include "store/uploads.h"

#include <pthread.h>

#define STORE_READERS 4

/* Lock order: none of these is taken while another is held, except message and sync under writer_lock, and any under
 * upload_lock. */
typedef struct pending pending;

struct store {
    pthread_mutex_t writer_lock; /* writer, last_ms, sequence, max_queue */
    connection writer;           /* the only one that writes and checkpoints */
    uint64_t last_ms;            /* time and counter in the newest id, so that ids ascend when the clock does not */
    unsigned sequence;
    int64_t max_queue; /* 0: no limit */

    pthread_mutex_t queue_lock; /* everything down to leading; write.c */
    pending *queue, **queue_end;
    bool leading; /* somebody carries out changes */

    pthread_mutex_t readers_lock; /* readers_free */
    pthread_cond_t reader_free;
    connection readers[STORE_READERS];
    connection *readers_free[STORE_READERS];
    int n_readers_free;

    /* Changes are numbered as they are committed; sync.c. */
    pthread_mutex_t sync_lock; /* everything down to sync_stop */
    pthread_cond_t sync_asked, sync_ended;
    uint64_t begun;     /* the number of the last COMMIT, which may be under way: readers may see it already */
    uint64_t committed; /* of the last one that ended */
    uint64_t wanted;    /* somebody wants those up to here on disk */
    uint64_t synced;    /* those up to here are */
    uint64_t failures;  /* times that this could not be had, the last time */
    uint64_t failed;    /* for those up to here */
    bool sync_stop, sync_started;
    sqlite3_file *log; /* the writer's write-ahead log, set before the thread starts */
    pthread_t syncer;

    pthread_mutex_t message_lock; /* message */
    char message[256];
    pthread_mutex_t upload_lock; /* everything down to uploads_pending, and the files of uploads with their rows */
    upload_limits upload_limits;
    int64_t uploads_bytes;   /* of all that have rows */
    int64_t uploads_pending; /* of those that are being written */
    char *uploads_folder;    /* absolute; made with the first upload */

    void (*changed)(void *ctx, const char *id); /* store_listen; may be NULL */
    void *changed_ctx;
    metrics *metrics; /* may be NULL */
    char *path;       /* absolute, of the file */
    int file; /* holds the lock that keeps a second daemon out; closed after every connection (see store_open) */
};

/* Runs `change` on the writer, alone or with others in one transaction: STORE_OK commits, anything else takes back what
 * it did. It may run more than once, so it must reset what it publishes; on a full disk it runs again once the journal
 * is moved into the database. */
typedef store_status (*store_change)(store *s, connection *c, void *args);
/* When the caller is told. */
typedef enum {
    WRITE_DURABLE, /* when it is on disk */
    WRITE_SOON, /* when it is committed: a power loss may undo it for a moment longer, but whoever reads what it wrote
                   waits (store_settle) */
    WRITE_LAZY  /* when it is committed; it reaches the disk with whatever comes next. Right for what the start
                   after a crash undoes by itself: claims and leases */
} write_durability;
store_status store_write_as(store *s, write_durability durability, store_change change, void *args);
store_status store_write(store *s, store_change change, void *args); /* WRITE_DURABLE */

/* ---- sync.c */
bool store_sync_begin(store *s); /* once the writer has read the file; false: no thread, or no log */
void store_sync_end(store *s);
/* Around a COMMIT, however it ends; under writer_lock. The second returns its number. */
void store_begin_commit(store *s);
uint64_t store_note_commit(store *s);
void store_want_sync(store *s, uint64_t number);
store_status store_await_sync(store *s, uint64_t number);
store_status store_settle(store *s); /* returns when all that anybody may have read is on disk */

/* Before jobs are told that were read: returns when the end of each is on disk. */
store_status store_settle_jobs(store *s, const job *jobs, size_t count);

/* Calls who listens (store_listen). */
void store_tell(const store *s, const char *id);

/* Keeps the connection's message as the store's last one. */
void store_keep_message(store *s, const connection *c);
double store_clock(void); /* seconds, CLOCK_MONOTONIC */

/* A reader for the calling thread alone, until it is given back with how the read ended, which is returned. */
connection *store_take_reader(store *s);
store_status store_give_reader(store *s, connection *c, store_status status);

/* Counts the uploads and removes what a crash left of one. False: the rows can't be read (writer.message). */
bool store_open_uploads(store *s);

/* STORE_ERROR: the file was deleted, moved or replaced while it is open. What is written to it then is not found by the
 * next start, so nothing may be acknowledged. */
store_status store_check_place(const store *s, connection *c);

/* The next id, 32 hex digits: 12 of milliseconds, 4 of a counter within them, 16 random. Under writer_lock. */
void store_next_id(store *s, char id[33]);

double store_now(void); /* Unix seconds */

/* The job in the current row, whose first columns are the job's. Failure leaves *out zero. */
store_status store_read_job(statement *st, job *out);

/* STORE_CONFLICT if the job exists, else STORE_NOT_FOUND: why an update found nothing to change. */
store_status store_why_unchanged(connection *c, const char *id);

/* A copy of the blob in column `at`, NUL-terminated; NULL: no memory. */
char *store_copy_blob(statement *st, int at, size_t *len);

/* A copy of a text column; NULL for SQL NULL, and *ok false when there is no memory. */
char *store_copy_text(statement *st, int at, bool *ok);

/* Inserts the vectors, the histories and the cases' answers of a job that has none. */
store_status store_insert_results(connection *c, const char *id, const store_outcome *outcome);

#endif
