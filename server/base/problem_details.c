#include "base/problem_details.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* A detail may quote bytes that a client sent: what is no printable ASCII becomes '?', so the text is always UTF-8. */
static void keep_ascii(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || (unsigned char)*text > 0x7e)
            *text = '?';
}

_Bool http_problem(problem_details *out, int status, const char *code, const char *title, const char *format, ...)
{
    va_list args;
    memset(out, 0, sizeof *out);
    out->status = status;
    snprintf(out->code, sizeof out->code, "%s", code);
    snprintf(out->title, sizeof out->title, "%s", title);
    va_start(args, format);
    vsnprintf(out->detail, sizeof out->detail, format, args);
    va_end(args);
    keep_ascii(out->detail);
    return 0;
}
