/* submit, refine and verify: the commands that make jobs. */
#include "request/build.h"
#include "commands/follow.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define KEY_BYTES 16

/* One key for all that the command makes: whoever repeats it with that key finds what is there already. Random, so that
 * a repeated request is recognised as the same one and no other. */
static bool have_key(client_session *s)
{
    unsigned char bytes[KEY_BYTES];
    if (s->options->key || *s->key)
        return true;
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes)
        return false;
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(s->key + 2 * i, 3, "%02x", bytes[i]);
    return true;
}

/* One of several jobs, from 0; -1: the only one, which may be waited for at once. */
static client_exit post_body(client_session *s, const char *path, const client_buffer *body, client_watch *watch,
                             int number, json_t **job)
{
    char prefer[40], *header = NULL, *key = NULL;
    client_request request = client_request_new(s, "POST", path);
    *job = NULL;
    if (!have_key(s))
        return client_complain(s, CLIENT_LOCAL, "no random numbers for an idempotency key");
    const char *given = s->options->key ? s->options->key : s->key;
    bool ok = (number < 0 ? asprintf(&key, "%s", given) : asprintf(&key, "%s-%d", given, number)) >= 0;
    if (!ok || asprintf(&header, "Idempotency-Key: %s", key) < 0) {
        if (ok)
            free(key);
        return client_complain(s, CLIENT_LOCAL, "no memory");
    }
    request.headers[0] = header;
    request.body = body->data ? body->data : "";
    request.body_len = body->len;
    if (s->options->wait && number < 0)
        client_hold(s, &request, watch->progress, prefer);
    client_exit code = client_ask_json(s, job, &request);
    if (code == CLIENT_INTERRUPTED) {
        char message[300];
        snprintf(message, sizeof message,
                 "interrupted before the service answered; the same command with --key %.200s finds the job", given);
        client_complain(s, CLIENT_INTERRUPTED, message);
    }
    free(header);
    free(key);
    return code;
}

/* The id of a job, or of the result that verify answers with, which is printed where it is wanted. "" where the reply
 * has none, which is told. */
static client_exit take_id(client_session *s, char id[128], const json_t *job, bool print)
{
    const char *of_result = client_json_text(job, "job");
    snprintf(id, 128, "%s", *of_result ? of_result : client_json_text(job, "id"));
    if (!*id)
        return client_complain(s, CLIENT_SERVER_ERROR, "the reply names no job; is this the right server?");
    if (print) {
        client_print_safe(s->out, id);
        fputc('\n', s->out);
        fflush(s->out); /* whoever reads it may want to use it while we wait */
    }
    return CLIENT_OK;
}

/* --------------------------------------------------------------- one job */

static client_exit post_and_stay(client_session *s, const char *path, const client_buffer *body)
{
    char id[128];
    json_t *job = NULL;
    client_watch watch;
    client_progress progress = client_progress_new(s->err, s->options->progress, s->options->quiet);
    progress.shown = progress.shown && s->options->wait;
    client_watch_begin(&watch, s->http, &progress);
    client_exit code = post_body(s, path, body, &watch, -1, &job);
    const bool whole = !s->options->wait && s->options->json;
    if (code == CLIENT_OK)
        code = take_id(s, id, job,
                       !whole && (!s->options->wait || (s->options->quiet && s->options->command != CLIENT_VERIFY)));
    if (code == CLIENT_OK && whole)
        code = client_print_json(s, job);
    if (code == CLIENT_OK && s->options->wait) {
        if (*client_json_text(job, "job")) { /* verify answered with a result, which is no job */
            json_decref(job);
            job = NULL;
        } else {
            client_progress_show(watch.progress, job);
        }
        code = client_follow(s, id, &job, &watch);
    }
    client_watch_end(&watch, s->http);
    if (s->options->wait)
        code = client_report_end(s, job, code);
    json_decref(job);
    return code;
}

/* -------------------------------------------------------------- several */

