/* decode_beside.c: what a request says beside its problem: load cases, settings, quantities, assertions about the
 * summary. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/quantity.h"
#include "codec/room.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- cases */

#define MOST_CASES 10000 /* of a job */

static int compare_names(const void *a, const void *b)
{
    const uz_load_case *const *x = a, *const *y = b;
    int order = strcmp((*x)->name, (*y)->name);
    return order ? order : (*x > *y) - (*x < *y);
}

/* The vector `key` of a case in matrices, `wanted` numbers; absent: NULL. */
static bool take_vector(double **out, decoding *d, const json_value *item, const char *key, int64_t wanted,
                        const char *matrix)
{
    const json_value *value = json_get(item, key);
    int64_t n = 0;
    if (!value)
        return true;
    return decode_vector(out, &n, d, value) &&
           (n == wanted ||
            decode_refuse(d, "size_mismatch", value, "has %lld numbers; it must have %lld, one for each row of %s.",
                          (long long)n, (long long)wanted, matrix));
}

/* One item of the list into the case *out, of a path its last point. */
static bool decode_case(uz_load_case *out, decoding *d, const uz_problem *problem, const json_value *item)
{
    const json_value *name = json_get(item, "name"), *after = json_get(item, "after"), *part = json_get(item, "part");
    const json_value *steps = json_get(item, "steps"), *loads = json_get(item, "loads");
    if (!decode_label(out->name, d, name, name->text, name->count, "A name of a case") ||
        (after && !decode_label(out->after, d, after, after->text, after->count, "A name of a case")))
        return false;
    if (steps && part)
        return decode_refuse(d, "not_allowed", part, "is said by the last of steps: leave it out.");
    out->has_part = part || steps;
    out->part = steps ? steps->numbers[steps->count - 1] : json_number(part, 1);
    if (steps && problem->scene.kinematics != UZ_KINEMATICS_FINITE)
        return decode_refuse(d, "bad_scene", steps,
                             "is a path, and paths of loads are those of the kinematics \"finite\": use these, or give "
                             "each load a case.");
    return problem->kind == UZ_PROBLEM_SCENE
               ? !loads || decode_loads(&out->loads, &out->n_loads, d, loads, uz_scene_dim(&problem->scene))
               : take_vector(&out->p, d, item, "p", problem->qp.K.rows, "K") &&
                     take_vector(&out->h, d, item, "h", problem->qp.N.rows, "N");
}

/* The n points of a path, of which the last one, point[n - 1], is there: NAME 1, NAME 2, ... before it, each after the
 * one before. */
static bool add_points(uz_load_case *point, decoding *d, const json_value *item, int64_t n)
{
    uz_load_case *last = &point[n - 1];
    const json_value *steps = json_get(item, "steps");
    char name[sizeof last->name + 24];
    for (int64_t i = 0; i < n - 1; i++) {
        const int len = snprintf(name, sizeof name, "%s %lld", last->name, (long long)i + 1);
        if (!decode_label(point[i].name, d, json_get(item, "name"), name, (size_t)len, "A point of a path"))
            return false;
        memcpy(point[i].after, i == 0 ? last->after : point[i - 1].name, sizeof point[i].after);
        point[i].has_part = true;
        point[i].part = steps->numbers[i];
        point[i].surplus = last->surplus - n + 1 + i;
        if (!last->loads)
            continue;
        point[i].loads = room_for((size_t)last->n_loads, sizeof *last->loads);
        if (!point[i].loads)
            return problem_no_memory(d->problem);
        point[i].n_loads = last->n_loads;
        memcpy(point[i].loads, last->loads, (size_t)last->n_loads * sizeof *last->loads);
    }
    if (n > 1)
        memcpy(last->after, point[n - 2].name, sizeof last->after);
    return true;
}

static int64_t points_of(const json_value *item)
{
    const json_value *steps = json_get(item, "steps");
    return steps ? (int64_t)steps->count : 1;
}

