/* housekeeping.c: what has to happen without anybody asking: what waits too long fails, what is old or too much goes.
 * In a thread of its own, so that a long deletion never keeps a lease from being renewed. */
#include "work/housekeeping.h"
#include "codec/codec.h"
#include "store/nodes.h"
#include "store/uploads.h"

#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define ROUND_S   0.5
#define REPORT_S  2.0
#define HEAP_FREE ((size_t)16 << 20) /* may lie free */

/* What the jobs are told that have waited too long. */
static const problem_details WAITED = {
    .status = 503,
    .code = "queue_time_limit",
    .title = "The job waited too long",
    .detail =
        "It had not begun when its queue_limit_s was over. Submit it again, with more time or a larger priority."};

void housekeeping_report(work *w)
{
    store_node now = {.pid = (int)getpid(), .workers = w->options.workers, .busy = work_busy(w)};
    size_t entries, bytes;
    bool draining;
    work_cached(w, &entries, &bytes);
    now.factors = (int64_t)entries;
    now.bytes = (int64_t)bytes;
    now.max_bytes = (int64_t)w->options.cache_bytes;
    gethostname(now.host, sizeof now.host - 1);
    snprintf(now.name, sizeof now.name, "%s", w->options.node ? w->options.node : "");
    snprintf(now.version, sizeof now.version, "%s", w->options.version ? w->options.version : "");
    if (store_report(w->store, &now, &draining) != STORE_OK || draining == atomic_load(&w->draining))
        return;
    atomic_store(&w->draining, draining);
    log_write(w->log, LOG_INFO, draining ? "draining" : "drained_no_more", (log_field[]){{0}});
}

bool work_draining(work *w)
{
    return atomic_load(&w->draining);
}

void *housekeeping_loop(void *arg)
{
    work *w = arg;
    bool told = false; /* that the clock is not believed */
    double next_report = 0.0;
    pthread_mutex_lock(&w->lock);
    while (!w->finished) {
        if (clock_wait(&w->tick, &w->lock, clock_seconds(CLOCK_MONOTONIC) + ROUND_S))
            continue;
        pthread_mutex_unlock(&w->lock);
        /* What is freed stays in the heap (memory_keep_heap): where much lies free there, it goes back to the system.
         */
        const struct mallinfo2 heap = mallinfo2(); /* of another allocator all zero */
        if (heap.fordblks > HEAP_FREE)
            malloc_trim(0);
        work_rest_processes(w);
        if (clock_seconds(CLOCK_MONOTONIC) >= next_report) {
            housekeeping_report(w);
            next_report = clock_seconds(CLOCK_MONOTONIC) + REPORT_S;
        }
        int64_t expired = 0, total = 0, count = 1;
        bool held;
        char *error = codec_encode_problem(&WAITED);
        if (error && store_expire(w->store, error, &expired) == STORE_OK && expired > 0) {
            log_write(w->log, LOG_INFO, "queue_time_limit", (log_field[]){LOG_I("jobs", expired), {0}});
            metrics_job(w->options.metrics, job_status_name(JOB_FAILED), NULL, expired);
        }
        free(error);
        store_age_time(w->store, &held);
        if (held && !told)
            log_write(w->log, LOG_WARN, "clock_jumped",
                      (log_field[]){LOG_S("cause",
                                          "the clock is more than a day past what was stored last, or was set forward: "
                                          "nothing is deleted for its age by it before the daemon has run for a day"),
                                    {0}});
        told = held;
        while (count > 0 && !work_is_stopping(w) && store_retain(w->store, &w->options.retention, &count) == STORE_OK)
            total += count;
        metrics_add(w->options.metrics, METRIC_DELETED, total);
        if (total > 0)
            log_write(w->log, LOG_INFO, "jobs_deleted", (log_field[]){LOG_I("jobs", total), {0}});
        store_collect_uploads(w->store, NULL); /* also those of jobs that have just gone */
        store_collect_objects(w->store, &count);
        metrics_add(w->options.metrics, METRIC_OBJECT_GONE, count);
        store_tidy(w->store);
        pthread_mutex_lock(&w->lock);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}