static client_exit post_several(client_session *s, const client_bodies *bodies)
{
    client_watch watch;
    client_progress progress = client_progress_new(s->err, s->options->progress, s->options->quiet);
    json_t *jobs = json_array();
    progress.shown = progress.shown && s->options->wait;
    client_watch_begin(&watch, s->http, &progress);
    client_exit code = CLIENT_OK;
    for (size_t i = 0; code == CLIENT_OK && i < bodies->count; i++) {
        char id[128];
        json_t *job;
        code = post_body(s, "/v1/jobs", &bodies->item[i].body, &watch, (int)i, &job);
        if (code == CLIENT_OK)
            code = take_id(s, id, job, !s->options->json && (!s->options->wait || s->options->quiet));
        if (code == CLIENT_OK && json_array_append(jobs, job) != 0)
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        json_decref(job);
    }
    /* Each job to its end. The first exit code that is not 0 counts, but an interrupt or a timeout ends it all. */
    const bool follows = code == CLIENT_OK && s->options->wait, told = !s->options->json && !s->options->quiet;
    bool ended = follows;
    if (follows && told)
        fprintf(s->out, "%-32s  %-15s  %-13s  %s\n", "id", "outcome", "whole error", "values");
    for (size_t i = 0; ended && i < json_array_size(jobs); i++) {
        json_t *job = json_incref(json_array_get(jobs, i));
        const char *label = bodies->item[i].label;
        client_exit one = client_follow(s, client_json_text(job, "id"), &job, &watch);
        json_array_set(jobs, i, job);
        ended = one == CLIENT_OK;
        if (ended)
            one = client_job_exit(job);
        if (ended && told) {
            char text[32];
            const char *outcome = client_json_text(job, "summary.outcome");
            client_print_cell(s->out, client_json_text(job, "id"), 32);
            client_print_cell(s->out, *outcome ? outcome : client_json_text(job, "status"), 15);
            client_print_cell(s->out, client_format_error(text, client_json_at(job, "summary")), 13);
            client_print_safe(s->out, label);
            fputc('\n', s->out);
        }
        one = client_contract(s, job, label, one);
        json_decref(job);
        code = code == CLIENT_OK || !ended ? one : code;
    }
    client_watch_end(&watch, s->http);
    if (s->options->json && json_array_size(jobs) && client_print_json(s, jobs) != CLIENT_OK)
        code = CLIENT_LOCAL;
    json_decref(jobs);
    return code;
}

/* ------------------------------------------------------------- only checked */

static client_exit check_bodies(client_session *s, const client_bodies *bodies)
{
    client_exit first = CLIENT_OK;
    for (size_t i = 0; i < bodies->count; i++) {
        client_request request = client_request_new(s, "POST", "/v1/jobs?validate=true");
        json_t *valid;
        request.body = bodies->item[i].body.data ? bodies->item[i].body.data : "";
        request.body_len = bodies->item[i].body.len;
        client_exit code = client_ask_json(s, &valid, &request);
        if (code == CLIENT_OK && s->options->json)
            code = client_print_json(s, valid);
        else if (code == CLIENT_OK && !s->options->quiet)
            client_print_valid(s->out, bodies->item[i].label, valid);
        json_decref(valid);
        first = first == CLIENT_OK ? code : first;
    }
    return first;
}

/* ------------------------------------------------------------ the commands */

client_exit client_submit(client_session *s)
{
    client_bodies bodies;
    if (!have_key(s))
        return client_complain(s, CLIENT_LOCAL, "no random numbers for an idempotency key");
    client_exit code = client_build(s, &bodies);
    if (code == CLIENT_OK && s->options->validate)
        code = check_bodies(s, &bodies);
    else if (code == CLIENT_OK && bodies.count == 1)
        code = post_and_stay(s, "/v1/jobs", &bodies.item[0].body);
    else if (code == CLIENT_OK)
        code = post_several(s, &bodies);
    client_bodies_clear(&bodies);
    return code;
}

client_exit client_verify(client_session *s)
{
    char message[512];
    client_buffer file;
    if (!client_file_read(&file, s->options->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    client_exit code = post_and_stay(s, "/v1/verify", &file);
    free(file.data);
    return code;
}

client_exit client_refine(client_session *s)
{
    const client_options *o = s->options;
    char *path = client_job_path(s, o->operand, "/refine"), *text = NULL, *end;
    client_exit code = CLIENT_LOCAL;
    if (!path)
        return code;
    /* {"accuracy": {"relative_error": 1e-8}} or {"accuracy": "exact"}, and the limits that were given. */
    const double error = strtod(o->accuracy, &end);
    const bool number = *end == '\0' && isfinite(error);
    json_t *wanted = number ? json_pack("{s:{s:f}}", "accuracy", "relative_error", error)
                            : json_pack("{s:s}", "accuracy", o->accuracy);
    bool ok = wanted != NULL;
    if (ok && o->max_iterations >= 0)
        ok = json_object_set_new(wanted, "max_iterations", json_integer(o->max_iterations)) == 0;
    if (ok && isfinite(o->time_limit_s))
        ok = json_object_set_new(wanted, "time_limit_s", json_real(o->time_limit_s)) == 0;
    if (ok)
        text = json_dumps(wanted, JSON_COMPACT);
    json_decref(wanted);
    if (text) {
        client_buffer body = {.data = text, .len = strlen(text)};
        code = post_and_stay(s, path, &body);
    } else {
        client_complain(s, code, "no memory, or the accuracy is not UTF-8");
    }
    free(text);
    free(path);
    return code;
}
