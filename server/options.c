#include "options.h"

#include "memory.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define AT(member) offsetof(server_options, member)
#define NO_LIMIT   NULL
static const double LARGE = 9007199254740992.0; /* 2^53: every integer below it is a double */

static const option_row ROWS[] = {
    {"listen", OPTION_TEXT, AT(listen), 0, 0, "127.0.0.1:8080", NULL, NO_LIMIT, false,
     "HOST:PORT to listen on; [::1]:0 works too, port 0 takes a free one. An address that others can reach needs a "
     "token-file"},
    {"db", OPTION_FILE, AT(db), 0, 0, "./contact.db", NULL, NO_LIMIT, false, "jobs and results are kept in this file"},
    {"config", OPTION_FILE, AT(config), 0, 0, "", NULL, NO_LIMIT, false,
     "file with lines \"name = value\" for all options but this one"},
    {"token-file", OPTION_FILE, AT(token_file), 0, 0, "", NULL, NO_LIMIT, false,
     "lines \"name scope secret\": who may read, submit or admin; read again at SIGHUP. Without it everybody may all"},
    {"insecure-public", OPTION_SWITCH, AT(insecure_public), 0, 1, "no", NULL, NO_LIMIT, false,
     "listen on an address that others can reach although there is no token-file"},
    {"tls-cert", OPTION_FILE, AT(tls_cert), 0, 0, "", NULL, NO_LIMIT, false,
     "certificate chain (PEM): answer by HTTPS; needs tls-key"},
    {"tls-key", OPTION_FILE, AT(tls_key), 0, 0, "", NULL, NO_LIMIT, false, "private key (PEM) of tls-cert"},
    {"user", OPTION_TEXT, AT(user), 0, 0, "", NULL, NO_LIMIT, false,
     "become this user once the port is taken, when started as root"},
    {"workers", OPTION_INTEGER, AT(workers), 1, 1024, NULL, "as many as there are processors", "threads", false,
     "problems solved at once"},
    {"cache", OPTION_BYTES, AT(cache), 1, 0, "1G", NULL, "bytes", false, "memory for factors that are kept"},
    {"memory", OPTION_BYTES, AT(memory), 1, 0, NULL,
     "80 % of what the machine or its control group has, less the cache, divided by the workers", "bytes", false,
     "memory that one problem may take"},
    {"max-solve-s", OPTION_SECONDS, AT(max_solve_s), 0, 1e9, "86400", NULL, "seconds", true,
     "time that one job may take; it ends with the best answer so far, or fails where there is none; 0: no limit"},
    {"max-attempts", OPTION_INTEGER, AT(max_attempts), 1, 1000, "3", NULL, "runs", false,
     "runs of a job whose run ends with the process before it is failed"},
    {"max-connections", OPTION_INTEGER, AT(max_connections), 1, 100000, "256", NULL, "connections", false,
     "connections open at once"},
    {"max-client-connections", OPTION_INTEGER, AT(max_client_connections), 0, 100000, "0", NULL, "connections", true,
     "connections of one address open at once; 0: no limit of its own. Behind a proxy all clients are one"},
    {"max-client-rate", OPTION_INTEGER, AT(max_client_rate), 0, 1000000, "10000", NULL, "requests per second", true,
     "requests of one address or token per second, twice as many at once; more are answered 429; 0: no limit"},
    {"max-body", OPTION_BYTES, AT(max_body), 1, 0, "64M", NULL, "bytes", false, "largest request body"},
    {"max-json-depth", OPTION_INTEGER, AT(max_json_depth), 8, 64, "64", NULL, "levels", false,
     "arrays and objects within each other in a request"},
    {"max-dofs", OPTION_COUNT, AT(max_dofs), 1, 0, "100M", NULL, "dofs", false, "d: degrees of freedom of a problem"},
    {"max-rows", OPTION_COUNT, AT(max_rows), 1, 0, "100M", NULL, "rows", false,
     "m: rows of N of a problem given as matrices"},
    {"max-nonzeros", OPTION_COUNT, AT(max_nonzeros), 1, 0, "1000M", NULL, "entries", false,
     "entries of K, and of N, of a problem given as matrices"},
    {"request-deadline-s", OPTION_SECONDS, AT(request_deadline_s), 0.1, 1e6, "30", NULL, "seconds", false,
     "time for a request to arrive, plus 1 s per 100 kB of its body"},
    {"max-wait-s", OPTION_SECONDS, AT(max_wait_s), 0, 3600, "60", NULL, "seconds", false,
     "longest wait that Prefer: wait is granted"},
    {"drain-s", OPTION_SECONDS, AT(drain_s), 0, 1e6, "30", NULL, "seconds", false,
     "time for running jobs to end after SIGTERM; then they are put back"},
    {"log-level", OPTION_LEVEL, AT(level), 0, 3, "info", NULL, NO_LIMIT, false, "debug, info, warn or error"},
    {"access-log", OPTION_SWITCH, AT(access_log), 0, 1, "yes", NULL, NO_LIMIT, false, "log a line for each request"},
};
#define N_ROWS (sizeof ROWS / sizeof ROWS[0])
_Static_assert(N_ROWS <= OPTIONS_MAX, "server_options has room for the sources");

