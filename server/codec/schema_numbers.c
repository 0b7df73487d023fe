#include "codec/schema_numbers.h"

#include <math.h>
#include <string.h>

/* Is every keyword one of these, or says it nothing about values? */
static bool only_keywords(const json_t *node, const char *const *known, size_t count)
{
    static const char *const SILENT[] = {"title", "description", "default", "examples", "$comment"};
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)node, key, value)
    {
        bool found = false;
        for (size_t i = 0; i < sizeof SILENT / sizeof SILENT[0]; i++)
            found = found || strcmp(key, SILENT[i]) == 0;
        for (size_t i = 0; i < count; i++)
            found = found || strcmp(key, known[i]) == 0;
        if (!found)
            return false;
    }
    return true;
}

static double number_or(const json_t *node, const char *key, double otherwise)
{
    const json_t *value = json_object_get(node, key);
    return json_is_number(value) ? json_number_value(value) : otherwise;
}

schema_numbers schema_plain_numbers(schema_at at)
{
    static const char *const KNOWN[] = {"type", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"};
    at = schema_resolve(at);
    const unsigned types = schema_types(at);
    schema_numbers out = {.plain = json_is_true(at.node), .least = -INFINITY, .above = -INFINITY};
    out.most = out.below = INFINITY;
    if (!json_is_object(at.node) || !only_keywords(at.node, KNOWN, sizeof KNOWN / sizeof KNOWN[0]))
        return out;
    out.plain = (types & SCHEMA_INTEGER) != 0;
    out.whole = !(types & SCHEMA_FRACTION);
    out.least = number_or(at.node, "minimum", -INFINITY);
    out.above = number_or(at.node, "exclusiveMinimum", -INFINITY);
    out.most = number_or(at.node, "maximum", INFINITY);
    out.below = number_or(at.node, "exclusiveMaximum", INFINITY);
    return out;
}

bool schema_numbers_fit(schema_numbers numbers, const double *x, int64_t count)
{
    for (int64_t i = 0; i < count; i++)
        if (!(x[i] >= numbers.least && x[i] > numbers.above && x[i] <= numbers.most && x[i] < numbers.below) ||
            (numbers.whole && x[i] != floor(x[i])))
            return false;
    return numbers.plain;
}

schema_numbers schema_row_numbers(schema_at row)
{
    static const char *const KNOWN[] = {"type", "minItems", "maxItems", "items"};
    row = schema_resolve(row);
    const json_t *items = json_object_get(row.node, "items");
    schema_numbers out = {.plain = true, .least = -INFINITY, .above = -INFINITY, .most = INFINITY, .below = INFINITY};
    if (json_is_true(row.node))
        return out;
    out.plain = json_is_object(row.node) && only_keywords(row.node, KNOWN, sizeof KNOWN / sizeof KNOWN[0]);
    return out.plain && items ? schema_plain_numbers(schema_child(row, items)) : out;
}
