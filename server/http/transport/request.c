/* request.c: what a request's header fields and query say. */
#include "http/transport/message.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const char *skip_space(const char *at, const char *end)
{
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    return at;
}

static const char *trim_end(const char *from, const char *end)
{
    while (end > from && (end[-1] == ' ' || end[-1] == '\t'))
        end--;
    return end;
}

/* The end of the list member at `at`: a separator outside quotes. */
static const char *member_end(const char *at, const char *end, char separator)
{
    bool quoted = false;
    for (; at < end && (quoted || *at != separator); at++) {
        if (*at == '\\' && quoted && at + 1 < end)
            at++;
        else if (*at == '"')
            quoted = !quoted;
    }
    return at;
}

/* Whole seconds of one preference, -1 if it is not a valid "wait". */
static long preference_wait(const char *at, const char *end)
{
    end = trim_end(at, member_end(at, end, ';'));
    const char *equals = memchr(at, '=', (size_t)(end - at));
    if (!equals || !token_equal(at, (size_t)(trim_end(at, equals) - at), "wait"))
        return -1;
    const char *value = skip_space(equals + 1, end);
    if (end - value >= 2 && value[0] == '"' && end[-1] == '"') {
        value++;
        end--;
    }
    long seconds = 0;
    if (value == end || end - value > 9)
        return -1;
    for (; value < end; value++) {
        if (*value < '0' || *value > '9')
            return -1;
        seconds = seconds * 10 + (*value - '0');
    }
    return seconds;
}

static long field_wait(const header_field *field)
{
    const char *at = field->value, *end = at + field->value_len;
    while (at < end) {
        const char *next = member_end(at, end, ',');
        long seconds = preference_wait(skip_space(at, next), next);
        if (seconds >= 0)
            return seconds;
        at = next + (next < end);
    }
    return -1;
}

double request_wait(const http_request *rq, double otherwise, double max_wait_s)
{
    for (size_t i = 0; i < rq->headers.count; i++) {
        const header_field *field = &rq->headers.fields[i];
        if (!token_equal(field->name, field->name_len, "Prefer"))
            continue;
        long seconds = field_wait(field);
        if (seconds >= 0)
            return (double)seconds < max_wait_s ? (double)seconds : max_wait_s;
    }
    return otherwise < max_wait_s ? otherwise : max_wait_s;
}

/* True for ";q=0", ";q=0.000" among a media range's parameters. */
static bool quality_is_zero(const char *at, const char *end)
{
    for (at = member_end(at, end, ';'); at < end; at = member_end(at, end, ';')) {
        at = skip_space(at + 1, end);
        if (end - at >= 3 && (at[0] | 0x20) == 'q' && at[1] == '=')
            return strtod(at + 2, NULL) <= 0; /* ends at the first character that is no digit, at the latest at NUL */
    }
    return false;
}

static bool field_accepts(const header_field *field, const char *type)
{
    const char *at = field->value, *end = at + field->value_len;
    while (at < end) {
        const char *next = member_end(at, end, ',');
        const char *name = skip_space(at, next);
        const char *name_end = trim_end(name, member_end(name, next, ';'));
        if (token_equal(name, (size_t)(name_end - name), type) && !quality_is_zero(name, next))
            return true;
        at = next + (next < end);
    }
    return false;
}

bool request_accepts(const http_request *rq, const char *type)
{
    for (size_t i = 0; i < rq->headers.count; i++) {
        const header_field *field = &rq->headers.fields[i];
        if (token_equal(field->name, field->name_len, "Accept") && field_accepts(field, type))
            return true;
    }
    return false;
}

/* -1: the field does not name the coding, else whether it takes it. */
static int field_takes(const header_field *field, const char *coding)
{
    const char *at = field->value, *end = at + field->value_len;
    while (at < end) {
        const char *next = member_end(at, end, ',');
        const char *name = skip_space(at, next);
        const char *name_end = trim_end(name, member_end(name, next, ';'));
        if (token_equal(name, (size_t)(name_end - name), coding))
            return !quality_is_zero(name, next);
        at = next + (next < end);
    }
    return -1;
}

bool request_takes_gzip(const http_request *rq)
{
    static const char *const NAMES[] = {"gzip", "x-gzip", "*"}; /* the star is for those that are not named */
    for (size_t k = 0; k < sizeof NAMES / sizeof NAMES[0]; k++)
        for (size_t i = 0; i < rq->headers.count; i++) {
            const header_field *field = &rq->headers.fields[i];
            bool named = token_equal(field->name, field->name_len, "Accept-Encoding");
            int takes = named ? field_takes(field, NAMES[k]) : -1;
            if (takes >= 0)
                return takes;
        }
    return false;
}

bool request_is_json(const http_request *rq)
{
    size_t count;
    const header_field *field = header_find(&rq->headers, "Content-Type", &count);
    if (!field)
        return true;
    const char *end = field->value + field->value_len;
    end = trim_end(field->value, member_end(field->value, end, ';'));
    size_t len = (size_t)(end - field->value);
    bool structured = len > 5 && memchr(field->value, '/', len) && strncasecmp(end - 5, "+json", 5) == 0;
    return count == 1 && (structured || token_equal(field->value, len, "application/json"));
}

bool request_client_gone(const http_request *rq)
{
    struct pollfd p = {.fd = rq->fd, .events = POLLRDHUP};
    return poll(&p, 1, 0) > 0 && (p.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL));
}

void request_note_reply(http_request *rq)
{
    http_reply *reply = &rq->reply;
    rq->status = reply->status;
    rq->reply_len = strcmp(rq->method, "HEAD") == 0 ? 0 : reply->len;
    memcpy(reply->request_id, rq->id, sizeof reply->request_id);
}

static const char *keep_text(char **at, const char *text, size_t len)
{
    char *kept = memcpy(*at, text, len);
    kept[len] = '\0';
    *at += len + 1;
    return kept;
}

bool request_keep_fields(http_request *rq)
{
    header_field *fields = rq->headers.fields;
    size_t size = 1;
    for (size_t i = 0; i < rq->headers.count; i++)
        size += fields[i].name_len + fields[i].value_len + 2;
    char *at = rq->kept_fields = malloc(size);
    for (size_t i = 0; at && i < rq->headers.count; i++) {
        fields[i].name = keep_text(&at, fields[i].name, fields[i].name_len);
        fields[i].value = keep_text(&at, fields[i].value, fields[i].value_len);
    }
    return at != NULL;
}

bool request_integer(const http_request *rq, const char *key, int64_t least, int64_t most, int64_t *out,
                     problem_details *problem)
{
    const char *text = target_value(&rq->target, key);
    if (!text)
        return true;
    char *end;
    errno = 0;
    long long value = strtoll(text, &end, 10);
    bool digits = text[0] == '-' ? text[1] && !text[1 + strspn(text + 1, "0123456789")]
                                 : text[0] && !text[strspn(text, "0123456789")];
    if (!digits || errno || value < least || value > most)
        return http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                            "%s must be an integer from %lld to %lld", key, (long long)least, (long long)most);
    *out = value;
    return true;
}
