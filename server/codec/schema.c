/* Loading: every keyword known, every reference resolved, every choice decidable, before the first request. */
#include "codec/schema.h"
#include "codec/embedded.h"

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

static void fail(fault *f, const char *file, const char *what, const char *name)
{
    if (!f->failed)
        snprintf(f->message, f->size, "schemas/%s: %s \"%s\"", file, what, name);
    f->failed = true;
}

schema_at schema_child(schema_at at, const json_t *node)
{
    at.node = node;
    return at;
}

/* The node at a fragment such as "#/$defs/vector"; no escapes in it. */
static const json_t *fragment(const json_t *root, const char *text)
{
    while (root && *text) {
        const char *start = ++text; /* behind '#' or '/' */
        text = strchrnul(start, '/');
        if (text > start)
            root = json_object_getn(root, start, (size_t)(text - start));
    }
    return root;
}

/* What the reference of a schema points at: "#/$defs/x", "file.json" or "file.json#/$defs/x". */
static schema_at follow(schema_at at, const char *ref)
{
    char name[64];
    size_t len = strcspn(ref, "#");
    if (len > 0) {
        snprintf(name, sizeof name, "%.*s", (int)len, ref);
        void *entry = json_object_iter_at((json_t *)at.files, name);
        at.file = entry ? json_object_iter_key(entry) : NULL;
        at.node = entry ? json_object_iter_value(entry) : NULL;
    } else {
        at.node = json_object_get(at.files, at.file);
    }
    at.node = fragment(at.node, ref + len);
    return at;
}

schema_at schema_resolve(schema_at at)
{
    for (int i = 0; i < MAX_REFS && at.node; i++) {
        const char *ref = json_string_value(json_object_get(at.node, "$ref"));
        if (!ref)
            return at;
        at = follow(at, ref);
    }
    at.node = NULL;
    return at;
}

static unsigned type_bits(const json_t *name)
{
    static const struct {
        const char *name;
        unsigned bits;
    } TYPES[] = {{"null", SCHEMA_NULL},       {"boolean", SCHEMA_BOOLEAN},
                 {"integer", SCHEMA_INTEGER}, {"number", SCHEMA_INTEGER | SCHEMA_FRACTION},
                 {"string", SCHEMA_STRING},   {"array", SCHEMA_ARRAY},
                 {"object", SCHEMA_OBJECT}};
    for (size_t i = 0; json_is_string(name) && i < sizeof TYPES / sizeof TYPES[0]; i++)
        if (strcmp(TYPES[i].name, json_string_value(name)) == 0)
            return TYPES[i].bits;
    return 0;
}

unsigned schema_types(schema_at at)
{
    const json_t *type = json_object_get(at.node, "type");
    unsigned all = 0;
    if (!type)
        return SCHEMA_ANY;
    if (!json_is_array(type))
        return type_bits(type);
    for (size_t i = 0; i < json_array_size(type); i++) {
        unsigned bits = type_bits(json_array_get(type, i));
        if (bits == 0)
            return 0;
        all |= bits;
    }
    return all;
}

const char *schema_discriminator(schema_at at, const json_t **value)
{
    const json_t *properties = json_object_get(at.node, "properties");
    const json_t *required = json_object_get(at.node, "required");
    for (size_t i = 0; i < json_array_size(required); i++) {
        const char *key = json_string_value(json_array_get(required, i));
        *value = key ? json_object_get(json_object_get(properties, key), "const") : NULL;
        if (*value)
            return key;
    }
    return NULL;
}

/* ------------------------------------------------------------- loading */

static bool apart(schema_at a, schema_at b)
{
    const json_t *x, *y;
    if ((schema_types(a) & schema_types(b)) == 0)
        return true;
    if (schema_types(a) != SCHEMA_OBJECT || schema_types(b) != SCHEMA_OBJECT)
        return false;
    const char *i = schema_discriminator(a, &x), *j = schema_discriminator(b, &y);
    return i && j && strcmp(i, j) == 0 && !json_equal(x, y);
}