/* The first case whose name an earlier one has is refused. */
static bool check_names(const uz_problem *problem, decoding *d, const json_value *list)
{
    int64_t found = problem->n_cases, earlier = 0;
    const uz_load_case **sorted = room_for((size_t)problem->n_cases, sizeof *sorted);
    if (!sorted)
        return problem_no_memory(d->problem);
    for (int64_t i = 0; i < problem->n_cases; i++)
        sorted[i] = &problem->cases[i];
    qsort(sorted, (size_t)problem->n_cases, sizeof *sorted, compare_names);
    for (int64_t i = 1; i < problem->n_cases; i++)
        if (strcmp(sorted[i - 1]->name, sorted[i]->name) == 0 && sorted[i] - problem->cases < found) {
            found = sorted[i] - problem->cases;
            earlier = sorted[i - 1] - problem->cases;
        }
    free(sorted);
    if (found == problem->n_cases)
        return true;
    char shown[80];
    problem_quote(shown, sizeof shown, problem->cases[found].name, strlen(problem->cases[found].name));
    return decode_refuse(d, "not_allowed", json_get(&list->items[found - problem->cases[found].surplus], "name"),
                         "is %s, which is the name of case %lld already.", shown,
                         (long long)(earlier - problem->cases[earlier].surplus));
}

bool decode_cases(uz_problem *problem, decoding *d, const json_value *list)
{
    int64_t all = 0, at = 0;
    for (size_t i = 0; i < json_size(list); i++)
        all += points_of(&list->items[i]);
    if (all == 0)
        return true;
    if (all > MOST_CASES)
        return decode_refuse(d, "not_allowed", list, "has %lld cases with the points of their paths; at most %d.",
                             (long long)all, MOST_CASES);
    problem->cases = calloc((size_t)all, sizeof *problem->cases);
    if (!problem->cases)
        return problem_no_memory(d->problem);
    problem->n_cases = all;
    for (size_t i = 0; i < json_size(list); i++) {
        const json_value *item = &list->items[i];
        const int64_t points = points_of(item);
        at += points;
        problem->cases[at - 1].surplus = at - 1 - (int64_t)i;
        if (!decode_case(&problem->cases[at - 1], d, problem, item) ||
            !add_points(&problem->cases[at - points], d, item, points))
            return false;
    }
    return check_names(problem, d, list);
}

/* ---- settings */

static const char *text_or(const json_value *object, const char *key, const char *otherwise)
{
    const char *text = json_text(json_get(object, key));
    return text ? text : otherwise;
}

/* The schema's enums and the library's names are the same words (a test compares them), so parsing cannot fail. */
void decode_settings(uz_settings *out, const json_value *object)
{
    static const struct {
        const char *name;
        double relative_error; /* 0: rounding level */
        bool balanced;
    } LEVELS[] = {{"quick", 1e-2, false}, {"balanced", 1e-2, true}, {"precise", 1e-8, false}, {"exact", 0, false}};
    uz_settings s = uz_settings_default();
    const json_value *accuracy = json_get(object, "accuracy");
    uz_method_parse(&s.method, text_or(object, "method", "auto"));
    s.op = (uz_operator)uz_choice_find(UZ_CHOICE_OPERATOR, text_or(object, "operator", "auto"));
    s.ordering = (uz_ordering)uz_choice_find(UZ_CHOICE_ORDERING, text_or(object, "ordering", "auto"));
    s.stopping = (uz_stopping)uz_choice_find(UZ_CHOICE_STOPPING, text_or(object, "stopping", "certified"));
    s.row_scaling = (uz_row_scaling)uz_choice_find(UZ_CHOICE_ROW_SCALING, text_or(object, "row_scaling", "auto"));
    const char *level = text_or(object, "accuracy", s.stopping == UZ_STOP_PAPER ? "quick" : "precise");
    for (size_t i = 0; i < sizeof LEVELS / sizeof LEVELS[0]; i++)
        if (strcmp(LEVELS[i].name, level) == 0) {
            s.relative_error = LEVELS[i].relative_error;
            s.balanced = LEVELS[i].balanced;
        }
    s.guaranteed = json_truth(json_get(accuracy, "guaranteed"));
    s.total_error = json_number(json_get(accuracy, "total"), 0);
    if (s.total_error > 0) /* the equations may have a tenth of it */
        s.relative_error = 0.1 * s.total_error;
    s.relative_error = json_number(json_get(accuracy, "relative_error"), s.relative_error);
    s.epsilon = json_number(json_get(object, "epsilon"), 1e-6);
    s.alpha = json_number(json_get(object, "alpha"), s.alpha);
    s.max_iterations = (int64_t)json_number(json_get(object, "max_iterations"), (double)s.max_iterations);
    s.time_limit_s = json_number(json_get(object, "time_limit_s"), s.time_limit_s);
    s.semidefinite = json_truth(json_get(object, "semidefinite"));
    *out = s;
}

