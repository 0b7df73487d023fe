/* quantity.c: names of numbers, against the schema of summaries and in a summary. */
#include "codec/quantity.h"
#include "codec/problem.h"
#include "text/edit_distance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- steps of a name */

typedef struct {
    const char *at; /* len bytes, then '.' or the end of the name */
    size_t len;
} step;

static step first_step(const char *name, const char *end)
{
    const char *dot = memchr(name, '.', (size_t)(end - name));
    return (step){name, (size_t)((dot ? dot : end) - name)};
}

static bool step_is(step s, const char *word)
{
    return strlen(word) == s.len && memcmp(s.at, word, s.len) == 0;
}

/* A decimal index without leading zeros, of at most 9 digits; -1: the step is none. */
static long step_index(step s)
{
    long index = 0;
    if (s.len == 0 || s.len > 9 || (s.len > 1 && *s.at == '0'))
        return -1;
    for (size_t i = 0; i < s.len; i++) {
        if (s.at[i] < '0' || s.at[i] > '9')
            return -1;
        index = 10 * index + (s.at[i] - '0');
    }
    return index;
}

/* ---- names against the schema */

/* What a summary says of its own assertions is nothing to assert. */
static const char VERDICTS[] = "assertions";

/* Does the schema name its types, and one of these? */
static bool may_be(schema_at at, unsigned wanted)
{
    const unsigned types = schema_types(at);
    return types != SCHEMA_ANY && (types & wanted);
}

/* The schema one step further; node NULL: there is none. A code leads to the warning's value, a name to the
 * quantity's. */
static schema_at schema_step(schema_at at, step s)
{
    if (!(schema_types(at) & SCHEMA_ARRAY))
        return schema_resolve(schema_child(at, json_get_n(json_get(at.node, "properties"), s.at, s.len)));
    schema_at items = schema_resolve(schema_child(at, json_get(at.node, "items")));
    if (step_index(s) >= 0)
        return items;
    const json_value *properties = json_get(items.node, "properties");
    const json_value *codes = json_get(json_get(properties, "code"), "enum"), *value = NULL;
    for (size_t i = 0; i < json_size(codes); i++)
        if (step_is(s, codes->items[i].text))
            value = json_get(properties, "value");
    if (json_get(properties, "name") && json_get(properties, "value"))
        value = json_get(properties, "value");
    return schema_resolve(schema_child(items, value));
}

enum { SCHEMA_NUMBER = SCHEMA_FRACTION | SCHEMA_INTEGER };

/* ---- what may have been meant */

enum { MOST_NAMES = 400 };

typedef struct {
    char name[MOST_NAMES][64];
    const char *whole[MOST_NAMES], *last[MOST_NAMES]; /* the names, and what follows their last dot */
    size_t count;
} name_list;

/* The names of all numbers from this one on; arrays by their first item. */
static void collect(name_list *out, schema_at at, const char *above, const char *key)
{
    char name[64];
    const json_value *properties = json_get(at.node, "properties");
    const int len = snprintf(name, sizeof name, "%s%s%s", above, above[0] ? "." : "", key);
    if (!at.node || len >= (int)sizeof name || strncmp(name, VERDICTS, sizeof VERDICTS - 1) == 0)
        return;
    if (may_be(at, SCHEMA_NUMBER | SCHEMA_ARRAY) && out->count < MOST_NAMES) {
        const char *whole = strcpy(out->name[out->count], name), *dot = strrchr(whole, '.');
        out->whole[out->count] = whole;
        out->last[out->count++] = dot ? dot + 1 : whole;
    }
    if (may_be(at, SCHEMA_ARRAY))
        collect(out, schema_resolve(schema_child(at, json_get(at.node, "items"))), name, "0");
    for (size_t i = 0; i < json_size(properties); i++)
        collect(out, schema_resolve(schema_child(at, &properties->items[i])), name, properties->items[i].key);
}

