/* vary.c: --vary: what a load case can carry becomes cases of one job, anything else a job for each value. */
#include "request/build.h"
#include "request/paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_VARIED 8
#define MOST_CASES  10000 /* schemas/request.json */
#define MOST_JOBS   1000
#define NAME_MOST   63 /* bytes of a case's name, schemas/request.json */

typedef struct {
    client_path path;
    json_t *values;
    bool in_case;
} varied;

/* ------------------------------------------------------------------ values */

/* FIRST:LAST:COUNT. NULL: it is not. */
static json_t *read_range(const char *text)
{
    char *end;
    double first = strtod(text, &end);
    if (end == text || *end != ':')
        return NULL;
    const char *rest = end + 1;
    double last = strtod(rest, &end);
    if (end == rest || *end != ':' || !isfinite(first) || !isfinite(last))
        return NULL;
    rest = end + 1;
    long count = strtol(rest, &end, 10);
    if (end == rest || *end || count < 2 || count > MOST_CASES)
        return NULL;
    json_t *values = json_array();
    for (long i = 0; values && i < count; i++) {
        /* The number that a person would write, where that is the same to 14 digits: 0.3, not 0.30000000000000004. */
        char tidy[40];
        snprintf(tidy, sizeof tidy, "%.14g", first + (last - first) * (double)i / (double)(count - 1));
        const double x = strtod(tidy, NULL);
        const bool whole = floor(x) == x && fabs(x) < 9e15;
        if (json_array_append_new(values, whole ? json_integer((json_int_t)x) : json_real(x)) != 0) {
            json_decref(values);
            return NULL;
        }
    }
    return values;
}

json_t *client_vary_values(const char *text, char *message, size_t size)
{
    char *end;
    strtod(text, &end);
    const bool range = end != text && *end == ':';
    json_t *values = range ? read_range(text) : NULL;
    message[0] = '\0';
    if (!range) { /* A,B,C as JSON, or else as words, none of them empty */
        client_buffer array = {0};
        const bool memory = client_buffer_append(&array, "[", 1) && client_buffer_append(&array, text, strlen(text)) &&
                            client_buffer_append(&array, "]", 1);
        values = memory ? json_loadb(array.data, array.len, JSON_REJECT_DUPLICATES, NULL) : NULL;
        free(array.data);
        if (!memory)
            return NULL;
        bool more = !json_array_size(values);
        if (more) {
            json_decref(values);
            values = json_array();
        }
        for (const char *at = text; more && values; at++) {
            const size_t len = strcspn(at, ",");
            if (!len || json_array_append_new(values, client_value_read(at, len)) != 0) {
                json_decref(values);
                values = NULL;
            }
            at += len;
            more = *at == ',';
        }
    }
    if (!values)
        snprintf(message, size,
                 range
                     ? "\"%.100s\" is no FIRST:LAST:COUNT: two numbers and a count from 2 to 10000, such as 0.1:1.0:10"
                     : "\"%.100s\" is no list: values with commas between them, or FIRST:LAST:COUNT",
                 text);
    return values;
}

/* -------------------------------------------------------------- what varies */

static client_exit read_varied(client_session *s, varied *out, const json_t *request, const char *word)
{
    char message[1024], why[900] = "it wants PATH=VALUES";
    const char *equals = strchr(word, '=');
    size_t len = equals ? (size_t)(equals - word) : strlen(word);
    bool ok = equals && client_path_read(&out->path, request, word, len, why, sizeof why);
    out->values = ok ? client_vary_values(equals + 1, why, sizeof why) : NULL;
    ok = out->values != NULL;
    if (ok) {
        /* The first value is tried, so that a wrong path is told before anything is sent. */
        json_t *copy = json_deep_copy(request);
        ok = strcmp(out->path.part[0], "problem") != 0 || client_path_get(&out->path, copy, why, sizeof why);
        ok = ok && client_path_set(&out->path, copy, json_incref(json_array_get(out->values, 0)), why, sizeof why);
        json_decref(copy);
    }
    /* Can a load case carry it (scene_case and matrices_case of schemas/request.json)? */
    const char *kind = json_string_value(json_object_get(json_object_get(request, "problem"), "kind"));
    if (ok && kind && out->path.count >= 2 && strcmp(out->path.part[0], "problem") == 0) {
        const char *what = out->path.part[1];
        out->in_case =
            strcmp(kind, "scene") == 0 ? strcmp(what, "loads") == 0 : strcmp(what, "p") == 0 || strcmp(what, "h") == 0;
    }
    if (ok && out->in_case && json_object_get(request, "cases")) {
        snprintf(why, sizeof why, "a load is varied by cases, and the request has cases of its own: take them out");
        ok = false;
    }
    if (ok)
        return CLIENT_OK;
    if (!why[0])
        return client_complain(s, CLIENT_LOCAL, "no memory");
    snprintf(message, sizeof message, "--vary %.*s: %s", (int)(len < 200 ? len : 200), word, why);
    return client_complain(s, CLIENT_USAGE, message);
}

