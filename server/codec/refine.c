/* refine.c: requests made from other requests, as text: a body may be large, and its matrices must not be read again
 * only to be written again. The old texts are valid requests, so that the walk over them needs no checks. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/schema.h"
#include "codec/text.h"

#include <stdlib.h>
#include <string.h>

/* A range of bytes of a text; to 0: there is none. */
typedef struct {
    size_t from, to;
} span;

/* ---- a walk over the members of the outermost object */

static size_t skip_space(const char *json, size_t len, size_t at)
{
    while (at < len && strchr(" \t\r\n", json[at]))
        at++;
    return at;
}

/* Behind the closing quote of the string that begins at `at`. */
static size_t string_end(const char *json, size_t len, size_t at)
{
    for (at++; at < len && json[at] != '"'; at++)
        at += json[at] == '\\';
    return at + 1;
}

/* Behind the value that begins at `at`. */
static size_t value_end(const char *json, size_t len, size_t at)
{
    int depth = 0;
    while (at < len) {
        char c = json[at];
        if (depth == 0 && (c == ',' || c == '}'))
            break;
        depth += (c == '{' || c == '[') - (c == '}' || c == ']');
        at = c == '"' ? string_end(json, len, at) : at + 1;
    }
    while (at > 0 && strchr(" \t\r\n", json[at - 1]))
        at--;
    return at;
}

/* A key may be written with escapes, at most six bytes for each of its own. */
static bool key_is(const char *json, size_t from, size_t to, const char *key)
{
    char plain[64];
    size_t inside = to - from - 2, wanted = strlen(key);
    if (inside > 6 * wanted || inside > sizeof plain)
        return false;
    return json_text_decode(plain, json + from + 1, inside) == wanted && memcmp(plain, key, wanted) == 0;
}

/* The value of a member of the outermost object. */
static span find_member(const char *json, size_t len, const char *key)
{
    size_t at = skip_space(json, len, 0) + 1;
    for (at = skip_space(json, len, at); at < len && json[at] == '"'; at = skip_space(json, len, at)) {
        size_t end = string_end(json, len, at);
        size_t value = skip_space(json, len, skip_space(json, len, end) + 1), behind = value_end(json, len, value);
        if (key_is(json, at, end, key))
            return (span){value, behind};
        at = skip_space(json, len, behind);
        at = skip_space(json, len, at + (at < len && json[at] == ','));
    }
    return (span){0, 0};
}

static bool same_member(const char *a, size_t a_len, const char *b, size_t b_len, const char *key)
{
    span x = find_member(a, a_len, key), y = find_member(b, b_len, key);
    return x.to - x.from == y.to - y.from && (x.to == 0) == (y.to == 0) &&
           memcmp(a + x.from, b + y.from, x.to - x.from) == 0;
}

bool codec_is_verify(const char *body, size_t len)
{
    return find_member(body, len, "answer").to != 0;
}

bool codec_same_problem(const char *a, size_t a_len, const char *b, size_t b_len)
{
    return same_member(a, a_len, b, b_len, "problem") && same_member(a, a_len, b, b_len, "cases");
}

/* ---- the new solver */

static bool set_text(json_t *object, const char *key, const char *value)
{
    return json_object_set_new(object, key, json_string(value)) == 0;
}

static bool set_start(json_t *solver, const char *id)
{
    json_t *start = json_object();
    if (start && set_text(start, "job", id) && json_object_set_new(start, "continue", json_true()) == 0)
        return json_object_set_new(solver, "warm_start", start) == 0;
    json_decref(start);
    return false;
}

/* Writes a small value: jansson's own writer leaves bytes out when it finds no memory for them. Keys are of the schema,
 * so that nothing in them needs an escape. */
static void put_value(text *t, const json_t *value)
{
    const char *key;
    json_t *member;
    if (json_is_object(value)) {
        text_open(t, '{');
        json_object_foreach((json_t *)value, key, member)
        {
            text_key(t, key);
            put_value(t, member);
        }
        text_close(t, '}');
    } else if (json_is_string(value)) {
        text_string(t, json_string_value(value));
    } else if (json_is_boolean(value)) {
        text_bool(t, json_is_true(value));
    } else {
        text_number(t, json_real_value(value));
    }
}

/* The old object with the values of `change`; a rule that may stop short of the accuracy goes. */
static char *write_solver(json_t *solver, const json_t *change, const char *id)
{
    static const char *const KEYS[] = {"accuracy", "max_iterations", "time_limit_s"};
    text t = {0};
    bool ok = json_is_object(solver) && set_text(solver, "stopping", "certified") && set_start(solver, id);
    for (size_t i = 0; ok && i < sizeof KEYS / sizeof KEYS[0]; i++) {
        json_t *value = json_object_get(change, KEYS[i]);
        ok = !value || json_object_set(solver, KEYS[i], value) == 0;
    }
    json_object_del(solver, "epsilon");
    if (ok)
        put_value(&t, solver);
    t.failed = t.failed || !ok;
    return text_finish(&t, NULL);
}

/* Reads the old solver, which may be absent, and writes the new one; NULL: no memory. */
static char *make_solver(const char *old, span at, const json_t *change, const char *id)
{
    json_doc doc;
    problem_details ignored;
    const char *json = at.to ? old + at.from : "{}";
    if (!json_scan(&doc, json, at.to ? at.to - at.from : 2, &ignored))
        return NULL;
    char *solver = write_solver(doc.root, change, id);
    json_doc_clear(&doc);
    return solver;
}

static char *replace_solver(const char *old, size_t old_len, const char *id, const json_t *change, size_t *out_len)
{
    text t = {0};
    span at = find_member(old, old_len, "solver");
    char *solver = make_solver(old, at, change, id);
    size_t head = at.to ? at.from : skip_space(old, old_len, 0) + 1;
    t.failed = !solver;
    text_bytes(&t, old, head);
    text_put(&t, at.to ? "" : "\"solver\": ");
    text_put(&t, solver);
    text_put(&t, at.to ? "" : ", ");
    text_bytes(&t, old + (at.to ? at.to : head), old_len - (at.to ? at.to : head));
    free(solver);
    return text_finish(&t, out_len);
}

char *codec_refine(const char *old, size_t old_len, const char *id, const char *body, size_t len, size_t *out_len,
                   problem_details *problem)
{
    json_doc change;
    char *made = NULL;
    *out_len = 0;
    if (!json_scan(&change, body, len, problem))
        return NULL;
    if (decode_check(&change, "refine.json", problem)) {
        made = replace_solver(old, old_len, id, change.root, out_len);
        if (!made)
            decode_no_memory(problem);
    }
    json_doc_clear(&change);
    return made;
}
