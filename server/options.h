/* options.h: the daemon's command line. */
#ifndef SERVER_OPTIONS_H
#define SERVER_OPTIONS_H

#include "log.h"

#include <stddef.h>
#include <stdio.h>

#define UZAWAD_VERSION "0.1.0"

typedef struct {
    const char *listen, *db; /* point into argv or to constants */
    int workers, max_attempts;
    unsigned max_connections;
    size_t max_body, cache;          /* bytes */
    size_t memory;                   /* of one solve, bytes */
    size_t max_upload, uploads;      /* bytes of one upload, and of all */
    double upload_days;              /* one that no job uses is kept so long */
    double keep_days;                /* ended jobs; 0: no limit */
    long keep_jobs, max_queue;       /* 0: no limit */
    size_t keep_bytes;               /* 0: no limit */
    const char *webhook_secret_file; /* NULL: none */
    const char **webhook_allow;      /* n_webhook_allow, as cors */
    size_t n_webhook_allow;
    const char **cors; /* n_cors origins; allocated, the texts are argv's */
    size_t n_cors;
    double drain_s, request_deadline_s;
    log_level level;
} server_options;

typedef enum {
    OPTIONS_RUN,
    OPTIONS_HELP,
    OPTIONS_VERSION,
    OPTIONS_WRONG /* the reason is in message */
} options_verdict;

/* Reads argv; *out has the defaults for what is not given. */
options_verdict options_parse(server_options *out, int argc, char **argv, char *message, size_t size);
/* Frees what options_parse allocated, whatever it returned. */
void options_clear(server_options *options);
void options_usage(FILE *to);

#endif
