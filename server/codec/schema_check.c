/* Checking: one rule per keyword, in the order of the table, until the first violation. */
#include "codec/problem.h"
#include "codec/schema_numbers.h"
#include "codec/schema_visit.h"

#include <string.h>

enum { MAX_NAMES = 64 }; /* candidates looked at for "did you mean" */

static bool check(const visit *v);

/* ------------------------------------------------- any value, scalars */

static bool rule_type(const visit *v, const json_t *argument)
{
    unsigned allowed = schema_types(v->at);
    (void)argument;
    return (visit_type(v) & allowed) != 0 || visit_wrong_type(v, allowed);
}

static bool same_scalar(const visit *v, const json_t *wanted)
{
    size_t len;
    const char *text = visit_string(v, &len);
    if (json_is_string(wanted))
        return visit_type(v) == SCHEMA_STRING && len == json_string_length(wanted) &&
               memcmp(text, json_string_value(wanted), len) == 0;
    if (json_is_number(wanted))
        return json_is_real(v->value) && json_real_value(v->value) == json_number_value(wanted);
    return json_typeof(v->value) == json_typeof(wanted);
}

static bool rule_enum(const visit *v, const json_t *argument)
{
    const char *names[MAX_NAMES];
    char got[64];
    size_t i, len, count = 0;
    json_t *item;
    json_array_foreach(argument, i, item)
    {
        if (same_scalar(v, item))
            return true;
        if (json_is_string(item) && count < MAX_NAMES)
            names[count++] = json_string_value(item);
    }
    const char *text = visit_string(v, &len);
    visit_describe(got, sizeof got, v);
    visit_refuse(v, "not_allowed", "is %s; it must be %s", got, count > 1 ? "one of " : "");
    visit_list(v, names, count);
    if (v->problem)
        problem_add(v->problem, ".");
    visit_suggest(v, text, len, names, count);
    return false;
}

static bool rule_const(const visit *v, const json_t *argument)
{
    char got[64];
    if (same_scalar(v, argument))
        return true;
    visit_describe(got, sizeof got, v);
    if (json_is_string(argument))
        return visit_refuse(v, "not_allowed", "is %s; it must be \"%s\".", got, json_string_value(argument));
    return visit_refuse(v, "not_allowed", "is %s; it must be %.15g.", got, json_number_value(argument));
}

static bool rule_minimum(const visit *v, const json_t *argument)
{
    double x = json_real_value(v->value), least = json_number_value(argument);
    return !json_is_real(v->value) || x >= least ||
           visit_refuse(v, "out_of_range", "must be at least %.15g, not %.15g.", least, x);
}

static bool rule_maximum(const visit *v, const json_t *argument)
{
    double x = json_real_value(v->value), most = json_number_value(argument);
    return !json_is_real(v->value) || x <= most ||
           visit_refuse(v, "out_of_range", "must be at most %.15g, not %.15g.", most, x);
}

static bool rule_exclusive_minimum(const visit *v, const json_t *argument)
{
    double x = json_real_value(v->value), least = json_number_value(argument);
    return !json_is_real(v->value) || x > least ||
           visit_refuse(v, "out_of_range", "must be greater than %.15g, not %.15g.", least, x);
}

static bool rule_exclusive_maximum(const visit *v, const json_t *argument)
{
    double x = json_real_value(v->value), most = json_number_value(argument);
    return !json_is_real(v->value) || x < most ||
           visit_refuse(v, "out_of_range", "must be less than %.15g, not %.15g.", most, x);
}

/* Characters, not bytes. -1: no string. */
static double text_length(const visit *v)
{
    size_t len, count = 0;
    const char *text = visit_string(v, &len);
    if (visit_type(v) != SCHEMA_STRING)
        return -1;
    for (size_t i = 0; i < len; i++)
        count += ((unsigned char)text[i] & 0xc0) != 0x80;
    return (double)count;
}

static bool rule_min_length(const visit *v, const json_t *argument)
{
    double n = text_length(v), least = json_number_value(argument);
    return n < 0 || n >= least ||
           visit_refuse(v, "out_of_range", "must have at least %.15g characters, not %.15g.", least, n);
}

static bool rule_max_length(const visit *v, const json_t *argument)
{
    double n = text_length(v), most = json_number_value(argument);
    return n <= most || visit_refuse(v, "out_of_range", "must have at most %.15g characters, not %.15g.", most, n);
}

/* -------------------------------------------------------------- arrays */

