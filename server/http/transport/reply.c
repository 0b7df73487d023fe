/* reply.c: what a handler answers, and the only functions that send it. */
#include "http/transport/message.h"
#include "codec/codec.h"

#include <microhttpd.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define MAX_FIELDS 24

static const char JSON_TYPE[] = "application/json";
static const char PROBLEM_TYPE[] = "application/problem+json";

typedef struct {
    const char *name, *value;
} field;

void reply_drop_body(http_reply *reply)
{
    if (!reply->body_is_static)
        free(reply->body);
    if (reply->has_file)
        close(reply->fd);
    reply->has_file = false;
    if (reply->source.read)
        reply->source.free(reply->source.ctx);
    reply->source.read = NULL;
    reply->body = NULL;
    reply->len = 0;
    reply->body_is_static = false;
}

void reply_clear(http_reply *reply)
{
    reply_drop_body(reply);
    memset(reply, 0, sizeof *reply);
}

void reply_no_memory(http_reply *reply)
{
    static char text[] = "{\"type\": \"about:blank\", \"title\": \"Out of memory\", \"status\": 503, "
                         "\"detail\": \"no memory for this reply: try again later\", \"code\": \"no_memory\"}";
    reply_drop_body(reply);
    reply->status = 503;
    reply->type = PROBLEM_TYPE;
    reply->body = text;
    reply->len = sizeof text - 1;
    reply->body_is_static = true;
    reply->retry_after_s = 5;
}

void reply_text(http_reply *reply, int status, const char *type, char *text, size_t len)
{
    reply_drop_body(reply);
    if (!text) {
        reply_no_memory(reply);
        return;
    }
    reply->status = status;
    reply->type = type;
    reply->body = text;
    reply->len = len;
}

void reply_file(http_reply *reply, int status, const char *type, int fd, size_t len)
{
    reply_drop_body(reply);
    reply->status = status;
    reply->type = type;
    reply->has_file = true;
    reply->fd = fd;
    reply->offset = 0;
    reply->len = len;
}

void reply_json(http_reply *reply, int status, char *text)
{
    reply_text(reply, status, JSON_TYPE, text, text ? strlen(text) : 0);
}

void reply_problem(http_reply *reply, const problem_details *problem)
{
    char *text = codec_encode_problem(problem);
    if (strcmp(problem->code, "store_unavailable") == 0 && reply->retry_after_s == 0)
        reply->retry_after_s = 5; /* also where a request could not be checked for it */
    reply_text(reply, problem->status, PROBLEM_TYPE, text, text ? strlen(text) : 0);
}

void reply_mistakes(http_reply *reply, char *text)
{
    reply_text(reply, 422, PROBLEM_TYPE, text, strlen(text));
}

void reply_refuse(http_reply *reply, int status, const char *code, const char *title, const char *format, ...)
{
    char detail[sizeof((problem_details *)0)->detail];
    problem_details problem;
    va_list args;
    va_start(args, format);
    vsnprintf(detail, sizeof detail, format, args);
    va_end(args);
    problem_fill(&problem, status, code, title, "%s", detail);
    reply_problem(reply, &problem);
}

/* Texts of header fields; they outlive the list of these. */
typedef struct {
    char number[16], tag[REPLY_TAG + 2], vary[64];
} field_texts;

/* What a page of another origin may do and see (WHATWG Fetch, CORS protocol). */
static size_t list_cors(field *out, const http_reply *reply)
{
    size_t n = 0;
    if (!reply->cors_origin)
        return 0;
    out[n++] = (field){"Access-Control-Allow-Origin", reply->cors_origin};
    if (!reply->preflight) {
        out[n++] =
            (field){"Access-Control-Expose-Headers", "Content-Range, ETag, Location, Preference-Applied, Retry-After, "
                                                     "WWW-Authenticate, X-Request-Id"};
        return n;
    }
    out[n++] = (field){"Access-Control-Allow-Methods", reply->allow};
    out[n++] =
        (field){"Access-Control-Allow-Headers",
                "Authorization, Content-Encoding, Content-Type, Idempotency-Key, If-Match, If-None-Match, If-Range, "
                "Last-Event-ID, Prefer, Range, X-Request-Id"};
    out[n++] = (field){"Access-Control-Max-Age", "600"};
    return n;
}

