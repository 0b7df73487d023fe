/* work.c: the threads: workers that claim, a keeper that renews their leases, and those who wait for a job. */
#include "base/memory.h"
#include "store/engine_base.h"
#include "store/nodes.h"
#include "work/housekeeping.h"
#include "work/internal.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#define CLAIM_RETRY_S 1.0                /* after the store failed */
#define PROBE_S       30.0               /* a process that has to be started may take a while */
#define LANE_CACHE    ((size_t)64 << 20) /* is enough for small jobs */

/* The daemon's own end, a kill or a power loss, is no fault of the jobs that ran then. One that brings the daemon down
 * each time it runs is given up all the same, after so many times the attempts that it has. */
#define DAEMON_ATTEMPTS 10

/* ---- workers */

/* lease: of the job that runs from now on; of none when it is all zero. */
static void publish(worker *me, const store_lease *lease)
{
    pthread_mutex_lock(&me->lock);
    me->process = NULL;
    me->n_cases = 0;
    me->progress = 1;
    me->lease = *lease;
    strcpy(me->id, lease->job);
    pthread_mutex_unlock(&me->lock);
}

/* *later_s: nothing was claimed, but something waits that may be claimed then; 0: nothing does. */
static store_status claim(worker *me, job *claimed, char **body, size_t *body_len, double *later_s)
{
    work *w = me->w;
    store_lease lease;
    pthread_mutex_lock(&w->claim_lock);
    store_status status =
        store_claim(w->store, me->owner, w->options.lease_s, me->lane, &lease, claimed, body, body_len);
    *later_s = status == STORE_NOT_FOUND ? lease.later_s : 0.0;
    if (status == STORE_OK) {
        if (lease.held_body)
            metrics_add(w->options.metrics,
                        lease.fit == FIT_HELD     ? METRIC_BODY_HELD
                        : lease.fit == FIT_OTHERS ? METRIC_BODY_OTHERS
                                                  : METRIC_BODY_NEW,
                        1);
        atomic_store(&me->cancel, false);
        atomic_store(&me->lost, false);
        publish(me, &lease);
    }
    pthread_mutex_unlock(&w->claim_lock);
    if (status == STORE_OK)
        feed_goes_on(w->feed, claimed->id);
    return status;
}

/* Under work.lock: a job waits, or several may. Whoever else is idle has it, else a lane. */
static void call_worker(work *w, bool several)
{
    w->submitted++;
    (several ? pthread_cond_broadcast : pthread_cond_signal)(&w->wake);
    if (several || w->busy == w->options.workers)
        (several ? pthread_cond_broadcast : pthread_cond_signal)(&w->crowd);
}

/* Under work.lock, when a job begins or has ended: each has as many processors, from now on, in the middle of a solve
 * too. Those of the lanes have one. */
static void share_processors(work *w)
{
    for (int i = 0; i < w->options.workers; i++)
        atomic_store(&w->processes[i].board->threads, work_threads(w, w->busy));
}

