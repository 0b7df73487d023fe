/* internal.h: what the files of this engine share. */
#ifndef SERVER_STORE_POSTGRESQL_INTERNAL_H
#define SERVER_STORE_POSTGRESQL_INTERNAL_H

#include "store/batch.h"
#include "store/engine_base.h"
#include "store/postgresql/connection.h"

#include <pthread.h>

#define STORE_LINKS 8
#define CLAIMS_MOST 8 /* that a claim may take beside its own */

/* A job that was claimed for whoever claims next. */
typedef struct {
    job job;
    store_lease lease;
    char *body;
    size_t len;
    double since; /* CLOCK_MONOTONIC */
} kept_claim;

typedef struct told told; /* tell.c */

/* Lock order: none of these is taken while another is held, except the message's last. */
typedef struct {
    store base;
    char *address;
    char node[33]; /* this daemon's name among those that share the database */

    pthread_mutex_t links_lock; /* what follows, down to pooled */
    pthread_cond_t link_free;
    link_to links[STORE_LINKS];
    link_to *links_free[STORE_LINKS];
    int n_links_free;
    double connect_after, connect_delay; /* not before this (CLOCK_MONOTONIC), after what failed */
    char connect_cause[LINK_CAUSE];
    bool pooled; /* somebody stands between who hands connections on, as it turned out */

    batch changes; /* submissions and ends that wait for their transaction; jobs.c */

    pthread_mutex_t state_lock; /* what follows */
    uint64_t last_ms;           /* of the newest id */
    unsigned sequence;
    int most_attempts; /* as recover was told, for jobs whose owner is gone later on; 0: nothing was told */
    char *lost_json;
    kept_claim ahead[CLAIMS_MOST]; /* n_ahead, the oldest first */
    size_t n_ahead;

    told *told;
    double collect_after; /* CLOCK_MONOTONIC; of the one thread that collects */
} postgresql_store;

static inline postgresql_store *postgresql_of(store *s)
{
    return (postgresql_store *)s;
}

/* A connection for the calling thread alone, until it is given back with how its work ended, which is returned. It may
 * not be connected: then whatever is done with it is STORE_AWAY. */
link_to *postgresql_take(postgresql_store *s);
store_status postgresql_give(postgresql_store *s, link_to *l, store_status status);

/* One call as a transaction of its own. What the answer says is read by `read`, which may be NULL and may run more than
 * once. repeat: where the connection was lost, it does no harm to carry it out twice. */
typedef store_status answer_reader(link_to *l, const PGresult *answer, void *ctx);
store_status postgresql_do(postgresql_store *s, link_kind kind, bool repeat, const call *c, answer_reader *read,
                           void *ctx);

/* The columns of a row called job, in the order that postgresql_read_job expects (uzawa.shown). */
#define JOB_COLUMNS                                                                                                    \
    "job.id, job.status, job.progress, job.attempts, job.created, job.started, job.finished, job.tags, job.summary,"   \
    " job.error, job.refines, job.priority, job.client, job.summary IS NULL OR"                                        \
    " job.summary_sum = uzawa.sum_of(uzawa.keys_of(job.id, job.status::text), job.summary)"
/* Failure leaves *out zero. */
store_status postgresql_read_job(link_to *l, const PGresult *r, int row, job *out);

/* STORE_QUOTA and a message: this client has as many of that as it may. what: a verdict of uzawa.submit. */
store_status postgresql_over_quota(link_to *l, const char *client, const char *what);

/* Tells the other daemons (tell.c), and here: the listener, for what the owner did not do. client: of one that is gone.
 * id "": everybody there is to look again. */
typedef enum { TELL_CHANGED = 'c', TELL_WAITS = 'w', TELL_GONE = 'g' } tell_what;
void postgresql_tell(postgresql_store *s, const char *id, tell_what what, const char *client, bool here);
/* Who just had an answer of the database says so: where the connection that listens is gone or does not answer,
 * everybody here is told to look. */
void postgresql_look_if_deaf(postgresql_store *s);
bool postgresql_tell_begin(postgresql_store *s);
void postgresql_tell_end(postgresql_store *s);

