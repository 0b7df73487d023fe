/* internal.h: what the files of this engine share. */
#ifndef SERVER_STORE_SQLITE_INTERNAL_H
#define SERVER_STORE_SQLITE_INTERNAL_H

#include "store/sqlite/connection.h"
#include "store/sqlite/trail.h"
#include "store/batch.h"
#include "store/engine_base.h"

#include <pthread.h>
#include <stdatomic.h>

#define STORE_READERS 4

/* Lock order: none of these is taken while another is held, except message, move and sync under writer_lock. */
typedef struct {
    store base;
    pthread_mutex_t writer_lock; /* writer, last_ms, sequence, claims */
    connection writer;           /* the only one that changes anything */
    uint64_t last_ms;            /* time and counter in the newest id, so that ids ascend when the clock does not */
    unsigned sequence;
    uint64_t claims; /* the token of the last one; begins at the time of opening, past those of earlier processes */

    batch changes; /* that wait for the writer; write.c */

    /* The log is moved into the file by mover, while others write, or where it has grown too long by the writer: log.c.
     */
    pthread_mutex_t move_lock; /* one of them at a time; mover */
    connection mover;
    atomic_int log_pages;    /* of the log when a change was committed last */
    atomic_bool log_suspect; /* it could not be moved */

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

    trail trail; /* `waiting` is under sync_lock, what is appended the syncer's, the rest the writer's */

    /* FILE-spare: room on the disk that a deletion gets where there is no other. -1: there is none. */
    int spare;
    bool spare_there; /* under writer_lock */

    char *path; /* absolute, of the file */
    int file;   /* holds the lock that keeps a second daemon out; closed after every connection (see sqlite_open) */
} sqlite_store;

static inline sqlite_store *sqlite_of(store *s)
{
    return (sqlite_store *)s;
}

/* Runs `change` on the writer, alone or with others in one transaction: STORE_OK commits, anything else takes back what
 * it did. It may run more than once, so it must reset what it publishes; on a full disk it runs again once the journal
 * is moved into the database. */
typedef store_status (*store_change)(sqlite_store *s, connection *c, void *args);
/* When the caller is told. */
typedef enum {
    WRITE_DURABLE, /* when it is on disk */
    WRITE_FREES,   /* the same, of a change that makes room: a full disk does not refuse it (sqlite_store.spare) */
    WRITE_SOON, /* when it is committed: a power loss may undo it for a moment longer, but whoever reads what it wrote
                   waits (sqlite_settle) */
    WRITE_LAZY  /* when it is committed; it reaches the disk with whatever comes next. Right for what the start
                   after a crash undoes by itself: claims and leases */
} write_durability;
store_status sqlite_write(sqlite_store *s, write_durability durability, store_change change, void *args);
/* The first half of it, up to the commit, whose number sqlite_sync takes. frees: as WRITE_FREES. */
store_status sqlite_change(uint64_t *number, sqlite_store *s, bool frees, store_change change, void *args);
/* Carries out what waits in sqlite_store.changes. */
void sqlite_run_batch(void *ctx, batch_change *first);
/* Takes the spare room, if there is any to take. Before other threads, or under writer_lock. */
void sqlite_take_spare(sqlite_store *s);
/* Has the disk of an open file hardly any room? */
bool sqlite_is_full(int fd);
/* On a full disk, for a start: leaves a part of the spare room free. */
void sqlite_lend_spare(sqlite_store *s);

/* ---- log.c */
bool sqlite_log_begin(sqlite_store *s, char *message, size_t size); /* once the writer has read the file */
/* All of the log, whoever has to wait for that, on the writer, under its lock: what was written is then in the file,
 * and on disk. false: it could not be moved. */
bool sqlite_move_log(sqlite_store *s);
/* A long log, as far as nobody has to wait for that. */
store_status sqlite_tidy(store *s);

/* ---- sync.c */
bool sqlite_sync_begin(sqlite_store *s); /* once the writer has read the file; false: no thread, or no log */
void sqlite_sync_end(sqlite_store *s);
/* COMMIT of the writer, under its lock; its number, however it ends. */
store_status sqlite_commit(sqlite_store *s, uint64_t *number);
/* Asks for the commits up to this number to be brought to the disk; wait: returns when they are there. STORE_ERROR:
 * that failed. */
