/* stored.c: what this service wrote or took itself, read back: summaries and errors of jobs, and requests made from
 * other requests. The old texts are valid, so that reading them needs no checks. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/json.h"
#include "codec/problem.h"
#include "codec/text.h"

#include <stdio.h>
#include <string.h>

bool codec_decode_problem(problem_details *out, const char *json)
{
    problem_details ignored;
    json_tree tree;
    memset(out, 0, sizeof *out);
    if (!json_scan(&tree, json, strlen(json), &ignored))
        return false;
    const json_value *object = tree.root;
    const bool good = json_is(object, JSON_IS_OBJECT);
    out->status = (int)json_number(json_get(object, "status"), 0);
    out->line = (int64_t)json_number(json_get(object, "line"), 0);
    const struct {
        const char *key;
        char *out;
        size_t size;
    } TEXTS[] = {{"code", out->code, sizeof out->code},
                 {"title", out->title, sizeof out->title},
                 {"detail", out->detail, sizeof out->detail},
                 {"pointer", out->pointer, sizeof out->pointer}};
    for (size_t i = 0; i < sizeof TEXTS / sizeof TEXTS[0]; i++) {
        const char *found = json_text(json_get(object, TEXTS[i].key));
        snprintf(TEXTS[i].out, TEXTS[i].size, "%s", found ? found : "");
    }
    json_clear(&tree);
    return good;
}

bool codec_summary_read(json_tree *out, const char *json)
{
    problem_details ignored;
    return json_scan(out, json, strlen(json), &ignored);
}

const char *codec_summary_text(const json_value *summary, const char *name)
{
    const json_value *node = summary;
    for (size_t len = strcspn(name, "."); node; name += len + 1, len = strcspn(name, ".")) {
        node = json_get_n(node, name, len);
        if (!name[len])
            break;
    }
    return json_text(node) ? json_text(node) : "";
}

/* ---- requests, as text: a body may be large, and its matrices must not be read again only to be written again */

bool codec_same_problem(const char *a, size_t a_len, const char *b, size_t b_len)
{
    static const char *const KEYS[] = {"problem", "cases"};
    bool same = true;
    for (size_t i = 0; i < sizeof KEYS / sizeof KEYS[0]; i++) {
        size_t x_len, y_len;
        const char *x = json_member_text(a, a_len, KEYS[i], &x_len), *y = json_member_text(b, b_len, KEYS[i], &y_len);
        same = same && x_len == y_len && (x_len == 0 || memcmp(x, y, x_len) == 0);
    }
    return same;
}

/* Writes a small value. Keys are of the schema, so that nothing in them needs an escape. */
static void put_value(text *t, const char *key, const json_value *value)
{
    if (value->kind == JSON_IS_OBJECT) {
        text_open(t, key, '{');
        for (size_t i = 0; i < value->count; i++)
            put_value(t, value->items[i].key, &value->items[i]);
        text_close(t, '}');
    } else if (value->kind == JSON_IS_STRING) {
        text_string(t, key, json_text(value));
    } else if (value->kind == JSON_IS_BOOLEAN) {
        text_bool(t, key, value->truth);
    } else {
        text_number(t, key, json_number(value, 0));
    }
}

/* A member of the solver of a refining job. */
static void put_member(text *t, const char *key, const json_value *old, const json_value *change, const char *id)
{
    const json_value *asked = json_get(change, key);
    if (strcmp(key, "stopping") == 0) {
        text_string(t, key, "certified");
    } else if (strcmp(key, "warm_start") == 0) {
        text_open(t, key, '{');
        text_string(t, "job", id);
        text_bool(t, "continue", true);
        text_close(t, '}');
    } else {
        put_value(t, key, asked ? asked : old);
    }
}

char *codec_refine(const char *old, size_t old_len, const char *id, const char *body, size_t len, size_t *out_len,
                   problem_details *problem)
{
    static const char *const SET[] = {"stopping", "warm_start"}, *const KEYS[] = {"accuracy", "max_iterations",
                                                                                  "time_limit_s"};
    json_tree changes, tree = {NULL, NULL};
    problem_details ignored;
    size_t solver_len;
    *out_len = 0;
    if (!json_scan(&changes, body, len, problem))
        return NULL;
    const json_value *change = changes.root;
    if (!schemas_check(decode_schemas(), "refine.json", change, problem)) {
        json_clear(&changes);
        return NULL;
    }
    const char *at = json_member_text(old, old_len, "solver", &solver_len); /* NULL: there was none */
    const char *head = at ? at : (const char *)memchr(old, '{', old_len) + 1, *tail = head + solver_len;
    text t = {.failed = at && !json_scan(&tree, at, solver_len, &ignored)};
    text_bytes(&t, old, (size_t)(head - old));
    text_put(&t, at ? "" : "\"solver\": ");

    /* The old members, changed where they stand, then the new ones; a rule that may stop short of the accuracy goes. */
    const json_value *solver = tree.root;
    text_put(&t, "{");
    for (size_t i = 0; i < json_size(solver); i++)
        if (strcmp(solver->items[i].key, "epsilon") != 0)
            put_member(&t, solver->items[i].key, &solver->items[i], change, id);
    for (size_t i = 0; i < sizeof SET / sizeof SET[0]; i++)
        if (!json_get(solver, SET[i]))
            put_member(&t, SET[i], NULL, change, id);
    for (size_t i = 0; i < sizeof KEYS / sizeof KEYS[0]; i++)
        if (!json_get(solver, KEYS[i]) && json_get(change, KEYS[i]))
            put_member(&t, KEYS[i], NULL, change, id);
    text_close(&t, '}');
    text_put(&t, at ? "" : ", ");
    text_bytes(&t, tail, old_len - (size_t)(tail - old));
    json_clear(&tree);
    json_clear(&changes);
    char *made = text_finish(&t, out_len);
    if (!made)
        problem_no_memory(problem);
    return made;
}
