/* framing.c: header fields and the length of the body. */
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

static bool check_fields(const char *version, const header_list *headers, problem_details *problem)
{
    size_t hosts, tokens;
    if (headers->overflow)
        return problem_fill(problem, 431, "too_many_headers", "Too many header fields", "at most %d header fields",
                            HEADERS_MAX);
    for (size_t i = 0; i < headers->count; i++) {
        const header_field *field = &headers->fields[i];
        bool token = field->name_len > 0, text = true;
        for (size_t k = 0; k < field->name_len; k++) { /* tchar of RFC 9110, section 5.6.2 */
            const char c = field->name[k];
            const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
            token = token && (letter || (c != '\0' && strchr("!#$%&'*+-.^_`|~", c)));
        }
        for (size_t k = 0; k < field->value_len; k++) { /* no control characters but the tab */
            const unsigned char c = (unsigned char)field->value[k];
            text = text && !((c < 0x20 && c != '\t') || c == 0x7f);
        }
        if (!token)
            return refuse(problem, "a header field's name has a character that is not allowed, or a space before ':'");
        if (!text)
            return refuse(problem, "a header field's value has a control character");
    }
    header_find(headers, "Authorization", &tokens);
    if (tokens > 1) /* a proxy may have looked at the other one */
        return refuse(problem, "Authorization may occur once");
    const header_field *host = header_find(headers, "Host", &hosts);
    if (hosts > 1 || (strcmp(version, "HTTP/1.1") == 0 && hosts == 0))
        return refuse(problem, "exactly one Host header field is needed");
    size_t len = host ? host->value_len : 0;
    while (len > 0 && (host->value[len - 1] == ' ' || host->value[len - 1] == '\t'))
        len--;
    for (size_t k = 0; k < len; k++) /* the characters of uri-host [":" port] (RFC 3986, section 3.2.2) */
        if (strchr("\"#/<>?@\\^`{|} \t", host->value[k]) || (unsigned char)host->value[k] >= 0x7f)
            return refuse(problem, "the Host header field is no host name or address, with a port or without");
    return true;
}

bool framing_read(framing *out, const char *version, header_list *headers, problem_details *problem)
{
    size_t lengths, codings, expectations;
    memset(out, 0, sizeof *out);
    if (strcmp(version, "HTTP/1.1") != 0 && strcmp(version, "HTTP/1.0") != 0)
        return problem_fill(problem, 505, "http_version", "The HTTP version is not supported",
                            "use HTTP/1.1 or HTTP/1.0");
    if (!check_fields(version, headers, problem))
        return false;
    const header_field *length = header_find(headers, "Content-Length", &lengths);
    const header_field *coding = header_find(headers, "Transfer-Encoding", &codings);
    if (lengths > 1 || codings > 1)
        return refuse(problem, "Content-Length and Transfer-Encoding may occur once");
    if (length && coding)
        return refuse(problem, "Content-Length and Transfer-Encoding exclude each other");
    size_t len = length ? length->value_len : 0;
    while (len > 0 && (length->value[len - 1] == ' ' || length->value[len - 1] == '\t'))
        len--;
    if (length && (len == 0 || len > 18))
        return refuse(problem, "Content-Length must be a number of 1 to 18 digits");
    for (size_t i = 0; i < len; i++) {
        if (length->value[i] < '0' || length->value[i] > '9')
            return refuse(problem, "Content-Length must be digits only");
        out->length = out->length * 10 + (uint64_t)(length->value[i] - '0');
    }
    if (coding && strcmp(version, "HTTP/1.1") != 0)
        return refuse(problem, "Transfer-Encoding needs HTTP/1.1");
    if (coding && !token_equal(coding->value, coding->value_len, "chunked"))
        return refuse(problem, "the only transfer coding is \"chunked\"");
    out->chunked = coding != NULL;

    /* White space behind a value is none of it (RFC 9110, section 5.5); libmicrohttpd leaves it there. Not before the
     * fields that say how long the body is have been read: libmicrohttpd takes those with it for something else. */
    for (size_t i = 0; i < headers->count; i++) {
        header_field *field = &headers->fields[i];
        while (field->value_len > 0 && strchr(" \t", field->value[field->value_len - 1]))
            field->value_len--;
    }
    const header_field *expect = header_find(headers, "Expect", &expectations);
    if (expectations > 1 || (expect && !token_equal(expect->value, expect->value_len, "100-continue")))
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

bool chunks_follow(chunk_follower *f, const char *data, size_t size)
{
    static const char DIGITS[] = "0123456789abcdef0123456789ABCDEF";
    for (size_t i = 0; i < size; i++) {
        const char c = data[i];
        const char *digit = c ? strchr(DIGITS, c) : NULL;
        const bool text = (unsigned char)c >= 0x20 ? c != 0x7f : c == '\t';
        switch (f->state) {
        case CHUNKS_SIZE:
            if (digit && f->digits++ < 15)
                f->left = f->left * 16 + (uint64_t)((digit - DIGITS) % 16);
            else if (digit || f->digits == 0 || !(c == ';' || c == '\r'))
                return false;
            else
                f->state = c == ';' ? CHUNKS_EXTENSION : CHUNKS_SIZE_LF;
            break;
        case CHUNKS_EXTENSION:
        case CHUNKS_FIELD:
            if (c == '\r')
                f->state = f->state == CHUNKS_FIELD ? CHUNKS_FIELD_LF : CHUNKS_SIZE_LF;
            else if (!text)
                return false;
            break;
        case CHUNKS_DATA: {
            const size_t n = f->left < size - i ? (size_t)f->left : size - i;
            i += n - 1;
            f->left -= n;
            f->state = f->left > 0 ? CHUNKS_DATA : CHUNKS_DATA_CR;
            break;
        }
        case CHUNKS_DATA_CR:
            if (c != '\r')
                return false;
            f->state = CHUNKS_DATA_LF;
            break;
        case CHUNKS_TRAILER: /* a line that begins with white space would go on with the one before */
            if (c != '\r' && (!text || c == ' ' || c == '\t'))
                return false;
            f->state = c == '\r' ? CHUNKS_LAST_LF : CHUNKS_FIELD;
            break;
        case CHUNKS_SIZE_LF:
        case CHUNKS_DATA_LF:
        case CHUNKS_FIELD_LF:
        case CHUNKS_LAST_LF:
            if (c != '\n')
                return false;
            f->digits = 0;
            f->state = f->state == CHUNKS_SIZE_LF    ? f->left > 0 ? CHUNKS_DATA : CHUNKS_TRAILER
                       : f->state == CHUNKS_DATA_LF  ? CHUNKS_SIZE
                       : f->state == CHUNKS_FIELD_LF ? CHUNKS_TRAILER
                                                     : CHUNKS_DONE;
            break;
        case CHUNKS_DONE:
            f->beyond += size - i;
            return true;
        }
    }
    return true;
}