/* The header fields of a reply. */
static size_t list_fields(field out[MAX_FIELDS], const http_reply *reply, field_texts *texts)
{
    const char *const vary[] = {reply->varies_by_coding ? "Accept-Encoding" : NULL,
                                reply->varies_by_type ? "Accept" : NULL, reply->cors ? "Origin" : NULL};
    /* Replies load and run nothing; a picture that is looked at by itself has a style and an image within it. */
    const bool picture = reply->type && strcmp(reply->type, "image/svg+xml") == 0;
    const char *policy = reply->policy ? reply->policy
                         : picture
                             ? "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"
                             : "default-src 'none'; frame-ancestors 'none'";
    size_t n = 0;
    snprintf(texts->number, sizeof texts->number, "%d", reply->retry_after_s);
    snprintf(texts->tag, sizeof texts->tag, "\"%s\"", reply->tag);
    texts->vary[0] = '\0';
    for (size_t i = 0, used = 0; i < sizeof vary / sizeof vary[0]; i++)
        if (vary[i])
            used += (size_t)snprintf(texts->vary + used, sizeof texts->vary - used, "%s%s", used ? ", " : "", vary[i]);
    out[n++] = (field){"X-Content-Type-Options", "nosniff"};
    out[n++] = (field){"Content-Security-Policy", policy};
    out[n++] = (field){"Referrer-Policy", "no-referrer"};
    if (reply->secure) /* RFC 6797 */
        out[n++] = (field){"Strict-Transport-Security", "max-age=31536000"};
    out[n++] = (field){"Cache-Control", reply->immutable   ? "public, max-age=31536000, immutable"
                                        : reply->cacheable ? "no-cache"
                                        : reply->tag[0]    ? "private, no-cache"
                                                           : "no-store"};
    if (reply->tag[0])
        out[n++] = (field){"ETag", texts->tag};
    if (texts->vary[0])
        out[n++] = (field){"Vary", texts->vary};
    if (reply->takes_ranges)
        out[n++] = (field){"Accept-Ranges", "bytes"};
    if (reply->content_range[0])
        out[n++] = (field){"Content-Range", reply->content_range};
    if (reply->gzip)
        out[n++] = (field){"Content-Encoding", "gzip"};
    if (reply->body || reply->has_file || reply->source.read)
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
        out[n++] = (field){"Retry-After", texts->number};
    n += list_cors(out + n, reply);
    if (reply->close)
        out[n++] = (field){"Connection", "close"};
    return n;
}

static ssize_t read_source(void *ctx, uint64_t position, char *out, size_t size)
{
    const reply_source *source = ctx;
    ptrdiff_t n = source->read(source->ctx, out, size);
    (void)position;
    return n == REPLY_STREAM_ENDS     ? MHD_CONTENT_READER_END_OF_STREAM
           : n == REPLY_STREAM_BREAKS ? MHD_CONTENT_READER_END_WITH_ERROR
                                      : (ssize_t)n;
}

static void free_source(void *ctx)
{
    reply_source *source = ctx;
    source->free(source->ctx);
    free(source);
}

#define STREAM_PIECE 16384 /* bytes asked for at once */

bool reply_send(struct MHD_Connection *connection, http_reply *reply)
{
    field fields[MAX_FIELDS];
    field_texts texts = {.number = ""};
    size_t n = list_fields(fields, reply, &texts);
    struct MHD_Response *response = NULL; /* owns what the body was */
    if (reply->has_file) {
        response = MHD_create_response_from_fd_at_offset64(reply->len, reply->fd, reply->offset);
        reply->has_file = !response;
    } else if (reply->source.read) {
        reply_source *source = malloc(sizeof *source);
        if (source) {
            *source = reply->source;
            response =
                MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, STREAM_PIECE, read_source, source, free_source);
        }
        if (response)
            reply->source.read = NULL;
        else
            free(source);
    } else {
        const bool borrowed = reply->body_is_static || !reply->body;
        response = MHD_create_response_from_buffer(reply->len, reply->body,
                                                   borrowed ? MHD_RESPMEM_PERSISTENT : MHD_RESPMEM_MUST_FREE);
        if (response)
            reply->body = NULL;
    }
    bool sent = response != NULL;
    for (size_t i = 0; i < n && sent; i++)
        sent = MHD_add_response_header(response, fields[i].name, fields[i].value) == MHD_YES;
    sent = sent && MHD_queue_response(connection, (unsigned)reply->status, response) == MHD_YES;
    if (response)
        MHD_destroy_response(response);
    reply_clear(reply);
    return sent;
}

char *reply_message(const http_reply *reply, bool chunked, size_t *len)
{
    field fields[MAX_FIELDS];
    field_texts texts = {.number = ""};
    char *text = NULL;
    FILE *out = open_memstream(&text, len);
    if (!out)
        return NULL;
    size_t n = list_fields(fields, reply, &texts);
    fprintf(out, "HTTP/1.1 %d %s\r\n", reply->status, MHD_get_reason_phrase_for((unsigned)reply->status));
    /* What libmicrohttpd adds to the replies that it sends (RFC 9110, section 6.6.1). */
    static const char DAYS[] = "SunMonTueWedThuFriSat", MONTHS[] = "JanFebMarAprMayJunJulAugSepOctNovDec";
    struct tm t;
    time_t now = time(NULL);
    if (gmtime_r(&now, &t))
        fprintf(out, "Date: %.3s, %02d %.3s %04d %02d:%02d:%02d GMT\r\n", DAYS + 3 * t.tm_wday, t.tm_mday,
                MONTHS + 3 * t.tm_mon, t.tm_year + 1900, t.tm_hour, t.tm_min, t.tm_sec);
    for (size_t i = 0; i < n; i++)
        fprintf(out, "%s: %s\r\n", fields[i].name, fields[i].value);
    if (chunked)
        fputs("Transfer-Encoding: chunked\r\n\r\n", out);
    else if (reply->status == 204 || reply->status == 304) /* no body, nor its length (RFC 9110, section 8.6) */
        fputs("\r\n", out);
    else
        fprintf(out, "Content-Length: %zu\r\n\r\n", reply->len);
    if (!chunked && reply->len > 0)
        fwrite(reply->body, 1, reply->len, out);
    bool whole = !ferror(out);
    if (fclose(out) != 0 || !whole) {
        free(text);
        return NULL;
    }
    return text;
}
