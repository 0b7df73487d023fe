/* schema_check.c: checking: one rule per keyword, in the order of the table, until the first violation; or on to other
 * members, where all are wanted. */
#include "codec/problem.h"
#include "codec/schema.h"
#include "text/edit_distance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MAX_NAMES = 64 }; /* candidates looked at for "did you mean" */

/* A value against a schema. */
typedef struct {
    problem_details *problem; /* NULL: only the verdict is wanted */
    schema_at at;
    const json_value *value;
    schema_mistakes *more; /* NULL: the first violation ends it */
} visit;

/* A keyword; the rule is NULL for an annotation, or one that another rule uses. One that bounds a number says of what
 * values. */
typedef struct keyword {
    const char *name;
    schema_shape shape;
    bool (*rule)(const visit *v, const json_value *argument, const struct keyword *k);
    enum { NUMBERS = 1, TEXTS, ARRAYS } of; /* the value, characters, items */
    enum { AT_LEAST, AT_MOST, ABOVE, BELOW } sense;
    const char *says; /* bound, number */
} keyword;

static bool check(const visit *v);

/* Keeps what *v->problem says. */
static void keep(const visit *v)
{
    if (v->more->count < v->more->most)
        v->more->list[v->more->count++] = *v->problem;
}

/* ------------------------------------------------------------- refusals */

static unsigned type_of(const json_value *value)
{
    static const unsigned TYPES[] = {
        [JSON_IS_NULL] = SCHEMA_NULL,     [JSON_IS_BOOLEAN] = SCHEMA_BOOLEAN, [JSON_IS_NUMBER] = SCHEMA_FRACTION,
        [JSON_IS_STRING] = SCHEMA_STRING, [JSON_IS_ARRAY] = SCHEMA_ARRAY,     [JSON_IS_NUMBERS] = SCHEMA_ARRAY,
        [JSON_IS_OBJECT] = SCHEMA_OBJECT};
    /* a whole number however it is written */
    return value->kind == JSON_IS_NUMBER && value->number == floor(value->number) ? SCHEMA_INTEGER : TYPES[value->kind];
}

