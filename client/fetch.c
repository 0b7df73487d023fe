/* status, list, cancel, result, picture, history: one question, one answer. */
#include "plot.h"
#include "report.h"
#include "session.h"

#include <langinfo.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PAGE_JOBS  100L
#define PLOT_WIDTH 72

client_exit client_status(client_session *s)
{
    json_t *job = NULL;
    char *path = client_job_path(s, s->options->operand, "");
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "GET", path);
    client_exit code = client_ask_json(s, &job, &request);
    if (job && s->options->json)
        code = client_print_json(s, job);
    else if (job)
        client_print_summary(s->out, job);
    if (job && !s->options->json && client_job_ended(job) && code == CLIENT_OK)
        code = client_show_cases(s, job);
    if (job && !s->options->json && json_is_object(json_object_get(job, "error")))
        client_print_problem(s->out, 0, json_object_get(job, "error"));
    json_decref(job);
    free(path);
    return code;
}

/* A DELETE that arrived must not be sent again: the first dismisses a job, the second would delete it. */
client_exit client_cancel(client_session *s)
{
    client_reply reply;
    char *path = client_job_path(s, s->options->operand, "");
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "DELETE", path);
    request.repeatable = false;
    client_exit code = client_ask(s, &reply, &request);
    if (code == CLIENT_OK && s->options->json && reply.body.len)
        fprintf(s->out, "%s\n", reply.body.data);
    else if (code == CLIENT_OK && !s->options->quiet && !s->options->json)
        fprintf(s->out, "%s\n", reply.status == 204 ? "deleted" : "dismissed");
    client_reply_clear(&reply);
    free(path);
    return code;
}

/* ------------------------------------------------------------------- list */

static bool append_query(client_buffer *path, const char *name, const char *value)
{
    return !value || (client_buffer_append(path, "&", 1) && client_buffer_append(path, name, strlen(name)) &&
                      client_buffer_append(path, "=", 1) && client_http_append_escaped(path, value));
}

static client_exit list_page(client_session *s, json_t **page, long limit, const char *cursor)
{
    char start[64];
    client_buffer path = {0};
    const client_options *o = s->options;
    client_exit code = CLIENT_LOCAL;
    snprintf(start, sizeof start, "/v1/jobs?limit=%ld", limit);
    *page = NULL;
    if (client_buffer_append(&path, start, strlen(start)) && append_query(&path, "status", o->status) &&
        append_query(&path, "tag", o->n_tags ? o->tags[0] : NULL) && append_query(&path, "cursor", cursor)) {
        client_request request = client_request_new(s, "GET", path.data);
        code = client_ask_json(s, page, &request);
    } else
        client_complain(s, code, "no memory");
    free(path.data);
    return code;
}

/* Up to `limit` jobs in as many pages as that takes. *jobs: array, released by the caller. */
static client_exit list_all(client_session *s, json_t *jobs, long limit)
{
    char cursor[256] = "";
    client_exit code = CLIENT_OK;
    while (code == CLIENT_OK && (long)json_array_size(jobs) < limit) {
        json_t *page;
        long left = limit - (long)json_array_size(jobs);
        code = list_page(s, &page, left < PAGE_JOBS ? left : PAGE_JOBS, *cursor ? cursor : NULL);
        json_t *more = json_object_get(page, "jobs");
        if (code == CLIENT_OK && (!json_is_array(more) || json_array_extend(jobs, more) != 0))
            code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no list of jobs");
        snprintf(cursor, sizeof cursor, "%s", client_json_text(page, "next"));
        bool last = !*cursor || json_array_size(more) == 0;
        json_decref(page);
        if (last)
            break;
    }
    return code;
}

static void print_cell(FILE *to, const char *text, int width)
{
    client_print_safe(to, text);
    for (int i = (int)strlen(text); i < width; i++)
        fputc(' ', to);
    fputs("  ", to);
}

static void print_row(FILE *to, const json_t *job)
{
    const json_t *tags = json_object_get(job, "tags");
    print_cell(to, client_json_text(job, "id"), 32);
    print_cell(to, client_json_text(job, "status"), 10);
    print_cell(to, client_json_text(job, "summary.outcome"), 15);
    print_cell(to, client_json_text(job, "created"), 24);
    for (size_t i = 0; i < json_array_size(tags); i++) {
        const json_t *tag = json_array_get(tags, i);
        fputs(i ? "," : "", to);
        client_print_safe(to, json_is_string(tag) ? json_string_value(tag) : "?");
    }
    fputc('\n', to);
}

client_exit client_list(client_session *s)
{
    json_t *jobs = json_array();
    if (!jobs)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    client_exit code = list_all(s, jobs, s->options->limit);
    if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, jobs);
    else if (code == CLIENT_OK) {
        fprintf(s->out, "%-32s  %-10s  %-15s  %-24s  %s\n", "id", "status", "outcome", "created", "tags");
        for (size_t i = 0; i < json_array_size(jobs); i++)
            print_row(s->out, json_array_get(jobs, i));
    }
    json_decref(jobs);
    return code;
}