/* ---- quantities */

bool decode_quantities(uz_problem *problem, uz_settings *settings, decoding *d, const json_value *list,
                       const json_value *accuracy)
{
    const bool asked = json_get(accuracy, "quantity") != NULL;
    const int64_t first = asked ? 1 : 0, count = first + (int64_t)json_size(list);
    const int dim = uz_scene_dim(&problem->scene);
    if (count == 0)
        return true;
    problem->quantities = calloc((size_t)count, sizeof *problem->quantities);
    if (!problem->quantities)
        return problem_no_memory(d->problem);
    problem->n_quantities = count;
    problem->quantities[0].asked = asked;
    settings->quantity_error = json_number(json_get(accuracy, "relative"), 0);
    for (int64_t i = 0; i < count; i++) {
        const json_value *item = i < first ? accuracy : &list->items[i - first];
        const json_value *window = json_get(item, "window"), *name = json_get(item, "name");
        uz_quantity *to = &problem->quantities[i];
        double length = 0;
        to->kind = (uz_quantity_kind)uz_choice_find(UZ_CHOICE_QUANTITY, json_text(json_get(item, "quantity")));
        if (!decode_group(to->on, d, json_get(item, "on"), GROUP_OR_CONTACT))
            return false;
        if (json_get(item, "direction") &&
            !decode_components(to->direction, d, item, "direction", 0, dim, "it must be the direction of the number"))
            return false;
        if (window && (!decode_components(to->low, d, window, "min", 0, dim, NULL) ||
                       !decode_components(to->high, d, window, "max", 0, dim, NULL)))
            return false;
        for (int c = 0; c < dim; c++)
            length = hypot(length, to->direction[c]);
        for (int c = 0; c < dim && length > 0; c++)
            to->direction[c] /= length;
        for (int c = 0; c < dim && window; c++)
            if (!(to->low[c] <= to->high[c]))
                return decode_refuse(d, "out_of_range", window,
                                     "has min %.15g above max %.15g: nothing is between them.", to->low[c],
                                     to->high[c]);
        if (name && !decode_label(to->name, d, name, name->text, name->count, "A name of a quantity"))
            return false;
        if (name && (strchr(to->name, '.') || strspn(to->name, "0123456789") == strlen(to->name)))
            return decode_refuse(d, "not_allowed", name, "must have no dot and be no number: assertions name it.");
        if (!name)
            snprintf(to->name, sizeof to->name, "%s%s%.40s", uz_choice_name(UZ_CHOICE_QUANTITY, to->kind),
                     to->on[0] ? "_" : "", to->on);
        for (char *at = to->name; *at; at++)
            *at = *at == '.' ? '_' : *at;
    }
    return true;
}

/* ---- assertions */

/* Each summary has a line for each assertion about it. */
#define MOST_LINES 100000

/* A quantity that is asserted by its name must be one of the request's. */
static bool check_named(const codec_request *request, decoding *d, const json_value *quantity)
{
    static const char LIST[] = "quantities.";
    const char *name = quantity->text + sizeof LIST - 1;
    char shown[80];
    if (strncmp(quantity->text, LIST, sizeof LIST - 1) != 0 || (*name >= '0' && *name <= '9'))
        return true;
    for (int64_t i = 0; i < request->problem.n_quantities; i++)
        if (strcmp(request->problem.quantities[i].name, name) == 0)
            return true;
    problem_quote(shown, sizeof shown, name, strlen(name));
    problem_set(d->problem, 422, "not_allowed", quantity, "The request asks for no quantity called %s%s%s%s.", shown,
                request->problem.n_quantities > 0 ? "; the first is called \"" : "",
                request->problem.n_quantities > 0 ? request->problem.quantities[0].name : "",
                request->problem.n_quantities > 0 ? "\"" : "");
    return false;
}

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
        if (!check_named(out, d, quantity))
            return false;
        out->problem.scene.peak_stress |= strncmp(a->quantity, "stress.", 7) == 0; /* measured only where asked for */
        a->least = json_number(json_get(object, "min"), (double)NAN);
        a->most = json_number(json_get(object, "max"), (double)NAN);
        a->near = json_number(json_get(object, "near"), (double)NAN);
        a->absolute = json_number(json_get(object, "absolute"), (double)NAN);
        a->relative = json_number(json_get(object, "relative"), (double)NAN);
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
