#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/schema.h"
#include "codec/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Set by codec_init before threads start, only read until codec_end. */
static schemas *loaded;

bool codec_init(char *message, size_t size)
{
    codec_end();
    json_object_seed(0);
    loaded = schemas_load(message, size);
    return loaded != NULL;
}

void codec_end(void)
{
    schemas_free(loaded);
    loaded = NULL;
}

static int http_status(uz_status status)
{
    return status == UZ_ERR_MEMORY ? 503 : status == UZ_ERR_INTERNAL || status == UZ_ERR_ARGUMENT ? 500 : 422;
}

void codec_problem_from_error(problem_details *out, const uz_error *err)
{
    const char *where = err->where;
    problem_set(out, http_status(err->status), uz_status_name(err->status), NULL, "%s", err->message);
    snprintf(out->pointer, sizeof out->pointer, "/problem%s%s", where[0] && where[0] != '/' ? "/" : "", where);
    out->line = err->line;
}

/* Tags are compared as C strings by the store, and shown in terminals. */
static bool check_tags(const json_t *tags, problem_details *problem)
{
    size_t i;
    json_t *tag;
    json_array_foreach(tags, i, tag)
    {
        const char *word = json_string_value(tag);
        json_path list = {NULL, "tags", 4, 0}, path = {&list, NULL, 0, i};
        for (size_t k = 0; k < json_string_length(tag); k++)
            if ((unsigned char)word[k] < 0x20 || word[k] == 0x7f) {
                problem_set(problem, 422, "not_allowed", &path, "/tags/%zu has a control character; tags are words.",
                            i);
                return false;
            }
    }
    return true;
}

static bool decode_tags(char **out, const json_t *tags, problem_details *problem)
{
    if (!check_tags(tags, problem))
        return false;
    text none = {0};
    if (!tags)
        text_put(&none, "[]");
    *out = tags ? json_dumps(tags, JSON_COMPACT) : text_finish(&none, NULL);
    if (!*out)
        problem_set(problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return *out != NULL;
}

static bool decode_problem(uz_problem *out, json_doc *doc, size_t body_len, problem_details *problem)
{
    const json_t *object = json_object_get(doc->root, "problem");
    const char *kind = json_string_value(json_object_get(object, "kind"));
    bool scene = strcmp(kind, "scene") == 0;
    out->kind = scene ? UZ_PROBLEM_SCENE : UZ_PROBLEM_MATRICES;
    return scene ? decode_scene(&out->scene, object, problem)
                 : decode_matrices(&out->qp, doc, object, body_len, problem);
}

bool codec_decode_request(codec_request *out, const char *body, size_t len, problem_details *problem)
{
    json_doc doc;
    codec_request request = {.tags = NULL};
    *out = request;
    if (!json_scan(&doc, body, len, problem))
        return false;
    bool good = schemas_check(loaded, "request.json", &doc, problem) &&
                decode_tags(&request.tags, json_object_get(doc.root, "tags"), problem) &&
                decode_problem(&request.problem, &doc, len, problem);
    if (good)
        decode_settings(&request.settings, json_object_get(doc.root, "solver"));
    json_doc_clear(&doc);
    if (good)
        *out = request;
    else
        codec_request_clear(&request);
    return good;
}

void codec_request_clear(codec_request *request)
{
    if (!request)
        return;
    uz_problem_clear(&request->problem);
    free(request->tags);
    request->tags = NULL;
}