bool quantity_check(const schemas *all, const json_value *quantity, problem_details *problem)
{
    char shown[80];
    const char *name = quantity->text;
    const size_t len = quantity->count;
    const char *end = name + len;
    schema_at at = schema_root(all, "summary.json");
    bool own = len >= sizeof VERDICTS - 1 && strncmp(name, VERDICTS, sizeof VERDICTS - 1) == 0;
    for (step s = first_step(name, end); at.node && !own; s = first_step(s.at + s.len + 1, end)) {
        at = schema_step(at, s);
        if (s.at + s.len == end)
            break;
    }
    if (at.node && !own && may_be(at, SCHEMA_NUMBER | SCHEMA_ARRAY))
        return true;
    problem_quote(shown, sizeof shown, name, len);
    problem_set(problem, 422, "not_allowed", quantity, "%s is no number of a job's summary (/schemas/summary.json)",
                shown);
    if (at.node && !own && may_be(at, SCHEMA_OBJECT)) {
        problem_add(problem, ", but holds some");
        /* The first few numbers of an object. */
        const json_value *properties = json_get(at.node, "properties");
        const char *before = ": ";
        for (size_t i = 0; i < json_size(properties); i++) {
            if (!may_be(schema_resolve(schema_child(at, &properties->items[i])), SCHEMA_NUMBER))
                continue;
            problem_add(problem, "%s%.*s.%s", before, (int)len, name, properties->items[i].key);
            before = ", ";
        }
        problem_add(problem, ".");
    } else {
        problem_add(problem, ".");
        /* The whole name with the fewest edits, else the one that ends as this one does; without memory none. */
        const char *dot = memrchr(name, '.', len), *last = dot ? dot + 1 : name;
        name_list *names = calloc(1, sizeof *names);
        if (!names)
            return false;
        collect(names, schema_root(all, "summary.json"), "", "");
        int found = uz_closest(name, len, names->whole, names->count);
        if (found < 0)
            found = uz_closest(last, len - (size_t)(last - name), names->last, names->count);
        if (found >= 0)
            problem_add(problem, " Did you mean \"%s\"?", names->whole[found]);
        free(names);
    }
    return false;
}

/* ---- numbers of a summary */

bool quantity_read(double *value, const json_value *summary, const char *name)
{
    const char *end = name + strlen(name);
    const json_value *node = summary;
    json_value rooms[2]; /* a number of a row of a table */
    *value = (double)NAN;
    for (step s = first_step(name, end);; s = first_step(s.at + s.len + 1, end)) {
        if (json_is(node, JSON_IS_NULL)) /* max_pressure_at.node where nothing presses */
            return true;
        if (json_is_list(node) && step_index(s) < 0) {
            /* The value of the warning of this code, 0 where there is none; or the quantity of this name. */
            const json_value *found = NULL;
            bool named = false;
            for (size_t i = 0; node->kind == JSON_IS_ARRAY && i < node->count && !found; i++) {
                const char *name_of = json_text(json_get(&node->items[i], "name")),
                           *of = name_of ? name_of : json_text(json_get(&node->items[i], "code"));
                named = named || name_of;
                found = of && step_is(s, of) ? &node->items[i] : NULL;
            }
            if (found && s.at + s.len < end) {
                node = found;
                continue;
            }
            *value = found ? json_number(json_get(found, "value"), (double)NAN) : 0.0;
            return found || !named;
        }
        node = json_is_list(node) ? json_item(node, (size_t)step_index(s), &rooms[node == &rooms[0]])
                                  : json_get_n(node, s.at, s.len);
        if (!node)
            return false;
        if (s.at + s.len == end) {
            *value = json_is_list(node) ? (double)node->count : json_number(node, (double)NAN);
            return json_is_list(node) || node->kind == JSON_IS_NUMBER || node->kind == JSON_IS_NULL;
        }
    }
}
