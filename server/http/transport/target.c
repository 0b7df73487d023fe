#include "http/transport/transport.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Decodes in place; '+' is a space in a query only. */
static bool percent_decode(char *text, bool in_query)
{
    char *to = text;
    for (const char *from = text; *from; from++) {
        char c = *from;
        if (c == '%') {
            int high = hex_digit(from[1]), low = high < 0 ? -1 : hex_digit(from[2]);
            if (low < 0 || high * 16 + low == 0)
                return false;
            c = (char)(high * 16 + low);
            from += 2;
        } else if (c == '+' && in_query) {
            c = ' ';
        }
        *to++ = c;
    }
    *to = '\0';
    return true;
}

/* Where the path begins; NULL for a form that is not served. */
static char *skip_authority(char *text)
{
    if (strncasecmp(text, "http://", 7) == 0) {
        text += 7 + strcspn(text + 7, "/?");
        return text[0] == '/' ? text : NULL;
    }
    return text[0] == '/' ? text : NULL;
}

static bool has_strange_byte(const char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text <= 0x20 || (unsigned char)*text >= 0x7f)
            return true;
    return false;
}

static bool add_parameter(target *out, char *pair, problem_details *problem)
{
    char *value = strchr(pair, '=');
    if (value)
        *value++ = '\0';
    else
        value = pair + strlen(pair);
    if (!percent_decode(pair, true) || !percent_decode(value, true))
        return problem_fill(problem, 400, "bad_target", "The request target is malformed",
                            "the query has a '%%' that is not followed by two hexadecimal digits other than 00");
    if (target_value(out, pair) && strcmp(pair, TARGET_REPEATABLE) != 0)
        return problem_fill(problem, 400, "repeated_parameter", "A query parameter is given twice",
                            "\"%.100s\" occurs more than once in the query", pair);
    if (out->count == TARGET_MAX_PARAMETERS)
        return problem_fill(problem, 400, "bad_target", "The request target is malformed",
                            "the query has more than %d parameters", TARGET_MAX_PARAMETERS);
    out->parameters[out->count].key = pair;
    out->parameters[out->count++].value = value;
    return true;
}

static bool parse_query(target *out, char *query, problem_details *problem)
{
    while (query && *query) {
        char *next = strchr(query, '&');
        if (next)
            *next++ = '\0';
        if (*query && !add_parameter(out, query, problem))
            return false;
        query = next;
    }
    return true;
}

bool target_parse(target *out, const char *raw, problem_details *problem)
{
    memset(out, 0, sizeof *out);
    target t = {.text = strdup(raw)};
    if (!t.text)
        return problem_fill(problem, 500, "no_memory", "Out of memory", "no memory for the request target");
    char *path = skip_authority(t.text);
    char *query = path ? strchr(path, '?') : NULL;
    if (query)
        *query++ = '\0';
    bool ok = false;
    if (!path || has_strange_byte(raw) || strchr(raw, '#') || !percent_decode(path, false)) {
        problem_fill(problem, 400, "bad_target", "The request target is malformed",
                     "the target must be a path such as /v1/jobs, with '%%' followed by two hexadecimal digits "
                     "other than 00");
    } else {
        t.path = path;
        ok = parse_query(&t, query, problem);
    }
    if (!ok) {
        target_clear(&t);
        return false;
    }
    *out = t;
    return true;
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
