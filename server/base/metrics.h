/* metrics.h: what the daemon counts about itself, in the text format of Prometheus.
 * Source: Prometheus documentation, "Exposition formats", text format 0.0.4.
 *
 * One mutex inside, taken last and for a few instructions. A NULL metrics takes everything and keeps nothing, so that
 * no caller has to ask. Counters begin at 0 with the process. */
#ifndef SERVER_METRICS_H
#define SERVER_METRICS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct metrics metrics;
metrics *metrics_new(void); /* NULL: no memory */
void metrics_free(metrics *m);

/* Histograms of seconds. */
typedef enum {
    METRIC_COMMIT, /* of the store: a transaction's COMMIT */
    METRIC_OBJECT, /* a request to the object store, each try */
    METRIC_QUEUE,  /* of a job, and so on to TOTAL */
    METRIC_PARSE,
    METRIC_ASSEMBLE,
    METRIC_ORDER,
    METRIC_FACTOR,
    METRIC_CONDENSE,
    METRIC_ITERATE,
    METRIC_CERTIFY,
    METRIC_TOTAL,
    METRIC_HISTOGRAMS
} metric_histogram;
void metrics_seconds(metrics *m, metric_histogram which, double seconds);

/* Plain counters. */
typedef enum {
    METRIC_ITERATIONS,
    METRIC_CACHE_HITS, /* jobs that found their factor */
    METRIC_CACHE_MISSES,
    METRIC_SUBMITTED,      /* jobs stored; repeated ones are not */
    METRIC_CHANGES,        /* of the store; several may share a commit */
    METRIC_REQUEUED,       /* jobs put back, by the end of a drain or after the end of a process */
    METRIC_LANE,           /* jobs that a lane took */
    METRIC_LANE_RETURNED,  /* those of them that were larger than they seemed, and put back */
    METRIC_BODY_HELD,      /* jobs claimed whose body this daemon had, of several that share a store */
    METRIC_BODY_NEW,       /* nobody */
    METRIC_BODY_OTHERS,    /* others, which had no time for them */
    METRIC_DELETED,        /* ended jobs that were kept long enough */
    METRIC_OBJECT_WRITTEN, /* bytes put into the object store */
    METRIC_OBJECT_READ,    /* bytes got from there */
    METRIC_OBJECT_FAILED,  /* requests to it that failed, after all tries */
    METRIC_OBJECT_GONE,    /* objects that were nobody's any more and were removed */
    METRIC_UPLOADS,        /* uploads stored, or sent again */
    METRIC_WEBHOOK_TOLD,   /* ends of jobs that were told */
    METRIC_WEBHOOK_FAILED, /* attempts to tell that failed */
    METRIC_RATE_LIMITED,   /* requests answered 429 */
    METRIC_UNAUTHORIZED,   /* requests answered 401 or 403 */
    METRIC_COUNTERS
} metric_counter;
void metrics_add(metrics *m, metric_counter which, int64_t n);

/* n jobs ended. Both must be string constants; outcome NULL: none. */
void metrics_job(metrics *m, const char *status, const char *outcome, int64_t n);
/* A request was answered: route and method are string constants; NULL: no route. */
void metrics_request(metrics *m, const char *method, const char *route, int status, double seconds);

/* What is only known when somebody asks. */
typedef struct {
    int64_t jobs[5]; /* by job_status; -1: the store did not answer */
    int64_t clients; /* that have jobs which wait */
    int64_t nodes;   /* that share the store, and live; -1: it did not answer */
    bool draining;   /* this one claims nothing */
    const char *job_names[5];
    int workers, workers_busy;
    size_t cache_bytes, cache_max_bytes, cache_entries, body_bytes;
    unsigned connections, streams; /* streams: connections that are event streams */
    int64_t store_free_bytes;      /* < 0: not known */
    const char *version;
} metrics_now;
/* The whole text, malloc'ed, *len bytes; NULL: no memory. */
char *metrics_text(metrics *m, const metrics_now *now, size_t *len);

#endif
