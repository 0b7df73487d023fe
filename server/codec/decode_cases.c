/* decode_cases.c: what a request says beside its problem: load cases, a start, an answer to verify. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- names */

bool decode_label(char out[64], const json_t *value, const json_path *path, const char *what, problem_details *problem)
{
    const char *label = json_string_value(value);
    size_t len = json_string_length(value);
    bool fits = label && len < 64;
    for (size_t i = 0; fits && i < len; i++)
        fits = (unsigned char)label[i] >= 0x20 && label[i] != 0x7f;
    if (fits) {
        memcpy(out, label, len + 1);
        return true;
    }
    problem_set(problem, 422, "out_of_range", path, "%s has 1 to 63 bytes and no control characters; this one %s.",
                what, label && len < 64 ? "has one" : "is longer");
    return false;
}

/* `key` of the object at `parent`. */
static bool take_name(char out[64], const json_t *object, const char *key, const json_path *parent,
                      problem_details *problem)
{
    const json_path path = {parent, key, strlen(key), 0};
    return decode_label(out, json_object_get(object, key), &path, "A name of a case", problem);
}

static int compare_names(const void *a, const void *b)
{
    const uz_load_case *const *x = a, *const *y = b;
    int order = strcmp((*x)->name, (*y)->name);
    return order ? order : (*x > *y) - (*x < *y);
}

/* The first case whose name an earlier one has, -1: none, -2: no memory; *earlier is that one. */
static int64_t find_repeated(const uz_load_case *cases, int64_t n, int64_t *earlier)
{
    int64_t found = -1;
    const uz_load_case **sorted = room_for((size_t)n, sizeof *sorted);
    if (!sorted)
        return -2;
    for (int64_t i = 0; i < n; i++)
        sorted[i] = &cases[i];
    qsort(sorted, (size_t)n, sizeof *sorted, compare_names);
    for (int64_t i = 1; i < n; i++) {
        bool same = strcmp(sorted[i - 1]->name, sorted[i]->name) == 0;
        if (same && (found < 0 || sorted[i] - cases < found)) {
            found = sorted[i] - cases;
            *earlier = sorted[i - 1] - cases;
        }
    }
    free(sorted);
    return found;
}

static bool check_names(const uz_problem *p, problem_details *problem)
{
    char shown[80];
    int64_t earlier = 0, i = find_repeated(p->cases, p->n_cases, &earlier);
    if (i == -2)
        return decode_no_memory(problem);
    if (i < 0)
        return true;
    json_path list = {NULL, "cases", 5, 0}, item = {&list, NULL, 0, (size_t)i}, path = {&item, "name", 4, 0};
    problem_quote(shown, sizeof shown, p->cases[i].name, strlen(p->cases[i].name));
    problem_set(problem, 422, "not_allowed", &path, "/cases/%lld/name is %s, which is the name of case %lld already.",
                (long long)i, shown, (long long)earlier);
    return false;
}

/* ---- cases */

/* The vector `key` of a case in matrices, `wanted` numbers; absent: NULL. */
static bool take_vector(double **out, json_doc *doc, const json_t *item, const char *key, int64_t i, int64_t wanted,
                        size_t bound, problem_details *problem)
{
    char where[96];
    int64_t n = 0;
    const json_t *value = json_object_get(item, key);
    if (!value)
        return true;
    snprintf(where, sizeof where, "/cases/%lld/%s", (long long)i, key);
    if (!decode_vector(out, &n, doc, value, bound, where, problem))
        return false;
    if (n == wanted)
        return true;
    problem_set(problem, 422, "size_mismatch", NULL, "%s has %lld numbers; it must have %lld, one for each row of %s.",
                where, (long long)n, (long long)wanted, strcmp(key, "p") == 0 ? "K" : "N");
    snprintf(problem->pointer, sizeof problem->pointer, "%s", where);
    return false;
}

static bool take_case(uz_problem *p, int64_t i, json_doc *doc, const json_t *item, size_t bound,
                      problem_details *problem)
{
    json_path list = {NULL, "cases", 5, 0}, path = {&list, NULL, 0, (size_t)i};
    uz_load_case *out = &p->cases[i];
    if (!take_name(out->name, item, "name", &path, problem))
        return false;
    json_path loads = {&path, "loads", 5, 0};
    if (p->kind == UZ_PROBLEM_SCENE)
        return decode_loads(&out->loads, &out->n_loads, json_object_get(item, "loads"), uz_scene_dim(&p->scene), &loads,
                            problem);
    return take_vector(&out->p, doc, item, "p", i, p->qp.K.rows, bound, problem) &&
           take_vector(&out->h, doc, item, "h", i, p->qp.N.rows, bound, problem);
}

bool decode_cases(uz_problem *problem, json_doc *doc, const json_t *list, size_t body_len, problem_details *details)
{
    size_t count = json_array_size(list), bound = decode_memory_bound(body_len);
    if (count == 0)
        return true;
    problem->cases = calloc(count, sizeof *problem->cases);
    if (!problem->cases)
        return decode_no_memory(details);
    problem->n_cases = (int64_t)count;
    for (size_t i = 0; i < count; i++)
        if (!take_case(problem, (int64_t)i, doc, json_array_get(list, i), bound, details))
            return false;
    return check_names(problem, details);
}

/* ---- start */

bool decode_start(codec_start *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem)
{
    const char *id = json_string_value(json_object_get(object, "job"));
    const json_t *reactions = json_object_get(object, "reactions");
    json_path solver = {NULL, "solver", 6, 0}, path = {&solver, "warm_start", 10, 0};
    snprintf(out->job, sizeof out->job, "%s", id ? id : "");
    out->continued = json_is_true(json_object_get(object, "continue"));
    if (json_object_get(object, "case") && !take_name(out->case_name, object, "case", &path, problem))
        return false;
    return !reactions || decode_vector(&out->reactions, &out->n_reactions, doc, reactions,
                                       decode_memory_bound(body_len), "/solver/warm_start/reactions", problem);
}

/* ---- answer */

bool decode_answer(codec_answer *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem)
{
    size_t bound = decode_memory_bound(body_len);
    return decode_points(&out->u, &out->n_u, &out->columns, doc, json_object_get(object, "displacements"), bound,
                         "/answer/displacements", problem) &&
           decode_vector(&out->r, &out->n_r, doc, json_object_get(object, "reactions"), bound, "/answer/reactions",
                         problem);
}