/* ------------------------------------------------------------ combinations */

/* Of those varied in cases, or of the others. */
static size_t combinations(const varied *all, int count, bool in_case)
{
    size_t n = 1;
    for (int i = 0; i < count; i++)
        if (all[i].in_case == in_case && n <= MOST_CASES)
            n *= json_array_size(all[i].values);
    return n;
}

/* Puts the k-th combination into the request and its values into name; the last one varies fastest. */
static bool put_combination(const varied *all, int count, bool in_case, size_t k, json_t *request, char *name,
                            size_t size)
{
    char why[64];
    bool ok = true;
    size_t left = combinations(all, count, in_case);
    name[0] = '\0';
    for (int i = 0; ok && i < count; i++) {
        if (all[i].in_case != in_case)
            continue;
        left /= json_array_size(all[i].values);
        json_t *value = json_array_get(all[i].values, k / left);
        k %= left;
        size_t len = strlen(name);
        char number[40], *dumped = NULL;
        const char *text = json_string_value(value);
        if (json_is_real(value)) {
            snprintf(number, sizeof number, "%.15g", json_real_value(value));
            text = number;
        } else if (!text)
            text = dumped = json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(15));
        snprintf(name + len, size - len, "%s%s", len ? "," : "", text ? text : "?");
        free(dumped);
        ok = client_path_set(&all[i].path, request, json_deep_copy(value), why, sizeof why);
    }
    return ok;
}

static client_exit add_cases(client_session *s, json_t *request, const varied *all, int count)
{
    char name[160], message[256];
    size_t n = combinations(all, count, true);
    json_t *cases = json_array(), *names = json_object(), *copy = json_deep_copy(request);
    client_exit code = cases && names && copy ? CLIENT_OK : client_complain(s, CLIENT_LOCAL, "no memory");
    for (size_t k = 0; code == CLIENT_OK && k < n; k++) {
        bool ok = put_combination(all, count, true, k, copy, name, sizeof name);
        if (strlen(name) > NAME_MOST)
            snprintf(name, sizeof name, "case %zu", k);
        if (json_object_get(names, name)) {
            snprintf(message, sizeof message, "--vary gives \"%.100s\" twice: a case's name must be its own", name);
            code = client_complain(s, CLIENT_USAGE, message);
            break;
        }
        /* The load case that the request with its values put in stands for. */
        json_t *made = json_pack("{s:s}", "name", name), *problem = json_object_get(copy, "problem");
        ok = ok && made && json_object_set_new(names, name, json_true()) == 0;
        for (int i = 0; ok && i < count; i++) {
            const char *key = all[i].path.part[1];
            if (all[i].in_case)
                ok = json_object_set_new(made, key, json_deep_copy(json_object_get(problem, key))) == 0;
        }
        if (!ok || json_array_append(cases, made) != 0)
            code = client_complain(s, CLIENT_LOCAL, "no memory, or a value is not UTF-8");
        json_decref(made);
    }
    if (code == CLIENT_OK && json_object_set(request, "cases", cases) != 0)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    json_decref(cases);
    json_decref(names);
    json_decref(copy);
    return code;
}

client_exit client_build_variants(client_session *s, json_t **requests, json_t **labels, const json_t *request)
{
    varied all[MOST_VARIED] = {0};
    const uz_words *words = &s->options->vary;
    client_exit code = CLIENT_OK;
    bool cases = false;
    *requests = json_array();
    *labels = json_array();
    for (int i = 0; code == CLIENT_OK && i < words->count; i++) {
        code = read_varied(s, &all[i], request, words->item[i]);
        cases = cases || all[i].in_case;
    }
    size_t jobs = code == CLIENT_OK ? combinations(all, words->count, false) : 0;
    if (code == CLIENT_OK && (jobs > MOST_JOBS || combinations(all, words->count, true) > MOST_CASES))
        code = client_complain(s, CLIENT_USAGE, "--vary makes more than 1000 jobs or 10000 cases");
    for (size_t k = 0; code == CLIENT_OK && k < jobs; k++) {
        char label[160];
        json_t *copy = json_deep_copy(request);
        if (!copy || !put_combination(all, words->count, false, k, copy, label, sizeof label))
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        if (code == CLIENT_OK && cases)
            code = add_cases(s, copy, all, words->count);
        if (code == CLIENT_OK &&
            (json_array_append(*requests, copy) != 0 || json_array_append_new(*labels, json_string(label)) != 0))
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        json_decref(copy);
    }
    for (int i = 0; i < words->count; i++)
        json_decref(all[i].values);
    return code;
}
