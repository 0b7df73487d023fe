/* options_file.c: the configuration file.
 *
 * One "name = value" a line. Spaces around both are dropped. A value may stand in double quotes, with \" and \\ inside.
 * '#' begins a comment at the start of a line, or after a space outside quotes. */
#include "options/options.h"

#include "base/given_file.h"

#include <errno.h>
#include <string.h>

typedef struct {
    const char *path;
    int number;
    char *message;
    size_t size;
} line_place;

static bool refuse(const line_place *at, const char *what)
{
    snprintf(at->message, at->size, "%s:%d: %s", at->path, at->number, what);
    return false;
}

static char *trim(char *text)
{
    static const char SPACE[] = " \t\r\n";
    text += strspn(text, SPACE);
    size_t len = strlen(text);
    while (len > 0 && strchr(SPACE, text[len - 1]))
        len--;
    text[len] = '\0';
    return text;
}

/* The value without its quotes or a comment, in place; false where quotes are not closed or something follows them. */
static bool read_value(char *text)
{
    char *out = text, *in = text + 1;
    if (text[0] != '"') {
        while (*out && !(*out == '#' && (out == text || out[-1] == ' ' || out[-1] == '\t')))
            out++;
        *out = '\0';
        trim(text); /* its start is trimmed already */
        return true;
    }
    while (*in && *in != '"') {
        if (*in == '\\' && (in[1] == '"' || in[1] == '\\'))
            in++;
        *out++ = *in++;
    }
    const bool closed = *in == '"';
    in += closed + strspn(in + closed, " \t");
    const bool ends = *in == '\0' || *in == '#';
    *out = '\0';
    return closed && ends;
}

static bool take_line(server_options *o, char *text, const line_place *at)
{
    const uz_option_table table = DAEMON_OPTIONS;
    char why[256];
    text = trim(text);
    if (!text[0] || text[0] == '#')
        return true;
    char *equals = strchr(text, '=');
    if (!equals)
        return refuse(at, "a line must be \"name = value\", or begin with '#'");
    *equals = '\0';
    char *name = trim(text), *value = trim(equals + 1);
    const uz_option *row = uz_option_find(table, OPTION_SETTING, name, strlen(name));
    if (!row) {
        char what[256];
        const char *meant = uz_option_closest(DAEMON_OPTIONS, OPTION_SETTING, name, strlen(name));
        if (meant)
            snprintf(what, sizeof what, "there is no option \"%.60s\": did you mean \"%s\"?", name, meant);
        else
            snprintf(what, sizeof what, "there is no option \"%.60s\": uzawad --help lists them", name);
        return refuse(at, what);
    }
    if (strcmp(name, "config") == 0)
        return refuse(at, "a file can't name another one: take this line out");
    int *line = &o->line[row - table.rows];
    if (*line) {
        snprintf(why, sizeof why, "%s stands in line %d already: keep one of them", name, *line);
        return refuse(at, why);
    }
    if (!read_value(value))
        return refuse(at, "the quotes of this value are not closed, or something follows them");
    if (!options_set(o, row, value, why, sizeof why))
        return refuse(at, why);
    o->source[row - table.rows] = FROM_FILE;
    *line = at->number;
    return true;
}

bool options_read_file(server_options *o, const char *path, char *message, size_t size)
{
    char text[OPTION_PATH + 256];
    line_place at = {.path = path, .message = message, .size = size};
    FILE *file = given_file_open(path);
    if (!file) {
        snprintf(message, size, "cannot read the configuration %s: %s", path, strerror(errno));
        return false;
    }
    bool ok = true;
    while (ok && fgets(text, sizeof text, file)) {
        at.number++;
        if (!strchr(text, '\n') && !feof(file))
            ok = refuse(&at, "this line is too long, or has a NUL byte");
        else
            ok = take_line(o, text, &at);
    }
    if (ok && ferror(file)) {
        snprintf(message, size, "cannot read the configuration %s: %s", path, strerror(errno));
        ok = false;
    }
    fclose(file);
    return ok;
}
