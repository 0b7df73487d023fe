/* run.c: one job from its claim to its stored result. */
#include "codec/quantity.h"
#include "work/internal.h"
#include "work/parcel.h"
#include "work/solver_process.h"
#include "work/watch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>

#define FINISH_ATTEMPTS 5

/* What becomes of the job. */
typedef enum {
    END_FINISH,  /* outcome is stored */
    END_RELEASE, /* the service stops: somebody runs it later, from the start */
    END_RETRY,   /* its process died: somebody runs it later, and the attempt counts */
    END_DROP     /* another owner has it */
} run_end;

typedef struct {
    worker *me;
    job *job;
    double began, queue_s; /* began on CLOCK_MONOTONIC */
    store_outcome outcome; /* points into what follows */
    parcel parcel;
    char *error;
    double *rows; /* of the history of one whose process was ended */
    solve_figures figures;
} run;

/* ---- store */

static void log_store_failure(const run *r, log_level level, const char *event)
{
    char cause[256];
    store_message(r->me->w->store, cause, sizeof cause);
    log_write(r->me->w->log, level, event, (log_field[]){LOG_S("job", r->job->id), LOG_S("cause", cause), {0}});
}

/* With what else the outcome has. Without memory for the error the job fails without one. */
static void fail(run *r, const problem_details *problem)
{
    free(r->error);
    r->error = codec_encode_problem(problem);
    r->outcome.status = JOB_FAILED;
    r->outcome.error = r->error;
}

static bool is_settled(store_status status)
{
    return status == STORE_OK || status == STORE_CONFLICT || status == STORE_NOT_FOUND;
}

/* Tries to store the outcome for as long as there is hope, or until the service must end. Room may come back, and so
 * may a file that another program holds: that is worth a while, unless nobody wants the result any more. A database
 * that is away comes back, and until then nobody else has the job either. */
static store_status try_to_store(const run *r, bool for_ever)
{
    work *w = r->me->w;
    double begun = clock_seconds(CLOCK_MONOTONIC), finished;
    for (int attempt = 0;; attempt++) {
        store_status status = store_finish(w->store, &r->me->lease, &r->outcome, &finished);
        if (status == STORE_OK)
            ends_keep(w->ends, r->job, &r->outcome, finished);
        if (is_settled(status))
            return status;
        if (attempt < FINISH_ATTEMPTS)
            log_store_failure(r, LOG_WARN, "store_failed");
        bool may_pass =
            status == STORE_AWAY || ((status == STORE_FULL || status == STORE_LOCKED) && !atomic_load(&r->me->cancel) &&
                                     clock_seconds(CLOCK_MONOTONIC) - begun < w->options.room_wait_s);
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
        r->outcome = (store_outcome){.error = NULL};
        fail(r, &problem);
        if (atomic_load(&r->me->cancel))
            r->outcome = (store_outcome){.status = JOB_DISMISSED};
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
    const solve_figures *f = &r->figures;
    const bool kept = f->has_answer && r->outcome.status != JOB_FAILED;
    const char *outcome = kept ? uz_choice_name(UZ_CHOICE_OUTCOME, f->outcome) : NULL;
    const double total = clock_seconds(CLOCK_MONOTONIC) - r->began + r->queue_s;
    metrics_job(m, job_status_name(r->outcome.status), outcome, 1);
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
        if (f->op != UZ_OPERATOR_AUTO)
            pace_add(r->me->w->pace, f->op, f->said_s, f->took_s);
    }
    log_write(r->me->w->log, LOG_INFO, "job_ended",
              (log_field[]){LOG_S("job", r->job->id),
                            LOG_S("status", job_status_name(r->outcome.status)),
                            LOG_I("cases", f->cases),
                            LOG_S("outcome", outcome),
                            LOG_I("iterations", f->iterations),
                            LOG_N("queue_s", r->queue_s),
                            LOG_N("parse_s", f->parse),
                            LOG_N("total_s", total),
                            {0}});
}

/* ---- what came of it */

enum { BOUND = 9 }; /* its column of a history's row */

/* What a process had told when it was ended is the job's: the rows of its history, and in words where the last one
 * stands. Rows of a load case have no place in the store: its answer would stand before them. */
