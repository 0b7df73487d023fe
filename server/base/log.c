/* log.c: lines of the log. */
#include "base/log.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct server_log {
    pthread_mutex_t lock; /* stream */
    FILE *stream;
    log_level least;
};

server_log *log_open(FILE *stream, log_level least)
{
    server_log *log = calloc(1, sizeof *log);
    if (!log)
        return NULL;
    pthread_mutex_init(&log->lock, NULL);
    log->stream = stream;
    log->least = least;
    return log;
}

void log_close(server_log *log)
{
    if (!log)
        return;
    pthread_mutex_destroy(&log->lock);
    free(log);
}

/* The bytes of the UTF-8 sequence at s, 0 if there is none: no overlong forms, surrogates or values above U+10FFFF. */
static size_t utf8_length(const unsigned char *s)
{
    size_t n = s[0] < 0x80                    ? 1
               : s[0] >= 0xc2 && s[0] <= 0xdf ? 2
               : (s[0] & 0xf0) == 0xe0        ? 3
               : s[0] >= 0xf0 && s[0] <= 0xf4 ? 4
                                              : 0;
    for (size_t i = 1; i < n; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xf0 && s[1] < 0x90);
    bool too_large = (s[0] == 0xed && s[1] > 0x9f) || (s[0] == 0xf4 && s[1] > 0x8f);
    return n > 1 && (overlong || too_large) ? 0 : n;
}

static void write_string(FILE *out, const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    fputc('"', out);
    while (*s) {
        size_t n = utf8_length(s);
        if (n == 0)
            fputs("\\ufffd", out);
        else if (*s == '"' || *s == '\\')
            fprintf(out, "\\%c", *s);
        else if (*s < 0x20 || *s == 0x7f)
            fprintf(out, "\\u%04x", *s);
        else
            fwrite(s, 1, n, out);
        s += n ? n : 1;
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
