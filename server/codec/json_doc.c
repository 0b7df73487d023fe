#include "codec/json_doc.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void json_doc_clear(json_doc *doc)
{
    if (!doc)
        return;
    for (size_t i = 0; i < doc->n_lifted; i++) {
        free(doc->lifted[i].numbers);
        free(doc->lifted[i].text);
    }
    free(doc->lifted);
    free(doc->uploads);
    json_decref(doc->root);
    *doc = (json_doc){0};
}

json_lifted *json_doc_lifted(const json_doc *doc, const json_t *value)
{
    if (!json_is_integer(value))
        return NULL;
    json_int_t i = json_integer_value(value);
    return i >= 0 && (size_t)i < doc->n_lifted ? &doc->lifted[i] : NULL;
}

/* One step as it stands in a pointer, at most size - 1 bytes; returns its full length. */
static size_t write_step(char *out, size_t size, const json_path *step)
{
    size_t used = 0;
    if (!step->key)
        return (size_t)snprintf(out, size, "/%zu", step->index);
    if (size > 0)
        out[0] = '/';
    used = 1;
    for (size_t i = 0; i < step->key_len; i++) {
        unsigned char c = (unsigned char)step->key[i];
        const char *shown = c == '~' ? "~0" : c == '/' ? "~1" : NULL;
        char one[2] = {(char)(c < 0x20 || c == 0x7f ? '?' : c), '\0'};
        for (shown = shown ? shown : one; *shown; shown++, used++)
            if (used < size)
                out[used] = *shown;
    }
    if (used < size)
        out[used] = '\0';
    return used;
}

/* Appends the steps from the root down; false when one did not fit, and then nothing more is written. */
static bool write_steps(char *out, size_t size, size_t *used, const json_path *path)
{
    if (!path)
        return true;
    if (!write_steps(out, size, used, path->parent))
        return false;
    size_t step = write_step(out + *used, size - *used, path);
    if (step >= size - *used) {
        out[*used] = '\0';
        return false;
    }
    *used += step;
    return true;
}

void json_path_write(char *out, size_t size, const json_path *path)
{
    size_t used = 0;
    if (size == 0)
        return;
    out[0] = '\0';
    write_steps(out, size, &used, path);
}
