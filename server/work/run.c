/* run.c: one job from its claim to its stored result. */
#include "work/answers.h"
#include "work/internal.h"
#include "work/starts.h"

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
    double began, queue_s, parse_s; /* began on CLOCK_MONOTONIC */
    codec_request request;
    starts starts;
    uz_result **results; /* n of them */
    int64_t n;
    answers answers;
    char *error;
    store_outcome outcome;
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

/* ---- failures */

static const char *const NO_MEMORY_JSON = "{\"type\": \"about:blank\", \"title\": \"Out of memory\", \"status\": 500,"
                                          " \"detail\": \"There was not enough memory for the answer.\","
                                          " \"code\": \"out_of_memory\"}";

/* The text is `encoded`, which the run then owns, or a fixed one where there was no memory for it. */
static void set_failed(run *r, char *encoded)
{
    free(r->error);
    r->error = encoded;
    r->outcome = (store_outcome){.status = JOB_FAILED, .error = encoded ? encoded : NO_MEMORY_JSON};
}

static void log_store_failure(const run *r, log_level level, const char *event)
{
    char cause[256];
    store_message(r->me->w->store, cause, sizeof cause);
    log_write(r->me->w->log, level, event, (log_field[]){LOG_S("job", r->job->id), LOG_S("cause", cause), {0}});
}

/* ---- decode */

static bool decode_body(run *r, char *body, size_t body_len)
{
    problem_details problem = {0};
    double start = clock_seconds(CLOCK_MONOTONIC);
    bool ok = body && codec_decode(&r->request, CODEC_STORED, body, body_len, r->me->w->store, &problem);
    if (!body)
        codec_problem_damaged(&problem, r->job->id);
    free(body);
    r->parse_s = clock_seconds(CLOCK_MONOTONIC) - start;
    if (!ok) {
        set_failed(r, codec_encode_problem(&problem));
        return false;
    }
    pthread_mutex_lock(&r->me->lock);
    live_begin(&r->me->live, &r->request.settings, &r->request.problem);
    pthread_mutex_unlock(&r->me->lock);
    return true;
}

static bool any_dismissed(const run *r)
{
    for (int64_t i = 0; r->results && i < r->n; i++)
        if (r->results[i]->summary.outcome == UZ_DISMISSED)
            return true;
    return false;
}

/* ---- solve */

/* What the library can't know: who may do something about it, and how. */
static void add_remedy(uz_error *err, const char *remedy)
{
    size_t used = strlen(err->message);
    snprintf(err->message + used, sizeof err->message - used, "%s", remedy);
}

static uz_status verify(run *r, const uz_hooks *hooks, uz_error *err)
{
    const codec_answer *given = &r->request.answer;
    r->n = 1;
    r->results = calloc(1, sizeof(uz_result *));
    if (!r->results)
        return err->status = UZ_ERR_MEMORY;
    uz_status status = uz_verify(&r->results[0], &r->request.problem, given->u, given->r, &r->request.settings,
                                 r->me->w->cache, hooks, err);
    if (strcmp(err->where, "u") == 0)
        strcpy(err->where, "/answer/displacements");
    else if (strcmp(err->where, "r") == 0)
        strcpy(err->where, "/answer/reactions");
    /* A free body may have an answer, and one that this service itself found. */
    const uz_problem *problem = &r->request.problem;
    bool touches = problem->kind == UZ_PROBLEM_SCENE ? problem->scene.n_contacts > 0 : problem->qp.N.rows > 0;
    if (touches && (err->status == UZ_ERR_FREE_BODY || err->status == UZ_ERR_NOT_SPD))
        add_remedy(err, ". An answer is verified only where the supports alone hold the body; one that the obstacle "
                        "holds can be solved here: its summary has a certificate");
    return status;
}

static uz_status solve_cases(run *r, const uz_hooks *hooks, uz_error *err)
{
    const uz_problem *problem = &r->request.problem;
    /* A store that fails now may work when the result is kept: the run begins at zero, and says so. */
    if (starts_load(&r->starts, r->me->w->store, &r->request) != STORE_OK)
        log_store_failure(r, LOG_WARN, "start_not_read");
    r->n = problem->n_cases > 0 ? problem->n_cases : 1;
    uz_status status = uz_solve_cases(&r->results, problem, &r->request.settings,
                                      (const uz_state *const *)r->starts.states, r->me->w->cache, hooks, err);
    if (strstr(err->where, "start")) /* the library's name for what the request calls warm_start */
        strcpy(err->where, "/solver/warm_start");
    return status;
}

