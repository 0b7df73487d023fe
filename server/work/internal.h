/* internal.h: what the files of the workers share. */
#ifndef SERVER_WORK_INTERNAL_H
#define SERVER_WORK_INTERNAL_H

#include "base/clock.h"
#include "work/ends.h"
#include "work/feed.h"
#include "work/pace.h"
#include "work/process.h"
#include "work/work.h"

#include <pthread.h>
#include <stdatomic.h>

/* One thread and the job it runs. */
typedef struct {
    work *w;
    pthread_t thread;
    bool lane;       /* takes small jobs only, and has none for long */
    char owner[128]; /* who it is to the store: host, process, a random number, worker */

    pthread_mutex_t lock; /* down to progress; only this thread changes these */
    char id[33];          /* the job that runs now, "" when none */
    store_lease lease;    /* of that job */
    process *process;     /* that it runs in; NULL: none yet */
    int64_t n_cases;      /* of the job, once its process has read it */
    int progress;         /* the largest told yet */

    atomic_bool cancel; /* somebody wants this job to end with its best answer */
    atomic_bool lost;   /* the store says the job is not ours any more */
    int wake;           /* eventfd: written after one of these, or work.interrupt, was set */
} worker;

/* Lock order: claim_lock, then a worker's lock. claim_lock, then the store's. No other two are held together, but that
 * the feed's own is taken last. */
struct work {
    store *store;
    server_log *log;
    work_options options;
    int processors; /* that this process may use */

    /* A claim and the publishing of its id are one step, so that whoever saw the job running finds its worker. */
    pthread_mutex_t claim_lock;

    feed *feed; /* told of every change of a job after it was committed */
    ends *ends; /* of jobs that ended here, before the feed is told */
    pace *pace; /* of what they took; NULL: nobody keeps it */

    pthread_mutex_t pool_lock; /* of each process what its header says; taken alone */
    pthread_cond_t pool_idle;  /* one was given back */
    process *processes;        /* n of them: the workers' first, then those of the lanes */
    bool predicting;           /* a process of its own does */
    atomic_bool draining;      /* the store says so: nothing is claimed */

    pthread_mutex_t lock;  /* everything down to drain_until */
    pthread_cond_t wake;   /* submitted or stopping */
    pthread_cond_t probed; /* probe, or busy while one is asked for */
    pthread_cond_t crowd;  /* for the lanes: the same, or all workers are busy */
    pthread_cond_t idle;   /* alive became 0, the drain was shortened, or stopped */
    pthread_cond_t tick;   /* finished, or keep_now */
    uint64_t
        submitted; /* times that the store told of a job that waits: a worker that saw none waits for another number */
    int busy;      /* workers with a job, but for the lanes */
    int alive;     /* worker threads that have not ended */
    enum { PROBE_NONE, PROBE_ASKED, PROBE_RUNS, PROBE_GOOD, PROBE_BAD } probe;
    bool stopping;      /* no more claims */
    bool finished;      /* the keeper shall stop */
    bool keep_now;      /* it shall renew at once */
    bool stopped;       /* every thread was joined */
    double drain_until; /* on CLOCK_MONOTONIC */

    atomic_bool interrupt; /* the time to drain is over */
    int n_started;         /* workers to join; set before any other thread may call */
    bool keeper_started, housekeeper_started;
    pthread_t keeper, housekeeper;
    int n;           /* options.workers + options.lanes */
    worker *workers; /* n of them */
};

/* Has one claimed job solved and stores what came of it; takes over its texts and the body. */
void work_run(worker *me, job *claimed, char *body, size_t body_len);

/* Has a process solve a problem whose answer is known; false: it did not. */
bool work_probe(worker *me);

bool work_is_stopping(work *w);

/* That each of so many jobs may take: its share of the processors, at most options.threads. */
int work_threads(const work *w, int jobs);

/* Of the load case i of the job that it runs, once that was read. */
void work_case_name(const process *p, int64_t i, char name[CASE_NAME]);

/* A process for a job with this text, that is: one that has its body, even if it is to be waited for while an
 * outcome is stored, else the first one; of the lanes' for a lane. *body: what stands for it, or 0: not known yet; out:
 * for work_answered; 0: not to be told. There are as many as workers; still there may be a moment in which one more is
 * asked what it has. */
process *work_take_process(work *w, bool lane, const char *text, size_t len, uint64_t *body);
/* It has solved this body and only its outcome is still to be stored. */
void work_answered(work *w, process *p, uint64_t body);
/* done: what it said at the end; NULL: it has ended. body: of its job, 0: not known. What it has no more, and no other
 * process of the daemon has, the store is told. */
void work_give_process(work *w, process *p, const packet *done, uint64_t body);
/* Those that nobody has had for a while give back the memory of texts and answers. */
void work_rest_processes(work *w);

#endif
