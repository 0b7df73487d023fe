/* negotiate.c: what becomes of a whole reply by what the client has and takes: 304, a range of bytes, gzip. */
#include "http/transport/message.h"

#include <gnutls/crypto.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <zlib.h>

/* Smaller bodies gain nothing: header fields and frames are of that size. */
#define GZIP_LEAST 1024
/* Level 1: numbers as decimal text shrink to near half at any level, and the time is the client's. */
#define GZIP_LEVEL 1
static const char GZIP_MARK[] = "-gz"; /* another representation has another strong tag (RFC 9110, section 8.8.3) */

void tag_make(char tag[REPLY_TAG], const char *const *parts, const size_t *lens, size_t count)
{
    gnutls_hash_hd_t hash;
    unsigned char digest[32];
    tag[0] = '\0';
    if (gnutls_hash_init(&hash, GNUTLS_DIG_SHA256) != 0)
        return;
    bool ok = true;
    for (size_t i = 0; i < count; i++)
        ok = gnutls_hash(hash, &lens[i], sizeof lens[i]) == 0 && gnutls_hash(hash, parts[i], lens[i]) == 0 && ok;
    gnutls_hash_deinit(hash, digest);
    for (int i = 0; ok && i < 16; i++)
        snprintf(tag + 2 * i, 3, "%02x", digest[i]);
}

/* ---- If-None-Match */

/* True if a member of an entity-tag list, `"x"`, or if not strong `W/"x"`, is this tag in any coding, or "*". */
static bool field_has_tag(const header_field *field, const char *tag, bool strong)
{
    const char *at = field->value, *end = at + field->value_len;
    const size_t want = strlen(tag), mark = sizeof GZIP_MARK - 1;
    while (at < end) {
        const char *comma = memchr(at, ',', (size_t)(end - at)); /* our tags have none */
        const char *from = at, *to = comma ? comma : end;
        while (from < to && (*from == ' ' || *from == '\t'))
            from++;
        while (to > from && (to[-1] == ' ' || to[-1] == '\t'))
            to--;
        if (to - from == 1 && *from == '*')
            return true;
        if (to - from >= 2 && !strong && strncmp(from, "W/", 2) == 0)
            from += 2;
        if (to - from >= 2 && *from == '"' && to[-1] == '"') {
            size_t len = (size_t)(to - from) - 2;
            if (len == want + mark && memcmp(from + 1 + want, GZIP_MARK, mark) == 0)
                len = want;
            if (len == want && memcmp(from + 1, tag, want) == 0)
                return true;
        }
        at = comma ? comma + 1 : end;
    }
    return false;
}

bool reply_unchanged(const http_request *rq, http_reply *reply)
{
    if (!reply->tag[0] || !(strcmp(rq->method, "GET") == 0 || strcmp(rq->method, "HEAD") == 0))
        return false;
    for (size_t i = 0; i < rq->headers.count; i++) {
        const header_field *field = &rq->headers.fields[i];
        if (token_equal(field->name, field->name_len, "If-None-Match") && field_has_tag(field, reply->tag, false)) {
            reply_drop_body(reply);
            reply->status = 304;
            return true;
        }
    }
    return false;
}

bool request_still_means(const http_request *rq, char *body, double changed, http_reply *reply)
{
    char tag[REPLY_TAG], date[40];
    struct tm t = {0};
    bool asked = false, good = false;
    const header_field *since = header_find(&rq->headers, "If-Unmodified-Since", NULL);
    if (!body) {
        reply_no_memory(reply);
        return false;
    }
    tag_make(tag, (const char *const[]){body}, (const size_t[]){strlen(body)}, 1);
    free(body);
    for (size_t i = 0; i < rq->headers.count; i++) {
        const header_field *field = &rq->headers.fields[i];
        if (!token_equal(field->name, field->name_len, "If-Match"))
            continue;
        asked = true;
        good = good || field_has_tag(field, tag, true);
    }
    if (!asked && since) { /* a date that is none counts for nothing (RFC 9110, section 13.1.4) */
        snprintf(date, sizeof date, "%.*s", (int)(since->value_len < sizeof date ? since->value_len : 0), since->value);
        const char *rest = strptime(date, "%a, %d %b %Y %H:%M:%S GMT", &t);
        asked = rest && !*rest;
        good = asked && floor(changed) <= (double)timegm(&t);
    }
    if (asked && !good)
        reply_refuse(reply, 412, "precondition_failed", "It is not what it was",
                     "it has changed since it was read: look at it again, then ask with its new ETag");
    return !asked || good;
}

/* ---- Range */

/* Digits of text[0..len), at most 18; -1: none. */
static int64_t read_offset(const char *text, size_t len)
{
    int64_t value = 0;
    if (len == 0 || len > 18 || strspn(text, "0123456789") < len)
        return -1;
    for (size_t i = 0; i < len; i++)
        value = 10 * value + (text[i] - '0');
    return value;
}

/* True if the reply is a part, or says that there is no such part: for "bytes=A-B", "bytes=A-" or "bytes=-N"; anything
 * else, several ranges too, is as if it were not there. */
