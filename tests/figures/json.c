/* json.c: what the measurements are written with. */
#include "figures/figures.h"

#include <math.h>

static void begin(json *out, const char *key)
{
    fputs(out->first ? "\n" : ",\n", out->file);
    out->first = false;
    if (key)
        fprintf(out->file, "\"%s\": ", key);
}

void json_open(json *out, const char *key, char bracket)
{
    begin(out, key);
    fputc(bracket, out->file);
    out->first = true;
}

void json_close(json *out, char bracket)
{
    fputc(bracket, out->file);
    out->first = false;
}

void json_number(json *out, const char *key, double value)
{
    begin(out, key);
    if (isfinite(value))
        fprintf(out->file, "%.9g", value);
    else
        fputs("null", out->file);
}

void json_integer(json *out, const char *key, int64_t value)
{
    begin(out, key);
    fprintf(out->file, "%lld", (long long)value);
}

void json_text(json *out, const char *key, const char *value)
{
    begin(out, key);
    fputc('"', out->file);
    for (; *value; value++)
        if (*value == '"' || *value == '\\')
            fprintf(out->file, "\\%c", *value);
        else
            fputc((unsigned char)*value < ' ' ? ' ' : *value, out->file);
    fputc('"', out->file);
}