static run_end solve(run *r)
{
    worker *me = r->me;
    uz_error err = {0};
    const uz_hooks hooks = {
        .ctx = me, .cancelled = is_cancelled, .progress = note_progress, .begins = note_case, .grid = note_grid};
    double most = me->w->options.max_solve_s;
    if (most > 0.0 && r->request.settings.time_limit_s > most)
        r->request.settings.time_limit_s = most;
    r->request.settings.memory_limit = me->w->options.solve_bytes;
    uz_status status = r->request.answer.u ? verify(r, &hooks, &err) : solve_cases(r, &hooks, &err);
    if (status == UZ_ERR_LIMIT)
        add_remedy(&err, " (the limit is the daemon's option --memory)");
    bool was_stopped = status == UZ_ERR_CANCELLED || (status == UZ_OK && any_dismissed(r));
    /* By whom decides what becomes of the job. */
    if (was_stopped && atomic_load(&me->lost))
        return END_DROP;
    if (was_stopped && !atomic_load(&me->cancel))
        return END_RELEASE;
    if (status == UZ_OK) {
        r->outcome.status = any_dismissed(r) ? JOB_DISMISSED : JOB_SUCCESSFUL;
        if (!answers_build(&r->answers, &r->outcome, r->results, &r->request, &r->starts, r->queue_s, r->parse_s))
            set_failed(r, NULL);
    } else if (status == UZ_ERR_CANCELLED) {
        r->outcome = (store_outcome){.status = JOB_DISMISSED};
    } else {
        problem_details problem = {0};
        codec_problem_from_error(&problem, &err, r->request.problem.kind);
        set_failed(r, codec_encode_problem(&problem));
    }
    return END_FINISH;
}

/* ---- store */

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
        store_status status = store_finish(w->store, &r->me->lease, &r->outcome);
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
        set_failed(r, codec_encode_problem(&problem));
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

static int64_t count_iterations(const run *r)
{
    int64_t sum = 0;
    for (int64_t i = 0; r->results && i < r->n; i++)
        sum += r->results[i] ? r->results[i]->summary.iterations : 0;
    return sum;
}

/* Phases and cache: of the first case, which paid for the body; iterating and certifying of all. */
static void count_job(const run *r, const char *outcome)
{
    metrics *m = r->me->w->options.metrics;
    double iterate = 0.0, certify = 0.0;
    metrics_job(m, job_status_name(r->outcome.status), outcome, 1);
    metrics_seconds(m, METRIC_QUEUE, r->queue_s);
    metrics_seconds(m, METRIC_PARSE, r->parse_s);
    metrics_seconds(m, METRIC_TOTAL, clock_seconds(CLOCK_MONOTONIC) - r->began + r->queue_s);
    if (!r->results || !r->results[0])
        return;
    const uz_summary *first = &r->results[0]->summary;
    for (int64_t i = 0; i < r->n && r->results[i]; i++) {
        iterate += r->results[i]->summary.timings.iterate;
        certify += r->results[i]->summary.timings.certify;
    }
    metrics_add(m, first->reused.factor ? METRIC_CACHE_HITS : METRIC_CACHE_MISSES, 1);
    metrics_add(m, METRIC_ITERATIONS, count_iterations(r));
    metrics_seconds(m, METRIC_ASSEMBLE, first->timings.assemble);
    metrics_seconds(m, METRIC_ORDER, first->timings.order);
    metrics_seconds(m, METRIC_FACTOR, first->timings.factor);
    metrics_seconds(m, METRIC_CONDENSE, first->timings.condense);
    metrics_seconds(m, METRIC_ITERATE, iterate);
    metrics_seconds(m, METRIC_CERTIFY, certify);
}

static void store_end(run *r, run_end end)
{
    work *w = r->me->w;
    const uz_summary *first = r->results && r->results[0] ? &r->results[0]->summary : NULL;
    if (end == END_RELEASE && store_release(w->store, &r->me->lease) != STORE_OK)
        log_store_failure(r, LOG_ERROR, "release_failed");
    if (end != END_FINISH) {
        metrics_add(w->options.metrics, METRIC_REQUEUED, end == END_RELEASE);
        const char *event = end == END_RELEASE ? "job_released" : "job_taken_over";
        log_write(w->log, LOG_INFO, event, (log_field[]){LOG_S("job", r->job->id), {0}});
        return;
    }
    if (!store_outcome_of(r))
        return;
    if (r->outcome.status == JOB_FAILED)
        first = NULL; /* no answer was kept */
    count_job(r, first ? uz_outcome_name(first->outcome) : NULL);
    log_write(w->log, LOG_INFO, "job_ended",
              (log_field[]){LOG_S("job", r->job->id),
                            LOG_S("status", job_status_name(r->outcome.status)),
                            LOG_I("cases", r->n),
                            LOG_S("outcome", first ? uz_outcome_name(first->outcome) : NULL),
                            LOG_I("iterations", count_iterations(r)),
                            LOG_N("queue_s", r->queue_s),
                            LOG_N("parse_s", r->parse_s),
                            LOG_N("total_s", clock_seconds(CLOCK_MONOTONIC) - r->began + r->queue_s),
                            {0}});
}

void work_run(worker *me, job *claimed, char *body, size_t body_len)
{
    run r = {.me = me, .job = claimed, .began = clock_seconds(CLOCK_MONOTONIC)};
    run_end end = END_FINISH;
    me->told = -1;                                       /* of the job before */
    double waited = claimed->started - claimed->created; /* by the clock on the wall, which may be set back */
    r.queue_s = waited > 0.0 ? waited : 0.0;
    log_write(me->w->log, LOG_INFO, "job_started",
              (log_field[]){LOG_S("job", claimed->id), LOG_I("attempt", claimed->attempts), {0}});
    if (decode_body(&r, body, body_len))
        end = solve(&r);
    store_end(&r, end);
    pthread_mutex_lock(&me->lock);
    me->live.problem = NULL; /* it goes now */
    pthread_mutex_unlock(&me->lock);
    codec_request_clear(&r.request);
    uz_results_free(r.results, r.n);
    starts_clear(&r.starts);
    answers_clear(&r.answers);
    free(r.error);
    job_clear(claimed);
}
