/* schema.h: checks values against the embedded schema files.
 *
 * A part of JSON Schema 2020-12: type, const, enum, minimum, maximum, exclusiveMinimum, exclusiveMaximum, minLength,
 * maxLength, items, minItems, maxItems, uniqueItems, properties, additionalProperties, required, dependentRequired,
 * minProperties, maxProperties, oneOf, anyOf, if/then/else, $ref (within a file or to another), $defs, boolean schemas,
 * annotations. A schema with any other keyword is refused when it is loaded, so that nothing is silently not checked.
 *
 * oneOf and anyOf must be decidable by looking at one place (the type of the value, or one required key with a const),
 * so that an error always names the culprit and not the union. */
#ifndef SERVER_CODEC_SCHEMA_H
#define SERVER_CODEC_SCHEMA_H

#include "codec/embedded.h"
#include "codec/json.h"

/* Source: JSON Schema: A Media Type for Describing JSON Documents, draft 2020-12. */
typedef struct {
    const char *name;
    json_tree tree;
} schema_file;
typedef struct {
    schema_file *files; /* count; only read after loading */
    size_t count;
} schemas;

/* Parses and checks these files, whose names and texts must outlive what is made of them; NULL: every embedded one but
 * openapi.json, which is no schema. NULL: message. */
schemas *schemas_load(const embedded_file *files, size_t count, char *message, size_t size);
void schemas_free(schemas *all);

/* Checks a value against the file `name`. False: *problem is the first violation, 422 with code unknown_key,
 * missing_key, wrong_type, out_of_range, not_allowed, and a pointer. May be called from many threads. */
bool schemas_check(const schemas *all, const char *name, const json_value *value, problem_details *problem);

/* Violations, the first of each value that has some: at most `most` in a list of the caller's. */
typedef struct {
    problem_details *list;
    size_t count, most;
} schema_mistakes;
/* All of them, in the order of the schema, within out->most; count 0: there are none, or no such file. */
void schemas_check_all(const schemas *all, const char *name, const json_value *value, schema_mistakes *out);

/* ---- shared by schema.c (loading), schema_check.c (checking) and quantity.c */

/* A schema and the file that its references start from. */
typedef struct {
    const schemas *all;
    const schema_file *file;
    const json_value *node;
} schema_at;

/* Types as a set of bits; SCHEMA_INTEGER is the whole numbers, so "number" is both bits. */
enum {
    SCHEMA_NULL = 1,
    SCHEMA_BOOLEAN = 2,
    SCHEMA_INTEGER = 4,
    SCHEMA_FRACTION = 8,
    SCHEMA_STRING = 16,
    SCHEMA_ARRAY = 32,
    SCHEMA_OBJECT = 64,
    SCHEMA_ANY = 127
};

/* How a keyword's argument holds further schemas. */
typedef enum { SHAPE_NONE, SHAPE_SCHEMA, SHAPE_LIST, SHAPE_MAP, SHAPE_REF } schema_shape;

/* False if the keyword is not one of ours. */
bool schema_keyword(const char *name, schema_shape *shape);

schema_at schema_root(const schemas *all, const char *name); /* node NULL: there is no such file */
schema_at schema_child(schema_at at, const json_value *node);
/* Follows $ref until there is none; node NULL if it leads nowhere. */
schema_at schema_resolve(schema_at at);
/* The types that the resolved schema's "type" allows; SCHEMA_ANY without one; 0 if it is malformed. */
unsigned schema_types(schema_at at);
/* The required property that has a "const" in the resolved schema, and that const; NULL if none. */
const char *schema_discriminator(schema_at at, const json_value **value);

#endif
