/* uploads.c: /v1/uploads: texts that are sent once and used in many requests. A body goes to disk as it comes. */
#include "codec/codec.h"
#include "http/api.h"

#include <stdio.h>
#include <string.h>

static bool refuse(api *context, http_request *rq, upload_status status, problem_details *problem)
{
    char cause[256];
    switch (status) {
    case UPLOAD_OK:
        return true;
    case UPLOAD_TOO_LARGE:
        return problem_fill(problem, 413, "upload_too_large", "The upload is too large",
                            "an upload has at most %lld bytes here, counted after decompression",
                            (long long)context->options.max_upload);
    case UPLOAD_NO_ROOM:
        return problem_fill(problem, 507, "uploads_full", "There is no room for more uploads",
                            "uploads that no job uses make room after a while: delete some, or the jobs that use them");
    case UPLOAD_QUOTA:
        store_message(context->store, cause, sizeof cause);
        return problem_fill(problem, 429, "quota_exceeded", "The owner has as much as it may", "%s", cause);
    case UPLOAD_DISK_FULL:
        rq->reply.retry_after_s = 60;
        return problem_fill(problem, 507, "storage_full", "The disk is full",
                            "nothing was stored: delete uploads or ended jobs or free disk space, then try again");
    case UPLOAD_AWAY:
        rq->reply.retry_after_s = 5;
        return problem_fill(problem, 503, "store_unavailable", "The store does not answer",
                            "the database can't be reached now: send the upload again later");
    case UPLOAD_BAD_GZIP:
        return problem_fill(problem, 400, "bad_gzip", "The body is not what its Content-Encoding says",
                            "it is no gzip stream (RFC 1952), or it ends too early");
    case UPLOAD_FAILED:
        break;
    }
    return api_store_failed(context, problem);
}

bool uploads_begin(api *context, http_request *rq)
{
    upload_status status;
    const header_field *coding = header_find(&rq->headers, "Content-Encoding", NULL);
    bool gzip = coding && (token_equal(coding->value, coding->value_len, "gzip") ||
                           token_equal(coding->value, coding->value_len, "x-gzip"));
    rq->upload = store_upload_begin(context->store, rq->client, gzip, &status);
    return rq->upload || refuse(context, rq, status, &rq->refused);
}

bool uploads_take(void *ctx, http_request *rq, const char *data, size_t size)
{
    return refuse(ctx, rq, store_upload_write(rq->upload, data, size), &rq->refused);
}

void uploads_create(api *context, http_request *rq, http_reply *reply)
{
    upload_info info;
    problem_details problem;
    bool known = false;
    if (rq->body_len == 0) {
        store_upload_abort(rq->upload);
        rq->upload = NULL;
        reply_refuse(reply, 400, "empty_upload", "The body is empty", "send the text as the body of the request");
        return;
    }
    upload_status status = store_upload_end(rq->upload, &info, &known);
    rq->upload = NULL;
    if (!refuse(context, rq, status, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    metrics_add(context->metrics, METRIC_UPLOADS, 1);
    memcpy(rq->name, info.id, sizeof info.id);
    snprintf(reply->location, sizeof reply->location, "/v1/uploads/%s", info.id);
    reply_json(reply, known ? 200 : 201, codec_encode_upload(&info));
}

static void reply_failure(api *context, store_status status, http_reply *reply)
{
    char cause[256];
    if (status == STORE_NOT_FOUND)
        reply_refuse(reply, 404, "not_found", "Not found", "there is no upload with this id");
    else if (status == STORE_DAMAGED) {
        store_message(context->store, cause, sizeof cause);
        log_write(context->log, LOG_ERROR, "stored_data_damaged", (log_field[]){LOG_S("cause", cause), {0}});
        reply_refuse(reply, 500, "stored_data_damaged", "Stored data are damaged",
                     "the file of this upload is not what was sent, by its digest: send it again, which mends it");
    } else if (status == STORE_CONFLICT)
        reply_refuse(reply, 409, "upload_in_use", "A job uses the upload",
                     "it stays as long as the jobs that name it: delete them first");
    else
        reply_store_failure(context, status, reply);
}

void uploads_get(api *context, http_request *rq, http_reply *reply)
{
    upload_info info;
    int fd = -1;
    int64_t bytes = 0;
    const bool whole = request_accepts(rq, "application/octet-stream");
    store_status status = store_upload_get(context->store, rq->name, api_sees(rq), &info);
    if (status == STORE_OK && whole)
        status = store_upload_open(context->store, rq->name, &fd, &bytes);
    reply->varies_by_type = true;
    reply->tag_by_body = !whole;
    if (status != STORE_OK) {
        reply_failure(context, status, reply);
    } else if (whole) {
        reply_file(reply, 200, "application/octet-stream", fd, (size_t)bytes);
        snprintf(reply->tag, sizeof reply->tag, "%.32s", rq->name); /* half of a digest is name enough */
        reply->takes_ranges = true;
    } else {
        reply_json(reply, 200, codec_encode_upload(&info));
    }
}

void uploads_delete(api *context, http_request *rq, http_reply *reply)
{
    upload_info info;
    store_status status = store_upload_get(context->store, rq->name, api_sees(rq), &info);
    if (status == STORE_OK && !request_still_means(rq, codec_encode_upload(&info), info.used, reply))
        return;
    status = status != STORE_OK ? status : store_upload_delete(context->store, rq->name, api_sees(rq));
    if (status != STORE_OK)
        reply_failure(context, status, reply);
    else
        reply->status = 204;
}
