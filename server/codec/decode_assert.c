/* decode_assert.c: assertions about the summary of a job. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/quantity.h"

#include <math.h>
#include <string.h>

/* Each summary has a line for each assertion about it. */
#define MOST_LINES 100000

static bool take_assertion(codec_assertion *out, decoding *d, const uz_problem *p, const json_value *object)
{
    const json_value *quantity = json_get(object, "quantity"), *name = json_get(object, "name");
    const json_value *of = json_get(object, "case");
    if (!quantity_check(decode_schemas(), quantity, d->problem))
        return false;
    memcpy(out->quantity, quantity->text, quantity->count + 1);
    out->least = decode_number(object, "min", (double)NAN);
    out->most = decode_number(object, "max", (double)NAN);
    out->near = decode_number(object, "near", (double)NAN);
    out->absolute = decode_number(object, "absolute", (double)NAN);
    out->relative = decode_number(object, "relative", (double)NAN);
    if ((name && !decode_label(out->name, d, name, "The name of an assertion")) ||
        (of && !decode_label(out->case_name, d, of, "A name of a case")))
        return false;
    bool there = !of;
    for (int64_t i = 0; i < p->n_cases && !there; i++)
        there = strcmp(p->cases[i].name, out->case_name) == 0;
    if (!there) {
        char shown[80];
        problem_quote(shown, sizeof shown, out->case_name, strlen(out->case_name));
        problem_set(d->problem, 422, "not_allowed", of, "The request has no case %s%s.", shown,
                    p->n_cases == 0 ? "; it has none at all" : "");
    } else if (out->least > out->most) /* limits that no number can meet are a mistake */
        problem_set(d->problem, 422, "out_of_range", json_get(object, "min"),
                    "min is %.15g, above max, %.15g: no number is between them.", out->least, out->most);
    else if (out->near == 0.0 && isnan(out->absolute))
        problem_set(d->problem, 422, "out_of_range", json_get(object, "relative"),
                    "Nothing but 0 is near 0 by a relative measure: give absolute.");
    else
        return true;
    return false;
}

bool decode_assertions(codec_request *out, decoding *d, const json_value *list)
{
    const int64_t cases = out->problem.n_cases > 0 ? out->problem.n_cases : 1;
    int64_t n = 0;
    if (json_size(list) == 0)
        return true;
    out->assertions = decode_room(d, list, sizeof *out->assertions, &n);
    if (!out->assertions)
        return false;
    out->n_assertions = n;
    if (n > MOST_LINES / cases) {
        problem_set(d->problem, 422, "out_of_range", list,
                    "%lld assertions about each of %lld cases are too many: at most %d lines are judged.", (long long)n,
                    (long long)cases, MOST_LINES);
        return false;
    }
    for (int64_t i = 0; i < n; i++)
        if (!take_assertion(&out->assertions[i], d, &out->problem, &list->items[i]))
            return false;
    return true;
}
