#include "request/tags.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

/* Where in the text the tags go: bytes [from, to) are replaced. */
typedef struct {
    size_t from, to;
    bool has_tags, empty_object;
} tags_place;

static size_t skip_space(const client_buffer *text, size_t at)
{
    while (at < text->len && memchr(" \t\r\n", text->data[at], 4))
        at++;
    return at;
}

/* Index after the string that begins at `at`, or text->len. */
static size_t skip_string(const client_buffer *text, size_t at)
{
    for (at++; at < text->len && text->data[at] != '"'; at++)
        if (text->data[at] == '\\')
            at++;
    return at < text->len ? at + 1 : text->len;
}

/* False: the text is no object as far as can be seen. */
static bool find_place(tags_place *place, const client_buffer *text)
{
    static const char KEY[] = "\"tags\"";
    size_t at = skip_space(text, 0);
    if (at >= text->len || text->data[at] != '{')
        return false;
    *place = (tags_place){.from = at + 1, .to = at + 1};
    at = skip_space(text, at + 1);
    place->empty_object = at < text->len && text->data[at] == '}';
    while (at < text->len && text->data[at] == '"') {
        bool is_tags = text->len - at >= sizeof KEY - 1 && memcmp(text->data + at, KEY, sizeof KEY - 1) == 0;
        at = skip_space(text, skip_string(text, at));
        if (at >= text->len || text->data[at] != ':')
            return false;
        size_t from = skip_space(text, at + 1);
        /* behind the value: at the ',' or bracket that ends it in this object */
        int depth = 0;
        for (at = from; at < text->len && (depth > 0 || !memchr(",}]", text->data[at], 3));) {
            const char c = text->data[at];
            depth += (c == '{' || c == '[') - (c == '}' || c == ']');
            at = c == '"' ? skip_string(text, at) : at + 1;
        }
        if (is_tags) {
            *place = (tags_place){.from = from, .to = at, .has_tags = true};
            return true;
        }
        if (at < text->len && text->data[at] == ',')
            at = skip_space(text, at + 1);
    }
    return at < text->len && text->data[at] == '}';
}

bool client_tags_add(client_buffer *out, const client_buffer *body, const char *const *tags, int n_tags)
{
    tags_place place = {0};
    bool ok = true;
    char *text = NULL; /* the new array on one line */
    *out = (client_buffer){0};
    if (n_tags > 0 && find_place(&place, body)) {
        json_t *array =
            place.has_tags ? json_loadb(body->data + place.from, place.to - place.from, 0, NULL) : json_array();
        for (int i = 0; ok && json_is_array(array) && i < n_tags; i++) {
            bool has = false;
            for (size_t k = 0; k < json_array_size(array) && !has; k++) {
                const char *item = json_string_value(json_array_get(array, k));
                has = item && strcmp(item, tags[i]) == 0;
            }
            ok = has || json_array_append_new(array, json_string(tags[i])) == 0;
        }
        if (ok && json_is_array(array)) {
            text = json_dumps(array, JSON_COMPACT);
            ok = text != NULL;
        }
        json_decref(array);
    }
    if (!text)
        ok = ok && client_buffer_append(out, body->data, body->len);
    else {
        ok = client_buffer_append(out, body->data, place.from) &&
             (place.has_tags || client_buffer_append(out, "\"tags\":", 7)) &&
             client_buffer_append(out, text, strlen(text));
        /* An array that was written over several lines keeps its line breaks. */
        for (size_t i = place.from; ok && i < place.to; i++)
            if (body->data[i] == '\n')
                ok = client_buffer_append(out, "\n", 1);
        ok = ok && (place.has_tags || place.empty_object || client_buffer_append(out, ",", 1)) &&
             client_buffer_append(out, body->data + place.to, body->len - place.to);
    }
    if (!ok) {
        free(out->data);
        *out = (client_buffer){0};
    }
    free(text);
    return ok;
}