static void *work_loop(void *arg)
{
    worker *me = arg;
    work *w = me->w;
    bool store_failed = false;
    double later_s = 0.0;
    if (me == w->workers) { /* the first job finds a process */
        uint64_t body = 0;
        process *first = work_take_process(w, false, NULL, 0, &body);
        process_begin(first);
        work_give_process(w, first, NULL, 0);
    }
    pthread_mutex_lock(&w->lock);
    for (uint64_t seen = w->submitted - 1;;) { /* of w->submitted before the last look at the store */
        job claimed;
        char *body, cause[256];
        size_t body_len;
        /* until something was submitted since, a lane until nobody else is there for it either; after a failure of the
         * store it is tried again anyway, and where a job is left to another daemon for a while */
        const double pause = store_failed ? CLAIM_RETRY_S : later_s > 0.0 ? later_s : (double)INFINITY;
        const double until = clock_seconds(CLOCK_MONOTONIC) + pause;
        while (!w->stopping && (store_failed || w->submitted == seen || (me->lane && w->busy < w->options.workers)) &&
               (me->lane || w->probe != PROBE_ASKED) && clock_wait(me->lane ? &w->crowd : &w->wake, &w->lock, until))
            ;
        if (w->stopping)
            break;
        if (w->probe == PROBE_ASKED && !me->lane) { /* before a job: somebody waits, and it takes a millisecond */
            w->probe = PROBE_RUNS;
            pthread_mutex_unlock(&w->lock);
            const bool good = work_probe(me);
            pthread_mutex_lock(&w->lock);
            w->probe = good ? PROBE_GOOD : PROBE_BAD;
            pthread_cond_broadcast(&w->probed);
            continue;
        }
        seen = w->submitted;
        pthread_mutex_unlock(&w->lock);
        const store_status status = claim(me, &claimed, &body, &body_len, &later_s);
        store_failed = status != STORE_OK && status != STORE_NOT_FOUND;
        if (store_failed) {
            store_message(w->store, cause, sizeof cause);
            log_write(w->log, LOG_ERROR, "claim_failed", (log_field[]){LOG_S("cause", cause), {0}});
        }
        pthread_mutex_lock(&w->lock);
        if (status != STORE_OK)
            continue;
        metrics_add(w->options.metrics, METRIC_LANE, me->lane);
        w->busy += !me->lane;
        share_processors(w);
        if (w->busy == w->options.workers)
            pthread_cond_signal(&w->crowd);
        if (w->probe == PROBE_ASKED)
            pthread_cond_broadcast(&w->probed);
        pthread_mutex_unlock(&w->lock);
        char id[33];
        strcpy(id, claimed.id);
        work_run(me, &claimed, body, body_len);
        publish(me, &(store_lease){.token = 0});
        feed_changed(w->feed, id, NULL); /* ended, or put back */
        pthread_mutex_lock(&w->lock);
        w->busy -= !me->lane;
        share_processors(w);
        if (me->lane) /* what it puts back is for another one */
            call_worker(w, false);
        seen = w->submitted - 1;
    }
    /* A process dies with the thread that began it, and another worker may have it now: all leave together. */
    if (--w->alive == 0)
        pthread_cond_broadcast(&w->idle);
    while (w->alive > 0)
        pthread_cond_wait(&w->idle, &w->lock);
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

/* Sets one of the reasons for a job to stop, and wakes who watches it. */
static void stop_job(worker *me, atomic_bool *why)
{
    const uint64_t one = 1;
    atomic_store(why, true);
    (void)!write(me->wake, &one, sizeof one);
}

/* ---- the keeper: a factorization may take longer than a lease and asks nothing meanwhile, so leases are renewed from
 * a thread of their own */

static void *keep_loop(void *arg)
{
    work *w = arg;
    pthread_mutex_lock(&w->lock);
    while (!w->finished) {
        const double until = clock_seconds(CLOCK_MONOTONIC) + w->options.lease_s / 3.0;
        while (!w->finished && !w->keep_now && clock_wait(&w->tick, &w->lock, until))
            ;
        if (w->finished)
            break;
        w->keep_now = false;
        pthread_mutex_unlock(&w->lock);
        for (int i = 0; i < w->n; i++) {
            worker *me = &w->workers[i];
            pthread_mutex_lock(&me->lock);
            const store_lease lease = me->lease;
            if (me->process)
                me->progress = live_progress(&me->process->board->live, me->progress);
            const int progress = me->progress;
            pthread_mutex_unlock(&me->lock);
            if (!lease.job[0])
                continue;
            bool end;
            const store_status status = store_renew(w->store, &lease, progress, &end);
            if (status != STORE_CONFLICT && status != STORE_NOT_FOUND && !end)
                continue; /* a store that fails now may work before the lease ends */
            pthread_mutex_lock(&me->lock);
            if (me->lease.token == lease.token && strcmp(me->id, lease.job) == 0) /* else it ended meanwhile */
                stop_job(me, end ? &me->cancel : &me->lost);
            pthread_mutex_unlock(&me->lock);
        }
        pthread_mutex_lock(&w->lock);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

/* ---- starting */

static bool recover(work *w, char *message, size_t size)
{
    int64_t requeued, failed;
    char cause[256];
    problem_details problem = {.status = 500, .code = "attempts_exhausted", .title = "Every attempt was cut short"};
    snprintf(problem.detail, sizeof problem.detail,
             "The service ended while this job ran, as often as is allowed: maybe for want of memory. Make it smaller "
             "or submit it again.");
    char *error = codec_encode_problem(&problem);
    store_status status =
        error ? store_recover(w->store, DAEMON_ATTEMPTS * w->options.max_attempts, error, &requeued, &failed)
              : STORE_ERROR;
    free(error);
    if (status != STORE_OK) {
        store_message(w->store, cause, sizeof cause);
        snprintf(message, size, "cannot take up the jobs that were left running: %s", cause);
        return false;
    }
    metrics_add(w->options.metrics, METRIC_REQUEUED, requeued);
    if (requeued + failed > 0)
        log_write(w->log, LOG_WARN, "recovered",
                  (log_field[]){LOG_I("requeued", requeued), LOG_I("failed", failed), {0}});
    return true;
}

static work *make_work(store *s, const work_options *options, server_log *log)
{
    char host[65] = "";
    unsigned random = 0;
    work *w = calloc(1, sizeof *w);
    if (!w)
        return NULL;
    gethostname(host, sizeof host - 1);
    if (getrandom(&random, sizeof random, 0) < 0)
        random = (unsigned)time(NULL);
    w->store = s;
    w->log = log;
    w->options = *options;
    w->options.workers = options->workers > 0 ? options->workers : 1;
    w->n = w->options.workers + w->options.lanes;
    w->options.max_attempts = options->max_attempts > 0 ? options->max_attempts : 3;
    w->options.room_wait_s = options->room_wait_s > 0.0 ? options->room_wait_s : 60.0;
    w->options.lease_s = options->lease_s > 0.0 ? options->lease_s : 30.0;
    pthread_mutex_init(&w->claim_lock, NULL);
    pthread_mutex_init(&w->pool_lock, NULL);
    pthread_mutex_init(&w->lock, NULL);
    clock_condition(&w->pool_idle);
    clock_condition(&w->wake);
    clock_condition(&w->crowd);
    clock_condition(&w->probed);
    clock_condition(&w->idle);
    clock_condition(&w->tick);
    w->processors = processors_available();
    w->feed = feed_new();
    w->ends = ends_new();
    w->pace = pace_new();
    w->workers = calloc((size_t)w->n, sizeof *w->workers);
    w->processes = calloc((size_t)w->n, sizeof *w->processes);
    for (int i = 0; w->workers && i < w->n; i++) {
        w->workers[i].w = w;
        w->workers[i].lane = i >= w->options.workers;
        snprintf(w->workers[i].owner, sizeof w->workers[i].owner, "%s:%ld:%08x:%d", host, (long)getpid(), random, i);
        pthread_mutex_init(&w->workers[i].lock, NULL);
        w->workers[i].wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    }
    return w;
}

/* The worker that runs the job, with its lock held; NULL: none. */
static worker *find_worker(work *w, const char *id)
{
    for (int i = 0; id[0] && i < w->n; i++) {
        pthread_mutex_lock(&w->workers[i].lock);
        if (strcmp(w->workers[i].id, id) == 0)
            return &w->workers[i];
        pthread_mutex_unlock(&w->workers[i].lock);
    }
    return NULL;
}

/* What the store tells (store_listener): a job that waits is for one of the workers. One that runs here was changed by
 * another process: the keeper asks what that was, also where changes may have been missed. */
static void tell_change(void *ctx, const char *id, bool waits, const char *gone)
{
    work *w = ctx;
    if (id && waits)
        feed_goes_on(w->feed, id);
    else if (id)
        feed_changed(w->feed, id, gone);
    else
        feed_wake_all(w->feed);
    worker *runs = id && !waits && !gone ? find_worker(w, id) : NULL;
    if (runs)
        pthread_mutex_unlock(&runs->lock);
    if (!waits && id && !runs)
        return;
    pthread_mutex_lock(&w->lock);
    if (runs || !id) {
        w->keep_now = true;
        pthread_cond_broadcast(&w->tick);
    }
    if (!runs)
        call_worker(w, !id);
    pthread_mutex_unlock(&w->lock);
}

/* A small part goes to the lanes. Half of the rest goes to all other processes alike, of the other half each has as
 * much as all after it together: the first ones are those that work where there is little to do. */
static size_t cache_share(const work_options *o, size_t left, int i)
{
    const size_t part = o->lanes > 0 ? o->cache_bytes / 16 / (size_t)o->lanes : 0;
    const size_t of_lane = part < LANE_CACHE ? part : LANE_CACHE, all = o->cache_bytes - (size_t)o->lanes * of_lane;
    if (i >= o->workers)
        return of_lane > 0 ? of_lane : 1;
    if (i == o->workers - 1)
        return left > (size_t)o->lanes * of_lane ? left - (size_t)o->lanes * of_lane : 1;
    return all / 2 / (size_t)o->workers + (i < 60 ? (all / 2) >> (i + 1) : 0);
}

work *work_start(store *s, const work_options *options, server_log *log, char *message, size_t size)
{
    work *w = make_work(s, options, log);
    bool made = w && w->workers && w->processes && w->feed && w->ends;
    size_t left = made ? w->options.cache_bytes : 0;
    for (int i = 0; made && i < w->n; i++) {
        const size_t share = cache_share(&w->options, left, i);
        left -= share < left ? share : left;
        made = process_make(&w->processes[i], options->program, share, w->options.solve_bytes, log) &&
               w->workers[i].wake >= 0;
    }
    if (!made) {
        snprintf(message, size, "no memory or no descriptors for the workers");
        work_free(w);
        return NULL;
    }
    housekeeping_report(w); /* nobody finds it without a name, nor knows whose place it takes */
    if (!recover(w, message, size)) {
        work_free(w);
        return NULL;
    }
    store_listen(s, tell_change, w);
    /* Signals are for the thread that waits for them; those that a fault raises in its own thread stay open. */
    static const int FAULTS[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP};
    sigset_t blocked, before;
    sigfillset(&blocked);
    for (size_t i = 0; i < sizeof FAULTS / sizeof FAULTS[0]; i++)
        sigdelset(&blocked, FAULTS[i]);
    pthread_sigmask(SIG_SETMASK, &blocked, &before);
    bool ok = pthread_create(&w->keeper, NULL, keep_loop, w) == 0;
    w->keeper_started = ok;
    ok = ok && pthread_create(&w->housekeeper, NULL, housekeeping_loop, w) == 0;
    w->housekeeper_started = ok;
    pthread_mutex_lock(&w->lock);
    for (int i = 0; ok && i < w->n; i++) {
        ok = pthread_create(&w->workers[i].thread, NULL, work_loop, &w->workers[i]) == 0;
        w->n_started += ok;
        w->alive += ok;
    }
    pthread_mutex_unlock(&w->lock);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (ok)
        return w;
    snprintf(message, size, "cannot start %d worker threads", w->n);
    work_free(w);
    return NULL;
}

/* ---- stopping */

void work_stop(work *w, double drain_s)
{
    double until = clock_seconds(CLOCK_MONOTONIC) + (drain_s > 0.0 ? drain_s : 0.0);
    pthread_mutex_lock(&w->lock);
    bool first = !w->stopping;
    w->drain_until = first || until < w->drain_until ? until : w->drain_until;
    w->stopping = true;
    pthread_cond_broadcast(&w->wake);
    pthread_cond_broadcast(&w->crowd);
    pthread_cond_broadcast(&w->probed);
    pthread_cond_broadcast(&w->idle);
    pthread_mutex_unlock(&w->lock);
    feed_wake_all(w->feed);
    pthread_mutex_lock(&w->lock);
    while (first && w->alive > 0 &&
           clock_seconds(CLOCK_MONOTONIC) < w->drain_until) /* another call may bring that time nearer */
        clock_wait(&w->idle, &w->lock, w->drain_until);
    while (!first && !w->stopped)
        pthread_cond_wait(&w->idle, &w->lock);
    pthread_mutex_unlock(&w->lock);
    if (!first)
        return;
    for (int i = 0; i < w->n; i++)
        stop_job(&w->workers[i], &w->interrupt);
    for (int i = 0; i < w->n_started; i++)
        pthread_join(w->workers[i].thread, NULL);
    pthread_mutex_lock(&w->lock);
    w->finished = true; /* only now: leases are kept until the last job has ended */
    pthread_cond_broadcast(&w->tick);
    pthread_mutex_unlock(&w->lock);
    if (w->keeper_started)
        pthread_join(w->keeper, NULL);
    if (w->housekeeper_started)
        pthread_join(w->housekeeper, NULL);
    pthread_mutex_lock(&w->lock);
    w->stopped = true;
    pthread_cond_broadcast(&w->idle);
    pthread_mutex_unlock(&w->lock);
}

void work_free(work *w)
{
    if (!w)
        return;
    if (w->feed)
        work_stop(w, 0.0);
    store_listen(w->store, NULL, NULL);
    for (int i = 0; w->workers && i < w->n; i++) {
        if (w->workers[i].wake >= 0)
            close(w->workers[i].wake);
        pthread_mutex_destroy(&w->workers[i].lock);
    }
    for (int i = 0; w->processes && i < w->n; i++)
        process_free(&w->processes[i]);
    free(w->workers);
    free(w->processes);
    feed_free(w->feed);
    ends_free(w->ends);
    pace_free(w->pace);
    pthread_cond_destroy(&w->pool_idle);
    pthread_mutex_destroy(&w->pool_lock);
    pthread_cond_destroy(&w->tick);
    pthread_cond_destroy(&w->idle);
    pthread_cond_destroy(&w->wake);
    pthread_cond_destroy(&w->crowd);
    pthread_cond_destroy(&w->probed);
    pthread_mutex_destroy(&w->lock);
    pthread_mutex_destroy(&w->claim_lock);
    free(w);
}

/* ---- what the rest of the server asks */

bool work_cancel(work *w, const char *id)
{
    pthread_mutex_lock(&w->claim_lock);
    worker *found = find_worker(w, id);
    if (found) {
        stop_job(found, &found->cancel);
        pthread_mutex_unlock(&found->lock);
    }
    pthread_mutex_unlock(&w->claim_lock);
    return found != NULL;
}

/* Names of the cases stand at the begin of the outbox while the job runs; the daemon has not read its text. */
void work_case_name(const process *p, int64_t i, char name[CASE_NAME])
{
    const ssize_t got = pread(p->outbox.fd, name, CASE_NAME, i * CASE_NAME);
    name[got == CASE_NAME ? CASE_NAME - 1 : 0] = '\0';
}

bool work_grid(work *w, const char *id, job_grid *out)
{
    worker *found = find_worker(w, id);
    *out = (job_grid){.number = 0};
    if (!found)
        return false;
    if (found->process)
        *out = live_job_grid(&found->process->board->live, clock_seconds(CLOCK_MONOTONIC));
    pthread_mutex_unlock(&found->lock);
    return out->number > 0;
}

bool work_live(work *w, const char *id, int *progress, const char *case_name, int64_t after, work_history *out)
{
    bool ok = true;
    worker *found = find_worker(w, id);
    if (out)
        *out = (work_history){.rows = NULL};
    if (!found)
        return false;
    const process *p = found->process;
    if (p)
        found->progress = live_progress(&p->board->live, found->progress);
    if (progress)
        *progress = found->progress;
    if (out) {
        const live_state now = p ? live_read(&p->board->live) : (live_state){.read = 0};
        if (now.current >= 0 && now.current < found->n_cases)
            work_case_name(p, now.current, out->case_name);
        out->is_case = case_name && !now.read;
        char name[CASE_NAME];
        for (int64_t i = 0; case_name && i < found->n_cases && !out->is_case; i++) {
            work_case_name(p, i, name);
            out->is_case = strcmp(name, case_name) == 0;
        }
        if (p && (!case_name || strcmp(case_name, out->case_name) == 0))
            ok = live_rows(&p->board->live, after, &out->rows, &out->count);
    }
    pthread_mutex_unlock(&found->lock);
    return ok;
}

feed *work_feed(work *w)
{
    return w->feed;
}

const work_options *work_settings(const work *w)
{
    return &w->options;
}

/* A worker without a job is asked; who has one solves, and its time is limited. One caller at a time. */
bool work_solves(work *w)
{
    const double until = clock_seconds(CLOCK_MONOTONIC) + PROBE_S;
    pthread_mutex_lock(&w->lock);
    if (w->probe != PROBE_RUNS) /* an earlier one that nobody waited for any more */
        w->probe = PROBE_ASKED;
    pthread_cond_broadcast(&w->wake);
    while (!w->stopping && (w->probe == PROBE_RUNS || (w->probe == PROBE_ASKED && w->busy < w->options.workers)) &&
           clock_wait(&w->probed, &w->lock, until))
        ;
    const bool good = w->probe == PROBE_GOOD || (w->probe == PROBE_ASKED && w->busy == w->options.workers);
    w->probe = w->probe == PROBE_RUNS ? PROBE_RUNS : PROBE_NONE;
    pthread_mutex_unlock(&w->lock);
    return good;
}

int work_threads(const work *w, int jobs)
{
    const int each = w->processors / (jobs > 1 ? jobs : 1), most = w->options.threads;
    return most > 0 && most < each ? most : each;
}

int work_busy(work *w)
{
    pthread_mutex_lock(&w->lock);
    const int busy = w->busy;
    pthread_mutex_unlock(&w->lock);
    return busy;
}
