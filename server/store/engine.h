/* engine.h: an engine of the store, for who writes one. store.h and uploads.h have the contract of each operation;
 * docs/architecture/store.md says what holds for all of them and shows how to add one. What engines share:
 * engine_base.h.
 *
 *   - Each operation is one transaction, all of it or nothing, and may be called from any thread.
 *   - STORE_OK means: durable, but for claim and renew, which recover makes good for. What may still be lost is not
 *     read either: get, list and find_repeat return an end or a job only once it is durable.
 *   - Outputs are never NULL, zeroed before the call, and freed after one that failed. claim sets the lease's token.
 *   - Before STORE_FULL, STORE_LOCKED, STORE_DAMAGED, STORE_AWAY and STORE_ERROR: store_set_message with the cause.
 *   - store_tell after the commit of every change that the job's owner did not make, without a lock held. */
#ifndef SERVER_STORE_ENGINE_H
#define SERVER_STORE_ENGINE_H

#include "store/move.h"
#include "store/nodes.h"
#include "store/result_blobs.h"
#include "store/uploads.h"

/* What only the owner of a running job does: store_renew, store_finish or store_release. */
typedef struct {
    enum { LEASE_RENEW, LEASE_FINISH, LEASE_RELEASE } what;
    int progress;                 /* renew */
    bool *end;                    /* renew: store.h; false before the call, and stays where there is one process */
    const store_outcome *outcome; /* finish */
    double *finished; /* finish: when it was, where the end is durable by then; 0 before the call, and stays where a
                       * reader has to wait for that */
    bool counted;     /* release: the attempt */
} lease_use;

typedef struct {
    const char *scheme; /* how its addresses begin: "postgresql://"; "": it takes all others, as names of files */
    store *(*open)(const char *address, char *message, size_t size);
    void (*close)(store *s);
    store_status (*submit)(store *s, const store_request *request, job *out, bool *repeated);
    store_status (*find_repeat)(store *s, const store_request *request, job *out);
    store_status (*claim)(store *s, store_lease *lease, double lease_s, bool small, job *out, char **body, size_t *len);
    store_status (*use_lease)(store *s, const store_lease *lease, const lease_use *use);
    store_status (*recover)(store *s, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed);
    store_status (*expire)(store *s, const char *error_json, int64_t *count);
    store_status (*retain)(store *s, const store_retention *limits, double now, int64_t *count);
    store_status (*dismiss)(store *s, const char *id, job_status *was);
    store_status (*get)(store *s, const char *id, job *out);
    store_status (*list)(store *s, const store_query *query, job *jobs, size_t *count); /* limit + 1 of them at most */
    store_status (*get_body)(store *s, const char *id, char **body, size_t *len);
    store_status (*get_cases)(store *s, const char *id, const char *name, store_case **cases, size_t *count);
    const result_blobs *results; /* vectors and histories */
    store_status (*counts)(store *s, int64_t counts[STORE_COUNTS]);
    store_status (*webhook_next)(store *s, const char *const *except, size_t n, webhook_due *out);
    store_status (*webhooks_open)(store *s, bool *any);
    store_status (*webhook_attempted)(store *s, const webhook_due *due, webhook_end end, double delay_s,
                                      double silent_s);
    /* The rows of uploads. */
    store_status (*upload_get)(store *s, const char *id, const char *client, upload_info *out);
    store_status (*upload_named)(store *s, const char *id, const char *of_job); /* STORE_NOT_FOUND: not by this job */
    store_status (*upload_add)(store *s, const char *id, const char *client, int64_t bytes, upload_info *out,
                               bool *known);
    /* It is no more this client's; NULL: nobody's. STORE_CONFLICT while a job of theirs refers to it. *gone: the row
     * went, since nobody has it any more and no job refers to it. */
    store_status (*upload_forget)(store *s, const char *id, const char *client, bool *gone);
    /* No job's, of those that at `now` were unused for so long the one that was for longest. */
    store_status (*upload_idle)(store *s, double now, double unused_s, upload_info *out);
    store_status (*upload_total)(store *s, int64_t *bytes); /* NULL: nobody sends it any */
    const store_engine_nodes *nodes;                        /* NULL: a store has one daemon */
    store_status (*collect)(store *s, int64_t *count); /* store_collect_objects; NULL: settings.objects is not used */
    store_status (*tidy)(store *s);                    /* NULL: it puts nothing off */
    store_status (*try_write)(store *s);
    int64_t (*free_bytes)(store *s);
    store_status (*check)(store *s, store_findings *out);
    /* Of an address whose store may be open elsewhere. */
    bool (*check_file)(const char *address, store_findings *out, char *message, size_t size);
    const store_moves *moves; /* for a move into another engine, or from one; NULL: there is none */
    bool (*backup_file)(const char *address, const char *to, int64_t *bytes, char *message, size_t size);
} store_engine;

#endif
