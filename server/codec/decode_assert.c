/* decode_assert.c: assertions about the summary of a job. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/quantity.h"

#include <math.h>
#include <string.h>

/* Each summary has a line for each assertion about it. */
#define MOST_LINES 100000

bool decode_assertions(codec_request *out, decoding *d, const json_value *list)
{
    const uz_problem *p = &out->problem;
    const int64_t cases = p->n_cases > 0 ? p->n_cases : 1;
    if (json_size(list) == 0)
        return true;
    out->assertions = decode_room(d, list, sizeof *out->assertions, &out->n_assertions);
    if (!out->assertions)
        return false;
    if (out->n_assertions > MOST_LINES / cases) {
        problem_set(d->problem, 422, "out_of_range", list,
                    "%lld assertions about each of %lld cases are too many: at most %d lines are judged.",
                    (long long)out->n_assertions, (long long)cases, MOST_LINES);
        return false;
    }
    for (int64_t i = 0; i < out->n_assertions; i++) {
        const json_value *object = &list->items[i], *quantity = json_get(object, "quantity");
        const json_value *name = json_get(object, "name"), *of = json_get(object, "case");
        codec_assertion *a = &out->assertions[i];
        if (!quantity_check(decode_schemas(), quantity, d->problem))
            return false;
        memcpy(a->quantity, quantity->text, quantity->count + 1);
        a->least = decode_number(object, "min", (double)NAN);
        a->most = decode_number(object, "max", (double)NAN);
        a->near = decode_number(object, "near", (double)NAN);
        a->absolute = decode_number(object, "absolute", (double)NAN);
        a->relative = decode_number(object, "relative", (double)NAN);
        if ((name && !decode_label(a->name, d, name, name->text, name->count, "The name of an assertion")) ||
            (of && !decode_label(a->case_name, d, of, of->text, of->count, "A name of a case")))
            return false;
        bool there = !of;
        for (int64_t k = 0; k < p->n_cases && !there; k++)
            there = strcmp(p->cases[k].name, a->case_name) == 0;
        if (!there) {
            char shown[80];
            problem_quote(shown, sizeof shown, a->case_name, strlen(a->case_name));
            problem_set(d->problem, 422, "not_allowed", of, "The request has no case %s%s.", shown,
                        p->n_cases == 0 ? "; it has none at all" : "");
        } else if (a->least > a->most) { /* limits that no number can meet are a mistake */
            problem_set(d->problem, 422, "out_of_range", json_get(object, "min"),
                        "min is %.15g, above max, %.15g: no number is between them.", a->least, a->most);
        } else if (a->near == 0.0 && isnan(a->absolute)) {
            problem_set(d->problem, 422, "out_of_range", json_get(object, "relative"),
                        "Nothing but 0 is near 0 by a relative measure: give absolute.");
        } else {
            continue;
        }
        return false;
    }
    return true;
}
