/* decode_assert.c: assertions about the summary of a job. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/quantity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Each summary has a line for each assertion about it. */
#define MOST_LINES 100000

static double number_or_nan(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return value ? json_real_value(value) : NAN;
}

static bool has_case(const uz_problem *p, const char *name)
{
    for (int64_t i = 0; i < p->n_cases; i++)
        if (strcmp(p->cases[i].name, name) == 0)
            return true;
    return false;
}

static bool take_case(codec_assertion *out, const uz_problem *p, const json_t *value, const json_path *item,
                      problem_details *problem)
{
    char shown[80];
    const json_path path = {item, "case", 4, 0};
    if (!decode_label(out->case_name, value, &path, "A name of a case", problem))
        return false;
    if (has_case(p, out->case_name))
        return true;
    problem_quote(shown, sizeof shown, out->case_name, strlen(out->case_name));
    problem_set(problem, 422, "not_allowed", &path, "The request has no case %s%s.", shown,
                p->n_cases == 0 ? "; it has none at all" : "");
    return false;
}

/* Limits that no number can meet are a mistake. */
static bool check_limits(const codec_assertion *a, const json_path *item, problem_details *problem)
{
    const json_path min = {item, "min", 3, 0}, relative = {item, "relative", 8, 0};
    if (a->least > a->most) {
        problem_set(problem, 422, "out_of_range", &min, "min is %.15g, above max, %.15g: no number is between them.",
                    a->least, a->most);
        return false;
    }
    if (a->near == 0.0 && isnan(a->absolute)) {
        problem_set(problem, 422, "out_of_range", &relative,
                    "Nothing but 0 is near 0 by a relative measure: give absolute.");
        return false;
    }
    return true;
}

static bool take_assertion(codec_assertion *out, const uz_problem *p, const json_t *object, const json_path *item,
                           problem_details *problem)
{
    const json_t *quantity = json_object_get(object, "quantity"), *name = json_object_get(object, "name");
    const json_t *of = json_object_get(object, "case");
    const json_path quantity_at = {item, "quantity", 8, 0}, name_at = {item, "name", 4, 0};
    const size_t len = json_string_length(quantity);
    if (!quantity_check(decode_schemas(), json_string_value(quantity), len, &quantity_at, problem))
        return false;
    memcpy(out->quantity, json_string_value(quantity), len + 1);
    out->least = number_or_nan(object, "min");
    out->most = number_or_nan(object, "max");
    out->near = number_or_nan(object, "near");
    out->absolute = number_or_nan(object, "absolute");
    out->relative = number_or_nan(object, "relative");
    if (name && !decode_label(out->name, name, &name_at, "The name of an assertion", problem))
        return false;
    return (!of || take_case(out, p, of, item, problem)) && check_limits(out, item, problem);
}

bool decode_assertions(codec_request *out, const json_t *list, problem_details *problem)
{
    const json_path assert = {NULL, "assert", 6, 0};
    const int64_t cases = out->problem.n_cases > 0 ? out->problem.n_cases : 1;
    int64_t n = 0;
    if (json_array_size(list) == 0)
        return true;
    out->assertions = decode_room(list, sizeof *out->assertions, &n, problem);
    if (!out->assertions)
        return false;
    out->n_assertions = n;
    if (n > MOST_LINES / cases) {
        problem_set(problem, 422, "out_of_range", &assert,
                    "%lld assertions about each of %lld cases are too many: at most %d lines are judged.", (long long)n,
                    (long long)cases, MOST_LINES);
        return false;
    }
    for (int64_t i = 0; i < n; i++) {
        const json_path item = {&assert, NULL, 0, (size_t)i};
        if (!take_assertion(&out->assertions[i], &out->problem, json_array_get(list, (size_t)i), &item, problem))
            return false;
    }
    return true;
}
