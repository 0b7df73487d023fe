#include "http/transport/framing.h"

#include <string.h>

static bool refuse(problem_details *problem, const char *detail)
{
    return problem_fill(problem, 400, "bad_request_framing", "The request is malformed or ambiguous", "%s", detail);
}

const header_field *header_find(const header_list *headers, const char *name, size_t *count)
{
    const header_field *first = NULL;
    size_t n = 0;
    for (size_t i = 0; i < headers->count; i++) {
        const header_field *field = &headers->fields[i];
        if (!token_equal(field->name, field->name_len, name))
            continue;
        n++;
        if (!first)
            first = field;
    }
    if (count)
        *count = n;
    return first;
}

/* RFC 9110, section 5.6.2: tchar. */
static bool is_token(const char *text, size_t len)
{
    for (size_t i = 0; i < len; i++) {
        char c = text[i];
        bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        if (!letter && (c == '\0' || !strchr("!#$%&'*+-.^_`|~", c)))
            return false;
    }
    return len > 0;
}

/* A field value has no control characters but the tab. */
static bool is_value(const char *text, size_t len)
{
    for (size_t i = 0; i < len; i++) {
        unsigned char c = (unsigned char)text[i];
        if ((c < 0x20 && c != '\t') || c == 0x7f)
            return false;
    }
    return true;
}

static bool check_fields(const header_list *headers, problem_details *problem)
{
    if (headers->overflow)
        return problem_fill(problem, 431, "too_many_headers", "Too many header fields", "at most %d header fields",
                            HEADERS_MAX);
    for (size_t i = 0; i < headers->count; i++) {
        const header_field *field = &headers->fields[i];
        if (!is_token(field->name, field->name_len))
            return refuse(problem, "a header field's name has a character that is not allowed, or a space before ':'");
        if (!is_value(field->value, field->value_len))
            return refuse(problem, "a header field's value has a control character");
    }
    return true;
}

/* The characters of uri-host [":" port] (RFC 3986, section 3.2.2). */
static bool is_host(const char *text, size_t len)
{
    while (len > 0 && (text[len - 1] == ' ' || text[len - 1] == '\t'))
        len--;
    for (size_t i = 0; i < len; i++)
        if (strchr("\"#/<>?@\\^`{|} \t", text[i]) || (unsigned char)text[i] >= 0x7f)
            return false;
    return true;
}

static bool check_host(const char *version, const header_list *headers, problem_details *problem)
{
    size_t count;
    const header_field *host = header_find(headers, "Host", &count);
    bool required = strcmp(version, "HTTP/1.1") == 0;
    if (count > 1 || (required && count == 0))
        return refuse(problem, "exactly one Host header field is needed");
    if (host && !is_host(host->value, host->value_len))
        return refuse(problem, "the Host header field is no host name or address, with a port or without");
    return true;
}

static bool read_length(framing *out, const header_field *field, problem_details *problem)
{
    size_t len = field->value_len;
    while (len > 0 && (field->value[len - 1] == ' ' || field->value[len - 1] == '\t'))
        len--;
    if (len == 0 || len > 18)
        return refuse(problem, "Content-Length must be a number of 1 to 18 digits");
    for (size_t i = 0; i < len; i++) {
        if (field->value[i] < '0' || field->value[i] > '9')
            return refuse(problem, "Content-Length must be digits only");
        out->length = out->length * 10 + (uint64_t)(field->value[i] - '0');
    }
    return true;
}

static bool read_coding(framing *out, const header_field *field, const char *version, problem_details *problem)
{
    if (strcmp(version, "HTTP/1.1") != 0)
        return refuse(problem, "Transfer-Encoding needs HTTP/1.1");
    if (!token_equal(field->value, field->value_len, "chunked"))
        return refuse(problem, "the only transfer coding is \"chunked\"");
    out->chunked = true;
    return true;
}

/* White space behind a value is none of it (RFC 9110, section 5.5); libmicrohttpd leaves it there. Not before the
 * fields that say how long the body is have been read: libmicrohttpd takes those with it for something else. */
static void trim_values(header_list *headers)
{
    for (size_t i = 0; i < headers->count; i++) {
        header_field *field = &headers->fields[i];
        while (field->value_len > 0 && strchr(" \t", field->value[field->value_len - 1]))
            field->value_len--;
    }
}

bool framing_read(framing *out, const char *version, header_list *headers, problem_details *problem)
{
    size_t lengths, codings;
    memset(out, 0, sizeof *out);
    if (strcmp(version, "HTTP/1.1") != 0 && strcmp(version, "HTTP/1.0") != 0)
        return problem_fill(problem, 505, "http_version", "The HTTP version is not supported",
                            "use HTTP/1.1 or HTTP/1.0");
    if (!check_fields(headers, problem) || !check_host(version, headers, problem))
        return false;
    const header_field *length = header_find(headers, "Content-Length", &lengths);
    const header_field *coding = header_find(headers, "Transfer-Encoding", &codings);
    if (lengths > 1 || codings > 1)
        return refuse(problem, "Content-Length and Transfer-Encoding may occur once");
    if (length && coding)
        return refuse(problem, "Content-Length and Transfer-Encoding exclude each other");
    if ((length && !read_length(out, length, problem)) || (coding && !read_coding(out, coding, version, problem)))
        return false;
    trim_values(headers);
    size_t count;
    const header_field *field = header_find(headers, "Expect", &count);
    if (count > 1 || (field && !token_equal(field->value, field->value_len, "100-continue")))
        return problem_fill(problem, 417, "expectation_failed", "The expectation is not met",
                            "the only expectation is \"100-continue\"");
    return true;
}

/* The end of the line that ends at `at`: CR LF became two NULs. */
static const char *line_end(const char *at)
{
    return at && at[0] == '\0' && at[1] == '\0' ? at + 2 : NULL;
}

bool framing_tiles(const framing_layout *layout, const header_list *headers)
{
    const char *end = layout->method + layout->block_len;
    if (!layout->target || layout->target != layout->method + strlen(layout->method) + 1 ||
        layout->version != layout->target + layout->target_len + 1)
        return false;
    const char *next = line_end(layout->version + strlen(layout->version));
    for (size_t i = 0; next && i < headers->count; i++) {
        const header_field *field = &headers->fields[i];
        const char *space = next + field->name_len + 1;
        if (field->name != next || field->value < space || field->value + field->value_len + 2 > end)
            return false;
        for (; space < field->value; space++)
            if (*space != ' ' && *space != '\t')
                return false;
        next = line_end(field->value + field->value_len + strspn(field->value + field->value_len, " \t"));
    }
    return next && next + 2 == end;
}
