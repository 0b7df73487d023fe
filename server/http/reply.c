#include "http/reply.h"
#include "codec/codec.h"
#include "http/problem.h"

#include <microhttpd.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_FIELDS 16

static const char JSON_TYPE[] = "application/json";
static const char PROBLEM_TYPE[] = "application/problem+json";

typedef struct {
    const char *name, *value;
} field;

static void clear_body(http_reply *reply)
{
    if (!reply->body_is_static)
        free(reply->body);
    reply->body = NULL;
    reply->len = 0;
    reply->body_is_static = false;
}

void reply_clear(http_reply *reply)
{
    clear_body(reply);
    memset(reply, 0, sizeof *reply);
}

void reply_no_memory(http_reply *reply)
{
    static char text[] = "{\"type\": \"about:blank\", \"title\": \"Out of memory\", \"status\": 503, "
                         "\"detail\": \"no memory for this reply: try again later\", \"code\": \"no_memory\"}";
    clear_body(reply);
    reply->status = 503;
    reply->type = PROBLEM_TYPE;
    reply->body = text;
    reply->len = sizeof text - 1;
    reply->body_is_static = true;
    reply->retry_after_s = 5;
}

void reply_text(http_reply *reply, int status, const char *type, char *text, size_t len)
{
    clear_body(reply);
    if (!text) {
        reply_no_memory(reply);
        return;
    }
    reply->status = status;
    reply->type = type;
    reply->body = text;
    reply->len = len;
}

void reply_json(http_reply *reply, int status, char *text)
{
    reply_text(reply, status, JSON_TYPE, text, text ? strlen(text) : 0);
}

void reply_problem(http_reply *reply, const problem_details *problem)
{
    char *text = codec_encode_problem(problem);
    reply_text(reply, problem->status, PROBLEM_TYPE, text, text ? strlen(text) : 0);
}

void reply_refuse(http_reply *reply, int status, const char *code, const char *title, const char *format, ...)
{
    char detail[sizeof((problem_details *)0)->detail];
    problem_details problem;
    va_list args;
    va_start(args, format);
    vsnprintf(detail, sizeof detail, format, args);
    va_end(args);
    http_problem(&problem, status, code, title, "%s", detail);
    reply_problem(reply, &problem);
}

/* The header fields of a reply; number needs 16 bytes that outlive the list. */
static size_t list_fields(field out[MAX_FIELDS], const http_reply *reply, char *number)
{
    size_t n = 0;
    snprintf(number, 16, "%d", reply->retry_after_s);
    out[n++] = (field){"X-Content-Type-Options", "nosniff"};
    out[n++] = (field){"Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'"};
    out[n++] = (field){"Cache-Control", reply->cacheable ? "no-cache" : "no-store"};
    if (reply->body)
        out[n++] = (field){"Content-Type", reply->type};
    if (reply->request_id[0])
        out[n++] = (field){"X-Request-Id", reply->request_id};
    if (reply->location[0])
        out[n++] = (field){"Location", reply->location};
    if (reply->preference_applied[0])
        out[n++] = (field){"Preference-Applied", reply->preference_applied};
    if (reply->authenticate[0])
        out[n++] = (field){"WWW-Authenticate", reply->authenticate};
    if (reply->allow[0])
        out[n++] = (field){"Allow", reply->allow};
    if (reply->retry_after_s > 0)
        out[n++] = (field){"Retry-After", number};
    if (reply->close)
        out[n++] = (field){"Connection", "close"};
    return n;
}

bool reply_send(struct MHD_Connection *connection, http_reply *reply)
{
    field fields[MAX_FIELDS];
    char number[16];
    bool sent = false;
    bool copy_is_needed = reply->body_is_static || !reply->body;
    struct MHD_Response *response = MHD_create_response_from_buffer(
        reply->len, reply->body, copy_is_needed ? MHD_RESPMEM_PERSISTENT : MHD_RESPMEM_MUST_FREE);
    if (!response)
        goto done;
    size_t n = list_fields(fields, reply, number);
    bool complete = true;
    for (size_t i = 0; i < n; i++)
        complete = complete && MHD_add_response_header(response, fields[i].name, fields[i].value) == MHD_YES;
    reply->body = NULL; /* the response owns it */
    sent = complete && MHD_queue_response(connection, (unsigned)reply->status, response) == MHD_YES;
    MHD_destroy_response(response);
done:
    reply_clear(reply);
    return sent;
}

char *reply_message(const http_reply *reply)
{
    field fields[MAX_FIELDS];
    char number[16], *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    size_t n = list_fields(fields, reply, number);
    fprintf(out, "HTTP/1.1 %d %s\r\n", reply->status, MHD_get_reason_phrase_for((unsigned)reply->status));
    for (size_t i = 0; i < n; i++)
        fprintf(out, "%s: %s\r\n", fields[i].name, fields[i].value);
    fprintf(out, "Content-Length: %zu\r\n\r\n%.*s", reply->len, (int)reply->len, reply->body ? reply->body : "");
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}
