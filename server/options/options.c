#include "options/options.h"

#include "base/memory.h"

#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double LARGE = 9007199254740992.0; /* 2^53: every integer below it is a double */

/* Numbers given to getopt_long beyond those of the rows. */
enum { FIRST = 1000, ASK_CHECK = FIRST + OPTIONS_MAX, ASK_EXAMPLE, ASK_CHECK_DB, ASK_BACKUP, ASK_VERSION, ASK_HELP };

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

/* "64M": a number of at least `least`; K, M and G are powers of `base`. */
static bool parse_size(const char *text, unsigned long long base, double least, size_t *out)
{
    static const char SUFFIXES[] = "KMG";
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10), factor = 1;
    if (errno || end == text || text[0] == '-' || (double)value < least)
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

bool options_is_list(const option_row *row)
{
    return row->kind == OPTION_ORIGINS || row->kind == OPTION_HOSTS;
}

/* "https://host[:port]" as a browser sends it, or "*". */
static bool is_origin(const char *word)
{
    const char *host = strstr(word, "://");
    bool fits = host && (strncmp(word, "http://", 7) == 0 || strncmp(word, "https://", 8) == 0);
    return strcmp(word, "*") == 0 || (fits && host[3] && !strchr(host + 3, '/'));
}

/* "host" or "host:port", without a scheme. */
static bool is_host(const char *word)
{
    return !strchr(word, '/');
}

/* Keeps the words with single spaces between them. */
static bool set_list(char *value, option_kind kind, const char *text)
{
    char word[OPTION_PATH], list[OPTION_PATH] = "";
    size_t used = 0, count = 0;
    while (*(text += strspn(text, " \t"))) {
        size_t len = strcspn(text, " \t");
        if (used + len + 2 > sizeof list || ++count > OPTION_WORDS)
            return false;
        snprintf(word, sizeof word, "%.*s", (int)len, text);
        if (!(kind == OPTION_ORIGINS ? is_origin(word) : is_host(word)))
            return false;
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", used ? " " : "", word);
        text += len;
    }
    memcpy(value, list, used + 1);
    return true;
}

void options_split(option_words *out, const char *list)
{
    out->n = 0;
    snprintf(out->text, sizeof out->text, "%s", list);
    for (char *rest = NULL, *word = strtok_r(out->text, " ", &rest); word && out->n < OPTION_WORDS;
         word = strtok_r(NULL, " ", &rest))
        out->words[out->n++] = word;
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
        return parse_size(text, 1024, row->least, value);
    case OPTION_COUNT:
        return parse_size(text, 1000, row->least, value);
    case OPTION_SECONDS:
        return parse_seconds(text, row->least, row->most, value);
    case OPTION_LEVEL:
    case OPTION_SWITCH:
        return set_word(value, row->kind, text);
    case OPTION_ORIGINS:
    case OPTION_HOSTS:
        return set_list(value, row->kind, text);
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
        snprintf(out, size, "give a number of bytes%s, with K, M or G where you like: 64M",
                 row->least > 0 ? " above 0" : "");
        return;
    case OPTION_COUNT:
        snprintf(out, size, "give a number above 0, with K, M or G where you like: 2M is 2 million");
        return;
    case OPTION_SECONDS:
        snprintf(out, size, "give %s from %g to %g", row->unit, row->least, row->most);
        return;
    case OPTION_LEVEL:
        snprintf(out, size, "give debug, info, warn or error");
        return;
    case OPTION_SWITCH:
        snprintf(out, size, "give yes or no");
        return;
    case OPTION_ORIGINS:
        snprintf(out, size, "give http://host[:port], https://host[:port] or *, at most %d with spaces between",
                 OPTION_WORDS);
        return;
    case OPTION_HOSTS:
        snprintf(out, size, "give host or host:port, at most %d with spaces between", OPTION_WORDS);
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
    const option_row *rows;
    size_t n = options_table(&rows);
    char unused[256];
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    memset(o, 0, sizeof *o);
    for (size_t i = 0; i < n; i++)
        if (rows[i].normal && rows[i].normal[0])
            options_set(o, &rows[i], rows[i].normal, unused, sizeof unused);
    o->workers = cores < 1 ? 1 : cores > 1024 ? 1024 : (int)cores;
}

/* ------------------------------------------------------------- command line */

enum { LISTS = 4 }; /* room for the options that are lists */

typedef struct {
    const char *value[OPTIONS_MAX]; /* from argv or lists; NULL: not given */
    char lists[LISTS][OPTION_PATH]; /* what was given several times */
    size_t n_lists;
    const char *backup;
    options_verdict verdict;
} flags;

