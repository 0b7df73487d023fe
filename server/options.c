#include "options.h"

#include "memory.h"

#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    LISTEN = 1000,
    DB,
    WORKERS,
    MAX_BODY,
    CACHE,
    MAX_ATTEMPTS,
    DRAIN,
    CONNECTIONS,
    LEVEL,
    DEADLINE,
    MEMORY,
    CORS,
    WEBHOOK_ALLOW,
    WEBHOOK_SECRET,
    KEEP_DAYS,
    KEEP_JOBS,
    KEEP_BYTES,
    MAX_QUEUE,
    MAX_UPLOAD,
    UPLOADS,
    UPLOAD_DAYS,
    VERSION,
    HELP
};

static const struct option LONG_OPTIONS[] = {
    {"listen", required_argument, NULL, LISTEN},
    {"db", required_argument, NULL, DB},
    {"workers", required_argument, NULL, WORKERS},
    {"max-body", required_argument, NULL, MAX_BODY},
    {"cache", required_argument, NULL, CACHE},
    {"memory", required_argument, NULL, MEMORY},
    {"max-attempts", required_argument, NULL, MAX_ATTEMPTS},
    {"drain-s", required_argument, NULL, DRAIN},
    {"max-connections", required_argument, NULL, CONNECTIONS},
    {"log-level", required_argument, NULL, LEVEL},
    {"request-deadline-s", required_argument, NULL, DEADLINE},
    {"max-upload", required_argument, NULL, MAX_UPLOAD},
    {"uploads", required_argument, NULL, UPLOADS},
    {"upload-days", required_argument, NULL, UPLOAD_DAYS},
    {"keep-days", required_argument, NULL, KEEP_DAYS},
    {"keep-jobs", required_argument, NULL, KEEP_JOBS},
    {"keep-bytes", required_argument, NULL, KEEP_BYTES},
    {"max-queue", required_argument, NULL, MAX_QUEUE},
    {"webhook-allow", required_argument, NULL, WEBHOOK_ALLOW},
    {"webhook-secret-file", required_argument, NULL, WEBHOOK_SECRET},
    {"cors", required_argument, NULL, CORS},
    {"version", no_argument, NULL, VERSION},
    {"help", no_argument, NULL, HELP},
    {NULL, 0, NULL, 0},
};

void options_usage(FILE *to)
{
    fputs(
        "usage: uzawad [OPTION]...\n"
        "Solves frictionless contact problems for whoever asks by HTTP.\n"
        "\n"
        "  --listen HOST:PORT      where to listen; [::1]:0 works too, port 0 takes a free one (127.0.0.1:8080)\n"
        "  --db FILE               jobs and results are kept here (./contact.db)\n"
        "  --workers N             problems solved at once (as many as there are processors)\n"
        "  --cache BYTES           memory for factors that are kept (1G)\n"
        "  --memory BYTES          memory that one problem may take (80 % of what the machine or its control group\n"
        "                          has, less the cache, divided by the workers)\n"
        "  --max-body BYTES        largest request body (64M)\n"
        "  --max-upload BYTES      largest upload, after decompression (1G)\n"
        "  --uploads BYTES         all uploads together, in the folder FILE-uploads; those that no job uses make\n"
        "                          room (10G)\n"
        "  --upload-days D         an upload that no job uses is deleted so long after it was last used (30)\n"
        "  --max-connections N     connections open at once (256)\n"
        "  --max-queue N           jobs that may wait; one more is answered 503 (no limit)\n"
        "  --keep-days D, --keep-jobs N, --keep-bytes BYTES\n"
        "                          ended jobs that are older, more, or larger together than that are deleted, the\n"
        "                          oldest first (no limit)\n"
        "  --webhook-allow HOST[:PORT]\n"
        "                          jobs may ask to have their end told there; may be given several times (none)\n"
        "  --webhook-secret-file FILE\n"
        "                          what is told is signed with these bytes\n"
        "  --cors ORIGIN           pages of this origin (https://host[:port], or * for all) may use the service from "
        "a\n"
        "                          browser; may be given several times (none)\n"
        "  --request-deadline-s S  time for a request to arrive, plus 1 s per 100 kB of its body (30)\n"
        "  --max-attempts N        runs of a job whose run ends with the process before it is failed (3)\n"
        "  --drain-s S             time for running jobs to end after SIGTERM (30)\n"
        "  --log-level LEVEL       debug, info, warn or error (info)\n"
        "  --version, --help\n"
        "\n"
        "BYTES takes the suffixes K, M and G. When it is ready it prints one line, \"listening on URL\"; the log goes\n"
        "to standard error, one JSON object a line. SIGTERM and SIGINT end it after a drain, a second one at once:\n"
        "jobs that were running are run again at the next start.\n"
        "\n"
        "exit status: 0 ended by a signal, 1 could not start or failed, 2 wrong usage\n",
        to);
}

static bool parse_integer(const char *text, long least, long most, long *out)
{
    char *end;
    errno = 0;
    long value = strtol(text, &end, 10);
    if (errno || end == text || *end || value < least || value > most)
        return false;
    *out = value;
    return true;
}

static bool parse_seconds(const char *text, double least, double *out)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !isfinite(value) || value < least || value > 1e6)
        return false;
    *out = value;
    return true;
}

/* "64M": a number of bytes, at least 1. */
static bool parse_bytes(const char *text, size_t *out)
{
    static const char SUFFIXES[] = "KMG";
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10);
    if (errno || end == text || text[0] == '-' || value == 0)
        return false;
    const char *suffix = *end ? strchr(SUFFIXES, *end) : NULL;
    int shift = suffix ? 10 * (int)(suffix - SUFFIXES + 1) : 0;
    if ((*end && !suffix) || (suffix && end[1]) || value > (SIZE_MAX >> 2) >> shift)
        return false;
    *out = (size_t)value << shift;
    return true;
}

