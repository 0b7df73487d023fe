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

const char *options_address(const server_options *o)
{
    return o->store[0] ? o->store : o->db;
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

static bool take_flag(flags *f, const uz_option_walk *walk, char *message, size_t size)
{
    const uz_option *row = walk->row;
    const size_t i = (size_t)(row - walk->table.rows);
    bool fits = true;
    if (row->kind == UZ_OPTION_FLAG && walk->value) {
        snprintf(message, size, "--%s takes no value", row->name);
        return false;
    }
    if (row->places & OPTION_REQUEST) {
        f->verdict = (options_verdict)row->least;
        f->backup = walk->value;
    } else if (row->kind != UZ_OPTION_LIST) {
        f->value[i] = walk->value ? walk->value : "yes";
    } else if (!f->value[i]) {
        fits = f->n_lists < LISTS && strlen(walk->value) < OPTION_PATH;
        if (fits)
            f->value[i] = strcpy(f->lists[f->n_lists++], walk->value);
    } else { /* one that was given before adds its words to those */
        char *list = f->lists[0];
        while (list != f->value[i])
            list += OPTION_PATH;
        const size_t len = strlen(list);
        fits = (size_t)snprintf(list + len, OPTION_PATH - len, " %s", walk->value) < OPTION_PATH - len;
    }
    if (!fits)
        snprintf(message, size, "--%s takes words of %d bytes together", row->name, OPTION_PATH - 1);
    return fits;
}

static options_verdict read_flags(flags *f, int argc, char **argv, char *message, size_t size)
{
    uz_option_walk walk = {.table = DAEMON_OPTIONS,
                           .places = OPTION_SETTING | OPTION_REQUEST,
                           .abbreviated = true,
                           .argc = argc,
                           .argv = argv};
    const char *operand = NULL, *meant, *second = NULL;
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
            second = operand ? walk.word : NULL;
            operand = operand ? operand : walk.word;
            break;
        case UZ_WALK_END:
            break;
        }
    }
    if (operand && f->verdict == OPTIONS_MOVE && !second) { /* --move FILE URL */
        f->value[uz_option_find(walk.table, OPTION_SETTING, "store", strlen("store")) - walk.table.rows] = operand;
    } else if (operand) {
        snprintf(message, size, "unexpected argument \"%s\"", operand);
        return OPTIONS_WRONG;
    }
    return f->verdict;
}

/* ------------------------------------------------------------------- layers */

/* The values of a layer, FROM_ENVIRONMENT or FROM_FLAG, over those below it. */
static bool set_layer(server_options *o, option_source layer, const flags *f, char *message, size_t size)
{
    const uz_option_table table = DAEMON_OPTIONS;
    char name[64], why[256];
    for (size_t i = 0; i < table.count && table.rows[i].places & OPTION_SETTING; i++) {
        const bool flag = layer == FROM_FLAG;
        const char *text = flag ? f->value[i] : uz_option_environment(&table.rows[i], ENVIRONMENT, name);
        if (!text)
            continue;
        if (!options_set(o, &table.rows[i], text, why, sizeof why)) {
            snprintf(message, size, flag ? "--%s%s" : "%s in the environment: %s", flag ? "" : name, why);
            return false;
        }
        o->source[i] = layer;
    }
    return true;
}

static const uz_option *row_of(const char *name)
{
    return uz_option_find(DAEMON_OPTIONS, OPTION_SETTING, name, strlen(name));
}

options_verdict options_read(server_options *out, int argc, char **argv, char *backup, char *message, size_t size)
{
    flags f = {.verdict = OPTIONS_RUN};
    char name[64];
    const uz_option_table table = DAEMON_OPTIONS;
    const uz_option *config = row_of("config");
    const int cores = processors_available();
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < table.count; i++)
        if (table.rows[i].normal && table.rows[i].normal[0])
            uz_option_set(out, &table.rows[i], table.rows[i].normal);
    out->max_client_connections = -1;
    out->workers = cores > 1024 ? 1024 : cores;
    options_verdict verdict = read_flags(&f, argc, argv, message, size);
    if (verdict == OPTIONS_WRONG || verdict == OPTIONS_HELP || verdict == OPTIONS_VERSION)
        return verdict;
    const char *path = f.value[config - table.rows]; /* the layers above the file name it */
    if (!path)
        path = uz_option_environment(config, ENVIRONMENT, name);
    if ((path && path[0] && !options_read_file(out, path, message, size)) ||
        !set_layer(out, FROM_ENVIRONMENT, NULL, message, size) || !set_layer(out, FROM_FLAG, &f, message, size))
        return OPTIONS_WRONG;
    if (out->store[0] && strcmp(out->db, row_of("db")->normal) != 0) {
        snprintf(message, size, "store and db are both given: jobs are kept in one of them");
        return OPTIONS_WRONG;
    }
    if (out->store[0] && !strstr(out->store, "://")) {
        snprintf(message, size, "store does not take \"%.100s\": give postgresql://USER@HOST/NAME; a file is for db",
                 out->store);
        return OPTIONS_WRONG;
    }
    if (strlen(out->node) > 63 || out->node[strcspn(out->node, "/?#% ")]) {
        snprintf(message, size, "node does not take \"%.100s\": give at most 63 bytes without / ? # %% and spaces",
                 out->node);
        return OPTIONS_WRONG;
    }
    if (!out->tls_cert[0] != !out->tls_key[0]) {
        snprintf(message, size, "tls-cert and tls-key need each other: give both or neither");
        return OPTIONS_WRONG;
    }
    if (out->max_streams == 0) /* they hold their connections for long: the others are for everything else */
        out->max_streams = out->max_connections - out->max_connections / 4;
    if (out->max_client_connections < 0) { /* whether nobody else can reach the address, as far as its text says */
        const bool loopback = strncmp(out->listen, "127.", 4) == 0 || strncmp(out->listen, "[::1]:", 6) == 0 ||
                              strncmp(out->listen, "localhost:", 10) == 0;
        out->max_client_connections = loopback ? 0 : 1 + out->max_connections / 4;
    }
    if (out->cache == 0)
        out->cache = memory_for_cache(memory_available());
    if (out->memory == 0)
        out->memory = memory_share(memory_available(), out->cache, out->workers);
    if (backup)
        snprintf(backup, OPTION_PATH, "%s", f.backup ? f.backup : "");
    return verdict;
}

size_t options_limits(const server_options *o, option_limit *out, size_t most)
{
    const uz_option_table table = DAEMON_OPTIONS;
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
