/* store.h: jobs, results and histories that survive a restart, for who uses a store.
 *
 * The interface is narrow on purpose: each operation is one whole transaction, claims carry an owner and a lease, and
 * nothing of an engine shows. engine.h is the interface for who writes one; engines/engines.h opens a store.
 * Every function may be called from any thread. All strings are UTF-8; JSON texts are stored as given. Times are Unix
 * seconds, 0: not yet. */
#ifndef SERVER_STORE_H
#define SERVER_STORE_H

#include "base/metrics.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct store store;

typedef enum {
    STORE_OK,
    STORE_NOT_FOUND, /* no such job, or nothing to claim */
    STORE_CONFLICT,  /* the job is not in a state that allows this; or the idempotency key came with another body */
    STORE_BUSY,      /* as many jobs wait as may */
    STORE_QUOTA,     /* its client has what it may: store_message says of what */
    STORE_FULL,      /* the disk is full; nothing was changed */
    STORE_LOCKED,    /* another program holds what is to be changed; nothing was */
    STORE_DAMAGED,   /* what is stored of this job is not what was written: store_message names the job */
    STORE_AWAY,      /* the database does not answer now; whether anything was changed shows when it does again */
    STORE_ERROR      /* anything else: store_message says what */
} store_status;

typedef enum { JOB_ACCEPTED, JOB_RUNNING, JOB_SUCCESSFUL, JOB_FAILED, JOB_DISMISSED } job_status;
const char *job_status_name(job_status status);

/* Whose a job, a key or an upload is: the name of an owner of tokens, "" where there are none. Where an operation takes
 * one, NULL means that it is of no matter. */
#define STORE_CLIENT 64

/* The grid that a job's search for one solves on: not stored, told by the worker while it runs. */
typedef struct {
    int64_t number;      /* from 1; 0: there is no search */
    double unknowns;     /* displacements of its nodes */
    double error, asked; /* of the grid before; NaN where there is none */
    double seconds_left; /* until the search ends, by estimate; NaN: not known */
} job_grid;

typedef struct {
    char id[33]; /* 32 hex digits; ids sort in order of creation (millisecond time, counter, random) */
    job_status status;
    int progress;  /* 0..100 */
    job_grid grid; /* see there */
    int attempts;  /* runs begun */
    double created, started, finished;
    char *tags;    /* JSON array of strings, never NULL */
    char *summary; /* JSON object once it ended with an answer, else NULL */
    char *error;   /* JSON object (problem details) when it failed, else NULL */
    int priority;
    char refines[33];          /* the job whose run this one continues; "": none. It may have been deleted */
    char client[STORE_CLIENT]; /* whose it is */
    bool damaged;              /* its summary was there and is not what was written: it is not shown */
} job;
void job_clear(job *j); /* frees the texts, zeroes *j; NULL is fine */

/* Bytes of uploads, and for how long they are kept (uploads.h). */
typedef struct {
    int64_t one;   /* bytes of one upload, after decompression; 0: no limit */
    int64_t all;   /* bytes of all together; what no job uses goes to make room; 0: no limit */
    double keep_s; /* one that no job uses goes so long after it was last used; 0: no limit */
} upload_limits;

/* What one client may have, if it has a name; 0: no limit. */
typedef struct {
    int64_t waiting; /* jobs that wait */
    int64_t bytes;   /* requests, results and uploads */
    double seconds;  /* of workers, in a day (UTC); counted when jobs end */
} client_quotas;

/* Kept nowhere: each start gives them, as the member `settings` of the store (engine.h), before other threads use it;
 * until then nothing is limited or counted. */
typedef struct {
    metrics *metrics;  /* counts commits and changes there; may be NULL */
    int64_t max_queue; /* so many jobs may wait; a submission beyond it is STORE_BUSY; 0: no limit */
    upload_limits uploads;
    client_quotas quotas;
    double affinity_s; /* with several daemons a job waits at most so long for one that has its body, or because others
                        * whose body the claimer has go before it; 0: it does not */
    int claims_ahead; /* with several daemons: so many small jobs a claim takes beside its own, for those that follow */
    double ahead_s;   /* what nobody here has begun by then waits again: all workers have something else to do */
    struct objects *objects; /* where large blobs go (objects/objects.h), if the engine does so; NULL: with the rest */
} store_settings;
/* NULL is fine. */
void store_close(store *s);

