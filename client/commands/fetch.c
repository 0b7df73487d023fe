/* status, cancel, delete, request, result, picture, history: one question, one answer. */
#include "commands/fetch.h"
#include "request/build.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

client_exit client_status(client_session *s)
{
    json_t *job;
    client_exit code = client_get_json(s, &job, client_job_path(s, s->options->operand, ""));
    if (job && s->options->json)
        code = client_print_json(s, job);
    else if (job)
        client_print_summary(s->out, job);
    if (job && !s->options->json && client_job_ended(job) && code == CLIENT_OK)
        code = client_show_cases(s, job);
    if (job && !s->options->json && json_is_object(json_object_get(job, "error")))
        client_print_problem(s->out, 0, json_object_get(job, "error"));
    json_decref(job);
    return code;
}

client_exit client_show_cases(client_session *s, const json_t *job)
{
    json_t *result;
    if (!json_is_object(client_json_at(job, "summary.cases")))
        return CLIENT_OK;
    const client_exit code =
        client_get_json(s, &result, client_job_path(s, client_json_text(job, "id"), "/result?fields=summary"));
    if (result)
        client_print_cases(s->out, result);
    json_decref(result);
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

/* cancel too. Sends the service's one DELETE, which dismisses a job or deletes an ended one: only where the job has
 * ended, or has not, as the command means; else says what the other command is. */
client_exit client_delete(client_session *s)
{
    const bool of_ended = s->options->command == CLIENT_DELETE;
    json_t *job;
    char message[240], *path = NULL;
    client_exit code = client_get_json(s, &job, client_job_path(s, s->options->operand, ""));
    snprintf(message, sizeof message,
             of_ended ? "the job is %.20s: delete is for ended ones; to stop it: uzawa cancel %.40s"
                      : "the job has ended already: %.20s; cancel stops waiting and running ones. To delete it with "
                        "its answer: uzawa delete %.40s",
             client_json_text(job, "status"), client_json_text(job, "id"));
    if (code == CLIENT_OK && client_job_ended(job) != of_ended)
        code = client_complain(s, CLIENT_REFUSED, message);
    json_decref(job);
    if (code == CLIENT_OK && !(path = client_job_path(s, s->options->operand, "")))
        code = CLIENT_LOCAL;
    if (path) {
        client_reply reply;
        const client_reply nothing = {0};
        client_request request = client_request_new(s, "DELETE", path);
        /* One that arrived must not be sent again where the second would delete what the first dismissed. A job that
         * has ended stays so: one that is not there the second time is gone by the first. */
        request.repeatable = of_ended;
        const client_http_end end = client_http_send(s->http, &reply, &request);
        const bool answered = end == CLIENT_HTTP_ANSWERED, again = of_ended && reply.attempts > 1;
        if (answered && (reply.status == 204 || (reply.status == 404 && again)))
            code = say_gone(s, "deleted", &nothing);
        else if (answered && !of_ended && reply.status >= 200 && reply.status < 300)
            code = say_gone(s, "dismissed", &reply);
        else
            code = client_explain(s, end, &reply);
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
    if (strcmp(path, "-") == 0 && len && text[len - 1] != '\n' && !memchr(text, '\0', len)) /* no archive */
        fputc('\n', s->out);
    if (strcmp(path, "-") == 0 || !s->options->json)
        return CLIENT_OK;
    json_t *written = json_pack("{s:s, s:I}", "file", path, "bytes", (json_int_t)len);
    client_exit code = written ? client_print_json(s, written) : CLIENT_LOCAL;
    json_decref(written);
    return code;
}

bool client_append_words(client_buffer *out, const uz_words *words)
{
    bool ok = client_buffer_append(out, "", 0);
    for (int i = 0; ok && i < words->count; i++)
        ok = client_buffer_append(out, ",", i > 0) && client_buffer_append(out, words->item[i], strlen(words->item[i]));
    return ok;
}

/* "/v1/jobs/ID/result?a=1&b=2"; a part without a name ends the list. The caller frees. NULL: no memory, said. */
char *client_path_with_query(client_session *s, const char *id, const char *suffix, const client_query *part)
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
        path = client_job_path(s, id, query.data);
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
    client_exit code = client_get(s, &reply, path, NULL);
    if (code == CLIENT_OK)
        code = client_deliver(s, reply.body.data, reply.body.len);
    client_reply_clear(&reply);
    return code;
}

client_exit client_result(client_session *s)
{
    const client_options *o = s->options;
    const char *format = o->format ? o->format : "json";
    client_buffer text = {0};
    if (!client_append_words(&text, &o->fields)) {
        free(text.data);
        return client_complain(s, CLIENT_LOCAL, "no memory");
    }
    const char *fields = text.data;
    const bool columns = strcmp(format, "table") == 0, rows = columns || strcmp(format, "csv") == 0;
    const client_query query[] = {{"fields", *fields ? fields : NULL}, {"case", o->case_name}, {NULL, NULL}};
    const char *const at = strcmp(format, "vtu") == 0   ? "/result.vtu"
                           : strcmp(format, "npz") == 0 ? "/result.npz"
                                                        : "/result";
    client_exit code;
    if (strcmp(format, "pvd") == 0)
        code = client_series_of_files(s, *fields ? fields : NULL);
    else if (rows && strcmp(fields, "summary") == 0)
        code = client_numbers(s, columns);
    else if (rows)
        code = client_table(s, *fields ? fields : "reactions,gaps", columns);
    else
        code = fetch_and_deliver(s, client_path_with_query(s, o->operand, at, query));
    free(text.data);
    return code;
}

client_exit client_import(client_session *s)
{
    json_t *request;
    client_exit code = client_build_deck(s, &request, s->options->operand, true);
    char *text = code == CLIENT_OK ? json_dumps(request, JSON_COMPACT) : NULL;
    if (code == CLIENT_OK && !text)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    if (code == CLIENT_OK)
        code = client_deliver(s, text, strlen(text));
    free(text);
    json_decref(request);
    return code;
}

client_exit client_request_of(client_session *s)
{
    return fetch_and_deliver(s, client_job_path(s, s->options->operand, "/request"));
}

client_exit client_history(client_session *s)
{
    client_reply reply;
    const client_options *o = s->options;
    const client_query query[] = {{"case", o->case_name}, {NULL, NULL}};
    client_exit code = client_get(s, &reply, client_path_with_query(s, o->operand, "/history", query),
                                  o->csv || o->plot ? "Accept: text/csv" : "Accept: application/json");
    if (code == CLIENT_OK && o->plot)
        code = client_draw_history(s, reply.body.data ? reply.body.data : "");
    else if (code == CLIENT_OK)
        code = client_deliver(s, reply.body.data, reply.body.len);
    client_reply_clear(&reply);
    return code;
}
