/* options_show.c: the table of options for people: usage, effective values, a sample file. */
#include "options/options.h"
#include "text/edit_distance.h"

#include <string.h>

enum { COLUMN = 30, WIDTH = 118 };

const char *options_closest(const char *name, size_t len)
{
    const option_row *rows;
    const char *names[OPTIONS_MAX];
    size_t n = options_table(&rows);
    for (size_t i = 0; i < n; i++)
        names[i] = rows[i].name;
    int at = uz_closest(name, len, names, n);
    return at < 0 ? NULL : names[at];
}

/* Writes words from column `at`, breaking lines at spaces; later lines begin with `margin`, `indent` columns wide. */
static void write_wrapped(FILE *to, const char *text, int at, const char *margin, int indent)
{
    while (*text) {
        int word = (int)strcspn(text, " ");
        if (at > indent && at + 1 + word > WIDTH) {
            fprintf(to, "\n%s%*s", margin, indent - (int)strlen(margin), "");
            at = indent;
        } else if (at > indent) {
            fputc(' ', to);
            at++;
        }
        fprintf(to, "%.*s", word, text);
        at += word;
        text += word + (text[word] == ' ');
    }
}

static const char *placeholder(const option_row *row)
{
    static const char *const OF_KIND[] = {
        [OPTION_TEXT] = " TEXT",      [OPTION_FILE] = " FILE", [OPTION_INTEGER] = " N",   [OPTION_BYTES] = " BYTES",
        [OPTION_COUNT] = " N",        [OPTION_SECONDS] = " S", [OPTION_LEVEL] = " LEVEL", [OPTION_SWITCH] = "",
        [OPTION_ORIGINS] = " ORIGIN", [OPTION_HOSTS] = " HOST"};
    if (row->kind == OPTION_SWITCH && row->normal[0] == 'y')
        return " yes|no";
    if (row->kind == OPTION_SECONDS && strcmp(row->unit, "days") == 0)
        return " D";
    return OF_KIND[row->kind];
}

static void describe(char *out, size_t size, const option_row *row)
{
    const char *normal = row->normal ? row->normal : row->otherwise;
    snprintf(out, size, normal[0] ? "%s (%s)" : "%s", row->meaning, normal);
}

static void write_usage_line(FILE *to, const char *name, const char *value, const char *text)
{
    int n = fprintf(to, "  --%s%s", name, value);
    fprintf(to, "%*s", n < COLUMN ? COLUMN - n : 1, "");
    write_wrapped(to, text, n < COLUMN ? COLUMN : n + 1, "", COLUMN);
    fputc('\n', to);
}

void options_usage(FILE *to)
{
    const option_row *rows;
    size_t n = options_table(&rows);
    char text[512];
    fputs("usage: uzawad [OPTION]...\n"
          "Solves frictionless contact problems for whoever asks by HTTP.\n\n",
          to);
    for (size_t i = 0; i < n; i++) {
        describe(text, sizeof text, &rows[i]);
        write_usage_line(to, rows[i].name, placeholder(&rows[i]), text);
    }
    write_usage_line(to, "check-config", "",
                     "print the values in effect and where they come from, look at the files and the address that they "
                     "name, and end");
    write_usage_line(to, "example-config", "", "print a configuration file with every option, and end");
    write_usage_line(to, "check-db", "",
                     "look whether the file of --db is whole, also while a daemon uses it, and end");
    write_usage_line(to, "backup", " FILE", "copy the database to a new FILE, also while a daemon uses it, and end");
    fputs("  --version, --help\n", to);
    fputs(
        "\n"
        "Each option may also stand in the environment (UZAWAD_MAX_BODY) or in the file of --config (max-body = 64M).\n"
        "The command line counts before the environment, and that before the file.\n"
        "BYTES takes the suffixes K, M and G. When it is ready it prints one line, \"listening on URL\"; the log goes\n"
        "to standard error, one JSON object a line. SIGTERM and SIGINT end it after a drain, a second one at once:\n"
        "jobs that were running are run again at the next start. SIGHUP reads the token-file again, if there is one;\n"
        "else it ends the daemon too.\n"
        "\n"
        "exit status: 0 ended by a signal, or the check found nothing; 1 could not start or failed; 2 wrong usage\n",
        to);
}

static void write_text(FILE *to, const char *text)
{
    bool plain = text[0] && !strpbrk(text, " \t#\"\\");
    if (plain) {
        fputs(text, to);
        return;
    }
    fputc('"', to);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', to);
        fputc(*text, to);
    }
    fputc('"', to);
}

static void write_value(const server_options *o, const option_row *row, FILE *to)
{
    static const char *const LEVELS[] = {"debug", "info", "warn", "error"};
    const void *at = (const char *)o + row->offset;
    switch (row->kind) {
    case OPTION_TEXT:
    case OPTION_FILE:
    case OPTION_ORIGINS:
    case OPTION_HOSTS:
        write_text(to, at);
        return;
    case OPTION_INTEGER:
        fprintf(to, "%d", *(const int *)at);
        return;
    case OPTION_BYTES:
    case OPTION_COUNT:
        fprintf(to, "%zu", *(const size_t *)at);
        return;
    case OPTION_SECONDS:
        fprintf(to, "%.12g", *(const double *)at);
        return;
    case OPTION_LEVEL:
        fputs(LEVELS[*(const log_level *)at], to);
        return;
    case OPTION_SWITCH:
        fputs(*(const bool *)at ? "yes" : "no", to);
        return;
    }
}

static void write_source(const server_options *o, size_t i, const option_row *row, FILE *to)
{
    static const char *const NAMES[] = {"default", "file", "environment", "command line"};
    if (o->source[i] == FROM_FILE)
        fprintf(to, "line %d of the file", o->line[i]);
    else if (o->source[i] == FROM_DEFAULT && !row->normal)
        fprintf(to, "default: %s", row->otherwise);
    else
        fputs(NAMES[o->source[i]], to);
}

void options_show(const server_options *o, FILE *to)
{
    const option_row *rows;
    size_t n = options_table(&rows);
    for (size_t i = 0; i < n; i++) {
        bool is_this_file = strcmp(rows[i].name, "config") == 0; /* can't stand in a file */
        fprintf(to, "%s%s = ", is_this_file ? "# " : "", rows[i].name);
        write_value(o, &rows[i], to);
        fputs("  # ", to);
        write_source(o, i, &rows[i], to);
        fputc('\n', to);
    }
}

void options_example(FILE *to)
{
    const option_row *rows;
    size_t n = options_table(&rows);
    fputs("# Configuration of uzawad: uzawad --config FILE. Every option is here with its default; take the '#' away\n"
          "# before the ones to change. uzawad --config FILE --check-config says what is in effect.\n",
          to);
    for (size_t i = 0; i < n; i++) {
        if (strcmp(rows[i].name, "config") == 0)
            continue;
        fputs("\n# ", to);
        write_wrapped(to, rows[i].meaning, 2, "# ", 2);
        if (!rows[i].normal) {
            fputs("\n# Default: ", to);
            write_wrapped(to, rows[i].otherwise, 11, "# ", 2);
        }
        fprintf(to, "\n#%s =", rows[i].name);
        if (rows[i].normal && rows[i].normal[0])
            fprintf(to, " %s", rows[i].normal);
        fputc('\n', to);
    }
}
