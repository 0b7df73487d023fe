/* decode_upload.c: texts of a request, in it or uploaded before. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <string.h>

const char *decode_upload_id(const json_t *value)
{
    return json_is_object(value) ? json_string_value(json_object_get(value, "upload")) : NULL;
}

static bool refuse(problem_details *problem, int status, const char *code, const char *where, const char *detail)
{
    char pointer[sizeof problem->pointer];
    snprintf(pointer, sizeof pointer, "%s%.160s/upload", where[0] == '/' ? "" : "/problem/", where);
    problem_set(problem, status, code, NULL, "%s %s", pointer, detail);
    snprintf(problem->pointer, sizeof problem->pointer, "%s", pointer);
    return false;
}

/* Notes that the request uses it, once. */
static bool note(json_doc *doc, const char *id, problem_details *problem)
{
    for (size_t i = 0; i < doc->n_uploads; i++)
        if (strcmp(doc->uploads[i], id) == 0)
            return true;
    char(*grown)[65] = room_grow(doc->uploads, doc->n_uploads + 1, sizeof *grown);
    if (!grown)
        return decode_no_memory(problem);
    doc->uploads = grown;
    snprintf(doc->uploads[doc->n_uploads++], sizeof *grown, "%s", id);
    return true;
}

bool decode_source_open(decode_source *out, json_doc *doc, const json_t *value, const char *where,
                        problem_details *problem)
{
    const char *id = decode_upload_id(value);
    *out = (decode_source){.data = NULL};
    if (!id) {
        out->data = decode_text(doc, value, &out->len);
        return true;
    }
    store_status status = doc->store ? store_upload_text(doc->store, id, &out->mapped) : STORE_NOT_FOUND;
    if (status == STORE_NOT_FOUND)
        return refuse(problem, 422, "unknown_upload", where,
                      "names no upload of this server: send the text to POST /v1/uploads first.");
    if (status == STORE_DAMAGED)
        return refuse(problem, 500, "stored_data_damaged", where,
                      "names an upload whose file is not what was sent, by its digest: send the text to POST "
                      "/v1/uploads again, which mends it.");
    if (status != STORE_OK)
        return refuse(problem, 500, "store_error", where, "names an upload that could not be read.");
    out->data = out->mapped.data;
    out->len = out->mapped.len;
    if (note(doc, id, problem))
        return true;
    store_upload_text_done(&out->mapped);
    return false;
}

void decode_source_close(decode_source *source, const json_doc *doc, const json_t *value)
{
    if (decode_upload_id(value))
        store_upload_text_done(&source->mapped);
    else
        decode_text_done(doc, value);
    *source = (decode_source){.data = NULL};
}
