/* What a refused value is told. */
#include "codec/schema_visit.h"
#include "codec/problem.h"
#include "text/edit_distance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

bool visit_refuse(const visit *v, const char *code, const char *format, ...)
{
    char text[400];
    va_list args;
    if (!v->problem)
        return false;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    problem_set(v->problem, 422, code, v->path, "%s", "");
    problem_add(v->problem, "%s %s", v->problem->pointer[0] ? v->problem->pointer : "The request", text);
    return false;
}

bool visit_no_memory(const visit *v)
{
    if (v->problem)
        problem_set(v->problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return false;
}

const char *visit_string(const visit *v, size_t *len)
{
    const json_lifted *lifted = json_doc_lifted(v->doc, v->value);
    *len = lifted ? lifted->len : json_string_length(v->value);
    return lifted ? lifted->text : json_string_value(v->value);
}

unsigned visit_type(const visit *v)
{
    const json_lifted *lifted = json_doc_lifted(v->doc, v->value);
    double x = json_real_value(v->value);
    switch (json_typeof(v->value)) {
    case JSON_OBJECT:
        return SCHEMA_OBJECT;
    case JSON_ARRAY:
        return SCHEMA_ARRAY;
    case JSON_STRING:
        return SCHEMA_STRING;
    case JSON_INTEGER:
        return lifted && lifted->is_text ? SCHEMA_STRING : SCHEMA_ARRAY;
    case JSON_REAL:
        return x == floor(x) ? SCHEMA_INTEGER : SCHEMA_FRACTION;
    case JSON_NULL:
        return SCHEMA_NULL;
    default:
        return SCHEMA_BOOLEAN;
    }
}

/* "a string or an array" for a set of types. */
static void name_types(char *out, size_t size, unsigned types)
{
    static const struct {
        unsigned bits;
        const char *name;
    } NAMES[] = {{SCHEMA_INTEGER | SCHEMA_FRACTION, "a number"},
                 {SCHEMA_INTEGER, "a whole number"},
                 {SCHEMA_STRING, "a string"},
                 {SCHEMA_ARRAY, "an array"},
                 {SCHEMA_OBJECT, "an object"},
                 {SCHEMA_BOOLEAN, "true or false"},
                 {SCHEMA_NULL, "null"},
                 {SCHEMA_FRACTION, "a number"}};
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0] && used < size; i++) {
        if ((types & NAMES[i].bits) != NAMES[i].bits)
            continue;
        used += (size_t)snprintf(out + used, size - used, "%s%s", used ? " or " : "", NAMES[i].name);
        types &= ~NAMES[i].bits;
    }
}

/* The value for a person: a short string or number as it is, else its type. */
void visit_describe(char *out, size_t size, const visit *v)
{
    size_t len = 0;
    unsigned type = visit_type(v);
    const char *text = visit_string(v, &len);
    if (type == SCHEMA_STRING && text)
        problem_quote(out, size < 48 ? size : 48, text, len);
    else if (json_is_real(v->value))
        snprintf(out, size, "%.15g", json_real_value(v->value));
    else
        name_types(out, size, type);
}

bool visit_wrong_type(const visit *v, unsigned allowed)
{
    char want[128], got[64];
    name_types(want, sizeof want, allowed);
    name_types(got, sizeof got, visit_type(v));
    if (visit_type(v) == SCHEMA_FRACTION && (allowed & SCHEMA_INTEGER))
        visit_describe(got, sizeof got, v);
    return visit_refuse(v, "wrong_type", "must be %s, not %s.", want, got);
}

/* Appends `Did you mean "x"?` if one of the names is close. */
void visit_suggest(const visit *v, const char *text, size_t len, const char *const *names, size_t count)
{
    int closest = text && v->problem ? uz_closest(text, len, names, count) : -1;
    if (closest >= 0)
        problem_add(v->problem, " Did you mean \"%s\"?", names[closest]);
}

void visit_list(const visit *v, const char *const *names, size_t count)
{
    for (size_t i = 0; v->problem && i < count; i++)
        problem_add(v->problem, "%s\"%s\"", i ? ", " : "", names[i]);
}
