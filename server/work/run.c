/* run.c: one job from its claim to its stored result. */
#include "work/internal.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define FINISH_ATTEMPTS 5
#define MAX_VECTORS     8

/* What becomes of the job. */
typedef enum {
    END_FINISH,  /* outcome is stored */
    END_RELEASE, /* the service stops: somebody runs it later, from the start */
    END_DROP     /* another owner has it */
} run_end;

typedef struct {
    worker *me;
    job *job;
    double queue_s, parse_s;
    codec_request request;
    uz_result *result;
    char *summary, *error;
    double dim, *contact_nodes, *pressure, *history;
    store_vector vectors[MAX_VECTORS];
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

static void note_progress(void *ctx, const uz_history_row *row)
{
    worker *me = ctx;
    pthread_mutex_lock(&me->lock);
    live_add(&me->live, row);
    pthread_mutex_unlock(&me->lock);
}

/* ---- failures */

static const char *const NO_MEMORY_JSON = "{\"type\": \"about:blank\", \"title\": \"Out of memory\", \"status\": 500,"
                                          " \"detail\": \"There was not enough memory for the answer.\","
                                          " \"code\": \"out_of_memory\"}";

/* The text is `encoded`, which the run then owns, or a fixed one where there was no memory for it. */
static void set_failed(run *r, char *encoded)
{
    r->error = encoded;
    r->outcome = (store_outcome){.status = JOB_FAILED, .error = encoded ? encoded : NO_MEMORY_JSON};
}

static void fail_from_problem(run *r, const problem_details *problem)
{
    set_failed(r, codec_encode_problem(problem));
}

static void fail_from_error(run *r, const uz_error *err)
{
    problem_details problem = {0};
    codec_problem_from_error(&problem, err);
    fail_from_problem(r, &problem);
}

/* ---- decode */

static bool decode_body(run *r, char *body, size_t body_len)
{
    problem_details problem = {0};
    double start = work_clock();
    bool ok = codec_decode_request(&r->request, body, body_len, &problem);
    free(body);
    r->parse_s = work_clock() - start;
    if (!ok) {
        fail_from_problem(r, &problem);
        return false;
    }
    pthread_mutex_lock(&r->me->lock);
    live_begin(&r->me->live, &r->request.settings);
    pthread_mutex_unlock(&r->me->lock);
    return true;
}

/* ---- the result as the store keeps it */

static void add_vector(run *r, const char *name, const double *data, int64_t count)
{
    if (!data)
        return;
    store_vector *v = &r->vectors[r->outcome.n_vectors++];
    snprintf(v->name, sizeof v->name, "%s", name);
    v->data = data;
    v->count = count;
}

static bool add_scene_vectors(run *r)
{
    const uz_result *result = r->result;
    add_vector(r, "nodes", result->mesh.xyz, result->mesh.n_nodes * result->mesh.dim);
    if (!result->mesh.contact_node)
        return true;
    r->contact_nodes = calloc((size_t)result->m + 1, sizeof *r->contact_nodes);
    if (!r->contact_nodes)
        return false;
    for (int64_t i = 0; i < result->m; i++)
        r->contact_nodes[i] = (double)result->mesh.contact_node[i];
    add_vector(r, "contact_nodes", r->contact_nodes, result->m);
    r->pressure = calloc((size_t)result->m + 1, sizeof *r->pressure);
    for (int64_t i = 0; r->pressure && i < result->m; i++)
        r->pressure[i] = (0.0 - result->r[i]) / result->mesh.contact_area[i];
    add_vector(r, "pressure", r->pressure, result->m);
    return r->pressure != NULL;
}

static bool add_vectors(run *r)
{
    const uz_result *result = r->result;
    bool is_scene = r->request.problem.kind == UZ_PROBLEM_SCENE;
    r->dim = is_scene ? result->mesh.dim : 0;
    r->outcome.vectors = r->vectors;
    add_vector(r, "dim", &r->dim, 1);
    add_vector(r, "reactions", result->r, result->m);
    add_vector(r, "gaps", result->g, result->m);
    add_vector(r, "ray", result->ray, result->m);
    add_vector(r, "displacements", result->u, is_scene ? result->mesh.n_nodes * result->mesh.dim : result->d);
    return !is_scene || add_scene_vectors(r);
}

static bool add_history(run *r)
{
    const uz_history *history = &r->result->history;
    r->history = calloc((size_t)history->count + 1, CODEC_HISTORY_COLUMNS * sizeof *r->history);
    if (!r->history)
        return false;
    for (int64_t i = 0; i < history->count; i++)
        codec_history_row(r->history + i * CODEC_HISTORY_COLUMNS, &history->rows[i]);
    r->outcome.history = r->history;
    r->outcome.history_rows = history->count;
    r->outcome.history_columns = CODEC_HISTORY_COLUMNS;
    return true;
}

static void take_result(run *r)
{
    uz_summary *summary = &r->result->summary;
    r->outcome.status = summary->outcome == UZ_DISMISSED ? JOB_DISMISSED : JOB_SUCCESSFUL;
    summary->timings.queue = r->queue_s;
    summary->timings.parse = r->parse_s;
    summary->timings.total += r->queue_s + r->parse_s;
    r->summary = codec_encode_summary(summary, r->request.problem.kind);
    r->outcome.summary = r->summary;
    if (!r->summary || !add_vectors(r) || !add_history(r))
        set_failed(r, NULL);
}

/* ---- solve */

/* The solver was stopped before it ended of itself: by whom decides what becomes of the job. */
static run_end why_stopped(const run *r)
{
    if (atomic_load(&r->me->lost))
        return END_DROP;
    return atomic_load(&r->me->cancel) ? END_FINISH : END_RELEASE;
}

static run_end solve(run *r)
{
    uz_error err = {0};
    uz_hooks hooks = {.ctx = r->me, .cancelled = is_cancelled, .progress = note_progress};
    uz_status status = uz_solve(&r->result, &r->request.problem, &r->request.settings, r->me->w->cache, &hooks, &err);
    bool was_stopped = status == UZ_ERR_CANCELLED || (status == UZ_OK && r->result->summary.outcome == UZ_DISMISSED);
    run_end end = was_stopped ? why_stopped(r) : END_FINISH;
    if (end != END_FINISH)
        return end;
    if (status == UZ_OK)
        take_result(r);
    else if (status == UZ_ERR_CANCELLED)
        r->outcome = (store_outcome){.status = JOB_DISMISSED};
    else
        fail_from_error(r, &err);
    return END_FINISH;
}

/* ---- store */

static void log_store_failure(const run *r, log_level level, const char *event)
{
    char cause[256];
    store_message(r->me->w->store, cause, sizeof cause);
    log_write(r->me->w->log, level, event, (log_field[]){LOG_S("job", r->job->id), LOG_S("cause", cause), {0}});
}

/* Waits longer each time, 0.05 s to 3.2 s, but not at all once the service must end. */
static void wait_before_retry(const run *r, int attempt)
{
    double seconds = 0.05 * (double)(1 << (2 * attempt));
    for (double waited = 0.0; waited < seconds && !atomic_load(&r->me->w->interrupt); waited += 0.05)
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
}

/* A failure that lasts leaves the job running in the store, so that the next start runs it again. */
static bool store_outcome_of(const run *r)
{
    work *w = r->me->w;
    for (int attempt = 0; attempt < FINISH_ATTEMPTS; attempt++) {
        store_status status = store_finish(w->store, r->job->id, r->me->owner, &r->outcome);
        if (status == STORE_OK)
            return true;
        if (status == STORE_CONFLICT || status == STORE_NOT_FOUND) {
            log_write(w->log, LOG_WARN, "result_not_wanted", (log_field[]){LOG_S("job", r->job->id), {0}});
            return false;
        }
        log_store_failure(r, LOG_WARN, "store_failed");
        if (attempt + 1 < FINISH_ATTEMPTS)
            wait_before_retry(r, attempt);
    }
    log_store_failure(r, LOG_ERROR, "result_lost");
    return false;
}

static void store_end(run *r, run_end end)
{
    work *w = r->me->w;
    const uz_summary *summary = r->result ? &r->result->summary : NULL;
    if (end == END_RELEASE && store_release(w->store, r->job->id, r->me->owner) != STORE_OK)
        log_store_failure(r, LOG_ERROR, "release_failed");
    if (end != END_FINISH) {
        const char *event = end == END_RELEASE ? "job_released" : "job_taken_over";
        log_write(w->log, LOG_INFO, event, (log_field[]){LOG_S("job", r->job->id), {0}});
        return;
    }
    if (!store_outcome_of(r))
        return;
    log_write(w->log, LOG_INFO, "job_ended",
              (log_field[]){LOG_S("job", r->job->id),
                            LOG_S("status", job_status_name(r->outcome.status)),
                            LOG_S("outcome", summary ? uz_outcome_name(summary->outcome) : NULL),
                            LOG_I("iterations", summary ? summary->iterations : 0),
                            LOG_N("queue_s", r->queue_s),
                            LOG_N("parse_s", r->parse_s),
                            LOG_N("total_s", summary ? summary->timings.total : 0.0),
                            {0}});
}

void work_run(worker *me, job *claimed, char *body, size_t body_len)
{
    run r = {.me = me, .job = claimed};
    run_end end = END_FINISH;
    double waited = claimed->started - claimed->created; /* by the clock on the wall, which may be set back */
    r.queue_s = waited > 0.0 ? waited : 0.0;
    log_write(me->w->log, LOG_INFO, "job_started",
              (log_field[]){LOG_S("job", claimed->id), LOG_I("attempt", claimed->attempts), {0}});
    if (decode_body(&r, body, body_len)) {
        end = solve(&r);
        codec_request_clear(&r.request);
    }
    store_end(&r, end);
    uz_result_free(r.result);
    free(r.summary);
    free(r.error);
    free(r.contact_nodes);
    free(r.pressure);
    free(r.history);
    job_clear(claimed);
}