/* Fills the problem with "PLACE message"; returns false, so that a rule ends in `return refuse(...)`. */
__attribute__((format(printf, 3, 4))) static bool refuse(const visit *v, const char *code, const char *format, ...)
{
    char text[400];
    va_list args;
    if (!v->problem)
        return false;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    problem_set(v->problem, 422, code, v->value, "%s", "");
    problem_add(v->problem, "%s %s", v->problem->pointer[0] ? v->problem->pointer : "The request", text);
    return false;
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

/* The value for a person: a string, shortened, or a number as it is, else its type. */
static void describe(char *out, size_t size, const json_value *value)
{
    enum { SHOWN = 48 };
    char beginning[SHOWN + 4];
    const size_t len = value->count < SHOWN ? value->count : SHOWN;
    if (value->kind == JSON_IS_STRING && value->is_long)
        problem_quote(out, size < SHOWN ? size : SHOWN, beginning, json_text_decode(beginning, value->text, len));
    else if (value->kind == JSON_IS_STRING)
        problem_quote(out, size < SHOWN ? size : SHOWN, value->text, value->count);
    else if (value->kind == JSON_IS_NUMBER)
        snprintf(out, size, "%.15g", value->number);
    else
        name_types(out, size, type_of(value));
}

static bool refuse_type(const visit *v, unsigned allowed)
{
    char want[128], got[64];
    name_types(want, sizeof want, allowed);
    name_types(got, sizeof got, type_of(v->value));
    if (type_of(v->value) == SCHEMA_FRACTION && (allowed & SCHEMA_INTEGER))
        describe(got, sizeof got, v->value);
    return refuse(v, "wrong_type", "must be %s, not %s.", want, got);
}

/* Appends the names, quoted, between two texts. */
static void add_names(const visit *v, const char *before, const char *const *names, size_t count, const char *after)
{
    if (!v->problem)
        return;
    problem_add(v->problem, "%s", before);
    for (size_t i = 0; i < count; i++)
        problem_add(v->problem, "%s\"%s\"", i ? ", " : "", names[i]);
    problem_add(v->problem, "%s", after);
}

/* Appends `Did you mean "x"?` if one of the names is close. */
static void suggest(const visit *v, const char *text, size_t len, const char *const *names, size_t count)
{
    const int closest = text && v->problem ? uz_closest(text, len, names, count) : -1;
    if (closest >= 0)
        problem_add(v->problem, " Did you mean \"%s\"?", names[closest]);
}

/* ------------------------------------------------------------- any value */

static bool rule_type(const visit *v, const json_value *argument, const keyword *k)
{
    const unsigned allowed = schema_types(v->at);
    (void)argument;
    (void)k;
    return (type_of(v->value) & allowed) != 0 || refuse_type(v, allowed);
}

/* Is it one of the scalars of a schema? */
static bool same_scalar(const json_value *value, const json_value *wanted)
{
    return json_is_list(wanted) || json_is(wanted, JSON_IS_OBJECT) ? value->kind == wanted->kind
                                                                   : json_same(value, wanted);
}

static bool rule_enum(const visit *v, const json_value *argument, const keyword *k)
{
    const char *names[MAX_NAMES];
    char got[64];
    size_t count = 0;
    json_value room;
    (void)k;
    for (size_t i = 0; i < json_size(argument); i++) {
        const json_value *item = json_item(argument, i, &room);
        if (same_scalar(v->value, item))
            return true;
        if (json_text(item) && count < MAX_NAMES)
            names[count++] = json_text(item);
    }
    describe(got, sizeof got, v->value);
    refuse(v, "not_allowed", "is %s; it must be %s", got, count > 1 ? "one of " : "");
    add_names(v, "", names, count, ".");
    suggest(v, json_text(v->value), v->value->count, names, count);
    return false;
}

static bool rule_const(const visit *v, const json_value *argument, const keyword *k)
{
    char got[64];
    (void)k;
    if (same_scalar(v->value, argument))
        return true;
    describe(got, sizeof got, v->value);
    if (json_text(argument))
        return refuse(v, "not_allowed", "is %s; it must be \"%s\".", got, json_text(argument));
    return refuse(v, "not_allowed", "is %s; it must be %.15g.", got, json_number(argument, 0));
}

static bool rule_bound(const visit *v, const json_value *argument, const keyword *k)
{
    const json_value *value = v->value;
    double x = (double)NAN; /* meets every bound */
    if (k->of == NUMBERS)
        x = json_number(value, x);
    else if (k->of == TEXTS && value->kind == JSON_IS_STRING)
        x = (double)json_text_characters(value);
    else if (k->of == ARRAYS && json_is_list(value))
        x = (double)value->count;
    const double bound = json_number(argument, 0);
    const bool misses[] = {[AT_LEAST] = x<bound, [AT_MOST] = x> bound, [ABOVE] = x <= bound, [BELOW] = x >= bound};
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    return !misses[k->sense] || refuse(v, "out_of_range", k->says, bound, x); /* of the table below */
#pragma GCC diagnostic pop
}

/* -------------------------------------------------------------- arrays */

/* What a schema asks of a number, where it asks for nothing but a type and a range. */
typedef struct {
    bool plain; /* false: more is asked, or nothing that a number could meet */
    bool whole;
    double least, above, most, below; /* x >= least, x > above, x <= most, x < below */
} number_range;

/* Is every keyword one of these, or says it nothing about values? */
static bool only_keywords(const json_value *node, const char *const *known, size_t count)
{
    static const char *const SILENT[] = {"title", "description", "default", "examples", "$comment"};
    for (size_t k = 0; k < json_size(node); k++) {
        bool found = false;
        for (size_t i = 0; i < sizeof SILENT / sizeof SILENT[0]; i++)
            found = found || strcmp(node->items[k].key, SILENT[i]) == 0;
        for (size_t i = 0; i < count; i++)
            found = found || strcmp(node->items[k].key, known[i]) == 0;
        if (!found)
            return false;
    }
    return true;
}

/* Of a number, or of those in a row of a table, where nothing is asked of the row but its length and its items. */
static number_range range_of(schema_at at, bool row)
{
    static const char *const KNOWN[] = {"type", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"};
    static const char *const OF_ROW[] = {"type", "minItems", "maxItems", "items"};
    at = schema_resolve(at);
    const json_value *items = json_get(at.node, "items");
    const unsigned types = schema_types(at);
    number_range out = {json_truth(at.node), false, -INFINITY, -INFINITY, INFINITY, INFINITY};
    if (!json_is(at.node, JSON_IS_OBJECT))
        return out;
    if (row) {
        out.plain = only_keywords(at.node, OF_ROW, sizeof OF_ROW / sizeof OF_ROW[0]);
        return out.plain && items ? range_of(schema_child(at, items), false) : out;
    }
    if (!only_keywords(at.node, KNOWN, sizeof KNOWN / sizeof KNOWN[0]))
        return out;
    out.plain = (types & SCHEMA_INTEGER) != 0;
    out.whole = !(types & SCHEMA_FRACTION);
    out.least = json_number(json_get(at.node, "minimum"), -INFINITY);
    out.above = json_number(json_get(at.node, "exclusiveMinimum"), -INFINITY);
    out.most = json_number(json_get(at.node, "maximum"), INFINITY);
    out.below = json_number(json_get(at.node, "exclusiveMaximum"), INFINITY);
    return out;
}

/* A million numbers need no visit for each of them. */
static bool rule_items(const visit *v, const json_value *argument, const keyword *k)
{
    const json_value *list = v->value;
    const schema_at items = schema_child(v->at, argument);
    const size_t columns = list->columns ? list->columns : 1;
    const bool table = list->columns > 0, numbers = list->kind == JSON_IS_NUMBERS;
    const number_range r = numbers ? range_of(items, table) : (number_range){.plain = false};
    bool good = true;
    json_value room;
    (void)k;
    for (size_t i = 0; json_is_list(list) && i < list->count; i++) {
        /* rows are of one size: what holds for the first one holds for others whose numbers are in range */
        bool fits = r.plain && !(table && i == 0);
        const double *x = fits ? list->numbers + i * columns : NULL;
        for (size_t c = 0; fits && c < columns; c++)
            fits = x[c] >= r.least && x[c] > r.above && x[c] <= r.most && x[c] < r.below &&
                   (!r.whole || x[c] == floor(x[c]));
        good = (fits || check(&(visit){v->problem, items, json_item(list, i, &room), v->more})) && good;
        if (!good && (!v->more || v->more->count == v->more->most))
            return false;
    }
    return good;
}

/* Quadratic: loading demands a maxItems beside it. */
static bool rule_unique_items(const visit *v, const json_value *argument, const keyword *k)
{
    json_value room, other;
    (void)argument;
    (void)k;
    for (size_t i = 0; json_is_list(v->value) && i < v->value->count; i++)
        for (size_t j = 0; j < i; j++) {
            const json_value *item = json_item(v->value, i, &room);
            if (json_same(item, json_item(v->value, j, &other)))
                return refuse(&(visit){v->problem, v->at, item, NULL}, "not_allowed",
                              "repeats item %zu; each may stand only once.", j);
        }
    return true;
}

/* ------------------------------------------------------------- objects */

static bool rule_additional_properties(const visit *v, const json_value *argument, const keyword *k)
{
    const json_value *properties = json_get(v->at.node, "properties");
    bool good = true;
    (void)k;
    for (size_t i = 0; json_is(v->value, JSON_IS_OBJECT) && i < v->value->count; i++) {
        const json_value *member = &v->value->items[i];
        if (json_get_n(properties, member->key, member->place))
            continue;
        if (!json_is(argument, JSON_IS_BOOLEAN) || argument->truth) {
            good = check(&(visit){v->problem, schema_child(v->at, argument), member, v->more}) && good;
            if (!good && !v->more)
                return false;
            continue;
        }
        /* not known: which are */
        const char *names[MAX_NAMES];
        char shown[64];
        size_t count = 0;
        for (; count < json_size(properties) && count < MAX_NAMES; count++)
            names[count] = properties->items[count].key;
        problem_quote(shown, sizeof shown, member->key, member->place);
        refuse(&(visit){v->problem, v->at, member, NULL}, "unknown_key", "is not known: there is no key %s here.",
               shown);
        suggest(v, member->key, member->place, names, count);
        if (count > 0)
            add_names(v, " Known: ", names, count, ".");
        if (!v->more)
            return false;
        keep(v);
        good = false;
    }
    return good;
}

/* A list of keys, or for each of some keys the list of those that go with it. */
static bool rule_required(const visit *v, const json_value *argument, const keyword *k)
{
    const bool depends = json_is(argument, JSON_IS_OBJECT);
    (void)k;
    for (size_t i = 0; json_is(v->value, JSON_IS_OBJECT) && i < (depends ? argument->count : 1); i++) {
        const json_value *needed = depends ? &argument->items[i] : argument;
        for (size_t j = 0; (!depends || json_get(v->value, needed->key)) && j < json_size(needed); j++) {
            const char *key = needed->items[j].text;
            if (json_get(v->value, key))
                continue;
            return depends ? refuse(v, "missing_key", "has \"%s\" but no \"%s\", which goes with it.", needed->key, key)
                           : refuse(v, "missing_key", "has no \"%s\", which is required.", key);
        }
    }
    return true;
}

static bool rule_count(const visit *v, const json_value *argument, const keyword *k)
{
    const json_value *known = json_get(v->at.node, "properties");
    const double n = (double)json_size(v->value), bound = json_number(argument, 0);
    if (!json_is(v->value, JSON_IS_OBJECT) || (k->sense == AT_MOST ? n <= bound : n >= bound))
        return true;
    if (k->sense == AT_MOST)
        return refuse(v, "not_allowed", "has %.15g keys, but at most %.15g of them go together.", n, bound);
    refuse(v, "missing_key", "must have at least %.15g of the keys", bound);
    for (size_t i = 0; v->problem && i < json_size(known); i++)
        problem_add(v->problem, " \"%s\"", known->items[i].key);
    return false;
}

static bool rule_properties(const visit *v, const json_value *argument, const keyword *k)
{
    bool good = true;
    (void)k;
    for (size_t i = 0; i < json_size(argument); i++) {
        const json_value *schema = &argument->items[i], *value = json_get_n(v->value, schema->key, schema->place);
        good = (!value || check(&(visit){v->problem, schema_child(v->at, schema), value, v->more})) && good;
        if (!good && !v->more)
            return false;
    }
    return good;
}

/* -------------------------------------------------------- combinations */

static bool rule_ref(const visit *v, const json_value *argument, const keyword *k)
{
    (void)argument;
    (void)k;
    return check(&(visit){v->problem, schema_resolve(v->at), v->value, v->more});
}

/* The one branch that has the value's type; among several, which are all objects, the one whose const it names. */
static bool rule_choice(const visit *v, const json_value *argument, const keyword *k)
{
    const char *names[MAX_NAMES];
    const json_value *wanted = NULL, *named = NULL;
    schema_at chosen = v->at;
    size_t fitting = 0, count = 0;
    unsigned all = 0;
    json_value room;
    (void)k;
    for (size_t i = 0; i < json_size(argument); i++) {
        const schema_at at = schema_resolve(schema_child(v->at, json_item(argument, i, &room)));
        const unsigned types = schema_types(at);
        all |= types;
        if (types & type_of(v->value)) {
            chosen = at;
            fitting++;
        }
    }
    if (fitting == 0)
        return refuse_type(v, all);
    if (fitting == 1)
        return check(&(visit){v->problem, chosen, v->value, v->more});
    for (size_t i = 0; i < argument->count; i++) {
        const schema_at at = schema_resolve(schema_child(v->at, json_item(argument, i, &room)));
        const char *key = schema_discriminator(at, &wanted);
        if (!key)
            continue;
        named = json_get(v->value, key);
        if (!named)
            return refuse(v, "missing_key", "has no \"%s\", which is required.", key);
        if (same_scalar(named, wanted))
            return check(&(visit){v->problem, at, v->value, v->more});
        if (json_text(wanted) && count < MAX_NAMES)
            names[count++] = json_text(wanted);
    }
    if (!named)
        return false;
    const visit here = {v->problem, v->at, named, NULL};
    if (named->kind != JSON_IS_STRING)
        return refuse_type(&here, SCHEMA_STRING);
    refuse(&here, "not_allowed", "must be one of ");
    add_names(v, "", names, count, ".");
    suggest(v, json_text(named), named->count, names, count);
    return false;
}

/* "then" and "else" say in their description why they ask for more; it is added to what they refuse. */
static bool rule_if(const visit *v, const json_value *argument, const keyword *k)
{
    const bool holds = check(&(visit){NULL, schema_child(v->at, argument), v->value, NULL});
    const json_value *branch = json_get(v->at.node, holds ? "then" : "else");
    (void)k;
    if (!branch || check(&(visit){v->problem, schema_child(v->at, branch), v->value, NULL}))
        return true;
    const char *why = json_text(json_get(branch, "description"));
    if (why && v->problem)
        problem_add(v->problem, " %s", why);
    return false;
}

/* ------------------------------------------------------------ keywords */

/* In the order of checking: what names the culprit best comes first. */
static const keyword KEYWORDS[] = {
    {"$ref", SHAPE_REF, rule_ref, 0, 0, NULL},
    {"type", SHAPE_NONE, rule_type, 0, 0, NULL},
    {"const", SHAPE_NONE, rule_const, 0, 0, NULL},
    {"enum", SHAPE_NONE, rule_enum, 0, 0, NULL},
    {"minimum", SHAPE_NONE, rule_bound, NUMBERS, AT_LEAST, "must be at least %.15g, not %.15g."},
    {"maximum", SHAPE_NONE, rule_bound, NUMBERS, AT_MOST, "must be at most %.15g, not %.15g."},
    {"exclusiveMinimum", SHAPE_NONE, rule_bound, NUMBERS, ABOVE, "must be greater than %.15g, not %.15g."},
    {"exclusiveMaximum", SHAPE_NONE, rule_bound, NUMBERS, BELOW, "must be less than %.15g, not %.15g."},
    {"minLength", SHAPE_NONE, rule_bound, TEXTS, AT_LEAST, "must have at least %.15g characters, not %.15g."},
    {"maxLength", SHAPE_NONE, rule_bound, TEXTS, AT_MOST, "must have at most %.15g characters, not %.15g."},
    {"minItems", SHAPE_NONE, rule_bound, ARRAYS, AT_LEAST, "must have at least %.15g items, not %.15g."},
    {"maxItems", SHAPE_NONE, rule_bound, ARRAYS, AT_MOST, "must have at most %.15g items, not %.15g."},
    {"items", SHAPE_SCHEMA, rule_items, 0, 0, NULL},
    {"uniqueItems", SHAPE_NONE, rule_unique_items, 0, 0, NULL},
    {"additionalProperties", SHAPE_SCHEMA, rule_additional_properties, 0, 0, NULL},
    {"required", SHAPE_NONE, rule_required, 0, 0, NULL},
    {"dependentRequired", SHAPE_NONE, rule_required, 0, 0, NULL},
    {"minProperties", SHAPE_NONE, rule_count, 0, AT_LEAST, NULL},
    {"maxProperties", SHAPE_NONE, rule_count, 0, AT_MOST, NULL},
    {"properties", SHAPE_MAP, rule_properties, 0, 0, NULL},
    {"oneOf", SHAPE_LIST, rule_choice, 0, 0, NULL},
    {"anyOf", SHAPE_LIST, rule_choice, 0, 0, NULL},
    {"if", SHAPE_SCHEMA, rule_if, 0, 0, NULL},
    {"then", SHAPE_SCHEMA, NULL, 0, 0, NULL},
    {"else", SHAPE_SCHEMA, NULL, 0, 0, NULL},
    {"$defs", SHAPE_MAP, NULL, 0, 0, NULL},
    {"$schema", SHAPE_NONE, NULL, 0, 0, NULL},
    {"$id", SHAPE_NONE, NULL, 0, 0, NULL},
    {"$comment", SHAPE_NONE, NULL, 0, 0, NULL},
    {"title", SHAPE_NONE, NULL, 0, 0, NULL},
    {"description", SHAPE_NONE, NULL, 0, 0, NULL},
    {"default", SHAPE_NONE, NULL, 0, 0, NULL},
    {"examples", SHAPE_NONE, NULL, 0, 0, NULL},
    {"format", SHAPE_NONE, NULL, 0, 0, NULL},
    {"contentMediaType", SHAPE_NONE, NULL, 0, 0, NULL},
};
enum { KEYWORD_COUNT = sizeof KEYWORDS / sizeof KEYWORDS[0] };

bool schema_keyword(const char *name, schema_shape *shape)
{
    for (size_t i = 0; i < KEYWORD_COUNT; i++)
        if (strcmp(KEYWORDS[i].name, name) == 0) {
            *shape = KEYWORDS[i].shape;
            return true;
        }
    return false;
}

static bool check(const visit *v)
{
    if (json_is(v->at.node, JSON_IS_BOOLEAN))
        return v->at.node->truth || refuse(v, "not_allowed", "is not allowed here.");
    bool good = true;
    for (size_t i = 0; i < KEYWORD_COUNT; i++) {
        const keyword *k = &KEYWORDS[i];
        const json_value *argument = k->rule ? json_get(v->at.node, k->name) : NULL;
        const size_t kept = v->more ? v->more->count : 0;
        if (!argument || (!good && k->rule != rule_properties) || k->rule(v, argument, k))
            continue;
        if (!v->more)
            return false;
        if (v->more->count == kept) /* a rule that looks at members has kept what they violate */
            keep(v);
        good = false; /* a second mistake of the same value may follow from the first; those of its members do not */
    }
    return good;
}

bool schemas_check(const schemas *all, const char *name, const json_value *value, problem_details *problem)
{
    const schema_at root = schema_root(all, name);
    *problem = (problem_details){0};
    if (root.node)
        return check(&(visit){problem, root, value, NULL});
    problem_set(problem, 500, "internal", NULL, "There is no schema %s.", name);
    return false;
}

void schemas_check_all(const schemas *all, const char *name, const json_value *value, schema_mistakes *out)
{
    problem_details problem = {0};
    const schema_at root = schema_root(all, name);
    out->count = 0;
    if (root.node)
        check(&(visit){&problem, root, value, out});
}