/* Numbers given to getopt_long beyond those of the rows. */
enum { FIRST = 1000, ASK_CHECK = FIRST + OPTIONS_MAX, ASK_EXAMPLE, ASK_CHECK_DB, ASK_BACKUP, ASK_VERSION, ASK_HELP };

size_t options_table(const option_row **rows)
{
    *rows = ROWS;
    return N_ROWS;
}

const option_row *options_find(const char *name, size_t len)
{
    for (size_t i = 0; i < N_ROWS; i++)
        if (strlen(ROWS[i].name) == len && memcmp(ROWS[i].name, name, len) == 0)
            return &ROWS[i];
    return NULL;
}

/* ------------------------------------------------------------------ values */

static bool parse_integer(const char *text, double least, double most, int *out)
{
    char *end;
    errno = 0;
    long value = strtol(text, &end, 10);
    if (errno || end == text || *end || (double)value < least || (double)value > most)
        return false;
    *out = (int)value;
    return true;
}

static bool parse_seconds(const char *text, double least, double most, double *out)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !isfinite(value) || value < least || value > most)
        return false;
    *out = value;
    return true;
}

/* "64M": a number of at least 1; K, M and G are powers of `base`. */
static bool parse_size(const char *text, unsigned long long base, size_t *out)
{
    static const char SUFFIXES[] = "KMG";
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10), factor = 1;
    if (errno || end == text || text[0] == '-' || value == 0)
        return false;
    const char *suffix = *end ? strchr(SUFFIXES, *end) : NULL;
    if (*end && (!suffix || end[1]))
        return false;
    for (const char *at = SUFFIXES; suffix && at <= suffix; at++)
        factor *= base;
    if (value > (SIZE_MAX >> 2) / factor)
        return false;
    *out = (size_t)(value * factor);
    return true;
}

static bool parse_word(const char *text, const char *const *words, size_t count, int *out)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(text, words[i]) == 0) {
            *out = (int)i;
            return true;
        }
    return false;
}

static bool set_word(void *value, option_kind kind, const char *text)
{
    static const char *const LEVELS[] = {"debug", "info", "warn", "error"};
    static const char *const SWITCH[] = {"no", "yes", "false", "true", "0", "1"};
    int word;
    if (!parse_word(text, kind == OPTION_LEVEL ? LEVELS : SWITCH, kind == OPTION_LEVEL ? 4 : 6, &word))
        return false;
    if (kind == OPTION_LEVEL)
        *(log_level *)value = (log_level)word;
    else
        *(bool *)value = word % 2 == 1;
    return true;
}

static bool set_text(char *value, const option_row *row, const char *text)
{
    bool may_be_empty = row->normal && !row->normal[0];
    if (strlen(text) >= OPTION_PATH || (!text[0] && !may_be_empty))
        return false;
    strcpy(value, text);
    return true;
}

static bool set_value(void *value, const option_row *row, const char *text)
{
    switch (row->kind) {
    case OPTION_TEXT:
    case OPTION_FILE:
        return set_text(value, row, text);
    case OPTION_INTEGER:
        return parse_integer(text, row->least, row->most, value);
    case OPTION_BYTES:
        return parse_size(text, 1024, value);
    case OPTION_COUNT:
        return parse_size(text, 1000, value);
    case OPTION_SECONDS:
        return parse_seconds(text, row->least, row->most, value);
    case OPTION_LEVEL:
    case OPTION_SWITCH:
        return set_word(value, row->kind, text);
    }
    return false;
}