/* The last failure's cause, for the log; copied to buffer. */
void store_message(store *s, char *buffer, size_t size);

/* What a program without privileges may still write to the store's disk; -1: not known. */
int64_t store_free_bytes(store *s);

/* ---- notification: who waits learns of changes. The listener is called after every change of a job was committed that
 * anybody but its owner made (submitted, dismissed, expired, deleted), by the thread that made it or by one of the
 * engine's. What owners do (claim, finish, release) they tell themselves; an engine of several processes tells what
 * owners in the others do, and that a job which runs here is to end (store_renew says so). waits: the job now waits to
 * be claimed. gone: the job was deleted, and this client's it was; else NULL. id NULL: changes may have been missed,
 * everybody is to look again. It asks nothing of the store. */
typedef void store_listener(void *ctx, const char *id, bool waits, const char *gone);
/* At most one listens; NULL: nobody is told. When it returns the one before runs no more, and what it stands on may go.
 * Not from a listener. */
void store_listen(store *s, store_listener *listener, void *ctx);

/* What is submitted. */
typedef struct {
    const char *body;
    size_t body_len;
    const char *tags;   /* JSON array text; NULL: [] */
    const char *client; /* NULL: "" */
    const char *share;  /* whose share of the workers it takes: the owner or the address that sent it; NULL: "" */
    const char *idempotency_key; /* of this client; may be NULL */
    const char *refines;         /* id, or NULL */
    const char (*uploads)[65];   /* n_uploads ids of uploads that the body names */
    size_t n_uploads;
    bool any_upload;
    int priority;         /* -10..10: larger ones of a share run first, of the same the older one */
    bool small;           /* it is taken to end at once */
    const char *webhook;  /* address to tell of its end, or NULL */
    double queue_limit_s; /* it fails if it has not begun so long after it came; 0: no limit */
    uint64_t held_body;   /* what stands for its body: the same for jobs that a factor serves; 0: not known */
} store_request;

/* ---- submit: the job is on disk (fsync) before STORE_OK is returned. When the key is known and came with the same
 * body, *out is the earlier job and *repeated is true; with another body STORE_CONFLICT. STORE_NOT_FOUND: an upload is
 * not there (any more), or not this client's (its request says any_upload: no matter whose). */
store_status store_submit(store *s, const store_request *request, job *out, bool *repeated);

/* ---- repeat: the job that store_submit would answer this request with, without submitting it: STORE_OK,
 * STORE_CONFLICT for another body; STORE_NOT_FOUND: the key is new. */
store_status store_find_repeat(store *s, const store_request *request, job *out);

/* What a claim gives its owner, and what the owner shows with every change that only it may make. */
typedef struct {
    char job[33], owner[128];
    uint64_t token; /* fencing token: no other claim of this job by this owner has it */
    double seconds; /* that it lasts from its claim, and from each renewal */
    /* Of the claim, where several daemons share the store: */
    uint64_t held_body;                         /* as it was submitted */
    enum { FIT_NEW, FIT_HELD, FIT_OTHERS } fit; /* nobody had the body; this daemon; only others */
    double later_s; /* nothing was claimed, since jobs wait for who has their body: look again then; 0: nothing waits */
} store_lease;

/* A priority above this goes before all shares. */
#define STORE_PRIORITY_SHARED 5

/* ---- claim: an accepted job becomes running, attempts + 1, for lease_s seconds. It is one of the share whose turn it
 * is: of those for which fewest jobs run the one that has had the least time of workers, counted since all who wait now
 * have waited, and up to the last claim or renewal of what still runs. Of that share's it is the one with the highest
 * priority, of these the oldest. Shares with a job of a priority above STORE_PRIORITY_SHARED go before all others.
 * small: only jobs that are (those that were put back are not any more). *body is the request as submitted, freed by
 * the caller, or NULL where it is not what was written any more: the job can only be failed. STORE_NOT_FOUND when
 * nothing waits. A lease that has run out is still good until the job is somebody else's: by a claim of another owner
 * where the engine has several processes, by recover where it has one. From then on everything that is done with it is
 * STORE_CONFLICT and changes nothing. */