static bool apply_range(const http_request *rq, http_reply *reply)
{
    static const char UNIT[] = "bytes=";
    size_t count;
    const header_field *field = header_find(&rq->headers, "Range", &count);
    const header_field *of = header_find(&rq->headers, "If-Range", NULL);
    const size_t len = strlen(reply->tag), skip = sizeof UNIT - 1;
    if (!field || count != 1 || strcmp(rq->method, "GET") != 0)
        return false;
    /* A range is of the representation that the client has the first part of, if it says which (If-Range: strong). */
    if (of && (of->value_len != len + 2 || of->value[0] != '"' || of->value[len + 1] != '"' ||
               memcmp(of->value + 1, reply->tag, len) != 0))
        return false;
    if (field->value_len <= skip || strncasecmp(field->value, UNIT, skip) != 0)
        return false;
    const char *at = field->value + skip, *end = field->value + field->value_len;
    const char *dash = memchr(at, '-', (size_t)(end - at));
    if (!dash)
        return false;
    const int64_t first = read_offset(at, (size_t)(dash - at)), last = read_offset(dash + 1, (size_t)(end - dash - 1));
    const bool open = dash + 1 == end, suffix = dash == at;
    if ((first < 0 && !suffix) || (last < 0 && !open) || (open && suffix) || (!open && !suffix && last < first))
        return false;
    const int64_t size = (int64_t)reply->len, from = !suffix ? first : last < size ? size - last : 0;
    const int64_t to = suffix || open || last >= size ? size - 1 : last;
    if (from >= size || (suffix && last == 0)) {
        reply_refuse(reply, 416, "range_not_satisfiable", "There is no such range", "the representation has %lld bytes",
                     (long long)size);
        snprintf(reply->content_range, sizeof reply->content_range, "bytes */%lld", (long long)size);
        reply->tag[0] = '\0';
        return true;
    }
    snprintf(reply->content_range, sizeof reply->content_range, "bytes %lld-%lld/%lld", (long long)from, (long long)to,
             (long long)size);
    reply->status = 206;
    reply->len = (size_t)(to - from + 1);
    if (reply->has_file)
        reply->offset = (size_t)from;
    else if (reply->body)
        memmove(reply->body, reply->body + from, reply->len);
    return true;
}

/* ---- gzip */

/* NULL: no memory. */
static char *squeeze(const char *body, size_t len, size_t *out_len)
{
    z_stream z = {.next_in = (unsigned char *)(uintptr_t)body};
    if (deflateInit2(&z, GZIP_LEVEL, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) /* 16: gzip, not zlib */
        return NULL;
    size_t room = deflateBound(&z, len);
    char *out = malloc(room);
    size_t left = len;
    int rc = out ? Z_OK : Z_MEM_ERROR;
    while (rc == Z_OK) { /* zlib counts what it is given in 32 bits */
        unsigned piece = left < (1u << 30) ? (unsigned)left : 1u << 30;
        size_t free_room = room - z.total_out;
        z.avail_in += piece;
        left -= piece;
        z.next_out = (unsigned char *)out + z.total_out;
        z.avail_out = free_room < UINT32_MAX ? (unsigned)free_room : UINT32_MAX;
        rc = deflate(&z, left ? Z_NO_FLUSH : Z_FINISH);
    }
    *out_len = z.total_out;
    deflateEnd(&z);
    if (rc == Z_STREAM_END)
        return out;
    free(out);
    return NULL;
}

void negotiate(const http_request *rq, http_reply *reply)
{
    if (reply->tag_by_body && reply->status == 200 && reply->body)
        tag_make(reply->tag, (const char *const[]){reply->body}, &reply->len, 1);
    if (reply->status != 200)
        reply->tag[0] = reply->status == 304 ? reply->tag[0] : '\0';
    reply->varies_by_coding = reply->tag[0] && !reply->has_file; /* also in a 304 (RFC 9110, section 15.4.5) */
    if (reply->status == 200 && reply_unchanged(rq, reply))
        return;
    if (reply->status == 200 && reply->takes_ranges && apply_range(rq, reply))
        return;
    /* gzip: text, and the arrays of a surface, whose numbers repeat their leading bytes */
    const char *type = reply->type ? reply->type : "";
    const bool shrinks = strstr(type, "json") || strstr(type, "svg") || strncmp(type, "text/", 5) == 0 ||
                         strncmp(type, "model/", 6) == 0;
    if (!reply->body || !shrinks || reply->len < GZIP_LEAST)
        return;
    reply->varies_by_coding = true;
    if (!request_takes_gzip(rq))
        return;
    size_t len = reply->packed_len;
    char *small = reply->packed ? (char *)(uintptr_t)reply->packed : squeeze(reply->body, reply->len, &len);
    if (!small)
        return; /* as it is, then */
    reply_drop_body(reply);
    reply->body = small;
    reply->len = len;
    reply->body_is_static = reply->packed != NULL;
    reply->gzip = true;
    if (reply->tag[0])
        strcat(reply->tag, GZIP_MARK); /* REPLY_TAG has room */
}