/* Pieces of a result, in the transaction that ends its job: many small ones are one call, and one row. */
enum { PIECES_AT_ONCE = 64, PLACE_ROOM = RESULT_PIECE };
typedef struct {
    char name[32];
    int64_t number, part, encoding, header, size;
    double last;
    char digest[65]; /* of one that is kept once for all jobs, in hexadecimal; "": its bytes are the bundle's */
} kept_piece;
typedef struct {
    link_to *link;
    const char *job;
    uint64_t token;
    int bundles; /* sent so far */
    size_t n, len;
    kept_piece kept[PIECES_AT_ONCE];
    char *bytes; /* PLACE_ROOM of them, len in use; freed by who made the place */
} result_place;
store_status postgresql_send_pieces(result_place *place); /* those that are kept */
extern const result_blobs POSTGRESQL_RESULTS;
extern const store_moves POSTGRESQL_MOVES; /* move.c */

/* The text of an array whose elements are quoted; NULL: no memory. */
char *postgresql_quoted_array(const char *const *words, size_t n);

extern const store_engine_nodes POSTGRESQL_NODES;

/* Bytes of uploads in the database. NULL: no memory. */
typedef struct blobs blobs;
blobs *postgresql_blobs(postgresql_store *s);

/* Carries out what waits in postgresql_store.changes. */
void postgresql_run_batch(void *ctx, batch_change *list);

/* ---- the operations of the engine (engine.h), by the files that have them */
store *postgresql_open(const char *address, char *message, size_t size);
void postgresql_close(store *s);
store_status postgresql_submit(store *s, const store_request *request, job *out, bool *repeated);
store_status postgresql_find_repeat(store *s, const store_request *request, job *out);
store_status postgresql_claim(store *s, store_lease *lease, double lease_s, bool small, job *out, char **body,
                              size_t *len);
/* Puts back what was claimed ahead and nobody has begun; all: also what is fresh. */
void postgresql_put_back(postgresql_store *s, bool all);
store_status postgresql_use_lease(store *s, const store_lease *lease, const lease_use *use);
store_status postgresql_recover(store *s, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed);
store_status postgresql_expire(store *s, const char *error_json, int64_t *count);
store_status postgresql_retain(store *s, const store_retention *limits, double now, int64_t *count);
store_status postgresql_dismiss(store *s, const char *id, job_status *was);
store_status postgresql_get(store *s, const char *id, job *out);
store_status postgresql_list(store *s, const store_query *query, job *jobs, size_t *count);
store_status postgresql_get_body(store *s, const char *id, char **body, size_t *len);
store_status postgresql_get_cases(store *s, const char *id, const char *name, store_case **cases, size_t *count);
store_status postgresql_counts(store *s, int64_t counts[STORE_COUNTS]);
store_status postgresql_webhook_next(store *s, const char *const *except, size_t n, webhook_due *out);
store_status postgresql_webhooks_open(store *s, bool *any);
store_status postgresql_webhook_attempted(store *s, const webhook_due *due, webhook_end end, double delay_s,
                                          double silent_s);
store_status postgresql_upload_get(store *s, const char *id, const char *client, upload_info *out);
store_status postgresql_upload_named(store *s, const char *id, const char *of_job);
store_status postgresql_upload_add(store *s, const char *id, const char *client, int64_t bytes, upload_info *out,
                                   bool *known);
store_status postgresql_upload_forget(store *s, const char *id, const char *client, bool *gone);
store_status postgresql_upload_idle(store *s, double now, double unused_s, upload_info *out);
store_status postgresql_upload_total(store *s, int64_t *bytes);
store_status postgresql_collect(store *s, int64_t *count); /* objects.c */
store_status postgresql_try_write(store *s);
int64_t postgresql_free_bytes(store *s);
store_status postgresql_check(store *s, store_findings *out);
bool postgresql_check_file(const char *address, store_findings *out, char *message, size_t size);
bool postgresql_backup_file(const char *address, const char *to, int64_t *bytes, char *message, size_t size);

#endif