static void list_long_options(struct option *out)
{
    const option_row *rows;
    size_t n = 0, n_rows = options_table(&rows);
    for (; n < n_rows; n++) {
        bool alone = rows[n].kind == OPTION_SWITCH && rows[n].normal[0] == 'n'; /* --insecure-public means yes */
        out[n] = (struct option){rows[n].name, alone ? optional_argument : required_argument, NULL, FIRST + (int)n};
    }
    out[n++] = (struct option){"check-config", no_argument, NULL, ASK_CHECK};
    out[n++] = (struct option){"example-config", no_argument, NULL, ASK_EXAMPLE};
    out[n++] = (struct option){"check-db", no_argument, NULL, ASK_CHECK_DB};
    out[n++] = (struct option){"backup", required_argument, NULL, ASK_BACKUP};
    out[n++] = (struct option){"version", no_argument, NULL, ASK_VERSION};
    out[n++] = (struct option){"help", no_argument, NULL, ASK_HELP};
    out[n] = (struct option){NULL, 0, NULL, 0};
}

/* A flag that was given before adds its words to those; false: there are too many. */
static bool take_word(flags *f, size_t i, const char *text)
{
    if (!f->value[i]) {
        if (f->n_lists == LISTS || strlen(text) >= OPTION_PATH)
            return false;
        f->value[i] = strcpy(f->lists[f->n_lists++], text);
        return true;
    }
    char *list = f->lists[0];
    while (list != f->value[i])
        list += OPTION_PATH;
    size_t len = strlen(list);
    return (size_t)snprintf(list + len, OPTION_PATH - len, " %s", text) < OPTION_PATH - len;
}

static bool take_value(flags *f, size_t i, const char *text)
{
    const option_row *rows;
    options_table(&rows);
    if (options_is_list(&rows[i]))
        return take_word(f, i, text);
    f->value[i] = text;
    return true;
}

static void take_request(flags *f, int option)
{
    if (option == ASK_CHECK)
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

static void refuse_flag(const char *word, bool lacks_value, char *message, size_t size)
{
    const size_t dashes = strspn(word, "-");
    const char *meant = options_closest(word + dashes, strcspn(word + dashes, "="));
    if (lacks_value)
        snprintf(message, size, "%s needs a value", word);
    else if (meant)
        snprintf(message, size, "unknown option %s; did you mean --%s?", word, meant);
    else
        snprintf(message, size, "unknown option %s", word);
}

static options_verdict read_flags(flags *f, int argc, char **argv, char *message, size_t size)
{
    struct option known[OPTIONS_MAX + 7];
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
            refuse_flag(argv[optind - 1], option == ':', message, size);
            return OPTIONS_WRONG;
        }
        if (option >= ASK_CHECK)
            take_request(f, option);
        else if (!take_value(f, (size_t)(option - FIRST), optarg ? optarg : "yes")) {
            snprintf(message, size, "--%s takes words of %d bytes together", known[option - FIRST].name,
                     OPTION_PATH - 1);
            return OPTIONS_WRONG;
        }
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
    const option_row *rows;
    size_t n = options_table(&rows);
    char name[64], why[256];
    for (size_t i = 0; i < n; i++) {
        const char *text = read_environment(&rows[i], name);
        if (!text)
            continue;
        if (!options_set(o, &rows[i], text, why, sizeof why)) {
            snprintf(message, size, "%s in the environment: %s", name, why);
            return false;
        }
        o->source[i] = FROM_ENVIRONMENT;
    }
    return true;
}

static bool set_from_flags(server_options *o, const flags *f, char *message, size_t size)
{
    const option_row *rows;
    size_t n = options_table(&rows);
    char why[256];
    for (size_t i = 0; i < n; i++) {
        if (!f->value[i])
            continue;
        if (!options_set(o, &rows[i], f->value[i], why, sizeof why)) {
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
    const option_row *rows, *row = options_find("config", strlen("config"));
    options_table(&rows);
    const char *flag = f->value[row - rows], *path = flag ? flag : read_environment(row, name);
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
    if (out->max_streams == 0) /* they hold their connections for long: the others are for everything else */
        out->max_streams = out->max_connections - out->max_connections / 4;
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
    const option_row *rows;
    size_t n = 0, n_rows = options_table(&rows);
    for (size_t i = 0; i < n_rows && n < most; i++) {
        const option_row *row = &rows[i];
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
