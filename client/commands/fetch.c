/* status, cancel, delete, result, picture, history: one question, one answer. */
#include "commands/fetch.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

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

/* What became of the job, in words or as JSON. */
static client_exit say_gone(client_session *s, const char *what, const client_reply *reply)
{
    if (s->options->quiet)
        return CLIENT_OK;
    if (!s->options->json) {
        fprintf(s->out, "%s\n", what);
        return CLIENT_OK;
    }
    json_t *job = reply->body.len ? json_loadb(reply->body.data, reply->body.len, 0, NULL) : NULL;
    if (!job)
        job = json_pack("{s:s, s:s}", "id", s->options->operand, "status", what);
    client_exit code = job ? client_print_json(s, job) : client_complain(s, CLIENT_LOCAL, "no memory");
    json_decref(job);
    return code;
}

/* Asks how the job is, and goes on only where its having ended is as wanted; else says what the other command is. */
static client_exit check_ended(client_session *s, const char *path, bool wanted)
{
    json_t *job = NULL;
    char message[240];
    client_request request = client_request_new(s, "GET", path);
    client_exit code = client_ask_json(s, &job, &request);
    snprintf(message, sizeof message,
             wanted ? "the job is %.20s: delete is for ended ones; to stop it: uzawa cancel %.40s"
                    : "the job has ended already: %.20s; cancel stops waiting and running ones. To delete it with its "
                      "answer: uzawa delete %.40s",
             client_json_text(job, "status"), client_json_text(job, "id"));
    if (code == CLIENT_OK && client_job_ended(job) != wanted)
        code = client_complain(s, CLIENT_REFUSED, message);
    json_decref(job);
    return code;
}

client_exit client_cancel(client_session *s)
{
    char *path = client_job_path(s, s->options->operand, "");
    if (!path)
        return CLIENT_LOCAL;
    client_exit code = check_ended(s, path, false);
    if (code == CLIENT_OK) {
        /* The service knows one DELETE, which dismisses a job or deletes an ended one. One that arrived must not be
         * sent again: the second would delete what the first dismissed. */
        client_reply reply;
        client_request request = client_request_new(s, "DELETE", path);
        request.repeatable = false;
        code = client_ask(s, &reply, &request);
        if (code == CLIENT_OK)
            code = say_gone(s, reply.status == 204 ? "deleted" : "dismissed", &reply);
        client_reply_clear(&reply);
    }
    free(path);
    return code;
}

client_exit client_delete(client_session *s)
{
    char *path = client_job_path(s, s->options->operand, "");
    if (!path)
        return CLIENT_LOCAL;
    client_exit code = check_ended(s, path, true);
    if (code == CLIENT_OK) {
        /* Of a job that has ended, which it stays, so that it may be sent again: one that is not there then is gone by
         * it. */
        client_reply reply;
        client_request request = client_request_new(s, "DELETE", path);
        client_http_end end = client_http_send(s->http, &reply, &request);
        bool gone = end == CLIENT_HTTP_ANSWERED && (reply.status == 204 || (reply.status == 404 && reply.attempts > 1));
        client_reply nothing = {0};
        code = gone ? say_gone(s, "deleted", &nothing) : client_explain(s, end, &reply);
        client_reply_clear(&reply);
    }
    free(path);
    return code;
}

/* ----------------------------------------------- result, picture, history */

bool client_append_query(client_buffer *path, const char *name, const char *value)
{
    return !value || (client_buffer_append(path, "&", 1) && client_buffer_append(path, name, strlen(name)) &&
                      client_buffer_append(path, "=", 1) && client_http_append_escaped(path, value));
}

client_exit client_deliver(client_session *s, const char *text, size_t len)
{
    char message[512];
    const char *path = s->options->output ? s->options->output : "-";
    if (!client_file_write(path, text ? text : "", len, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    if (strcmp(path, "-") == 0 && len && text[len - 1] != '\n')
        fputc('\n', s->out);
    if (strcmp(path, "-") == 0 || !s->options->json)
        return CLIENT_OK;
    json_t *written = json_pack("{s:s, s:I}", "file", path, "bytes", (json_int_t)len);
    client_exit code = written ? client_print_json(s, written) : CLIENT_LOCAL;
    json_decref(written);
    return code;
}

/* "/v1/jobs/ID/result?a=1&b=2"; a part without a name ends the list. The caller frees. NULL: no memory, said. */
char *client_path_with_query(client_session *s, const char *suffix, const client_query *part)
{
    client_buffer query = {0};
    char *path = NULL;
    bool ok = client_buffer_append(&query, suffix, strlen(suffix));
    for (; ok && part->name; part++)
        ok = client_append_query(&query, part->name, part->value);
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
        code = client_deliver(s, reply.body.data, reply.body.len);
    client_reply_clear(&reply);
    free(path);
    return code;
}

client_exit client_result(client_session *s)
{
    const client_options *o = s->options;
    const char *format = o->format ? o->format : "json";
    /* "a,b" of the words, "" of none. The caller frees; NULL: no memory, said. */
    client_buffer text = {0};
    bool ok = client_buffer_append(&text, "", 0);
    for (int i = 0; ok && i < o->fields.count; i++)
        ok = client_buffer_append(&text, ",", i > 0) &&
             client_buffer_append(&text, o->fields.item[i], strlen(o->fields.item[i]));
    if (!ok) {
        free(text.data);
        client_complain(s, CLIENT_LOCAL, "no memory");
    }
    char *fields = ok ? text.data : NULL;
    if (!fields)
        return CLIENT_LOCAL;
    const client_query query[] = {{"fields", *fields ? fields : NULL}, {"case", o->case_name}, {NULL, NULL}};
    client_exit code;
    if (strcmp(format, "csv") == 0)
        code = client_table(s, *fields ? fields : "reactions,gaps");
    else
        code = fetch_and_deliver(
            s, client_path_with_query(s, strcmp(format, "vtu") == 0 ? "/result.vtu" : "/result", query));
    free(fields);
    return code;
}

client_exit client_picture(client_session *s)
{
    char width[24];
    const client_options *o = s->options;
    snprintf(width, sizeof width, "%d", o->width);
    const client_query query[] = {{"colour", o->colour},
                                  {"factor", o->factor},
                                  {"width", o->width < 0 ? NULL : width},
                                  {"case", o->case_name},
                                  {NULL, NULL}};
    return fetch_and_deliver(s, client_path_with_query(s, "/deformed.svg", query));
}

client_exit client_history(client_session *s)
{
    client_reply reply;
    const client_options *o = s->options;
    const client_query query[] = {{"case", o->case_name}, {NULL, NULL}};
    char *path = client_path_with_query(s, "/history", query);
    if (!path)
        return CLIENT_LOCAL;
    client_request request = client_request_new(s, "GET", path);
    request.headers[0] = o->csv || o->plot ? "Accept: text/csv" : "Accept: application/json";
    client_exit code = client_ask(s, &reply, &request);
    if (code == CLIENT_OK && o->plot)
        code = client_draw_history(s, reply.body.data ? reply.body.data : "");
    else if (code == CLIENT_OK)
        code = client_deliver(s, reply.body.data, reply.body.len);
    client_reply_clear(&reply);
    free(path);
    return code;
}
