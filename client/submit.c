/* submit, refine, verify and wait: the commands that may stay until a job has ended. */
#include "progress.h"
#include "report.h"
#include "session.h"
#include "tags.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define PATIENCE_WAITING_S 30.0 /* a server that restarts is back by then */
#define GRACE_S            5.0  /* for the reply to the last poll before the deadline */
#define LONG_POLL_S        30.0
#define SHORT_POLL_S       1.0 /* while progress is shown */
#define KEY_BYTES          16

/* Random, so that a repeated request is recognised as the same one and no other. */
static bool make_key(char key[2 * KEY_BYTES + 1])
{
    unsigned char bytes[KEY_BYTES];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes)
        return false;
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(key + 2 * i, 3, "%02x", bytes[i]);
    return true;
}

static double poll_seconds(const client_session *s, const client_progress *progress)
{
    double left = fmax(s->deadline - client_clock(), 0);
    return floor(fmin(progress->shown ? SHORT_POLL_S : LONG_POLL_S, left));
}

static void set_wait(client_request *request, char *header, size_t size, double seconds)
{
    request->silence_s += seconds;
    if (seconds < 1)
        return;
    snprintf(header, size, "Prefer: wait=%.0f", seconds);
    request->headers[1] = header;
}

/* One look at the job, which may take a while. *job is replaced only by a newer one. */
static client_exit poll_job(client_session *s, const char *path, const client_progress *progress, json_t **job)
{
    char prefer[40];
    json_t *newer;
    client_request request = client_request_new(s, "GET", path);
    set_wait(&request, prefer, sizeof prefer, poll_seconds(s, progress));
    request.deadline += GRACE_S;
    if (s->options->retry_s < 0)
        request.patience_s = PATIENCE_WAITING_S;
    client_exit code = client_ask_json(s, &newer, &request);
    if (newer) {
        json_decref(*job);
        *job = newer;
    }
    return code;
}

/* Until *job, which may be NULL at first, has ended. CLIENT_OK says that it has, however. */
static client_exit wait_for_end(client_session *s, const char *id, json_t **job, client_progress *progress)
{
    client_exit code = CLIENT_OK;
    char *path = client_job_path(s, id, "");
    if (!path)
        return CLIENT_LOCAL;
    while (code == CLIENT_OK && !client_job_ended(*job)) {
        double asked = client_clock();
        if (*job && asked >= s->deadline) {
            code = CLIENT_WAIT_TIMEOUT;
            break;
        }
        code = poll_job(s, path, progress, job);
        if (code == CLIENT_OK)
            client_progress_show(progress, *job);
        /* A server that does not hold the request must not be asked without a pause. */
        if (code == CLIENT_OK && !client_job_ended(*job) && client_clock() - asked < 0.2)
            client_sleep(fmin(0.2, s->deadline - client_clock()));
    }
    free(path);
    return code;
}

static void print_wait_timeout(client_session *s, const char *id)
{
    fprintf(s->err, "uzawa: the job has not ended after %g s and goes on; see it with: uzawa wait ",
            s->options->timeout_s);
    client_print_safe(s->err, id);
    fputc('\n', s->err);
}

/* What the user sees of an ended job; the exit code says how it ended. */
static client_exit report_end(client_session *s, const json_t *job)
{
    const json_t *error = json_object_get(job, "error");
    client_exit code = client_job_exit(job);
    if (code == CLIENT_JOB_FAILED || json_is_object(error))
        client_print_problem(s->err, 0, error);
    if (s->options->json)
        return client_print_json(s, job) == CLIENT_OK ? code : CLIENT_LOCAL;
    if (s->options->quiet)
        return code;
    client_print_summary(s->out, job);
    client_exit shown = client_show_cases(s, job);
    return shown == CLIENT_OK ? code : shown;
}

static client_exit wait_and_report(client_session *s, const char *id, json_t **job, client_progress *progress)
{
    client_exit code = wait_for_end(s, id, job, progress);
    client_progress_end(progress);
    if (code == CLIENT_WAIT_TIMEOUT)
        print_wait_timeout(s, id);
    if (code == CLIENT_OK)
        code = report_end(s, *job);
    return *job ? client_contract(s, *job, code) : code;
}

client_exit client_wait(client_session *s)
{
    json_t *job = NULL;
    client_progress progress = client_progress_new(s->err, s->options->progress, s->options->quiet);
    client_exit code = wait_and_report(s, s->options->operand, &job, &progress);
    json_decref(job);
    return code;
}

