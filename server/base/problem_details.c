#include "base/problem_details.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

_Bool problem_fill(problem_details *out, int status, const char *code, const char *title, const char *format, ...)
{
    va_list args;
    memset(out, 0, sizeof *out);
    out->status = status;
    snprintf(out->code, sizeof out->code, "%s", code);
    snprintf(out->title, sizeof out->title, "%s", title);
    va_start(args, format);
    vsnprintf(out->detail, sizeof out->detail, format, args);
    va_end(args);
    /* A detail may quote bytes that a client sent: so the text is always UTF-8. */
    for (char *at = out->detail; *at; at++)
        if ((unsigned char)*at < 0x20 || (unsigned char)*at > 0x7e)
            *at = '?';
    return 0;
}