/* Items of an array, lifted or not; -1: no array. */
static double array_length(const visit *v)
{
    const json_lifted *lifted = json_doc_lifted(v->doc, v->value);
    if (visit_type(v) != SCHEMA_ARRAY)
        return -1;
    return lifted ? (double)lifted->count : (double)json_array_size(v->value);
}

static bool rule_min_items(const visit *v, const json_t *argument)
{
    double n = array_length(v), least = json_number_value(argument);
    return n < 0 || n >= least ||
           visit_refuse(v, "out_of_range", "must have at least %.15g items, not %.15g.", least, n);
}

static bool rule_max_items(const visit *v, const json_t *argument)
{
    double n = array_length(v), most = json_number_value(argument);
    return n <= most || visit_refuse(v, "out_of_range", "must have at most %.15g items, not %.15g.", most, n);
}

/* Each row is put into one small array and checked as if it stood there. */
static bool check_table_rows(const visit *v, const json_lifted *table, schema_at items)
{
    const schema_numbers numbers = schema_row_numbers(items);
    json_t *row = json_array();
    bool good = row != NULL;
    for (int64_t j = 0; good && j < table->columns; j++)
        good = json_array_append_new(row, json_real(0)) == 0;
    if (!good)
        visit_no_memory(v);
    for (int64_t i = 0; good && i < table->count; i++) {
        json_path path = {v->path, NULL, 0, (size_t)i};
        /* the rows are of one size: what holds for the first one holds for others whose numbers are in range */
        if (i > 0 && schema_numbers_fit(numbers, table->numbers + i * table->columns, table->columns))
            continue;
        for (int64_t j = 0; j < table->columns; j++)
            json_real_set(json_array_get(row, (size_t)j), table->numbers[i * table->columns + j]);
        good = check(&(visit){v->doc, v->problem, items, row, &path});
    }
    json_decref(row);
    return good;
}

static bool check_lifted_items(const visit *v, const json_lifted *lifted, schema_at items)
{
    bool good = true;
    if (lifted->columns > 0)
        return check_table_rows(v, lifted, items);
    const schema_numbers numbers = schema_plain_numbers(items);
    json_t *number = json_real(0);
    if (!number)
        return visit_no_memory(v);
    for (int64_t i = 0; good && i < lifted->count; i++) {
        json_path path = {v->path, NULL, 0, (size_t)i};
        if (schema_numbers_fit(numbers, lifted->numbers + i, 1))
            continue;
        json_real_set(number, lifted->numbers[i]);
        good = check(&(visit){v->doc, v->problem, items, number, &path});
    }
    json_decref(number);
    return good;
}

static bool rule_items(const visit *v, const json_t *argument)
{
    const json_lifted *lifted = json_doc_lifted(v->doc, v->value);
    size_t i;
    json_t *item;
    if (visit_type(v) != SCHEMA_ARRAY)
        return true;
    if (lifted)
        return check_lifted_items(v, lifted, schema_child(v->at, argument));
    json_array_foreach(v->value, i, item)
    {
        json_path path = {v->path, NULL, 0, i};
        if (!check(&(visit){v->doc, v->problem, schema_child(v->at, argument), item, &path}))
            return false;
    }
    return true;
}

/* Quadratic: loading demands a maxItems beside it. Not for lifted arrays, which are longer than that maxItems. */
static bool rule_unique_items(const visit *v, const json_t *argument)
{
    (void)argument;
    for (size_t i = 0; i < json_array_size(v->value); i++)
        for (size_t j = 0; j < i; j++) {
            json_path path = {v->path, NULL, 0, i};
            if (json_equal(json_array_get(v->value, i), json_array_get(v->value, j)))
                return visit_refuse(&(visit){v->doc, v->problem, v->at, v->value, &path}, "not_allowed",
                                    "repeats item %zu; each may stand only once.", j);
        }
    return true;
}

/* ------------------------------------------------------------- objects */

static bool unknown_key(const visit *v, const char *key, size_t len)
{
    const char *names[MAX_NAMES], *name;
    char shown[64];
    size_t count = 0;
    json_t *value;
    json_path path = {v->path, key, len, 0};
    visit here = {v->doc, v->problem, v->at, v->value, &path};
    json_object_foreach(json_object_get(v->at.node, "properties"), name, value)
    {
        if (count < MAX_NAMES)
            names[count++] = name;
    }
    problem_quote(shown, sizeof shown, key, len);
    visit_refuse(&here, "unknown_key", "is not known: there is no key %s here.", shown);
    visit_suggest(&here, key, len, names, count);
    if (v->problem && count > 0) {
        problem_add(v->problem, " Known: ");
        visit_list(v, names, count);
        problem_add(v->problem, ".");
    }
    return false;
}

