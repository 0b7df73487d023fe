#include "request/paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool client_path_read(client_path *out, const json_t *request, const char *text, size_t len, char *message, size_t size)
{
    /* What a request may have at its top (schemas/request.json). */
    static const char *const TOP[] = {"problem",  "cases",         "solver",  "name",   "tags",
                                      "priority", "queue_limit_s", "webhook", "assert", "answer"};
    size_t room = sizeof out->text;
    *out = (client_path){0};
    if (len >= room || !len) {
        snprintf(message, size, len ? "a path is at most %zu characters long" : "the path is empty", room - 1);
        return false;
    }
    memcpy(out->text, text, len);
    out->text[len] = '\0';
    char key[256];
    snprintf(key, sizeof key, "%.*s", (int)strcspn(out->text, "."), out->text);
    bool is_top = json_object_get(request, key) != NULL;
    for (size_t i = 0; i < sizeof TOP / sizeof *TOP; i++)
        is_top = is_top || strcmp(TOP[i], key) == 0;
    if (!is_top)
        out->part[out->count++] = "problem";
    /* Split at dots in place. */
    for (char *at = out->text; out->count < CLIENT_PATH_PARTS && *at && *at != '.'; at++) {
        out->part[out->count++] = at;
        at += strcspn(at, ".");
        if (!*at)
            return true;
        *at = '\0';
    }
    snprintf(message, size, "\"%.*s\" is no path: keys and indices with a dot between them, such as loads.1.traction.0",
             (int)len, text);
    return false;
}

/* The index that a part is, -1 if it is none. */
static long index_of(const char *part)
{
    char *end;
    if (!*part || strspn(part, "0123456789") != strlen(part) || strlen(part) > 9)
        return -1;
    return strtol(part, &end, 10);
}

static json_t *step(json_t *at, const char *part)
{
    if (json_is_object(at))
        return json_object_get(at, part);
    long i = json_is_array(at) ? index_of(part) : -1;
    return i >= 0 ? json_array_get(at, (size_t)i) : NULL;
}

static void say_missing(const client_path *path, int i, const json_t *at, char *message, size_t size)
{
    char so_far[280] = "the request", keys[400]; /* or "problem.loads" of the parts before */
    const char *part = path->part[i];
    size_t len = 0, count = json_array_size(at);
    for (int k = 0; k < i && len < sizeof so_far; k++)
        len += (size_t)snprintf(so_far + len, sizeof so_far - len, "%s%s", k ? "." : "", path->part[k]);
    if (json_is_object(at)) {
        const char *key;
        json_t *value;
        size_t used = 0;
        snprintf(keys, sizeof keys, "nothing");
        json_object_foreach((json_t *)at, key, value)
        {
            if (used < sizeof keys)
                used += (size_t)snprintf(keys + used, sizeof keys - used, "%s%s", used ? ", " : "", key);
        }
        snprintf(message, size, "%s has no \"%s\"; it has: %s", so_far, part, keys);
    } else if (!json_is_array(at))
        snprintf(message, size, "%s is a single value and has no \"%s\"", so_far, part);
    else if (!count)
        snprintf(message, size, "%s is an empty list and has no \"%s\"", so_far, part);
    else
        snprintf(message, size, "%s is a list of %zu: \"%s\" is none of its indices 0 to %zu", so_far, count, part,
                 count - 1);
}

json_t *client_path_get(const client_path *path, json_t *request, char *message, size_t size)
{
    json_t *at = request;
    for (int i = 0; i < path->count; i++) {
        json_t *next = step(at, path->part[i]);
        if (!next) {
            say_missing(path, i, at, message, size);
            return NULL;
        }
        at = next;
    }
    return at;
}

bool client_path_set(const client_path *path, json_t *request, json_t *value, char *message, size_t size)
{
    json_t *at = request, *next;
    const char *last = path->part[path->count - 1];
    const bool makes = strcmp(path->part[0], "solver") == 0 || strcmp(path->part[0], "webhook") == 0;
    for (int i = 0; i + 1 < path->count; i++, at = next) {
        next = step(at, path->part[i]);
        /* Under solver and webhook an object that is not there is made, and a word in its place gives way:
         * {"accuracy": "quick"}. */
        if (makes && !json_is_object(next) && !json_is_array(next) && json_is_object(at) &&
            json_object_set_new(at, path->part[i], json_object()) == 0)
            next = json_object_get(at, path->part[i]);
        if (!next) {
            say_missing(path, i, at, message, size);
            json_decref(value);
            return false;
        }
    }
    long i = json_is_array(at) ? index_of(last) : -1;
    bool ok = false;
    if (json_is_object(at))
        ok = json_object_set(at, last, value) == 0;
    else if (i >= 0 && (size_t)i < json_array_size(at))
        ok = json_array_set(at, (size_t)i, value) == 0;
    else if (i >= 0 && (size_t)i == json_array_size(at))
        ok = json_array_append(at, value) == 0;
    if (!ok)
        say_missing(path, path->count - 1, at, message, size);
    json_decref(value);
    return ok;
}

json_t *client_value_read(const char *text, size_t len)
{
    json_t *value = json_loadb(text, len, JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL);
    return value ? value : json_stringn(text, len);
}
