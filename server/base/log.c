/* log.c: lines of the log. */
#include "base/log.h"
#include "text/utf8.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void write_string(FILE *out, const char *text)
{
    fputc('"', out);
    for (size_t len = strlen(text), at = 0, n; at < len; at += n ? n : 1) {
        const char c = text[at];
        n = uz_utf8_length(text + at, len - at);
        if (n == 0)
            fputs("\\ufffd", out);
        else if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if ((unsigned char)c < 0x20 || c == 0x7f)
            fprintf(out, "\\u%04x", (unsigned)c);
        else
            fwrite(text + at, 1, n, out);
    }
    fputc('"', out);
}

void log_write(server_log *log, log_level level, const char *event, const log_field *fields)
{
    static const char *const NAMES[] = {"debug", "info", "warn", "error"};
    char *line = NULL, time[32];
    size_t len = 0;
    struct timespec now;
    struct tm utc;
    if (!log || level < log->least)
        return;
    FILE *out = open_memstream(&line, &len);
    if (!out)
        return;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(time, sizeof time, "%Y-%m-%dT%H:%M:%S", &utc);
    fprintf(out, "{\"time\": \"%s.%03ldZ\", \"level\": \"%s\", \"event\": ", time, now.tv_nsec / 1000000, NAMES[level]);
    write_string(out, event);
    for (; fields && fields->key; fields++) {
        fputs(", ", out);
        write_string(out, fields->key);
        fputs(": ", out);
        if (fields->kind == LOG_INTEGER)
            fprintf(out, "%lld", fields->integer);
        else if (fields->kind == LOG_NUMBER && isfinite(fields->number))
            fprintf(out, "%.12g", fields->number);
        else if (fields->kind == LOG_STRING && fields->string)
            write_string(out, fields->string);
        else
            fputs("null", out); /* JSON has no NaN or infinity */
    }
    fputs("}\n", out);
    if (fclose(out) == 0) {
        pthread_mutex_lock(&log->lock);
        fwrite(line, 1, len, log->stream);
        fflush(log->stream);
        pthread_mutex_unlock(&log->lock);
    }
    free(line);
}