static void keep_told(run *r, char *words, size_t size)
{
    const worker *me = r->me;
    const live *told = &me->process->board->live;
    const live_state now = live_read(told);
    char name[CASE_NAME] = "", bound[64] = "";
    int64_t count = 0;
    words[0] = '\0';
    if (!now.any || !live_rows(told, -1, &r->rows, &count) || count == 0)
        return;
    if (me->n_cases > 0 && now.current >= 0 && now.current < me->n_cases)
        work_case_name(me->process, now.current, name);
    if (isfinite(now.latest[BOUND]))
        snprintf(bound, sizeof bound, ", with an error of at most %.2g in the energy norm", now.latest[BOUND]);
    snprintf(words, size, " It had come to iteration %.0f%s%s%s.", now.latest[0], name[0] ? " of case " : "", name,
             bound);
    if (me->n_cases > 0)
        return;
    r->outcome.whole.history = r->rows;
    r->outcome.whole.history_rows = count;
    r->outcome.whole.history_columns = CODEC_HISTORY_COLUMNS;
}

/* The process has died, of itself or because the system ended it. */
static run_end judge_death(run *r, const watch_report *seen, const char *told)
{
    problem_details problem;
    char how[64];
    if (WIFSIGNALED(seen->status))
        snprintf(how, sizeof how, "signal %d", WTERMSIG(seen->status));
    else if (WEXITSTATUS(seen->status) == SOLVER_GROUP_LOST)
        snprintf(how, sizeof how, "the loss of its group of processes");
    else
        snprintf(how, sizeof how, "status %d", WEXITSTATUS(seen->status));
    log_write(r->me->w->log, LOG_WARN, "process_died",
              (log_field[]){LOG_S("job", r->job->id),
                            LOG_I("attempt", r->job->attempts),
                            LOG_S("cause", seen->out_of_memory ? "out of memory" : how),
                            {0}});
    if (seen->out_of_memory)
        problem_fill(&problem, 503, "memory_limit", "Out of memory",
                     "The process that solved this job ended for want of memory: take a coarser mesh, or a service "
                     "with more.%s",
                     told);
    else if (r->job->attempts >= r->me->w->options.max_attempts)
        problem_fill(&problem, 500, "process_died", "The process that solved this job died",
                     "It was run %d times, and each time the process ended before it had an answer, the last time "
                     "with %s. Please report the request.%s",
                     r->job->attempts, how, told);
    else
        return END_RETRY;
    fail(r, &problem);
    return END_FINISH;
}

static run_end judge_end(run *r, watch_end end, const watch_report *seen)
{
    worker *me = r->me;
    problem_details problem;
    char told[256];
    const bool cancelled = atomic_load(&me->cancel), lost = atomic_load(&me->lost);
    if (end == WATCH_DONE || (end == WATCH_KEPT && !lost && !cancelled)) {
        segment *outbox = &me->process->outbox;
        const uint64_t at = seen->done.u.done.at, size = seen->done.u.done.size;
        r->figures = seen->done.u.done.figures;
        if (seen->done.u.done.stopped && (lost || !cancelled))
            return lost ? END_DROP : END_RELEASE;
        if (at % 8 == 0 && at < PTRDIFF_MAX && size < PTRDIFF_MAX && segment_reach(outbox, at + size, false) &&
            parcel_read(&r->parcel, outbox->at + at, (size_t)size)) {
            r->outcome = r->parcel.outcome;
            return END_FINISH;
        }
        end = WATCH_NO_ROOM;
    }
    if (lost)
        return END_DROP;
    r->outcome = (store_outcome){.status = JOB_DISMISSED};
    keep_told(r, told, sizeof told);
    if (cancelled)
        return END_FINISH;
    if (end == WATCH_STOPPED || atomic_load(&me->w->interrupt))
        return END_RELEASE;
    if (end == WATCH_DIED)
        return judge_death(r, seen, told);
    if (end == WATCH_NOT_STARTED && r->job->attempts < me->w->options.max_attempts)
        return END_RETRY; /* twice in a row it was killed before it had read the job */
    if (end == WATCH_OVERDUE)
        problem_fill(
            &problem, 422, "time_limit", "The time was over before there was an answer",
            "After %g s, which time_limit_s or the service's --max-solve-s allow, %s. Allow more time, or take "
            "a coarser mesh.%s",
            seen->time_limit_s,
            seen->began ? "the best answer so far could not be certified in time"
                        : "the body was still being factored: there is no answer and no bound yet",
            told);
    else if (end == WATCH_NOT_STARTED)
        problem_fill(&problem, 503, "process_not_started", "No process could be started for the job", "%s",
                     "The service's log has the cause. Submit the job again later.");
    else
        problem_fill(&problem, 503, "memory_limit", "Out of memory", "%s",
                     "There was not enough memory for the request or its answer. Submit the job again later.");
    fail(r, &problem);
    return END_FINISH;
}

