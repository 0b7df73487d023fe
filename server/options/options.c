/* options.c: the command line, the environment and the file put over the defaults. */
#include "options/options.h"

#include "base/memory.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

static const double LARGE = 9007199254740992.0; /* 2^53: every integer below it is a double */

/* Variables of this prefix that are no option are nobody's mistake: a cluster sets UZAWAD_SERVICE_HOST and the like for
 * a service of this name. */
static const char ENVIRONMENT[] = "UZAWAD_";

bool options_set(server_options *o, const uz_option *row, const char *text, char *message, size_t size)
{
    char wants[120];
    if (uz_option_set(o, row, text))
        return true;
    uz_option_wants(wants, sizeof wants, row);
    snprintf(message, size, "%s does not take \"%.100s\": give %s", row->name, text, wants);
    return false;
}

void options_split(option_words *out, const char *list)
{
    out->n = 0;
    snprintf(out->text, sizeof out->text, "%s", list);
    for (char *rest = NULL, *word = strtok_r(out->text, " ", &rest); word && out->n < OPTION_WORDS;
         word = strtok_r(NULL, " ", &rest))
        out->words[out->n++] = word;
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

/* A flag that was given before adds its words to those; false: there are too many. */
static bool take_words(flags *f, size_t i, const char *text)
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

static bool take_flag(flags *f, const uz_option_walk *walk, char *message, size_t size)
{
    const uz_option *row = walk->row;
    const size_t i = (size_t)(row - walk->table.rows);
    if (row->kind == UZ_OPTION_FLAG && walk->value) {
        snprintf(message, size, "--%s takes no value", row->name);
        return false;
    }
    if (row->places & OPTION_REQUEST) {
        f->verdict = (options_verdict)row->least;
        f->backup = walk->value;
    } else if (row->kind != UZ_OPTION_LIST) {
        f->value[i] = walk->value ? walk->value : "yes";
    } else if (!take_words(f, i, walk->value)) {
        snprintf(message, size, "--%s takes words of %d bytes together", row->name, OPTION_PATH - 1);
        return false;
    }
    return true;
}

static options_verdict read_flags(flags *f, int argc, char **argv, char *message, size_t size)
{
    uz_option_walk walk = {.table = options_table(),
                           .places = OPTION_SETTING | OPTION_REQUEST,
                           .abbreviated = true,
                           .argc = argc,
                           .argv = argv};
    const char *operand = NULL, *meant;
    for (uz_walk_step step; (step = uz_option_next(&walk)) != UZ_WALK_END;) {
        switch (step) {
        case UZ_WALK_OPTION:
            if (!take_flag(f, &walk, message, size))
                return OPTIONS_WRONG;
            if (f->verdict == OPTIONS_HELP || f->verdict == OPTIONS_VERSION)
                return f->verdict;
            break;
        case UZ_WALK_LACKS:
            snprintf(message, size, "%s needs a value", walk.word);
            return OPTIONS_WRONG;
        case UZ_WALK_UNKNOWN:
            meant = walk.word + strspn(walk.word, "-");
            meant = uz_option_closest(walk.table, OPTION_SETTING, meant, strcspn(meant, "="));
            snprintf(message, size, meant ? "unknown option %s; did you mean --%s?" : "unknown option %s", walk.word,
                     meant);
            return OPTIONS_WRONG;
        case UZ_WALK_OPERAND:
            operand = operand ? operand : walk.word;
            break;
        case UZ_WALK_END:
            break;
        }
    }
    if (operand) {
        snprintf(message, size, "unexpected argument \"%s\"", operand);
        return OPTIONS_WRONG;
    }
    return f->verdict;
}

/* ------------------------------------------------------------------- layers */

static bool set_from_environment(server_options *o, char *message, size_t size)
{
    const uz_option_table table = options_table();
    char name[64], why[256];
    for (size_t i = 0; i < table.count && table.rows[i].places & OPTION_SETTING; i++) {
        const char *text = uz_option_environment(&table.rows[i], ENVIRONMENT, name);
        if (!text)
            continue;
        if (!options_set(o, &table.rows[i], text, why, sizeof why)) {
            snprintf(message, size, "%s in the environment: %s", name, why);
            return false;
        }
        o->source[i] = FROM_ENVIRONMENT;
    }
    return true;
}

static bool set_from_flags(server_options *o, const flags *f, char *message, size_t size)
{
    const uz_option_table table = options_table();
    char why[256];
    for (size_t i = 0; i < table.count; i++) {
        if (!f->value[i])
            continue;
        if (!options_set(o, &table.rows[i], f->value[i], why, sizeof why)) {
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
    const uz_option_table table = options_table();
    const uz_option *row = uz_option_find(table, OPTION_SETTING, "config", strlen("config"));
    const char *flag = f->value[row - table.rows], *path = flag ? flag : uz_option_environment(row, ENVIRONMENT, name);
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
    const uz_option_table table = options_table();
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < table.count; i++)
        if (table.rows[i].normal && table.rows[i].normal[0])
            uz_option_set(out, &table.rows[i], table.rows[i].normal);
    out->workers = cores < 1 ? 1 : cores > 1024 ? 1024 : (int)cores;
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
    const uz_option_table table = options_table();
    size_t n = 0;
    for (size_t i = 0; i < table.count && n < most; i++) {
        const uz_option *row = &table.rows[i];
        const void *at = (const char *)o + row->offset;
        if (!row->unit)
            continue;
        double value = row->kind == UZ_OPTION_INTEGER  ? *(const int *)at
                       : row->kind == UZ_OPTION_NUMBER ? *(const double *)at
                                                       : fmin((double)*(const size_t *)at, LARGE);
        option_limit *limit = &out[n++];
        *limit = (option_limit){.value = row->zero_is_off && value == 0 ? INFINITY : value,
                                .unit = row->unit,
                                .meaning = row->about,
                                .is_set = o->source[i] != FROM_DEFAULT};
        snprintf(limit->name, sizeof limit->name, "%s", row->name);
        for (char *c = limit->name; *c; c++)
            *c = *c == '-' ? '_' : *c;
    }
    return n;
}