/* The request as it will be sent: the file, with the tags of the command line in it. */
static client_exit load_body(client_session *s, client_buffer *out)
{
    char message[512];
    client_buffer file;
    *out = (client_buffer){0};
    if (!client_file_read(&file, s->options->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    bool ok = client_tags_add(out, &file, s->options->tags, s->options->n_tags);
    free(file.data);
    return ok ? CLIENT_OK : client_complain(s, CLIENT_LOCAL, "cannot add the tags: one is not UTF-8, or no memory");
}

/* A certificate is wanted at once. */
static bool stays(const client_session *s)
{
    return s->options->wait || s->options->command == CLIENT_VERIFY;
}

static client_exit post_body(client_session *s, const char *path, const client_buffer *body,
                             const client_progress *progress, json_t **job)
{
    char key[2 * KEY_BYTES + 1], prefer[40], *header = NULL;
    client_request request = client_request_new(s, "POST", path);
    if (!s->options->key && !make_key(key))
        return client_complain(s, CLIENT_LOCAL, "no random numbers for an idempotency key");
    if (asprintf(&header, "Idempotency-Key: %s", s->options->key ? s->options->key : key) < 0)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    request.headers[0] = header;
    request.body = body->data;
    request.body_len = body->len;
    if (stays(s)) {
        set_wait(&request, prefer, sizeof prefer, poll_seconds(s, progress));
        request.deadline += GRACE_S;
    }
    client_exit code = client_ask_json(s, job, &request);
    free(header);
    return code;
}

static client_exit report_accepted(client_session *s, const json_t *job)
{
    if (s->options->json)
        return client_print_json(s, job);
    client_print_safe(s->out, client_json_text(job, "id"));
    fputc('\n', s->out);
    return CLIENT_OK;
}

static client_exit follow(client_session *s, json_t **job, client_progress *progress)
{
    char id[128];
    const char *of_result = client_json_text(*job, "job"); /* verify answers with a result */
    snprintf(id, sizeof id, "%s", *of_result ? of_result : client_json_text(*job, "id"));
    if (!*id)
        return client_complain(s, CLIENT_SERVER_ERROR, "the reply names no job; is this the right server?");
    if (*of_result) {
        json_decref(*job);
        *job = NULL;
        return wait_and_report(s, id, job, progress);
    }
    bool quiet = s->options->quiet && !s->options->json && s->options->command != CLIENT_VERIFY;
    if (!stays(s) || quiet)
        report_accepted(s, *job);
    if (!stays(s))
        return CLIENT_OK;
    client_progress_show(progress, *job);
    return wait_and_report(s, id, job, progress);
}

/* Sends the body, which it frees, and stays if it was told to. */
static client_exit post_and_follow(client_session *s, const char *path, client_buffer *body)
{
    json_t *job = NULL;
    client_progress progress = client_progress_new(s->err, s->options->progress, s->options->quiet);
    client_exit code = post_body(s, path, body, &progress, &job);
    free(body->data);
    if (code == CLIENT_OK)
        code = follow(s, &job, &progress);
    json_decref(job);
    return code;
}

static client_exit send_file(client_session *s, const char *path)
{
    client_buffer body;
    client_exit code = load_body(s, &body);
    return code == CLIENT_OK ? post_and_follow(s, path, &body) : code;
}

client_exit client_submit(client_session *s)
{
    return send_file(s, "/v1/jobs");
}

client_exit client_verify(client_session *s)
{
    return send_file(s, "/v1/verify");
}

/* {"accuracy": {"relative_error": 1e-8}} or {"accuracy": "exact"}, and the limits that were given. NULL: no memory. */
static char *refine_body(const client_options *o)
{
    char *end;
    double error = strtod(o->accuracy, &end);
    bool number = *end == '\0' && isfinite(error);
    json_t *body = number ? json_pack("{s:{s:f}}", "accuracy", "relative_error", error)
                          : json_pack("{s:s}", "accuracy", o->accuracy);
    bool ok = body != NULL;
    if (ok && o->max_iterations >= 0)
        ok = json_object_set_new(body, "max_iterations", json_integer(o->max_iterations)) == 0;
    if (ok && isfinite(o->time_limit_s))
        ok = json_object_set_new(body, "time_limit_s", json_real(o->time_limit_s)) == 0;
    char *text = ok ? json_dumps(body, JSON_COMPACT) : NULL;
    json_decref(body);
    return text;
}

client_exit client_refine(client_session *s)
{
    char *path = client_job_path(s, s->options->operand, "/refine"), *text = refine_body(s->options);
    client_exit code = CLIENT_LOCAL;
    if (path && text) {
        client_buffer body = {.data = text, .len = strlen(text)};
        code = post_and_follow(s, path, &body);
        text = NULL;
    } else if (path) {
        client_complain(s, code, "no memory, or the accuracy is not UTF-8");
    }
    free(text);
    free(path);
    return code;
}
