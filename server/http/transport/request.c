/* request.c: what a request's target, query and header fields say. */
#include "http/transport/message.h"
#include "http/transport/transport.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Leaves out white space on both sides. */
static void trim(const char **from, const char **to)
{
    while (*from < *to && (**from == ' ' || **from == '\t'))
        ++*from;
    while (*to > *from && ((*to)[-1] == ' ' || (*to)[-1] == '\t'))
        --*to;
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

/* A walk over the members of the lists (RFC 9110, section 5.6.1) in all header fields of one name. */
typedef struct {
    const header_list *headers;
    const char *field;
    size_t next;           /* field to look at */
    const char *rest, *to; /* of the present one */
    const char *at, *end;  /* the member */
} member_walk;

static bool next_member(member_walk *w)
{
    while (w->rest == w->to) {
        if (w->next == w->headers->count)
            return false;
        const header_field *field = &w->headers->fields[w->next++];
        if (!token_equal(field->name, field->name_len, w->field))
            continue;
        w->rest = field->value;
        w->to = field->value + field->value_len;
    }
    w->end = member_end(w->rest, w->to, ',');
    w->at = w->rest;
    w->rest = w->end + (w->end < w->to);
    trim(&w->at, &w->end);
    return true;
}

/* Is the member this token, with a quality above 0 (1), or with ";q=0", ";q=0.000" among its parameters (0)? -1: it is
 * another. */
static int quality_of(const member_walk *w, const char *token)
{
    const char *name = w->at, *at = member_end(w->at, w->end, ';'), *end = at;
    trim(&name, &end);
    if (!token_equal(name, (size_t)(end - name), token))
        return -1;
    while (at < w->end) {
        const char *next = w->end;
        at++;
        trim(&at, &next);
        if (w->end - at >= 3 && (at[0] | 0x20) == 'q' && at[1] == '=')
            return !(strtod(at + 2, NULL) <=
                     0); /* ends at the first character that is no digit, at the latest at NUL */
        at = member_end(at, w->end, ';');
    }
    return 1;
}

double request_wait(const http_request *rq, double otherwise, double max_wait_s)
{
    member_walk w = {.headers = &rq->headers, .field = "Prefer"};
    while (next_member(&w)) {
        /* whole seconds, with quotes or without */
        const char *end = member_end(w.at, w.end, ';');
        const char *equals = memchr(w.at, '=', (size_t)(end - w.at));
        const char *value = equals ? equals + 1 : end;
        if (!equals)
            continue;
        trim(&w.at, &equals);
        trim(&value, &end);
        if (!token_equal(w.at, (size_t)(equals - w.at), "wait"))
            continue;
        if (end - value >= 2 && value[0] == '"' && end[-1] == '"') {
            value++;
            end--;
        }
        long seconds = 0;
        bool good = value < end && end - value <= 9;
        for (; good && value < end; value++) {
            good = *value >= '0' && *value <= '9';
            seconds = seconds * 10 + (*value - '0');
        }
        if (good)
            return fmin((double)seconds, max_wait_s);
    }
    return fmin(otherwise, max_wait_s);
}

bool request_accepts(const http_request *rq, const char *type)
{
    member_walk w = {.headers = &rq->headers, .field = "Accept"};
    while (next_member(&w))
        if (quality_of(&w, type) > 0)
            return true;
    return false;
}

bool request_takes_gzip(const http_request *rq)
{
    static const char *const NAMES[] = {"gzip", "x-gzip", "*"}; /* the star is for those that are not named */
    int quality = -1;
    for (size_t k = 0; k < sizeof NAMES / sizeof NAMES[0] && quality < 0; k++) {
        member_walk w = {.headers = &rq->headers, .field = "Accept-Encoding"};
        while (quality < 0 && next_member(&w))
            quality = quality_of(&w, NAMES[k]);
    }
    return quality > 0;
}

body_type request_body_type(const http_request *rq)
{
    static const char APPLICATION[] = "application/";
    static const char *const FORMS[] = {"text/plain", "multipart/form-data", "application/x-www-form-urlencoded"};
    size_t count;
    const header_field *field = header_find(&rq->headers, "Content-Type", &count);
    if (count != 1)
        return BODY_OF_ANY_PAGE;
    const char *type = field->value, *end = member_end(type, type + field->value_len, ';');
    trim(&type, &end);
    const size_t len = (size_t)(end - type), prefix = sizeof APPLICATION - 1;
    const char *slash = memchr(type, '/', len);
    for (size_t i = 0; i < sizeof FORMS / sizeof FORMS[0]; i++)
        if (!slash || token_equal(type, len, FORMS[i]))
            return BODY_OF_ANY_PAGE;
    const bool structured =
        len > prefix + 5 && strncasecmp(type, APPLICATION, prefix) == 0 && strncasecmp(end - 5, "+json", 5) == 0;
    return structured || token_equal(type, len, "application/json") ? BODY_JSON : BODY_OTHER;
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

bool request_keep_fields(http_request *rq)
{
    size_t size = 1;
    for (size_t i = 0; i < rq->headers.count; i++)
        size += rq->headers.fields[i].name_len + rq->headers.fields[i].value_len + 2;
    char *at = rq->kept_fields = malloc(size);
    for (size_t i = 0; at && i < 2 * rq->headers.count; i++) {
        header_field *field = &rq->headers.fields[i / 2];
        const char **text = i % 2 == 0 ? &field->name : &field->value;
        const size_t len = i % 2 == 0 ? field->name_len : field->value_len;
        *text = memcpy(at, *text, len);
        at[len] = '\0';
        at += len + 1;
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
        return REFUSE_PARAMETER(problem, "%s must be an integer from %lld to %lld", key, (long long)least,
                                (long long)most);
    *out = value;
    return true;
}

/* ---- the target */

/* Decodes in place; '+' is a space in a query only. */
static bool percent_decode(char *text, bool in_query)
{
    static const char DIGITS[] = "0123456789abcdef0123456789ABCDEF";
    char *to = text;
    for (const char *from = text; *from; from++) {
        char c = *from;
        if (c == '%') {
            const char *high = from[1] ? strchr(DIGITS, from[1]) : NULL;
            const char *low = high && from[2] ? strchr(DIGITS, from[2]) : NULL;
            c = (char)(low ? (high - DIGITS) % 16 * 16 + (low - DIGITS) % 16 : 0);
            if (c == '\0')
                return false;
            from += 2;
        } else if (c == '+' && in_query) {
            c = ' ';
        }
        *to++ = c;
    }
    *to = '\0';
    return true;
}

bool target_parse(target *out, const char *raw, problem_details *problem)
{
    memset(out, 0, sizeof *out);
    target t = {.text = strdup(raw)};
    if (!t.text)
        return problem_fill(problem, 500, "no_memory", "Out of memory", "no memory for the request target");
    char *path = t.text;
    if (strncasecmp(path, "http://", 7) == 0) /* absolute form: the path begins behind the authority */
        path += 7 + strcspn(path + 7, "/?");
    char *query = path[0] == '/' ? strchr(path, '?') : NULL;
    if (query)
        *query++ = '\0';
    bool good = path[0] == '/' && !strchr(raw, '#');
    for (const char *c = raw; *c; c++)
        good = good && (unsigned char)*c > 0x20 && (unsigned char)*c < 0x7f;
    good = good && percent_decode(path, false);
    if (!good)
        problem_fill(problem, 400, "bad_target", "The request target is malformed",
                     "the target must be a path such as /v1/jobs, with '%%' followed by two hexadecimal digits "
                     "other than 00");
    t.path = path;
    for (char *pair = query, *next; good && pair && *pair; pair = next) {
        next = strchr(pair, '&');
        if (next)
            *next++ = '\0';
        if (!*pair)
            continue;
        char *value = strchr(pair, '=');
        if (value)
            *value++ = '\0';
        else
            value = pair + strlen(pair);
        good = percent_decode(pair, true) && percent_decode(value, true);
        if (!good)
            problem_fill(problem, 400, "bad_target", "The request target is malformed",
                         "the query has a '%%' that is not followed by two hexadecimal digits other than 00");
        else if (target_value(&t, pair) && strcmp(pair, TARGET_REPEATABLE) != 0)
            good = problem_fill(problem, 400, "repeated_parameter", "A query parameter is given twice",
                                "\"%.100s\" occurs more than once in the query", pair);
        else if (t.count == TARGET_MAX_PARAMETERS)
            good = problem_fill(problem, 400, "bad_target", "The request target is malformed",
                                "the query has more than %d parameters", TARGET_MAX_PARAMETERS);
        if (good) {
            t.parameters[t.count].key = pair;
            t.parameters[t.count++].value = value;
        }
    }
    if (good)
        *out = t;
    else
        target_clear(&t);
    return good;
}

void target_clear(target *t)
{
    free(t->text);
    memset(t, 0, sizeof *t);
}

const char *target_value(const target *t, const char *key)
{
    for (size_t i = 0; i < t->count; i++)
        if (strcmp(t->parameters[i].key, key) == 0)
            return t->parameters[i].value;
    return NULL;
}

bool token_equal(const char *text, size_t len, const char *token)
{
    return len == strlen(token) && strncasecmp(text, token, len) == 0;
}
