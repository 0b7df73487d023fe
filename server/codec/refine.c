/* refine.c: requests made from other requests, as text: a body may be large, and its matrices must not be read again
 * only to be written again. The old texts are valid requests, so that the walk over them needs no checks. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/text.h"

#include <stdlib.h>
#include <string.h>

static bool same_member(const char *a, size_t a_len, const char *b, size_t b_len, const char *key)
{
    size_t x_len, y_len;
    const char *x = json_member_text(a, a_len, key, &x_len), *y = json_member_text(b, b_len, key, &y_len);
    return x_len == y_len && (x_len == 0 || memcmp(x, y, x_len) == 0);
}

bool codec_is_verify(const char *body, size_t len)
{
    size_t answer_len;
    return json_member_text(body, len, "answer", &answer_len) != NULL;
}

bool codec_same_problem(const char *a, size_t a_len, const char *b, size_t b_len)
{
    return same_member(a, a_len, b, b_len, "problem") && same_member(a, a_len, b, b_len, "cases");
}

/* Writes a small value. Keys are of the schema, so that nothing in them needs an escape. */
static void put_value(text *t, const json_value *value)
{
    if (value->kind == JSON_IS_OBJECT) {
        text_open(t, NULL, '{');
        for (size_t i = 0; i < value->count; i++) {
            text_key(t, value->items[i].key);
            put_value(t, &value->items[i]);
        }
        text_close(t, '}');
    } else if (value->kind == JSON_IS_STRING) {
        text_string(t, NULL, json_text(value));
    } else if (value->kind == JSON_IS_BOOLEAN) {
        text_bool(t, NULL, value->truth);
    } else {
        text_number(t, NULL, json_number(value, 0));
    }
}

/* A member of the solver of a refining job. */
static void put_member(text *t, const char *key, const json_value *old, const json_value *change, const char *id)
{
    const json_value *asked = json_get(change, key);
    text_key(t, key);
    if (strcmp(key, "stopping") == 0) {
        text_string(t, NULL, "certified");
    } else if (strcmp(key, "warm_start") == 0) {
        text_open(t, NULL, '{');
        text_string(t, "job", id);
        text_bool(t, "continue", true);
        text_close(t, '}');
    } else {
        put_value(t, asked ? asked : old);
    }
}

/* at: the old solver, NULL: there was none. */
static char *make_solver(const char *at, size_t len, const json_value *change, const char *id)
{
    json_tree tree = {NULL, NULL};
    problem_details ignored;
    text t = {.failed = at && !json_scan(&tree, at, len, &ignored)};
    /* The old members, changed where they stand, then the new ones; a rule that may stop short of the accuracy goes. */
    const json_value *old = tree.root;
    static const char *const SET[] = {"stopping", "warm_start"}, *const KEYS[] = {"accuracy", "max_iterations",
                                                                                  "time_limit_s"};
    text_open(&t, NULL, '{');
    for (size_t i = 0; i < json_size(old); i++)
        if (strcmp(old->items[i].key, "epsilon") != 0)
            put_member(&t, old->items[i].key, &old->items[i], change, id);
    for (size_t i = 0; i < sizeof SET / sizeof SET[0]; i++)
        if (!json_get(old, SET[i]))
            put_member(&t, SET[i], NULL, change, id);
    for (size_t i = 0; i < sizeof KEYS / sizeof KEYS[0]; i++)
        if (!json_get(old, KEYS[i]) && json_get(change, KEYS[i]))
            put_member(&t, KEYS[i], NULL, change, id);
    text_close(&t, '}');
    json_clear(&tree);
    return text_finish(&t, NULL);
}

static char *replace_solver(const char *old, size_t old_len, const char *id, const json_value *change, size_t *out_len)
{
    size_t len;
    const char *at = json_member_text(old, old_len, "solver", &len);
    const char *head = at ? at : (const char *)memchr(old, '{', old_len) + 1, *tail = head + len;
    char *solver = make_solver(at, len, change, id);
    text t = {.failed = !solver};
    text_bytes(&t, old, (size_t)(head - old));
    text_put(&t, at ? "" : "\"solver\": ");
    text_put(&t, solver);
    text_put(&t, at ? "" : ", ");
    text_bytes(&t, tail, old_len - (size_t)(tail - old));
    free(solver);
    return text_finish(&t, out_len);
}

char *codec_refine(const char *old, size_t old_len, const char *id, const char *body, size_t len, size_t *out_len,
                   problem_details *problem)
{
    json_tree change;
    char *made = NULL;
    *out_len = 0;
    if (!json_scan(&change, body, len, problem))
        return NULL;
    if (schemas_check(decode_schemas(), "refine.json", change.root, problem)) {
        made = replace_solver(old, old_len, id, change.root, out_len);
        if (!made)
            problem_no_memory(problem);
    }
    json_clear(&change);
    return made;
}
