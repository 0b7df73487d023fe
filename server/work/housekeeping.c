/* housekeeping.c: what has to happen without anybody asking: what waits too long fails, what is old or too much goes.
 * In a thread of its own, so that a long deletion never keeps a lease from being renewed. */
#include "work/housekeeping.h"
#include "codec/codec.h"
#include "store/uploads.h"

#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>

#define ROUND_S 0.5
#define IDLE_S  300.0 /* then the reserve goes back to the system */

#define HEAP_FREE  ((size_t)16 << 20) /* may lie free where no large body was solved */
#define HUGE_PAGE  ((size_t)2 << 20)
#define SMALL_PAGE 4096

typedef struct {
    long long jobs; /* ended, when memory was made ready last */
    double since;   /* on CLOCK_MONOTONIC */
} idle_watch;

static void expire(work *w)
{
    int64_t count = 0;
    problem_details problem = {.status = 503, .code = "queue_time_limit", .title = "The job waited too long"};
    snprintf(problem.detail, sizeof problem.detail,
             "It had not begun when its queue_limit_s was over. Submit it again, with more time or a larger priority.");
    char *error = codec_encode_problem(&problem);
    if (error && store_expire(w->store, error, &count) == STORE_OK && count > 0) {
        log_write(w->log, LOG_INFO, "queue_time_limit", (log_field[]){LOG_I("jobs", count), {0}});
        metrics_job(w->options.metrics, job_status_name(JOB_FAILED), NULL, count);
    }
    free(error);
}

static void retain(work *w, bool *told)
{
    bool held;
    store_age_time(w->store, &held);
    if (held && !*told)
        log_write(
            w->log, LOG_WARN, "clock_jumped",
            (log_field[]){LOG_S("cause", "the clock is more than a day past what was stored last, or was set forward: "
                                         "nothing is deleted for its age by it before the daemon has run for a day"),
                          {0}});
    *told = held;
    int64_t total = 0, count = 1;
    while (count > 0 && !work_is_stopping(w) && store_retain(w->store, &w->options.retention, &count) == STORE_OK)
        total += count;
    metrics_add(w->options.metrics, METRIC_DELETED, total);
    if (total > 0)
        log_write(w->log, LOG_INFO, "jobs_deleted", (log_field[]){LOG_I("jobs", total), {0}});
}

/* Memory for the next body is touched while nobody waits for it, and given back when no job has run for long. What is
 * freed stays in the heap (main): where much lies free there, all of it goes back to the system; where little and a
 * body may come, so much is touched now, in huge pages. */
static void keep_reserve(work *w, idle_watch *idle)
{
    const long long jobs = atomic_load(&w->ended);
    const double now = clock_seconds(CLOCK_MONOTONIC);
    uz_reserve *reserve = w->options.reserve;
    if (!reserve)
        return;
    const bool busy = work_busy(w) > 0, news = jobs != idle->jobs && !busy;
    if (busy || news)
        idle->since = now;
    else if (now - idle->since > IDLE_S)
        uz_reserve_empty(reserve);
    while (news && work_busy(w) == 0 && !work_is_stopping(w) && uz_reserve_fill(reserve))
        ;
    const bool large = uz_reserve_bytes(reserve) > 0; /* bodies are solved here */
    const size_t share = w->options.cache_bytes / 8, least = large && news ? share : 0;
    const struct mallinfo2 heap = mallinfo2();
    const bool known = heap.uordblks > 0; /* else it is another allocator, which tells nothing */
    void *block = NULL;
    if (known && heap.fordblks > HEAP_FREE + (large ? 4 * share : 0))
        malloc_trim(0);
    else if (known && heap.fordblks < least / 2 && posix_memalign(&block, HUGE_PAGE, least) == 0) {
        madvise(block, least, MADV_HUGEPAGE);
        for (size_t at = 0; at < least; at += SMALL_PAGE)
            ((volatile char *)block)[at] = 0;
        free(block);
    }
    if (news)
        idle->jobs = jobs;
}

void *housekeeping_loop(void *arg)
{
    work *w = arg;
    bool told = false;
    idle_watch idle = {.since = clock_seconds(CLOCK_MONOTONIC)};
    pthread_mutex_lock(&w->lock);
    while (!w->finished) {
        if (clock_wait(&w->tick, &w->lock, clock_seconds(CLOCK_MONOTONIC) + ROUND_S))
            continue;
        pthread_mutex_unlock(&w->lock);
        keep_reserve(w, &idle);
        expire(w);
        retain(w, &told);
        store_collect_uploads(w->store, NULL); /* also those of jobs that have just gone */
        pthread_mutex_lock(&w->lock);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}