/* The process of which others read how far the job is; NULL: none. */
static void set_process(worker *me, process *p)
{
    pthread_mutex_lock(&me->lock);
    me->process = p;
    pthread_mutex_unlock(&me->lock);
}

void work_run(worker *me, job *claimed, char *body, size_t body_len)
{
    static const char *const EVENTS[] = {
        [END_RELEASE] = "job_released", [END_RETRY] = "job_retried", [END_DROP] = "job_taken_over"};
    work *w = me->w;
    run r = {.me = me, .job = claimed, .began = clock_seconds(CLOCK_MONOTONIC)};
    watch_report seen;
    double waited = claimed->started - claimed->created; /* by the clock on the wall, which may be set back */
    r.queue_s = waited > 0.0 ? waited : 0.0;
    log_write(w->log, LOG_INFO, "job_started",
              (log_field[]){LOG_S("job", claimed->id), LOG_I("attempt", claimed->attempts), {0}});
    uint64_t key = me->lease.held_body;
    process *p = work_take_process(w, me->lane, body, body_len, &key);
    set_process(me, p);
    const watch_end end = watch_job(me, claimed, body, body_len, r.queue_s, &seen);
    if (end == WATCH_DONE && seen.done.u.done.start_lost)
        log_store_failure(&r, LOG_WARN, "start_not_read");
    if (end == WATCH_DONE)
        work_answered(w, p, key);
    const run_end what = judge_end(&r, end, &seen);
    if ((what == END_RELEASE || what == END_RETRY) &&
        store_release(w->store, &me->lease, what == END_RETRY) != STORE_OK)
        log_store_failure(&r, LOG_ERROR, "release_failed");
    if (what != END_FINISH) {
        metrics_add(w->options.metrics, METRIC_REQUEUED, what != END_DROP);
        metrics_add(w->options.metrics, METRIC_LANE_RETURNED,
                    what == END_RELEASE && me->lane && !atomic_load(&w->interrupt));
        log_write(w->log, LOG_INFO, EVENTS[what], (log_field[]){LOG_S("job", claimed->id), {0}});
    } else if (store_outcome_of(&r)) {
        count_job(&r);
    }
    set_process(me, NULL);
    parcel_clear(&r.parcel);
    free(r.error);
    free(r.rows);
    job_clear(claimed);
    work_give_process(w, p, end == WATCH_DONE ? &seen.done : NULL, key);
}

/* ---- does anybody solve */

/* Two springs of stiffness 2 and 1 pulled by 2; the first is stopped at 0.5 and pushes back with 2 - 2 * 0.5 = 1. */
static const char PROBE[] =
    "{\"problem\": {\"kind\": \"matrices\", \"K\": \"%%MatrixMarket matrix coordinate real symmetric\\n"
    "2 2 2\\n1 1 2\\n2 2 1\\n\", \"N\": \"%%MatrixMarket matrix coordinate real general\\n1 2 1\\n1 1 1\\n\","
    " \"h\": [0.5], \"p\": [2, 2]}}";

bool work_probe(worker *me)
{
    const job probe = {.attempts = 1};
    run r = {.me = me};
    watch_report seen;
    uint64_t key = 0;
    double force = 0.0;
    char *body = strdup(PROBE);
    if (!body)
        return false;
    atomic_store(&me->cancel, false); /* what was wanted of the job before; nobody knows of this one */
    atomic_store(&me->lost, false);
    process *p = work_take_process(me->w, me->lane, NULL, 0, &key);
    set_process(me, p);
    const watch_end end = watch_job(me, &probe, body, sizeof PROBE - 1, 0.0, &seen);
    const bool done = end == WATCH_DONE && judge_end(&r, end, &seen) == END_FINISH && r.outcome.whole.summary;
    json_tree summary = {.root = NULL};
    const bool good = done && codec_summary_read(&summary, r.outcome.whole.summary) &&
                      strcmp(codec_summary_text(summary.root, "outcome"), "converged") == 0 &&
                      quantity_read(&force, summary.root, "contact.reaction_sum") && fabs(force + 1.0) < 1e-6;
    json_clear(&summary);
    set_process(me, NULL);
    parcel_clear(&r.parcel);
    work_give_process(me->w, p, end == WATCH_DONE ? &seen.done : NULL, 0);
    return good;
}
