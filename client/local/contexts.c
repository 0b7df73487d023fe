#include "local/contexts.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { ROOM = 1024 };

/* The text without blanks at both ends, in place. */
static char *trimmed(char *text)
{
    text += strspn(text, " \t\r\n");
    for (size_t len = strlen(text); len > 0 && strchr(" \t\r\n", text[len - 1]); len--)
        text[len - 1] = '\0';
    return text;
}

static bool file_name(char path[ROOM])
{
    const char *config = getenv("XDG_CONFIG_HOME"), *home = getenv("HOME");
    const int used = config && *config ? snprintf(path, ROOM, "%s/uzawa/config", config)
                     : home && *home   ? snprintf(path, ROOM, "%s/.config/uzawa/config", home)
                                       : -1;
    return used > 0 && used < ROOM;
}

/* Where a key's value goes; NULL: no such key. */
static char *member_of(client_context *out, const char *key)
{
    return strcmp(key, "server") == 0  ? out->server
           : strcmp(key, "token") == 0 ? out->token
           : strcmp(key, "ca") == 0    ? out->ca
                                       : NULL;
}

/* The section of that name, or with name "" the choice of the file, put into `choice`. *found: the section is there. */
static bool read_section(client_context *out, char choice[ROOM], bool *found, FILE *file, const char *name,
                         const char *path, char *message, size_t size)
{
    char line[2 * ROOM], *text;
    bool here = false, head = true;
    int number = 0;
    *found = false;
    while (fgets(line, sizeof line, file)) {
        number++;
        text = trimmed(line);
        if (*text == '\0' || *text == '#')
            continue;
        const size_t len = strlen(text);
        if (*text == '[' && text[len - 1] == ']') {
            text[len - 1] = '\0';
            head = false;
            here = *name && strcmp(trimmed(text + 1), name) == 0;
            *found = *found || here;
            continue;
        }
        char *equals = strchr(text, '=');
        if (equals)
            *equals = '\0';
        const char *key = trimmed(text), *value = equals ? trimmed(equals + 1) : NULL;
        client_context spare;
        char *to = head ? (strcmp(key, "context") == 0 ? choice : NULL) : member_of(here ? out : &spare, key);
        if (!value || !to || strlen(value) >= ROOM) {
            snprintf(message, size, "%.300s, line %d: \"%.60s\" is %s", path, number, key,
                     !value ? "no [name] and no key = value"
                     : !to  ? "not known: a context has server, token, ca, and before the first one stands context"
                            : "too long");
            return false;
        }
        strcpy(to, value);
    }
    return true;
}

bool client_context_find(client_context *out, const char *name, char *message, size_t size)
{
    char path[ROOM], choice[ROOM] = "";
    struct stat info;
    bool found = false, good = true;
    memset(out, 0, sizeof *out);
    FILE *file = file_name(path) ? fopen(path, "re") : NULL;
    if (!file) {
        const bool there = errno != ENOENT && errno != ENOTDIR;
        if (name || there)
            snprintf(message, size, "%.300s, where contexts are: %s", file_name(path) ? path : "no home folder",
                     strerror(errno));
        return !name && !there;
    }
    if (!name) {
        good = read_section(out, choice, &found, file, "", path, message, size);
        rewind(file);
        name = choice;
    }
    if (good && *name && (good = read_section(out, choice, &found, file, name, path, message, size)) && !found) {
        snprintf(message, size, "%.300s has no context [%.60s]", path, name);
        good = false;
    }
    if (good && found && !out->server[0]) {
        snprintf(message, size, "%.300s: the context [%.60s] has no server", path, name);
        good = false;
    }
    if (good && out->token[0] && (fstat(fileno(file), &info) != 0 || (info.st_mode & 077) != 0)) {
        snprintf(message, size, "%.300s has a token in it that others may read: chmod 600 it", path);
        good = false;
    }
    fclose(file);
    return good;
}
