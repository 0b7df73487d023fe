/* options_show.c: the table of options for people: usage, effective values, a sample file. */
#include "options/options.h"

#include <string.h>

enum { COLUMN = 30, WIDTH = 118 };

void options_usage(FILE *to)
{
    const uz_option_table table = DAEMON_OPTIONS;
    char text[512];
    fputs("usage: uzawad [OPTION]...\n"
          "Solves frictionless contact problems for whoever asks by HTTP.\n\n",
          to);
    for (size_t i = 0; i < table.count; i++) {
        const uz_option *row = &table.rows[i];
        const char *normal = row->normal ? row->normal : row->otherwise ? row->otherwise : "";
        if (!row->about)
            continue;
        snprintf(text, sizeof text, normal[0] ? "%s (%s)" : "%s", row->about, normal);
        uz_option_print(to, row, text, COLUMN, WIDTH, false);
    }
    fputs("  --version, --help\n", to);
    fputs(
        "\n"
        "Each option may also stand in the environment (UZAWAD_MAX_BODY) or in the file of --config (max-body = 64M).\n"
        "Precedence: flag, environment, file, default.\n"
        "BYTES takes the suffixes K, M and G. When it is ready it prints one line, \"listening on URL\"; the log goes\n"
        "to standard error, one JSON object a line. SIGTERM and SIGINT end it after a drain, a second one at once:\n"
        "jobs that were running are run again at the next start. SIGHUP reads token-file, tls-cert and tls-key again;\n"
        "without any of them it ends the daemon too.\n"
        "\n"
        "exit status: 0 ended by a signal, or the check found nothing; 1 could not start or failed; 2 wrong usage\n",
        to);
}

static void write_value(const server_options *o, const uz_option *row, FILE *to)
{
    static const char *const LEVELS[] = {"debug", "info", "warn", "error"};
    const void *at = (const char *)o + row->offset;
    const char *text = at;
    switch (row->kind) {
    case UZ_OPTION_TEXT:
    case UZ_OPTION_LIST:
        if (text[0] && !strpbrk(text, " \t#\"\\")) {
            fputs(text, to);
            return;
        }
        fputc('"', to);
        for (; *text; text++)
            fprintf(to, *text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
        fputc('"', to);
        return;
    case UZ_OPTION_INTEGER:
        fprintf(to, "%d", *(const int *)at);
        return;
    case UZ_OPTION_BYTES:
    case UZ_OPTION_COUNT:
        fprintf(to, "%zu", *(const size_t *)at);
        return;
    case UZ_OPTION_NUMBER:
        fprintf(to, "%.12g", *(const double *)at);
        return;
    case UZ_OPTION_LEVEL:
        fputs(LEVELS[*(const int *)at], to);
        return;
    case UZ_OPTION_SWITCH:
        fputs(*(const bool *)at ? "yes" : "no", to);
        return;
    case UZ_OPTION_FLAG:
    case UZ_OPTION_WORD:
    case UZ_OPTION_CHOICE:
    case UZ_OPTION_WORDS:
        return; /* no setting is one */
    }
}

void options_show(const server_options *o, FILE *to)
{
    static const char *const NAMES[] = {"default", "file", "environment", "command line"};
    const uz_option_table table = DAEMON_OPTIONS;
    const uz_option *rows = table.rows;
    for (size_t i = 0; i < table.count && rows[i].places & OPTION_SETTING; i++) {
        bool is_this_file = strcmp(rows[i].name, "config") == 0; /* can't stand in a file */
        fprintf(to, "%s%s = ", is_this_file ? "# " : "", rows[i].name);
        write_value(o, &rows[i], to);
        fputs("  # ", to);
        if (o->source[i] == FROM_FILE)
            fprintf(to, "line %d of the file\n", o->line[i]);
        else if (o->source[i] == FROM_DEFAULT && !rows[i].normal)
            fprintf(to, "default: %s\n", rows[i].otherwise);
        else
            fprintf(to, "%s\n", NAMES[o->source[i]]);
    }
}

void options_example(FILE *to)
{
    const uz_option_table table = DAEMON_OPTIONS;
    const uz_option *rows = table.rows;
    fputs("# Configuration of uzawad: uzawad --config FILE. Every option is here with its default; take the '#' away\n"
          "# before the ones to change. uzawad --config FILE --check-config says what is in effect.\n",
          to);
    for (size_t i = 0; i < table.count && rows[i].places & OPTION_SETTING; i++) {
        if (strcmp(rows[i].name, "config") == 0)
            continue;
        fputs("\n# ", to);
        uz_write_wrapped(to, rows[i].about, 2, "# ", 2, WIDTH);
        if (!rows[i].normal) {
            fputs("\n# Default: ", to);
            uz_write_wrapped(to, rows[i].otherwise, 11, "# ", 2, WIDTH);
        }
        fprintf(to, "\n#%s =", rows[i].name);
        if (rows[i].normal && rows[i].normal[0])
            fprintf(to, " %s", rows[i].normal);
        fputc('\n', to);
    }
}
