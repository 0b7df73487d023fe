/* schema_visit.h: a value at its place, against a schema; inside the schema checker only. */
#ifndef SERVER_CODEC_SCHEMA_VISIT_H
#define SERVER_CODEC_SCHEMA_VISIT_H

#include "codec/schema.h"

typedef struct {
    const json_doc *doc;
    problem_details *problem; /* NULL: only the verdict is wanted */
    schema_at at;
    const json_t *value;
    const json_path *path;
} visit;

/* One SCHEMA_ bit; a whole number is SCHEMA_INTEGER however it is written. */
unsigned visit_type(const visit *v);
/* The bytes of a string, lifted or not; NULL if it is none. */
const char *visit_string(const visit *v, size_t *len);

/* Fills v->problem with "PLACE message"; returns false, so that a rule ends in `return visit_refuse(...)`. */
bool visit_refuse(const visit *v, const char *code, const char *format, ...) __attribute__((format(printf, 3, 4)));
bool visit_no_memory(const visit *v); /* 503 */
bool visit_wrong_type(const visit *v, unsigned allowed);

/* The value for a person: a short string or a number as it is, else its type. */
void visit_describe(char *out, size_t size, const visit *v);
/* Append to the detail: `Did you mean "x"?` if one of the names is close to text; the names, quoted. */
void visit_suggest(const visit *v, const char *text, size_t len, const char *const *names, size_t count);
void visit_list(const visit *v, const char *const *names, size_t count);

#endif