static void say_what_it_takes(const option_row *row, char *out, size_t size)
{
    switch (row->kind) {
    case OPTION_TEXT:
    case OPTION_FILE:
        snprintf(out, size, "give a text of at most %d bytes", OPTION_PATH - 1);
        return;
    case OPTION_INTEGER:
        snprintf(out, size, "give an integer from %.0f to %.0f", row->least, row->most);
        return;
    case OPTION_BYTES:
        snprintf(out, size, "give a number of bytes above 0, with K, M or G where you like: 64M");
        return;
    case OPTION_COUNT:
        snprintf(out, size, "give a number above 0, with K, M or G where you like: 2M is 2 million");
        return;
    case OPTION_SECONDS:
        snprintf(out, size, "give seconds from %g to %g", row->least, row->most);
        return;
    case OPTION_LEVEL:
        snprintf(out, size, "give debug, info, warn or error");
        return;
    case OPTION_SWITCH:
        snprintf(out, size, "give yes or no");
        return;
    }
}

bool options_set(server_options *o, const option_row *row, const char *text, char *message, size_t size)
{
    char remedy[120] = "";
    if (set_value((char *)o + row->offset, row, text))
        return true;
    say_what_it_takes(row, remedy, sizeof remedy);
    snprintf(message, size, "%s does not take \"%.100s\": %s", row->name, text, remedy);
    return false;
}

static void set_defaults(server_options *o)
{
    char unused[160];
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    memset(o, 0, sizeof *o);
    for (size_t i = 0; i < N_ROWS; i++)
        if (ROWS[i].normal && ROWS[i].normal[0])
            options_set(o, &ROWS[i], ROWS[i].normal, unused, sizeof unused);
    o->workers = cores < 1 ? 1 : cores > 1024 ? 1024 : (int)cores;
}

/* ------------------------------------------------------------- command line */

typedef struct {
    const char *value[N_ROWS]; /* from argv; NULL: not given */
    const char *backup;
    options_verdict verdict;
} flags;

static void list_long_options(struct option *out)
{
    size_t n = 0;
    for (; n < N_ROWS; n++) {
        bool alone = ROWS[n].kind == OPTION_SWITCH && ROWS[n].normal[0] == 'n'; /* --insecure-public means yes */
        out[n] = (struct option){ROWS[n].name, alone ? optional_argument : required_argument, NULL, FIRST + (int)n};
    }
    out[n++] = (struct option){"check-config", no_argument, NULL, ASK_CHECK};
    out[n++] = (struct option){"example-config", no_argument, NULL, ASK_EXAMPLE};
    out[n++] = (struct option){"check-db", no_argument, NULL, ASK_CHECK_DB};
    out[n++] = (struct option){"backup", required_argument, NULL, ASK_BACKUP};
    out[n++] = (struct option){"version", no_argument, NULL, ASK_VERSION};
    out[n++] = (struct option){"help", no_argument, NULL, ASK_HELP};
    out[n] = (struct option){NULL, 0, NULL, 0};
}

static void take_flag(flags *f, int option)
{
    if (option < ASK_CHECK)
        f->value[option - FIRST] = optarg ? optarg : "yes";
    else if (option == ASK_CHECK)
        f->verdict = OPTIONS_CHECK;
    else if (option == ASK_EXAMPLE)
        f->verdict = OPTIONS_EXAMPLE;
    else if (option == ASK_CHECK_DB)
        f->verdict = OPTIONS_CHECK_DB;
    else {
        f->verdict = OPTIONS_BACKUP;
        f->backup = optarg;
    }
}

static options_verdict read_flags(flags *f, int argc, char **argv, char *message, size_t size)
{
    struct option known[N_ROWS + 7];
    int option;
    list_long_options(known);
    opterr = 0;
    optind = 0; /* glibc: start again, also after an earlier call */
    while ((option = getopt_long(argc, argv, ":", known, NULL)) != -1) {
        if (option == ASK_HELP)
            return OPTIONS_HELP;
        if (option == ASK_VERSION)
            return OPTIONS_VERSION;
        if (option == ':' || option == '?') {
            snprintf(message, size, option == ':' ? "%s needs a value" : "unknown option %s", argv[optind - 1]);
            return OPTIONS_WRONG;
        }
        take_flag(f, option);
    }
    if (optind < argc) {
        snprintf(message, size, "unexpected argument \"%s\"", argv[optind]);
        return OPTIONS_WRONG;
    }
    return f->verdict;
}

