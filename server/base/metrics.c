/* metrics.c: what is counted, and the text of it. */
#include "base/metrics.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Upper ends of the buckets, seconds: 1, 2.5, 5 in each decade from 0.1 ms to 100 s, and infinity. */
static const double BOUNDS[] = {1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 2.5e-2, 5e-2, 0.1,
                                0.25, 0.5,    1,    2.5,  5,      10,   25,   50,     100};
enum { N_BOUNDS = sizeof BOUNDS / sizeof BOUNDS[0], MAX_ROUTES = 64, MAX_CODES = 64, MAX_ENDS = 64 };

typedef struct {
    uint64_t buckets[N_BOUNDS + 1]; /* not cumulative */
    double sum;
} histogram;

typedef struct {
    const char *method, *route; /* NULL route: what has none */
    histogram seconds;
} route_latency;

typedef struct {
    const char *status, *outcome;
    uint64_t count;
} job_end;

struct metrics {
    pthread_mutex_t lock; /* everything below */
    histogram histograms[METRIC_HISTOGRAMS];
    uint64_t counters[METRIC_COUNTERS];
    route_latency routes[MAX_ROUTES];
    size_t n_routes;
    struct {
        int code;
        uint64_t count;
    } codes[MAX_CODES];
    size_t n_codes;
    job_end ends[MAX_ENDS];
    size_t n_ends;
    double started; /* Unix seconds */
};

metrics *metrics_new(void)
{
    metrics *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    pthread_mutex_init(&m->lock, NULL);
    m->started = (double)time(NULL);
    return m;
}

void metrics_free(metrics *m)
{
    if (!m)
        return;
    pthread_mutex_destroy(&m->lock);
    free(m);
}

static void observe(histogram *h, double seconds)
{
    size_t i = 0;
    double x = seconds > 0.0 ? seconds : 0.0; /* NaN too */
    while (i < N_BOUNDS && x > BOUNDS[i])
        i++;
    h->buckets[i]++;
    h->sum += x;
}

void metrics_seconds(metrics *m, metric_histogram which, double seconds)
{
    if (!m)
        return;
    pthread_mutex_lock(&m->lock);
    observe(&m->histograms[which], seconds);
    pthread_mutex_unlock(&m->lock);
}

void metrics_add(metrics *m, metric_counter which, int64_t n)
{
    if (!m || n <= 0)
        return;
    pthread_mutex_lock(&m->lock);
    m->counters[which] += (uint64_t)n;
    pthread_mutex_unlock(&m->lock);
}

void metrics_job(metrics *m, const char *status, const char *outcome, int64_t n)
{
    if (!m || n <= 0)
        return;
    size_t i = 0;
    outcome = outcome ? outcome : "none";
    pthread_mutex_lock(&m->lock);
    while (i < m->n_ends && (strcmp(m->ends[i].status, status) != 0 || strcmp(m->ends[i].outcome, outcome) != 0))
        i++;
    if (i == m->n_ends && i < MAX_ENDS)
        m->ends[m->n_ends++] = (job_end){status, outcome, 0};
    if (i < MAX_ENDS)
        m->ends[i].count += (uint64_t)n;
    pthread_mutex_unlock(&m->lock);
}

void metrics_request(metrics *m, const char *method, const char *route, int status, double seconds)
{
    if (!m)
        return;
    size_t i = 0, code = 0;
    method = route ? method : "any"; /* what has no route may have any method: a client's own words are no label */
    route = route ? route : "none";
    pthread_mutex_lock(&m->lock);
    while (code < m->n_codes && m->codes[code].code != status)
        code++;
    if (code == m->n_codes && code < MAX_CODES)
        m->codes[m->n_codes++].code = status;
    if (code < MAX_CODES)
        m->codes[code].count++;
    while (i < m->n_routes && (strcmp(m->routes[i].route, route) != 0 || strcmp(m->routes[i].method, method) != 0))
        i++;
    if (i == m->n_routes && i < MAX_ROUTES)
        m->routes[m->n_routes++] = (route_latency){.method = method, .route = route};
    if (i < MAX_ROUTES)
        observe(&m->routes[i].seconds, seconds);
    pthread_mutex_unlock(&m->lock);
}

/* -------------------------------------------------------------------- text */

static void write_head(FILE *out, const char *name, const char *type, const char *help)
{
    fprintf(out, "# HELP uzawad_%s %s\n# TYPE uzawad_%s %s\n", name, help, name, type);
}