store_status sqlite_sync(sqlite_store *s, uint64_t number, bool wait);
store_status sqlite_settle(sqlite_store *s); /* returns when all that anybody may have read is on disk */

/* Before jobs are told that were read: returns when the end of each is on disk. */
store_status sqlite_settle_jobs(sqlite_store *s, const job *jobs, size_t count);

/* A reader for the calling thread alone, until it is given back with how the read ended, which is returned. */
connection *sqlite_take_reader(sqlite_store *s);
store_status sqlite_give_reader(sqlite_store *s, connection *c, store_status status);

/* STORE_ERROR: the file was deleted, moved or replaced while it is open. What is written to it then is not found by the
 * next start, so nothing may be acknowledged. */
store_status sqlite_check_place(const sqlite_store *s, connection *c);

/* The job in the current row, whose first columns are the job's. Failure leaves *out zero. */
store_status sqlite_read_job(statement *st, job *out);

/* STORE_QUOTA, with a message, where a client has what it may of bytes or seconds, or would have with `more` bytes;
 * also of jobs that wait, where it submits one. */
store_status sqlite_check_quota(const sqlite_store *s, connection *c, const char *client, int64_t more, bool submits);

/* A copy of a text column; NULL for SQL NULL, and *ok false when there is no memory. */
char *sqlite_copy_text(statement *st, int at, bool *ok);

/* In a transaction's connection. */
extern const result_blobs SQLITE_RESULTS;
extern const store_moves SQLITE_MOVES; /* move.c */

/* ---- the operations of the engine (engine.h), by the files that have them */
store *sqlite_open(const char *address, char *message, size_t size);
void sqlite_close(store *s);
store_status sqlite_submit(store *s, const store_request *request, job *out, bool *repeated);
store_status sqlite_find_repeat(store *s, const store_request *request, job *out);
store_status sqlite_claim(store *s, store_lease *lease, double lease_s, bool small, job *out, char **body, size_t *len);
store_status sqlite_use_lease(store *s, const store_lease *lease, const lease_use *use);
store_status sqlite_recover(store *s, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed);
store_status sqlite_expire(store *s, const char *error_json, int64_t *count);
store_status sqlite_retain(store *s, const store_retention *limits, double now, int64_t *count);
store_status sqlite_dismiss(store *s, const char *id, job_status *was);
store_status sqlite_get(store *s, const char *id, job *out);
store_status sqlite_list(store *s, const store_query *query, job *jobs, size_t *count);
store_status sqlite_get_body(store *s, const char *id, char **body, size_t *len);
store_status sqlite_get_cases(store *s, const char *id, const char *name, store_case **cases, size_t *count);
store_status sqlite_counts(store *s, int64_t counts[STORE_COUNTS]);
store_status sqlite_webhook_next(store *s, const char *const *except, size_t n, webhook_due *out);
store_status sqlite_webhooks_open(store *s, bool *any);
store_status sqlite_webhook_attempted(store *s, const webhook_due *due, webhook_end end, double delay_s,
                                      double silent_s);
store_status sqlite_upload_get(store *s, const char *id, const char *client, upload_info *out);
store_status sqlite_upload_named(store *s, const char *id, const char *of_job);
store_status sqlite_upload_add(store *s, const char *id, const char *client, int64_t bytes, upload_info *out,
                               bool *known);
store_status sqlite_upload_forget(store *s, const char *id, const char *client, bool *gone);
store_status sqlite_upload_idle(store *s, double now, double unused_s, upload_info *out);
store_status sqlite_upload_total(store *s, int64_t *bytes);
store_status sqlite_try_write(store *s);
int64_t sqlite_free_bytes(store *s);
store_status sqlite_check(store *s, store_findings *out);
bool sqlite_check_file(const char *address, store_findings *out, char *message, size_t size);
bool sqlite_backup_file(const char *address, const char *to, int64_t *bytes, char *message, size_t size);

#endif
