/* log.h: one JSON object a line on a stream, whole lines even from many threads. */
#ifndef SERVER_LOG_H
#define SERVER_LOG_H

#include <pthread.h>
#include <stdio.h>

typedef enum { LOG_DEBUG, LOG_INFO, LOG_WARN, LOG_ERROR } log_level;
typedef struct {
    pthread_mutex_t lock; /* the stream; PTHREAD_MUTEX_INITIALIZER */
    FILE *stream;
    log_level least;
} server_log;

/* A named value of a log line. */
typedef struct {
    const char *key;
    enum { LOG_STRING, LOG_INTEGER, LOG_NUMBER } kind;
    const char *string;
    long long integer;
    double number;
} log_field;
#define LOG_S(k, v) ((log_field){.key = (k), .kind = LOG_STRING, .string = (v)})
#define LOG_I(k, v) ((log_field){.key = (k), .kind = LOG_INTEGER, .integer = (long long)(v)})
#define LOG_N(k, v) ((log_field){.key = (k), .kind = LOG_NUMBER, .number = (v)})

/* Writes {"time": "...Z", "level": ..., "event": EVENT, KEY: VALUE, ...}. Fields end with one whose key is NULL:
 * log_write(log, LOG_INFO, "job_finished", (log_field[]){LOG_S("job", id), {0}});
 * A NULL log, a failing stream and a lack of memory are silent: a log is never a reason to stop. Bytes that are not
 * UTF-8 become U+FFFD; NaN, infinities and NULL strings become null. Numbers assume the C locale. */
void log_write(server_log *log, log_level level, const char *event, const log_field *fields);

#endif
