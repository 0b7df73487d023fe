/* schema.c: loading: every keyword known, every reference resolved, every choice decidable, before the first request.
 */
#include "codec/schema.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where loading found a fault: the first one is kept. */
typedef struct {
    char *message;
    size_t size;
    bool failed;
} fault;

enum { MAX_REFS = 16 }; /* a chain of references longer than this is a circle */

static void audit(fault *f, schema_at at, int depth);

static void fail(fault *f, const char *file, const char *what, const char *name)
{
    if (!f->failed)
        snprintf(f->message, f->size, "schemas/%s: %s \"%s\"", file, what, name);
    f->failed = true;
}

schemas *schemas_load(const embedded_file *files, size_t count, char *message, size_t size)
{
    fault f = {message, size, false};
    problem_details problem;
    const size_t n = files ? count : embedded_count();
    schemas *all = calloc(1, sizeof *all);
    if (all)
        all->files = calloc(n + 1, sizeof *all->files);
    if (!all || !all->files)
        fail(&f, "", "no memory for", "the schemas");
    for (size_t i = 0; i < n && !f.failed; i++) {
        const embedded_file file = files ? files[i] : embedded_at(i);
        if (!files && strcmp(file.name, "openapi.json") == 0)
            continue;
        schema_file *to = &all->files[all->count++];
        to->name = file.name;
        if (!json_scan(&to->tree, file.text, file.len, &problem))
            fail(&f, file.name, "no JSON:", problem.detail);
    }
    for (size_t i = 0; !f.failed && i < all->count; i++)
        audit(&f, schema_root(all, all->files[i].name), 0);
    if (!f.failed)
        return all;
    schemas_free(all);
    return NULL;
}

void schemas_free(schemas *all)
{
    if (!all)
        return;
    for (size_t i = 0; i < all->count; i++)
        json_clear(&all->files[i].tree);
    free(all->files);
    free(all);
}

/* ------------------------------------------------------------ references */

schema_at schema_root(const schemas *all, const char *name)
{
    for (size_t i = 0; i < all->count; i++)
        if (strcmp(all->files[i].name, name) == 0)
            return (schema_at){all, &all->files[i], all->files[i].tree.root};
    return (schema_at){all, NULL, NULL};
}

schema_at schema_child(schema_at at, const json_value *node)
{
    at.node = node;
    return at;
}

schema_at schema_resolve(schema_at at)
{
    for (int i = 0; i < MAX_REFS && at.node; i++) {
        char name[64];
        const char *ref = json_text(json_get(at.node, "$ref"));
        if (!ref)
            return at;
        /* "#/$defs/x", "file.json" or "file.json#/$defs/x"; no escapes in it */
        const size_t len = strcspn(ref, "#");
        snprintf(name, sizeof name, "%.*s", (int)len, ref);
        at = len > 0 ? schema_root(at.all, name) : schema_child(at, at.file->tree.root);
        for (ref += len; at.node && *ref;) {
            const char *start = ref + 1; /* behind '#' or '/' */
            ref = strchrnul(start, '/');
            if (ref > start)
                at.node = json_get_n(at.node, start, (size_t)(ref - start));
        }
    }
    at.node = NULL;
    return at;
}

unsigned schema_types(schema_at at)
{
    static const struct {
        const char *name;
        unsigned bits;
    } TYPES[] = {{"null", SCHEMA_NULL},       {"boolean", SCHEMA_BOOLEAN},
                 {"integer", SCHEMA_INTEGER}, {"number", SCHEMA_INTEGER | SCHEMA_FRACTION},
                 {"string", SCHEMA_STRING},   {"array", SCHEMA_ARRAY},
                 {"object", SCHEMA_OBJECT}};
    const json_value *type = json_get(at.node, "type");
    const bool list = json_is_list(type);
    json_value room;
    unsigned all = 0;
    if (!type)
        return SCHEMA_ANY;
    for (size_t i = 0; i < (list ? json_size(type) : 1); i++) {
        unsigned bits = 0;
        for (size_t k = 0; k < sizeof TYPES / sizeof TYPES[0]; k++)
            if (json_text_is(list ? json_item(type, i, &room) : type, TYPES[k].name))
                bits = TYPES[k].bits;
        if (bits == 0)
            return 0;
        all |= bits;
    }
    return all;
}

const char *schema_discriminator(schema_at at, const json_value **value)
{
    const json_value *properties = json_get(at.node, "properties"), *required = json_get(at.node, "required");
    json_value room;
    for (size_t i = 0; i < json_size(required); i++) {
        const char *key = json_text(json_item(required, i, &room));
        *value = key ? json_get(json_get(properties, key), "const") : NULL;
        if (*value)
            return key;
    }
    return NULL;
}

/* ------------------------------------------------------------- auditing */

/* Can no value be both? */
static bool apart(schema_at a, schema_at b)
{
    const json_value *x, *y;
    if ((schema_types(a) & schema_types(b)) == 0)
        return true;
    if (schema_types(a) != SCHEMA_OBJECT || schema_types(b) != SCHEMA_OBJECT)
        return false;
    const char *i = schema_discriminator(a, &x), *j = schema_discriminator(b, &y);
    return i && j && strcmp(i, j) == 0 && !json_same(x, y);
}

/* A schema and, by way of its keywords, all that it holds. */
static void audit(fault *f, schema_at at, int depth)
{
    json_value room, other;
    if (json_is(at.node, JSON_IS_BOOLEAN))
        return;
    if (!json_is(at.node, JSON_IS_OBJECT) || depth > JSON_MAX_DEPTH) {
        fail(f, at.file->name, "no schema where one was expected", "");
        return;
    }
    if (schema_types(at) == 0)
        fail(f, at.file->name, "an unknown type in", "type");
    /* short enough for a comparison of all pairs */
    if (json_get(at.node, "uniqueItems") && !(json_number(json_get(at.node, "maxItems"), 1e9) <= JSON_SHORT_ARRAY))
        fail(f, at.file->name, "no small maxItems beside", "uniqueItems");
    for (size_t k = 0; k < at.node->count && !f->failed; k++) {
        const json_value *argument = &at.node->items[k];
        const bool object = json_is(argument, JSON_IS_OBJECT);
        schema_shape shape = SHAPE_NONE;
        if (!schema_keyword(argument->key, &shape))
            fail(f, at.file->name, "a keyword that is not checked here:", argument->key);
        if (shape == SHAPE_REF && !schema_resolve(at).node)
            fail(f, at.file->name, "a reference leads nowhere:", json_text(argument) ? json_text(argument) : "");
        if (shape == SHAPE_SCHEMA)
            audit(f, schema_child(at, argument), depth + 1);
        for (size_t i = 0; ((shape == SHAPE_MAP && object) || shape == SHAPE_LIST) && i < json_size(argument); i++)
            audit(f, schema_child(at, shape == SHAPE_MAP ? &argument->items[i] : json_item(argument, i, &room)),
                  depth + 1);
        for (size_t i = 0; shape == SHAPE_LIST && !f->failed && i < json_size(argument); i++)
            for (size_t j = 0; j < i; j++)
                if (!apart(schema_resolve(schema_child(at, json_item(argument, i, &room))),
                           schema_resolve(schema_child(at, json_item(argument, j, &other)))))
                    fail(f, at.file->name, "two branches that no type and no const tells apart in", argument->key);
    }
}