static bool rule_additional_properties(const visit *v, const json_t *argument)
{
    const json_t *properties = json_object_get(v->at.node, "properties");
    void *entry = json_is_object(v->value) ? json_object_iter((json_t *)v->value) : NULL;
    for (; entry; entry = json_object_iter_next((json_t *)v->value, entry)) {
        const char *key = json_object_iter_key(entry);
        size_t len = json_object_iter_key_len(entry);
        json_path path = {v->path, key, len, 0};
        if (json_object_getn(properties, key, len))
            continue;
        if (json_is_false(argument))
            return unknown_key(v, key, len);
        if (!check(&(visit){v->doc, v->problem, schema_child(v->at, argument), json_object_iter_value(entry), &path}))
            return false;
    }
    return true;
}

static bool rule_required(const visit *v, const json_t *argument)
{
    for (size_t i = 0; json_is_object(v->value) && i < json_array_size(argument); i++) {
        const char *key = json_string_value(json_array_get(argument, i));
        if (!json_object_get(v->value, key))
            return visit_refuse(v, "missing_key", "has no \"%s\", which is required.", key);
    }
    return true;
}

static bool rule_dependent_required(const visit *v, const json_t *argument)
{
    const char *key;
    json_t *needed, *other;
    size_t i;
    json_object_foreach((json_t *)argument, key, needed)
    {
        json_array_foreach(needed, i, other)
        {
            const char *name = json_string_value(other);
            if (json_object_get(v->value, key) && !json_object_get(v->value, name))
                return visit_refuse(v, "missing_key", "has \"%s\" but no \"%s\", which goes with it.", key, name);
        }
    }
    return true;
}

static bool rule_min_properties(const visit *v, const json_t *argument)
{
    const json_t *known = json_object_get(v->at.node, "properties");
    double n = (double)json_object_size(v->value), least = json_number_value(argument);
    const char *key;
    json_t *value;
    if (!json_is_object(v->value) || n >= least)
        return true;
    visit_refuse(v, "missing_key", "must have at least %.15g of the keys", least);
    json_object_foreach((json_t *)known, key, value)
    {
        if (v->problem)
            problem_add(v->problem, " \"%s\"", key);
    }
    return false;
}

static bool rule_max_properties(const visit *v, const json_t *argument)
{
    double n = (double)json_object_size(v->value), most = json_number_value(argument);
    return !json_is_object(v->value) || n <= most ||
           visit_refuse(v, "not_allowed", "has %.15g keys, but at most %.15g of them go together.", n, most);
}

static bool rule_properties(const visit *v, const json_t *argument)
{
    const char *key;
    json_t *schema;
    json_object_foreach((json_t *)argument, key, schema)
    {
        json_t *value = json_object_get(v->value, key);
        json_path path = {v->path, key, strlen(key), 0};
        if (value && !check(&(visit){v->doc, v->problem, schema_child(v->at, schema), value, &path}))
            return false;
    }
    return true;
}

/* -------------------------------------------------------- combinations */

static bool rule_ref(const visit *v, const json_t *argument)
{
    visit there = *v;
    (void)argument;
    there.at = schema_resolve(v->at);
    return check(&there);
}

/* Among branches that are all objects, the one whose const the value names. */
static bool choose_by_key(const visit *v, const json_t *branches)
{
    const char *names[MAX_NAMES], *key = NULL;
    size_t i, len, count = 0;
    json_t *branch;
    const json_t *wanted = NULL;
    visit here = *v;
    json_path path = {v->path, NULL, 0, 0};
    json_array_foreach(branches, i, branch)
    {
        schema_at at = schema_resolve(schema_child(v->at, branch));
        const char *name = schema_discriminator(at, &wanted);
        if (!name)
            continue;
        key = name;
        here.value = json_object_get(v->value, key);
        if (!here.value)
            return visit_refuse(v, "missing_key", "has no \"%s\", which is required.", key);
        if (same_scalar(&here, wanted))
            return check(&(visit){v->doc, v->problem, at, v->value, v->path});
        if (json_is_string(wanted) && count < MAX_NAMES)
            names[count++] = json_string_value(wanted);
    }
    if (!key)
        return false;
    path.key = key;
    path.key_len = strlen(key);
    here.path = &path;
    if (visit_type(&here) != SCHEMA_STRING)
        return visit_wrong_type(&here, SCHEMA_STRING);
    visit_refuse(&here, "not_allowed", "must be one of ");
    visit_list(v, names, count);
    if (v->problem)
        problem_add(v->problem, ".");
    const char *text = visit_string(&here, &len);
    visit_suggest(&here, text, len, names, count);
    return false;
}

