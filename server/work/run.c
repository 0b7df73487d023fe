/* run.c: one job from its claim to its stored result. */
#include "work/internal.h"
#include "work/solve.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define FINISH_ATTEMPTS 5

/* What becomes of the job. */
typedef enum {
    END_FINISH,  /* outcome is stored */
    END_RELEASE, /* the service stops: somebody runs it later, from the start */
    END_DROP     /* another owner has it */
} run_end;

typedef struct {
    worker *me;
    job *job;
    double began, queue_s; /* began on CLOCK_MONOTONIC */
    solution solution;
} run;

/* ---- what the solver asks and tells */

static bool is_cancelled(void *ctx)
{
    worker *me = ctx;
    return atomic_load_explicit(&me->cancel, memory_order_relaxed) ||
           atomic_load_explicit(&me->lost, memory_order_relaxed) ||
           atomic_load_explicit(&me->w->interrupt, memory_order_relaxed);
}

/* Progress is told so often; what ends a job is told at once. */
#define TELL_S 0.25

/* To all who follow this job; to those who follow all jobs only where the percentage is another one. By a clock that
 * costs nothing: there may be a million iterations a second. */
static void tell_progress(worker *me)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC_COARSE, &t);
    double now = (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
    if (now - me->told_at < TELL_S)
        return;
    me->told_at = now;
    pthread_mutex_lock(&me->lock);
    int progress = live_progress(&me->live);
    pthread_mutex_unlock(&me->lock);
    if (progress != me->told)
        feed_changed(me->w->feed, me->id); /* only this thread changes its id */
    else
        feed_moved(me->w->feed, me->id);
    me->told = progress;
}

static void note_progress(void *ctx, const uz_history_row *row)
{
    worker *me = ctx;
    pthread_mutex_lock(&me->lock);
    live_add(&me->live, row);
    pthread_mutex_unlock(&me->lock);
    tell_progress(me);
}

static void note_case(void *ctx, int64_t load_case)
{
    worker *me = ctx;
    pthread_mutex_lock(&me->lock);
    live_case(&me->live, load_case);
    pthread_mutex_unlock(&me->lock);
    tell_progress(me);
}

static void note_grid(void *ctx, double from, double to)
{
    worker *me = ctx;
    pthread_mutex_lock(&me->lock);
    live_part(&me->live, from, to);
    pthread_mutex_unlock(&me->lock);
    tell_progress(me);
}

/* The text was read. */
static void note_request(void *ctx, const codec_request *request)
{
    worker *me = ctx;
    pthread_mutex_lock(&me->lock);
    live_begin(&me->live, &request->settings, &request->problem);
    pthread_mutex_unlock(&me->lock);
}

/* ---- store */

static void log_store_failure(const run *r, log_level level, const char *event)
{
    char cause[256];
    store_message(r->me->w->store, cause, sizeof cause);
    log_write(r->me->w->log, level, event, (log_field[]){LOG_S("job", r->job->id), LOG_S("cause", cause), {0}});
}

static bool is_settled(store_status status)
{
    return status == STORE_OK || status == STORE_CONFLICT || status == STORE_NOT_FOUND;
}

/* Tries to store the outcome for as long as there is hope, or until the service must end. Room may come back, and so
 * may a file that another program holds: that is worth a while, unless nobody wants the result any more. */
static store_status try_to_store(const run *r, bool for_ever)
{
    work *w = r->me->w;
    double begun = clock_seconds(CLOCK_MONOTONIC);
    for (int attempt = 0;; attempt++) {
        store_status status = store_finish(w->store, &r->me->lease, &r->solution.outcome);
        if (is_settled(status))
            return status;
        if (attempt < FINISH_ATTEMPTS)
            log_store_failure(r, LOG_WARN, "store_failed");
        bool may_pass = (status == STORE_FULL || status == STORE_LOCKED) && !atomic_load(&r->me->cancel) &&
                        clock_seconds(CLOCK_MONOTONIC) - begun < w->options.room_wait_s;
        if (atomic_load(&w->interrupt) || !(for_ever || may_pass || attempt + 1 < FINISH_ATTEMPTS))
            return status;
        /* Longer each time, 0.05 s to 3.2 s, but not at all once the service must end. */
        double seconds = 0.05 * (double)(1 << (2 * (attempt < 3 ? attempt : 3)));
        for (double waited = 0.0; waited < seconds && !atomic_load(&w->interrupt); waited += 0.05)
            nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
    }
}

/* No job stays running for want of room: without a restart nobody would take it up. Where the service must end first,
 * the next start runs the job again. */