store_status store_claim(store *s, const char *owner, double lease_s, bool small, store_lease *lease, job *out,
                         char **body, size_t *body_len);
/* Extends the lease to its seconds from now; progress 0..100. STORE_CONFLICT when the job is no longer ours. *end (may
 * be NULL): another process was told that the job is to end (store_dismiss). */
store_status store_renew(store *s, const store_lease *lease, int progress, bool *end);

/* A named vector of doubles in a result: "reactions", "gaps", "displacements", "nodes", "contact_nodes", ...
 * On disk: little-endian IEEE 754 binary64, version in the row. */
typedef struct {
    char name[32];
    int64_t count;
    const double *data;
} store_vector;

/* What one load case leaves behind, or a job without cases. */
typedef struct {
    const char *name;    /* of the case, unique in its job */
    const char *summary; /* JSON object */
    const store_vector *vectors;
    size_t n_vectors;
    const double *history; /* history_rows x history_columns, row by row; NULL when there is none */
    int64_t history_rows, history_columns;
} store_answer;

/* What a run leaves behind. */
typedef struct {
    job_status status;  /* JOB_SUCCESSFUL, JOB_FAILED or JOB_DISMISSED */
    const char *error;  /* JSON object or NULL */
    store_answer whole; /* the job's own: name is not used, summary may be NULL. With cases: what they share */
    const store_answer *cases;
    size_t n_cases;
} store_outcome;

/* ---- finish: status, summaries, results and histories in one transaction. Only with the lease of the running job;
 * otherwise STORE_CONFLICT and nothing is written: each job gets one result. *finished (may be NULL): when the job
 * ended, by the store's clock, or 0 where that is not on disk yet and who reads the job waits for it. */
store_status store_finish(store *s, const store_lease *lease, const store_outcome *outcome, double *finished);

/* ---- requeue. store_release: one running job of ours goes back to accepted; counted: the attempt was one, since its
 * run failed (else the service stops).
 * store_recover, once at start before any claim: jobs left running by owners that are gone become accepted again, or
 * failed with the given error JSON when attempts >= max_attempts. Counts may be NULL. Both: a job that was told to end
 * becomes dismissed instead. */
store_status store_release(store *s, const store_lease *lease, bool counted);
store_status store_recover(store *s, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed);

/* ---- expire: jobs that have waited longer than they may fail with the given error JSON; *count is how many. They are
 * not claimed before that either. A job that had begun once and waits again has no limit any more. */
store_status store_expire(store *s, const char *error_json, int64_t *count);

/* ---- retain: ended jobs that are too old, too many or too large together go, the oldest first, a few in one
 * transaction; *count is how many went, 0: all is well. Those that somebody is still to be told of stay. */
typedef struct {
    double keep_s;      /* since the end; 0: no limit */
    int64_t keep_jobs;  /* 0: no limit */
    int64_t keep_bytes; /* requests and results; 0: no limit */
} store_retention;
store_status store_retain(store *s, const store_retention *limits, int64_t *count);

/* The time by which ages are counted, in Unix seconds (age_clock); *held: it does not follow the clock on the wall now.
 * One thread asks, and retains and collects. */
double store_age_time(store *s, bool *held);

/* ---- dismiss: an accepted job becomes dismissed and *was is JOB_ACCEPTED; of a running one it is kept that it is not
 * to run again (*was is JOB_RUNNING, also where that could not be kept: the caller tells the worker); an ended one is
 * deleted with its result and *was is its status. */
store_status store_dismiss(store *s, const char *id, job_status *was);

/* ---- read */
store_status store_get(store *s, const char *id, job *out);

