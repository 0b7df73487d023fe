/* work.h: the worker threads between the store and the processes that solve.
 *
 * One chain per job: claim -> in a process: decode, uz_solve -> finish (commit) -> tell the waiters. A worker owns the
 * job it runs; the store decides who owns what, and a job's lease is renewed until it ends. Whatever becomes of a
 * process is its job's alone. Lock order: work's own, then the store's; never the other way round (work/internal.h).
 *
 * What a finished job leaves in the store (store_get_vector):
 *   "dim"            1  0 for matrices; 2 or 3 for a scene: how displacements and nodes are grouped
 *   "reactions"      m  r
 *   "gaps"           m  g
 *   "displacements"  d for matrices; nodes x dim, node by node, for a scene
 *   "place"          nodes x dim, the displacement at which the contacts were found; only where kinematics moved them
 *   "free_strain"    elements, what temperature does under finite kinematics; only where it does
 *   "nodes"          nodes x dim, coordinates; scenes only
 *   "contact_nodes"  m, the node of each reaction; scenes only
 *   "pressure"       m, reaction over tributary area; scenes only
 *   "ray"            m, the proof of an infeasible problem
 *   "state"          where the run stood, for one that continues it (state.h)
 * and a history of CODEC_HISTORY_COLUMNS columns. A vector that a solve did not give is not there. A job with load
 * cases leaves dim, nodes and contact_nodes once, and the others for each case. In the summary timings_s.total covers
 * queue and parse too. */
#ifndef SERVER_WORK_H
#define SERVER_WORK_H

#include "base/log.h"
#include "base/metrics.h"
#include "store/store.h"
#include "uzawa.h"
#include "work/feed.h"

#include <stdatomic.h>
#include <stdbool.h>

typedef struct work work;

typedef struct {
    const char *node;    /* the name of this daemon among those that share its store; NULL: "" */
    const char *version; /* NULL: "" */
    int workers;
    int lanes;           /* workers beside those, which take small jobs only, while all of those are busy */
    int threads;         /* that one solve may take, where processors are idle; 0: all of those */
    const char *program; /* of the processes that solve; NULL: this one. It must call solver_process */
    int max_attempts;    /* runs begun before a job that keeps killing its process is failed */
    size_t cache_bytes;  /* factor caches of all processes, with their reserves */
    size_t solve_bytes;  /* of one solve: what would take more goes on without a factor or is refused; 0: no limit */
    double max_solve_s;  /* of one job, whatever it asks for; 0: no limit */
    const char *group_command; /* starts the processes of an operator distributed (group_process.h); "", NULL: none */
    double lease_s;
    double room_wait_s;        /* a result that has no room on the disk waits so long before its job is failed; 0: 60 */
    store_retention retention; /* of ended jobs */
    metrics *metrics;          /* may be NULL */
} work_options;

/* Recovers jobs left by a dead process, then starts the threads. NULL on failure with the reason in message. */
work *work_start(store *s, const work_options *options, server_log *log, char *message, size_t size);

/* Asks a running job to stop; false if no worker here runs it. The job ends as dismissed with its best answer so far,
 * unless it ends of itself first. */
bool work_cancel(work *w, const char *id);

/* Blocks until the job has ended, `seconds` have passed or the service stops; true if it ended (or does not exist). For
 * the client at the socket fd (-1: none): returns too when it has closed its end, or when *no_more (may be NULL) is
 * true, which whoever sets it tells by feed_wake_all. */
bool work_wait(work *w, const char *id, double seconds, int fd, const atomic_bool *no_more);
/* The same for who has seen that the job had not ended after he asked for the number `since` (feed_last): nobody looks
 * at the store before there is something to see. *found: the ended job, freed by the caller; it stays as it is where
 * none was seen. */
bool work_wait_since(work *w, const char *id, uint64_t since, double seconds, int fd, const atomic_bool *no_more,
                     job *found);
/* The job, for who has seen that it had not ended and waits for that: as it was when it ended here, or as the store has
 * it. */
store_status work_look(work *w, const char *id, job *out);
/* What changes jobs is told there: by the store what others than a job's owner do, by the workers the rest. */
feed *work_feed(work *w);

/* The history of a job that runs now: `count` rows of 12 doubles (codec's columns). Of a long run rows are left out,
 * evenly; the newest is always there. */
typedef struct {
    char case_name[64]; /* the case that runs now; "": the job has none */
    bool is_case;       /* the name that was asked for is a case of the job */
    double *rows;       /* of the case that runs now, if it is the one asked for; freed by the caller */
    int64_t count;
} work_history;
/* The grid that a job's search for one solves on. False: it does not run here, or is none. */
bool work_grid(work *w, const char *id, job_grid *out);
/* False if the job does not run here, or without memory. *progress in percent; *out the rows with iteration > after of
 * the case that is named (NULL: whichever runs). Both may be NULL. */
bool work_live(work *w, const char *id, int *progress, const char *case_name, int64_t after, work_history *out);

/* What the caches of all processes have, most recently used first in each; a factor that several have is one entry.
 * Of one that runs a job: as it was before. The caller frees *entries. False: no memory. */
bool work_factors(work *w, uz_cache_entry **entries, size_t *count);
/* The same in numbers, as the last job of each process left it. */
void work_cached(work *w, size_t *entries, size_t *bytes);
const work_options *work_settings(const work *w); /* as they are in force */
int work_busy(work *w);                           /* workers, without the lanes, that run a job */
/* What a request that is no job will take (uz_predict), found in a process of its own, which ends with the call: it may
 * take minutes and much memory, or die. One at a time. */
typedef struct {
    const char *text;
    size_t len;
    const char (*uploads)[65]; /* n_uploads, which it may read */
    size_t n_uploads;
    bool (*is_over)(void *asker); /* nobody waits for it any more; asked some times a second */
    void *asker;
} work_request;
/* False: nothing can tell, or it is over. */
bool work_predict(work *w, const work_request *request, uz_prediction *out);

/* What stands for the body of a job's text (store_request.held_body); 0: it is too long to be read for that. */
uint64_t work_body(const char *text, size_t len);

/* The store says that this daemon is to claim nothing (store_drain). */
bool work_draining(work *w);

/* A small problem is solved rightly by a worker that is idle; true too where all are at work. One thread asks. */
bool work_solves(work *w);

/* Stops: no more claims; running jobs get drain_s seconds to end, then they are interrupted and released back to
 * accepted. Waiters wake at once. Returns when every worker has ended, half a second later: what does not stop is
 * killed. May be called again, also from another thread while the first call waits: the earliest end of the drain
 * counts. */
void work_stop(work *w, double drain_s);
/* Stops what still runs. No other call may be in progress. NULL is fine. */
void work_free(work *w);

#endif