/* ------------------------------------------------------------------- layers */

/* UZAWAD_MAX_BODY of "max-body". Variables of that prefix that are no option are nobody's mistake: a cluster sets
 * UZAWAD_SERVICE_HOST and the like for a service of this name. */
static const char *read_environment(const option_row *row, char name[64])
{
    size_t n = (size_t)snprintf(name, 64, "UZAWAD_%s", row->name);
    for (size_t i = 7; i < n; i++)
        name[i] = name[i] == '-' ? '_' : (char)(name[i] >= 'a' && name[i] <= 'z' ? name[i] - 32 : name[i]);
    return getenv(name);
}

static bool set_from_environment(server_options *o, char *message, size_t size)
{
    char name[64], why[256];
    for (size_t i = 0; i < N_ROWS; i++) {
        const char *text = read_environment(&ROWS[i], name);
        if (!text)
            continue;
        if (!options_set(o, &ROWS[i], text, why, sizeof why)) {
            snprintf(message, size, "%s in the environment: %s", name, why);
            return false;
        }
        o->source[i] = FROM_ENVIRONMENT;
    }
    return true;
}

static bool set_from_flags(server_options *o, const flags *f, char *message, size_t size)
{
    char why[256];
    for (size_t i = 0; i < N_ROWS; i++) {
        if (!f->value[i])
            continue;
        if (!options_set(o, &ROWS[i], f->value[i], why, sizeof why)) {
            snprintf(message, size, "--%s", why);
            return false;
        }
        o->source[i] = FROM_FLAG;
    }
    return true;
}

/* The file is named by the layers above it. */
static bool set_from_file(server_options *o, const flags *f, char *message, size_t size)
{
    char name[64];
    const option_row *row = options_find("config", strlen("config"));
    const char *flag = f->value[row - ROWS], *path = flag ? flag : read_environment(row, name);
    return !path || !path[0] || options_read_file(o, path, message, size);
}

/* What needs two values to be seen. */
static bool check_together(const server_options *o, char *message, size_t size)
{
    if (!o->tls_cert[0] == !o->tls_key[0])
        return true;
    snprintf(message, size, "tls-cert and tls-key need each other: give both or neither");
    return false;
}

options_verdict options_read(server_options *out, int argc, char **argv, char *backup, char *message, size_t size)
{
    flags f = {.verdict = OPTIONS_RUN};
    set_defaults(out);
    options_verdict verdict = read_flags(&f, argc, argv, message, size);
    if (verdict == OPTIONS_WRONG || verdict == OPTIONS_HELP || verdict == OPTIONS_VERSION)
        return verdict;
    if (!set_from_file(out, &f, message, size) || !set_from_environment(out, message, size) ||
        !set_from_flags(out, &f, message, size) || !check_together(out, message, size))
        return OPTIONS_WRONG;
    if (out->memory == 0)
        out->memory = memory_share(memory_available(), out->cache, out->workers);
    if (backup)
        snprintf(backup, OPTION_PATH, "%s", f.backup ? f.backup : "");
    return verdict;
}

options_verdict options_parse(server_options *out, int argc, char **argv, char *message, size_t size)
{
    return options_read(out, argc, argv, NULL, message, size);
}

size_t options_limits(const server_options *o, option_limit *out, size_t most)
{
    size_t n = 0;
    for (size_t i = 0; i < N_ROWS && n < most; i++) {
        const option_row *row = &ROWS[i];
        const void *at = (const char *)o + row->offset;
        if (!row->unit)
            continue;
        double value = row->kind == OPTION_INTEGER   ? *(const int *)at
                       : row->kind == OPTION_SECONDS ? *(const double *)at
                                                     : fmin((double)*(const size_t *)at, LARGE);
        option_limit *limit = &out[n++];
        *limit = (option_limit){.value = row->zero_is_off && value == 0 ? INFINITY : value,
                                .unit = row->unit,
                                .meaning = row->meaning,
                                .is_set = o->source[i] != FROM_DEFAULT};
        snprintf(limit->name, sizeof limit->name, "%s", row->name);
        for (char *c = limit->name; *c; c++)
            *c = *c == '-' ? '_' : *c;
    }
    return n;
}