/* labels: "" or `phase="queue",` */
static void write_histogram(FILE *out, const char *name, const char *labels, const histogram *h)
{
    uint64_t sum = 0;
    size_t len = strlen(labels);
    for (size_t i = 0; i < N_BOUNDS; i++) {
        sum += h->buckets[i];
        fprintf(out, "uzawad_%s_bucket{%sle=\"%g\"} %" PRIu64 "\n", name, labels, BOUNDS[i], sum);
    }
    sum += h->buckets[N_BOUNDS];
    fprintf(out, "uzawad_%s_bucket{%sle=\"+Inf\"} %" PRIu64 "\n", name, labels, sum);
    const char *open = len ? "{" : "", *close = len ? "}" : "";
    int shown = len ? (int)len - 1 : 0; /* without the comma */
    fprintf(out, "uzawad_%s_sum%s%.*s%s %.9g\n", name, open, shown, labels, close, h->sum);
    fprintf(out, "uzawad_%s_count%s%.*s%s %" PRIu64 "\n", name, open, shown, labels, close, sum);
}

/* All that was counted. */
static void write_counted(const metrics *m, FILE *out)
{
    static const struct {
        const char *name, *help;
    } ROWS[METRIC_COUNTERS] = {
        [METRIC_ITERATIONS] = {"iterations_total", "Iterations of all solves."},
        [METRIC_CACHE_HITS] = {"cache_hits_total", "Jobs that found their factor in the cache."},
        [METRIC_CACHE_MISSES] = {"cache_misses_total", "Jobs that had to factor, or to go on without a factor."},
        [METRIC_SUBMITTED] = {"jobs_submitted_total", "Jobs that were stored."},
        [METRIC_CHANGES] = {"store_changes_total", "Changes of the store; several may share a commit."},
        [METRIC_REQUEUED] = {"jobs_requeued_total", "Jobs put back to be run again."},
        [METRIC_LANE] = {"lane_jobs_total", "Jobs that a lane for small ones took, past large ones."},
        [METRIC_LANE_RETURNED] = {"lane_jobs_returned_total",
                                  "Jobs in a lane that were larger than they seemed, and were put back."},
        [METRIC_BODY_HELD] = {"claims_body_held_total", "Jobs claimed whose body this daemon had."},
        [METRIC_BODY_NEW] = {"claims_body_new_total", "Jobs claimed whose body no daemon had."},
        [METRIC_BODY_OTHERS] = {"claims_body_others_total", "Jobs claimed whose body only other daemons had."},
        [METRIC_DELETED] = {"jobs_deleted_total", "Ended jobs that were deleted for their age, number or size."},
        [METRIC_OBJECT_WRITTEN] = {"object_written_bytes_total", "Bytes put into the object store."},
        [METRIC_OBJECT_READ] = {"object_read_bytes_total", "Bytes got from the object store."},
        [METRIC_OBJECT_FAILED] = {"object_failures_total", "Requests to the object store that failed after all tries."},
        [METRIC_OBJECT_GONE] = {"objects_removed_total", "Objects that belonged to nothing any more and were removed."},
        [METRIC_UPLOADS] = {"uploads_total", "Uploads that were stored, or sent again."},
        [METRIC_WEBHOOK_TOLD] = {"webhooks_told_total", "Ends of jobs that webhooks were told."},
        [METRIC_WEBHOOK_FAILED] = {"webhook_failures_total", "Attempts to tell a webhook that failed."},
        [METRIC_RATE_LIMITED] = {"http_rate_limited_total", "Requests answered 429."},
        [METRIC_UNAUTHORIZED] = {"http_unauthorized_total", "Requests answered 401 or 403 for their token."},
    };
    static const char *const PHASES[METRIC_HISTOGRAMS] = {
        [METRIC_QUEUE] = "queue",     [METRIC_PARSE] = "parse",     [METRIC_ASSEMBLE] = "assemble",
        [METRIC_ORDER] = "order",     [METRIC_FACTOR] = "factor",   [METRIC_CONDENSE] = "condense",
        [METRIC_ITERATE] = "iterate", [METRIC_CERTIFY] = "certify", [METRIC_TOTAL] = "total"};
    char labels[160];
    for (size_t i = 0; i < METRIC_COUNTERS; i++) {
        write_head(out, ROWS[i].name, "counter", ROWS[i].help);
        fprintf(out, "uzawad_%s %" PRIu64 "\n", ROWS[i].name, m->counters[i]);
    }
    write_head(out, "jobs_ended_total", "counter", "Jobs that ended, by status and outcome.");
    for (size_t i = 0; i < m->n_ends; i++)
        fprintf(out, "uzawad_jobs_ended_total{status=\"%s\",outcome=\"%s\"} %" PRIu64 "\n", m->ends[i].status,
                m->ends[i].outcome, m->ends[i].count);
    write_head(out, "http_requests_total", "counter", "Requests by status code; 0: no reply was sent.");
    for (size_t i = 0; i < m->n_codes; i++)
        fprintf(out, "uzawad_http_requests_total{code=\"%d\"} %" PRIu64 "\n", m->codes[i].code, m->codes[i].count);
    write_head(out, "store_commit_seconds", "histogram", "Time of a commit, which is on disk after it.");
    write_histogram(out, "store_commit_seconds", "", &m->histograms[METRIC_COMMIT]);
    write_head(out, "object_request_seconds", "histogram", "Time of a request to the object store, each try.");
    write_histogram(out, "object_request_seconds", "", &m->histograms[METRIC_OBJECT]);
    write_head(out, "job_phase_seconds", "histogram", "Time of a job's phases; total is from its submission.");
    for (size_t i = METRIC_QUEUE; i < METRIC_HISTOGRAMS; i++) {
        snprintf(labels, sizeof labels, "phase=\"%s\",", PHASES[i]);
        write_histogram(out, "job_phase_seconds", labels, &m->histograms[i]);
    }
    write_head(out, "http_request_seconds", "histogram", "Time from a request's first line to the end of its reply.");
    for (size_t i = 0; i < m->n_routes; i++) {
        snprintf(labels, sizeof labels, "method=\"%s\",route=\"%s\",", m->routes[i].method, m->routes[i].route);
        write_histogram(out, "http_request_seconds", labels, &m->routes[i].seconds);
    }
}