static void audit_choice(fault *f, schema_at at, const char *keyword)
{
    const json_t *list = json_object_get(at.node, keyword);
    for (size_t i = 0; i < json_array_size(list); i++)
        for (size_t j = 0; j < i; j++) {
            schema_at a = schema_resolve(schema_child(at, json_array_get(list, i)));
            schema_at b = schema_resolve(schema_child(at, json_array_get(list, j)));
            if (!apart(a, b))
                fail(f, at.file, "two branches that no type and no const tells apart in", keyword);
        }
}

static void audit(fault *f, schema_at at, int depth);

/* Walks into the schemas that the argument of a keyword holds. */
static void audit_argument(fault *f, schema_at at, const char *keyword, schema_shape shape, int depth)
{
    json_t *argument = json_object_get(at.node, keyword), *item;
    const char *key;
    size_t i;
    switch (shape) {
    case SHAPE_NONE:
        break;
    case SHAPE_REF:
        if (!schema_resolve(at).node)
            fail(f, at.file, "a reference leads nowhere:", json_is_string(argument) ? json_string_value(argument) : "");
        break;
    case SHAPE_SCHEMA:
        audit(f, schema_child(at, argument), depth);
        break;
    case SHAPE_LIST:
        json_array_foreach(argument, i, item)
        {
            audit(f, schema_child(at, item), depth);
        }
        if (!f->failed)
            audit_choice(f, at, keyword);
        break;
    case SHAPE_MAP:
        json_object_foreach(argument, key, item)
        {
            audit(f, schema_child(at, item), depth);
        }
        break;
    }
}

/* Short enough for a comparison of all pairs, and never lifted. */
static bool short_array(schema_at at)
{
    const json_t *most = json_object_get(at.node, "maxItems");
    return json_is_number(most) && json_number_value(most) <= JSON_LIFT_NUMBERS;
}

static void audit(fault *f, schema_at at, int depth)
{
    const char *key;
    json_t *value;
    schema_shape shape;
    if (json_is_boolean(at.node))
        return;
    if (!json_is_object(at.node) || depth > JSON_MAX_DEPTH) {
        fail(f, at.file, "no schema where one was expected", "");
        return;
    }
    if (schema_types(at) == 0)
        fail(f, at.file, "an unknown type in", "type");
    if (json_object_get(at.node, "uniqueItems") && !short_array(at))
        fail(f, at.file, "no small maxItems beside", "uniqueItems");
    json_object_foreach((json_t *)at.node, key, value)
    {
        if (f->failed)
            return;
        if (schema_keyword(key, &shape))
            audit_argument(f, at, key, shape, depth + 1);
        else
            fail(f, at.file, "a keyword that is not checked here:", key);
    }
}

/* By our own scanner: jansson's drops bytes of a token when it finds no memory for it, and goes on. */
static void load_file(fault *f, json_t *files, embedded_file file)
{
    json_doc doc;
    problem_details problem;
    if (!json_scan(&doc, file.text, file.len, &problem))
        fail(f, file.name, "no JSON:", problem.detail);
    else if (doc.n_lifted > 0)
        fail(f, file.name, "a long array or string in", "the file");
    else if (json_object_set(files, file.name, doc.root) != 0)
        fail(f, file.name, "no memory for", file.name);
    json_doc_clear(&doc);
}

schemas *schemas_adopt(json_t *files, char *message, size_t size)
{
    fault f = {message, size, false};
    const char *name;
    json_t *file;
    json_object_foreach(files, name, file)
    {
        if (!f.failed && strcmp(name, "openapi.json") != 0)
            audit(&f, (schema_at){files, name, file}, 0);
    }
    schemas *all = f.failed ? NULL : calloc(1, sizeof *all);
    if (all)
        all->files = files;
    else
        json_decref(files);
    if (!all)
        fail(&f, "", "no memory for", "the schemas");
    return all;
}

schemas *schemas_load(char *message, size_t size)
{
    fault f = {message, size, false};
    json_t *files = json_object();
    if (!files)
        fail(&f, "", "no memory for", "the schemas");
    for (size_t i = 0; embedded_at(i).name && !f.failed; i++)
        load_file(&f, files, embedded_at(i));
    if (!f.failed)
        return schemas_adopt(files, message, size);
    json_decref(files);
    return NULL;
}

void schemas_free(schemas *all)
{
    if (!all)
        return;
    json_decref(all->files);
    free(all);
}