#define STORE_MORE_TAGS 3
typedef struct {
    const char *client;
    bool by_status;
    job_status status;
    const char *tag;                   /* NULL: any */
    const char *more[STORE_MORE_TAGS]; /* tags that it must have too; NULL: none */
    double since, until;               /* created in [since, until), Unix seconds; until 0: no end */
    bool ascending;                    /* oldest first */
    const char *before; /* only jobs older than this id (the cursor), ascending: newer; NULL: from the start */
    int limit;          /* 1..1000 */
} store_query;
/* Newest first unless ascending; the caller frees with job_clear and free. *more: there are older ones. */
store_status store_list(store *s, const store_query *query, job **jobs, size_t *count, bool *more);

/* The body as submitted; the caller frees it. */
store_status store_get_body(store *s, const char *id, char **body, size_t *len);

/* A load case of an ended job. */
typedef struct {
    int64_t number; /* from 1, in the order of the request */
    char *name, *summary;
} store_case;
/* The cases of a job, or the one with this name where name is not NULL; the caller frees *cases with
 * store_cases_free. STORE_OK with a count of 0 where there is none, or no such job. */
store_status store_get_cases(store *s, const char *id, const char *name, store_case **cases, size_t *count);
void store_cases_free(store_case *cases, size_t count);

/* The named vector of a case, 0: of the job itself; *data is freed by the caller. STORE_NOT_FOUND if the result has
 * none of that name. */
store_status store_get_vector(store *s, const char *id, int64_t number, const char *name, double **data,
                              int64_t *count);
/* The lengths of all vectors of that name, over the job and its cases. */
store_status store_count_vectors(store *s, const char *id, const char *name, int64_t *total);
/* Rows whose first column (iteration) is > after; pass -1 for all. The caller frees *rows. STORE_NOT_FOUND if the case
 * (0: the job) has no stored history; STORE_OK with a count of 0 when it has one but nothing after `after`. */
store_status store_get_history(store *s, const char *id, int64_t number, int64_t after, double **rows, int64_t *count,
                               int64_t *columns);

/* Removes from the place of large blobs what belongs to nothing any more, a part of it; *count is how much. One thread
 * asks, often. */
store_status store_collect_objects(store *s, int64_t *count);

/* Does what was put off until nobody waits for it. One thread asks, often. */
store_status store_tidy(store *s);

/* Writes something that changes nothing, all the way to the disk: what a submission would meet now. */
store_status store_try_write(store *s);

/* Jobs in each status, indexed by job_status, then how many shares of the workers have jobs that wait. */
enum { STORE_SHARES_WAITING = 5, STORE_COUNTS };
store_status store_counts(store *s, int64_t counts[STORE_COUNTS]);

/* What a check found. */
typedef struct {
    char *findings; /* one a line; "" when the store is whole; freed by the caller, NULL on failure */
    int64_t jobs;   /* in the store */
    double seconds;
} store_findings;
/* Reads everything and looks at every reference, while others go on. */
store_status store_check(store *s, store_findings *out);

/* ---- webhooks: whom to tell of the end of which job. What is due stands in the store from the transaction that ends
 * the job until somebody was told, so that no crash forgets it; a crash in between may tell twice. */
typedef struct {
    char job[33];
    char *url;    /* freed by the caller */
    int attempts; /* made yet */
} webhook_due;
/* The one that has been due for longest of those whose address begins with none of `except` (n of them, at most
 * STORE_WEBHOOKS_EXCEPT); STORE_NOT_FOUND: none is. */
enum { STORE_WEBHOOKS_EXCEPT = 7 };
store_status store_webhook_next(store *s, const char *const *except, size_t n, webhook_due *out);

typedef enum { WEBHOOK_TOLD = 2, WEBHOOK_GIVEN_UP = 3, WEBHOOK_AGAIN = 1 } webhook_end;
/* Is there anybody to be told, now or later? */
store_status store_webhooks_open(store *s, bool *any);
/* How an attempt ended; again: not before delay_s are over. Where nobody answers at its address, all others that are
 * due there wait for silent_s (0: they do not). */
store_status store_webhook_attempted(store *s, const webhook_due *due, webhook_end end, double delay_s,
                                     double silent_s);

#endif
