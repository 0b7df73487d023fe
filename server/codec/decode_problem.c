#include "codec/codec.h"
#include "codec/json_doc.h"
#include "codec/problem.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

static void copy_member(char *out, size_t size, const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    snprintf(out, size, "%s", text ? text : "");
}

bool codec_decode_problem(problem_details *out, const char *json)
{
    memset(out, 0, sizeof *out);
    json_doc doc; /* jansson's own parser ends the process where it has no memory */
    problem_details why;
    if (!json_scan(&doc, json, strlen(json), &why))
        return false;
    const json_t *object = doc.root;
    if (!json_is_object(object)) {
        json_doc_clear(&doc);
        return false;
    }
    out->status = (int)json_number_value(json_object_get(object, "status")); /* each number of a scan is a real */
    out->line = (int64_t)json_number_value(json_object_get(object, "line"));
    copy_member(out->code, sizeof out->code, object, "code");
    copy_member(out->title, sizeof out->title, object, "title");
    copy_member(out->detail, sizeof out->detail, object, "detail");
    copy_member(out->pointer, sizeof out->pointer, object, "pointer");
    json_doc_clear(&doc);
    return true;
}