static bool store_outcome_of(run *r)
{
    work *w = r->me->w;
    store_status status = try_to_store(r, false);
    if (!is_settled(status) && !atomic_load(&w->interrupt)) {
        /* The result cannot be kept: the job ends without it, which takes hardly any room, and says why. */
        static const char TITLE[] = "The result could not be stored";
        problem_details problem;
        if (status == STORE_FULL)
            problem_fill(&problem, 507, "storage_full", TITLE, "%s",
                         "The disk had no room for the result: delete ended jobs or free disk space, then submit the "
                         "job again.");
        else
            problem_fill(&problem, 500, "result_not_stored", TITLE, "%s",
                         "The store failed, and the service's log has the cause: submit the job again.");
        log_store_failure(r, LOG_ERROR, "result_given_up");
        solution_fail(&r->solution, codec_encode_problem(&problem));
        if (atomic_load(&r->me->cancel))
            r->solution.outcome = (store_outcome){.status = JOB_DISMISSED};
        status = try_to_store(r, true);
    }
    if (status == STORE_OK)
        return true;
    if (is_settled(status))
        log_write(w->log, LOG_WARN, "result_not_wanted", (log_field[]){LOG_S("job", r->job->id), {0}});
    else
        log_store_failure(r, LOG_ERROR, "result_lost");
    return false;
}

static void count_job(const run *r)
{
    metrics *m = r->me->w->options.metrics;
    const solve_figures *f = &r->solution.figures;
    const bool kept = f->has_answer && r->solution.outcome.status != JOB_FAILED;
    const char *outcome = kept ? uz_outcome_name(f->outcome) : NULL;
    const double total = clock_seconds(CLOCK_MONOTONIC) - r->began + r->queue_s;
    metrics_job(m, job_status_name(r->solution.outcome.status), outcome, 1);
    metrics_seconds(m, METRIC_QUEUE, r->queue_s);
    metrics_seconds(m, METRIC_PARSE, f->parse);
    metrics_seconds(m, METRIC_TOTAL, total);
    if (f->has_answer) {
        metrics_add(m, f->cached ? METRIC_CACHE_HITS : METRIC_CACHE_MISSES, 1);
        metrics_add(m, METRIC_ITERATIONS, f->iterations);
        metrics_seconds(m, METRIC_ASSEMBLE, f->assemble);
        metrics_seconds(m, METRIC_ORDER, f->order);
        metrics_seconds(m, METRIC_FACTOR, f->factor);
        metrics_seconds(m, METRIC_CONDENSE, f->condense);
        metrics_seconds(m, METRIC_ITERATE, f->iterate);
        metrics_seconds(m, METRIC_CERTIFY, f->certify);
    }
    log_write(r->me->w->log, LOG_INFO, "job_ended",
              (log_field[]){LOG_S("job", r->job->id),
                            LOG_S("status", job_status_name(r->solution.outcome.status)),
                            LOG_I("cases", f->cases),
                            LOG_S("outcome", outcome),
                            LOG_I("iterations", f->iterations),
                            LOG_N("queue_s", r->queue_s),
                            LOG_N("parse_s", f->parse),
                            LOG_N("total_s", total),
                            {0}});
}

static void store_end(run *r, run_end end)
{
    work *w = r->me->w;
    if (end == END_RELEASE && store_release(w->store, &r->me->lease, false) != STORE_OK)
        log_store_failure(r, LOG_ERROR, "release_failed");
    if (end != END_FINISH) {
        metrics_add(w->options.metrics, METRIC_REQUEUED, end == END_RELEASE);
        const char *event = end == END_RELEASE ? "job_released" : "job_taken_over";
        log_write(w->log, LOG_INFO, event, (log_field[]){LOG_S("job", r->job->id), {0}});
    } else if (store_outcome_of(r)) {
        count_job(r);
    }
}

void work_run(worker *me, job *claimed, char *body, size_t body_len)
{
    run r = {.me = me, .job = claimed, .began = clock_seconds(CLOCK_MONOTONIC)};
    const uz_hooks hooks = {
        .ctx = me, .cancelled = is_cancelled, .progress = note_progress, .begins = note_case, .grid = note_grid};
    me->told = -1;                                       /* of the job before */
    double waited = claimed->started - claimed->created; /* by the clock on the wall, which may be set back */
    r.queue_s = waited > 0.0 ? waited : 0.0;
    log_write(me->w->log, LOG_INFO, "job_started",
              (log_field[]){LOG_S("job", claimed->id), LOG_I("attempt", claimed->attempts), {0}});
    const solve_with with = {.source = me->w->store,
                             .cache = me->w->cache,
                             .hooks = &hooks,
                             .memory_limit = me->w->options.solve_bytes,
                             .max_solve_s = me->w->options.max_solve_s,
                             .queue_s = r.queue_s,
                             .read = note_request};
    solve_job(&r.solution, &with, claimed->id, body, body_len);
    if (r.solution.start_lost)
        log_store_failure(&r, LOG_WARN, "start_not_read");
    /* Who stopped it decides what becomes of the job. */
    const bool stopped = r.solution.stopped;
    store_end(&r, stopped && atomic_load(&me->lost)      ? END_DROP
                  : stopped && !atomic_load(&me->cancel) ? END_RELEASE
                                                         : END_FINISH);
    pthread_mutex_lock(&me->lock);
    me->live.problem = NULL; /* it goes now */
    pthread_mutex_unlock(&me->lock);
    solution_clear(&r.solution);
    job_clear(claimed);
}