/* ----------------------------------------------- result, picture, history */

static client_exit deliver(client_session *s, const client_reply *reply)
{
    char message[512];
    const char *path = s->options->output ? s->options->output : "-";
    const char *text = reply->body.data ? reply->body.data : "";
    if (!client_file_write(path, text, reply->body.len, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    if (strcmp(path, "-") == 0 && reply->body.len && text[reply->body.len - 1] != '\n')
        fputc('\n', s->out);
    return CLIENT_OK;
}

typedef struct {
    const char *name, *value; /* value NULL: left out */
} query_part;

/* "/v1/jobs/ID/result?a=1&b=2"; a part without a name ends the list. The caller frees. NULL: no memory, said. */
static char *path_with_query(client_session *s, const char *suffix, const query_part *part)
{
    client_buffer query = {0};
    char *path = NULL;
    bool ok = client_buffer_append(&query, suffix, strlen(suffix));
    for (; ok && part->name; part++)
        ok = append_query(&query, part->name, part->value);
    if (ok) {
        char *first = strchr(query.data, '&');
        if (first)
            *first = '?';
        path = client_job_path(s, s->options->operand, query.data);
    } else {
        client_complain(s, CLIENT_LOCAL, "no memory");
    }
    free(query.data);
    return path;
}

/* What is at `path`, which it frees, as it comes. */
static client_exit fetch_and_deliver(client_session *s, char *path)
{
    client_reply reply;
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "GET", path);
    client_exit code = client_ask(s, &reply, &request);
    if (code == CLIENT_OK)
        code = deliver(s, &reply);
    client_reply_clear(&reply);
    free(path);
    return code;
}

client_exit client_result(client_session *s)
{
    const client_options *o = s->options;
    const bool vtu = o->format && strcmp(o->format, "vtu") == 0;
    const query_part query[] = {{"fields", o->fields}, {"case", o->case_name}, {NULL, NULL}};
    return fetch_and_deliver(s, path_with_query(s, vtu ? "/result.vtu" : "/result", query));
}

client_exit client_picture(client_session *s)
{
    char width[24];
    const client_options *o = s->options;
    snprintf(width, sizeof width, "%ld", o->width);
    const query_part query[] = {{"colour", o->colour},
                                {"factor", o->factor},
                                {"width", o->width < 0 ? NULL : width},
                                {"case", o->case_name},
                                {NULL, NULL}};
    return fetch_and_deliver(s, path_with_query(s, "/deformed.svg", query));
}

static bool locale_is_utf8(void)
{
    setlocale(LC_CTYPE, "");
    return strcmp(nl_langinfo(CODESET), "UTF-8") == 0;
}

client_exit client_show_cases(client_session *s, const json_t *job)
{
    json_t *result = NULL;
    if (!json_is_object(client_json_at(job, "summary.cases")))
        return CLIENT_OK;
    char *path = client_job_path(s, client_json_text(job, "id"), "/result?fields=summary");
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "GET", path);
    client_exit code = client_ask_json(s, &result, &request);
    if (result)
        client_print_cases(s->out, result);
    json_decref(result);
    free(path);
    return code;
}

/* The drawing goes where the data would: to the file or to standard output. */
static client_exit draw(client_session *s, const char *csv)
{
    char message[512], *text = NULL;
    size_t len = 0;
    client_series series;
    const client_options *o = s->options;
    client_plot_style style = {.width = o->width < 0 ? PLOT_WIDTH : (int)o->width, .height = (int)o->height};
    style.ascii = o->ascii || !locale_is_utf8();
    style.colour = !o->output && isatty(fileno(s->out)) == 1 && !getenv("NO_COLOR");
    if (!client_series_read(&series, csv, message, sizeof message))
        return client_complain(s, CLIENT_SERVER_ERROR, message);
    FILE *drawing = open_memstream(&text, &len);
    bool drawn = drawing && client_plot_print(drawing, &series, &style);
    bool ok = drawing && fclose(drawing) == 0;
    client_exit code = CLIENT_OK;
    if (!ok)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    else if (!drawn)
        client_complain(s, CLIENT_OK, "the history has no iteration to draw");
    else if (!client_file_write(o->output ? o->output : "-", text, len, message, sizeof message))
        code = client_complain(s, CLIENT_LOCAL, message);
    free(text);
    client_series_clear(&series);
    return code;
}

client_exit client_history(client_session *s)
{
    client_reply reply;
    const client_options *o = s->options;
    const query_part query[] = {{"case", o->case_name}, {NULL, NULL}};
    char *path = path_with_query(s, "/history", query);
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "GET", path);
    request.headers[0] = o->csv || o->plot ? "Accept: text/csv" : "Accept: application/json";
    client_exit code = client_ask(s, &reply, &request);
    if (code == CLIENT_OK && o->plot)
        code = draw(s, reply.body.data ? reply.body.data : "");
    else if (code == CLIENT_OK)
        code = deliver(s, &reply);
    client_reply_clear(&reply);
    free(path);
    return code;
}
