/* target.c: the request target. */
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
    while (good && query && *query) {
        char *next = strchr(query, '&');
        if (next)
            *next++ = '\0';
        good = !*query || add_parameter(&t, query, problem);
        query = next;
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