static void write_gauge(FILE *out, const char *name, const char *help, double value)
{
    write_head(out, name, "gauge", help);
    fprintf(out, "uzawad_%s %.15g\n", name, value);
}

static void write_now(const metrics *m, const metrics_now *now, FILE *out)
{
    write_head(out, "build_info", "gauge", "1; the version is in the label.");
    fprintf(out, "uzawad_build_info{version=\"%s\",compiler=\"%s\"} 1\n", now->version, __VERSION__);
    write_gauge(out, "start_time_seconds", "When the process began to count, Unix time.", m->started);
    write_head(out, "jobs", "gauge", "Jobs in the store by status.");
    for (size_t i = 0; i < 5 && now->jobs[i] >= 0; i++)
        fprintf(out, "uzawad_jobs{status=\"%s\"} %" PRId64 "\n", now->job_names[i], now->jobs[i]);
    if (now->jobs[0] >= 0) {
        write_gauge(out, "queue_depth", "Jobs that wait for a worker.", (double)now->jobs[0]);
        write_gauge(out, "queue_clients", "Owners of tokens, or addresses, whose jobs wait: who takes turns.",
                    (double)now->clients);
    }
    write_gauge(out, "workers", "Solver threads.", now->workers);
    write_gauge(out, "workers_busy", "Solver threads that run a job.", now->workers_busy);
    write_gauge(out, "cache_bytes", "Bytes that cached factors take.", (double)now->cache_bytes);
    write_gauge(out, "cache_max_bytes", "Bytes that cached factors may take.", (double)now->cache_max_bytes);
    write_gauge(out, "cache_entries", "Cached factors.", (double)now->cache_entries);
    if (now->nodes >= 0)
        write_gauge(out, "nodes", "Daemons that share the store and live.", (double)now->nodes);
    write_gauge(out, "draining", "1: this daemon was told to claim no jobs.", now->draining);
    if (now->store_free_bytes >= 0)
        write_gauge(out, "store_free_bytes", "Bytes that are free on the disk of the database.",
                    (double)now->store_free_bytes);
    write_gauge(out, "http_connections", "Open connections.", now->connections);
    write_gauge(out, "http_event_streams", "Open connections that are event streams.", now->streams);
    write_gauge(out, "http_body_bytes", "Bytes of request bodies in memory.", (double)now->body_bytes);
}

char *metrics_text(metrics *m, const metrics_now *now, size_t *len)
{
    char *text = NULL;
    long pages = 0, resident = 0;
    struct timespec cpu;
    metrics *copy = malloc(sizeof *copy); /* nobody waits while the text is made */
    *len = 0;
    FILE *out = copy ? open_memstream(&text, len) : NULL;
    if (!out) {
        free(copy);
        return NULL;
    }
    pthread_mutex_lock(&m->lock);
    memcpy(copy, m, sizeof *copy);
    pthread_mutex_unlock(&m->lock);
    write_now(copy, now, out);
    write_counted(copy, out);
    free(copy);

    /* The names that Prometheus's client libraries use for a process. Source: Prometheus documentation, "Writing client
     * libraries", process metrics. */
    FILE *file = fopen("/proc/self/statm", "re");
    if (file) {
        if (fscanf(file, "%ld %ld", &pages, &resident) == 2)
            fprintf(out,
                    "# HELP process_resident_memory_bytes Resident memory.\n"
                    "# TYPE process_resident_memory_bytes gauge\nprocess_resident_memory_bytes %.15g\n",
                    (double)resident * (double)sysconf(_SC_PAGESIZE));
        fclose(file);
    }
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu) == 0)
        fprintf(out,
                "# HELP process_cpu_seconds_total Processor time.\n# TYPE process_cpu_seconds_total counter\n"
                "process_cpu_seconds_total %.9g\n",
                (double)cpu.tv_sec + 1e-9 * (double)cpu.tv_nsec);

    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) {
        free(text);
        return NULL;
    }
    return text;
}