static bool rule_choice(const visit *v, const json_t *argument)
{
    schema_at chosen = v->at;
    size_t i, fitting = 0;
    unsigned all = 0;
    json_t *branch;
    json_array_foreach(argument, i, branch)
    {
        schema_at at = schema_resolve(schema_child(v->at, branch));
        unsigned types = schema_types(at);
        all |= types;
        if (types & visit_type(v)) {
            chosen = at;
            fitting++;
        }
    }
    if (fitting == 0)
        return visit_wrong_type(v, all);
    return fitting == 1 ? check(&(visit){v->doc, v->problem, chosen, v->value, v->path}) : choose_by_key(v, argument);
}

/* "then" and "else" say in their description why they ask for more; it is added to what they refuse. */
static bool rule_if(const visit *v, const json_t *argument)
{
    visit condition = {v->doc, NULL, schema_child(v->at, argument), v->value, v->path};
    const json_t *branch = json_object_get(v->at.node, check(&condition) ? "then" : "else");
    visit there = {v->doc, v->problem, schema_child(v->at, branch), v->value, v->path};
    if (!branch || check(&there))
        return true;
    const char *why = json_string_value(json_object_get(branch, "description"));
    if (why && v->problem)
        problem_add(v->problem, " %s", why);
    return false;
}

/* ------------------------------------------------------------ keywords */

/* In the order of checking: what names the culprit best comes first. No rule: an annotation, or used by another. */
static const struct {
    const char *name;
    schema_shape shape;
    bool (*rule)(const visit *v, const json_t *argument);
} KEYWORDS[] = {
    {"$ref", SHAPE_REF, rule_ref},
    {"type", SHAPE_NONE, rule_type},
    {"const", SHAPE_NONE, rule_const},
    {"enum", SHAPE_NONE, rule_enum},
    {"minimum", SHAPE_NONE, rule_minimum},
    {"maximum", SHAPE_NONE, rule_maximum},
    {"exclusiveMinimum", SHAPE_NONE, rule_exclusive_minimum},
    {"exclusiveMaximum", SHAPE_NONE, rule_exclusive_maximum},
    {"minLength", SHAPE_NONE, rule_min_length},
    {"maxLength", SHAPE_NONE, rule_max_length},
    {"minItems", SHAPE_NONE, rule_min_items},
    {"maxItems", SHAPE_NONE, rule_max_items},
    {"items", SHAPE_SCHEMA, rule_items},
    {"uniqueItems", SHAPE_NONE, rule_unique_items},
    {"additionalProperties", SHAPE_SCHEMA, rule_additional_properties},
    {"required", SHAPE_NONE, rule_required},
    {"dependentRequired", SHAPE_NONE, rule_dependent_required},
    {"minProperties", SHAPE_NONE, rule_min_properties},
    {"maxProperties", SHAPE_NONE, rule_max_properties},
    {"properties", SHAPE_MAP, rule_properties},
    {"oneOf", SHAPE_LIST, rule_choice},
    {"anyOf", SHAPE_LIST, rule_choice},
    {"if", SHAPE_SCHEMA, rule_if},
    {"then", SHAPE_SCHEMA, NULL},
    {"else", SHAPE_SCHEMA, NULL},
    {"$defs", SHAPE_MAP, NULL},
    {"$schema", SHAPE_NONE, NULL},
    {"$id", SHAPE_NONE, NULL},
    {"$comment", SHAPE_NONE, NULL},
    {"title", SHAPE_NONE, NULL},
    {"description", SHAPE_NONE, NULL},
    {"default", SHAPE_NONE, NULL},
    {"examples", SHAPE_NONE, NULL},
    {"format", SHAPE_NONE, NULL},
    {"contentMediaType", SHAPE_NONE, NULL},
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
    if (json_is_boolean(v->at.node))
        return json_is_true(v->at.node) || visit_refuse(v, "not_allowed", "is not allowed here.");
    for (size_t i = 0; i < KEYWORD_COUNT; i++) {
        const json_t *argument = json_object_get(v->at.node, KEYWORDS[i].name);
        if (argument && KEYWORDS[i].rule && !KEYWORDS[i].rule(v, argument))
            return false;
    }
    return true;
}

bool schemas_check(const schemas *all, const char *name, const json_doc *doc, problem_details *problem)
{
    const json_t *file = json_object_get(all->files, name);
    visit v = {doc, problem, {all->files, name, file}, doc->root, NULL};
    *problem = (problem_details){0};
    if (file)
        return check(&v);
    problem_set(problem, 500, "internal", NULL, "There is no schema %s.", name);
    return false;
}