static bool parse_level(const char *text, log_level *out)
{
    static const char *const NAMES[] = {"debug", "info", "warn", "error"};
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; i++)
        if (strcmp(text, NAMES[i]) == 0) {
            *out = (log_level)i;
            return true;
        }
    return false;
}

static bool set_integer(int *out, long least, long most, const char *text)
{
    long value;
    if (!parse_integer(text, least, most, &value))
        return false;
    *out = (int)value;
    return true;
}

static bool set_connections(unsigned *out, const char *text)
{
    int value;
    if (!set_integer(&value, 1, 100000, text))
        return false;
    *out = (unsigned)value;
    return true;
}

static bool add_text(const char ***list, size_t *n, const char *text)
{
    const char **grown = realloc(*list, (*n + 1) * sizeof *grown);
    if (!grown)
        return false;
    *list = grown;
    grown[(*n)++] = text;
    return true;
}

/* "https://host[:port]" as a browser sends it, or "*". */
static bool add_origin(server_options *out, const char *text)
{
    const char *host = strstr(text, "://");
    bool fits = host && (strncmp(text, "http://", 7) == 0 || strncmp(text, "https://", 8) == 0);
    if (strcmp(text, "*") != 0 && (!fits || !host[3] || strchr(host + 3, '/')))
        return false;
    return add_text(&out->cors, &out->n_cors, text);
}

void options_clear(server_options *options)
{
    free(options->cors);
    free(options->webhook_allow);
    options->cors = options->webhook_allow = NULL;
    options->n_cors = options->n_webhook_allow = 0;
}

static bool set_option(server_options *out, int option, const char *text)
{
    switch (option) {
    case LISTEN:
        out->listen = text;
        return text[0] != '\0';
    case DB:
        out->db = text;
        return text[0] != '\0';
    case WORKERS:
        return set_integer(&out->workers, 1, 1024, text);
    case MAX_BODY:
        return parse_bytes(text, &out->max_body);
    case CACHE:
        return parse_bytes(text, &out->cache);
    case MEMORY:
        return parse_bytes(text, &out->memory);
    case MAX_ATTEMPTS:
        return set_integer(&out->max_attempts, 1, 1000, text);
    case DRAIN:
        return parse_seconds(text, 0, &out->drain_s);
    case KEEP_DAYS:
        return parse_seconds(text, 0, &out->keep_days);
    case KEEP_JOBS:
        return parse_integer(text, 0, LONG_MAX, &out->keep_jobs);
    case KEEP_BYTES:
        return parse_bytes(text, &out->keep_bytes);
    case MAX_QUEUE:
        return parse_integer(text, 0, LONG_MAX, &out->max_queue);
    case WEBHOOK_ALLOW:
        return text[0] && !strchr(text, '/') && add_text(&out->webhook_allow, &out->n_webhook_allow, text);
    case WEBHOOK_SECRET:
        out->webhook_secret_file = text;
        return text[0] != '\0';
    case CORS:
        return add_origin(out, text);
    case MAX_UPLOAD:
        return parse_bytes(text, &out->max_upload);
    case UPLOADS:
        return parse_bytes(text, &out->uploads);
    case UPLOAD_DAYS:
        return parse_seconds(text, 0, &out->upload_days);
    case CONNECTIONS:
        return set_connections(&out->max_connections, text);
    case LEVEL:
        return parse_level(text, &out->level);
    case DEADLINE:
        return parse_seconds(text, 0.1, &out->request_deadline_s);
    default:
        return false;
    }
}

static server_options defaults(void)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return (server_options){.listen = "127.0.0.1:8080",
                            .db = "./contact.db",
                            .workers = cores < 1      ? 1
                                       : cores > 1024 ? 1024
                                                      : (int)cores,
                            .max_attempts = 3,
                            .max_connections = 256,
                            .max_body = (size_t)64 << 20,
                            .cache = (size_t)1 << 30,
                            .max_upload = (size_t)1 << 30,
                            .uploads = (size_t)10 << 30,
                            .upload_days = 30,
                            .drain_s = 30,
                            .request_deadline_s = 30,
                            .level = LOG_INFO};
}

options_verdict options_parse(server_options *out, int argc, char **argv, char *message, size_t size)
{
    int option, index = 0;
    *out = defaults();
    opterr = 0;
    optind = 0; /* glibc: start again, also after an earlier call */
    while ((option = getopt_long(argc, argv, ":", LONG_OPTIONS, &index)) != -1) {
        if (option == HELP)
            return OPTIONS_HELP;
        if (option == VERSION)
            return OPTIONS_VERSION;
        if (option == ':' || option == '?') {
            snprintf(message, size, option == ':' ? "%s needs a value" : "unknown option %s", argv[optind - 1]);
            return OPTIONS_WRONG;
        }
        if (!set_option(out, option, optarg)) {
            snprintf(message, size, "--%s does not take \"%s\"", LONG_OPTIONS[index].name, optarg);
            return OPTIONS_WRONG;
        }
    }
    if (out->memory == 0)
        out->memory = memory_share(memory_available(), out->cache, out->workers);
    if (optind < argc) {
        snprintf(message, size, "unexpected argument \"%s\"", argv[optind]);
        return OPTIONS_WRONG;
    }
    return OPTIONS_RUN;
}
