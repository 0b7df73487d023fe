/* path: displacement and stress along a line through the body, as a table for people, as CSV or as JSON. */
#include "commands/fetch.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

#define CELL 11 /* columns: "-1.2345e-06", or a longer heading and its space */

/* The service's CSV, which has names and numbers alone, with its columns below each other; a number with the five
 * digits that a person compares, and nothing where the point is not in the body. */
static void print_columns(FILE *to, const char *csv)
{
    size_t width[32];
    const size_t most = sizeof width / sizeof *width;
    for (bool heading = true; *csv; heading = false) {
        const size_t line = strcspn(csv, "\n");
        size_t column = 0;
        for (const char *at = csv, *end = csv + line; at <= end && column < most; column++) {
            const size_t len = strcspn(at, ",\n");
            char text[32];
            snprintf(text, sizeof text, "%.*s", (int)len, at);
            if (heading)
                width[column] = len > CELL ? len : CELL;
            else if (strcmp(text, "nan") == 0)
                snprintf(text, sizeof text, "-");
            else
                snprintf(text, sizeof text, "%.5g", strtod(text, NULL));
            fprintf(to, "%s%*s", column ? "  " : "", (int)width[column], text);
            at += len + 1;
        }
        fputc('\n', to);
        csv += line + (csv[line] == '\n');
    }
}

static client_exit deliver_table(client_session *s, const char *csv)
{
    char *text = NULL;
    size_t len = 0;
    FILE *to = open_memstream(&text, &len);
    if (to)
        print_columns(to, csv);
    const bool whole = to && !ferror(to);
    client_exit code;
    if (to && fclose(to) == 0 && whole)
        code = client_deliver(s, text, len);
    else
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    free(text);
    return code;
}

client_exit client_path(client_session *s)
{
    const client_options *o = s->options;
    const char *format = o->json ? "json" : o->format ? o->format : "table";
    char count[24];
    client_reply reply;
    snprintf(count, sizeof count, "%d", o->count);
    const client_query query[] = {
        {"from", o->from}, {"to", o->to}, {"count", o->count < 0 ? NULL : count}, {"case", o->case_name}, {NULL, NULL}};
    char *path = client_path_with_query(s, o->operand, strcmp(format, "json") == 0 ? "/path" : "/path.csv", query);
    if (!path)
        return CLIENT_LOCAL;
    const client_request request = client_request_new(s, "GET", path);
    client_exit code = client_ask(s, &reply, &request);
    if (code == CLIENT_OK && strcmp(format, "table") == 0)
        code = deliver_table(s, reply.body.data ? reply.body.data : "");
    else if (code == CLIENT_OK)
        code = client_deliver(s, reply.body.data, reply.body.len);
    client_reply_clear(&reply);
    free(path);
    return code;
}
