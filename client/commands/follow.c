/* follow.c: waiting for a job: a stream of events while progress is shown, else requests that the server holds. */
#include "commands/follow.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PATIENCE_WAITING_S 30.0 /* a server that restarts is back by then */
#define GRACE_S            5.0  /* for the reply to the last poll before the deadline */
#define LONG_POLL_S        30.0
#define SHORT_POLL_S       1.0 /* while progress is shown */
#define SILENCE_STREAM_S   60.0
#define EVENT_MOST         (1u << 24)

void client_hold(const client_session *s, client_request *request, const client_progress *progress, char header[40])
{
    const double left = fmax(s->deadline - client_clock(), 0);
    const double seconds = floor(fmin(progress->shown ? SHORT_POLL_S : LONG_POLL_S, left));
    request->silence_s += seconds;
    request->deadline += GRACE_S;
    if (seconds < 1)
        return;
    snprintf(header, 40, "Prefer: wait=%.0f", seconds);
    request->headers[1] = header;
}

/* ------------------------------------------- Server-Sent Events (WHATWG HTML, 9.2) */

typedef struct {
    client_buffer line, data;
    char event[24];
    json_t *job; /* the last status */
    client_progress *progress;
    int events;
} stream;

/* What follows "name:" and one blank in the line, or NULL. */
static const char *field(const char *line, const char *name)
{
    size_t len = strlen(name);
    if (strncmp(line, name, len) != 0 || line[len] != ':')
        return NULL;
    return line + len + 1 + (line[len + 1] == ' ');
}

static bool take_bytes(void *ctx, const char *bytes, size_t count)
{
    stream *st = ctx;
    bool go_on = true;
    for (size_t i = 0; go_on && i < count; i++) {
        if (bytes[i] == '\r')
            continue;
        if (bytes[i] != '\n') {
            go_on = st->line.len <= EVENT_MOST && client_buffer_append(&st->line, bytes + i, 1);
            continue;
        }
        const char *line = st->line.data ? st->line.data : "", *value;
        if (!*line) { /* the end of an event */
            json_t *told = st->data.len ? json_loadb(st->data.data, st->data.len, 0, NULL) : NULL;
            if (json_is_object(told) && strcmp(st->event, "status") == 0) {
                json_decref(st->job);
                st->job = json_incref(told);
                client_progress_show(st->progress, told);
                st->events++;
            } else if (json_is_object(told) && strcmp(st->event, "progress") == 0) {
                client_progress_row(st->progress, told);
                st->events++;
            }
            json_decref(told);
            st->data.len = 0;
            st->event[0] = '\0';
            go_on = !client_job_ended(st->job);
        } else if ((value = field(line, "event"))) {
            snprintf(st->event, sizeof st->event, "%s", value);
        } else if ((value = field(line, "data")) && st->data.len < EVENT_MOST) {
            go_on = client_buffer_append(&st->data, value, strlen(value));
        }
        st->line.len = 0;
        go_on = client_buffer_append(&st->line, "", 0) && go_on;
    }
    return go_on;
}

/* Shows the progress as the server tells it, until the stream ends for whatever reason. True: it told something. */
static bool watch_stream(client_session *s, const char *id, json_t **job, client_watch *watch)
{
    client_reply reply;
    stream st = {.progress = watch->progress};
    char *path = client_job_path(s, id, "/events");
    if (!path)
        return false;
    client_request request = client_request_new(s, "GET", path);
    request.headers[0] = "Accept: text/event-stream";
    request.patience_s = 0;
    request.silence_s = SILENCE_STREAM_S;
    request.take = take_bytes;
    request.take_ctx = &st;
    client_http_send(s->http, &reply, &request);
    client_reply_clear(&reply);
    if (st.job) {
        json_decref(*job);
        *job = st.job;
    }
    free(st.line.data);
    free(st.data.data);
    free(path);
    return st.events > 0;
}

/* ---------------------------------------------------------------- waiting */

client_exit client_follow(client_session *s, const char *id, json_t **job, client_watch *watch)
{
    client_exit code = CLIENT_OK;
    bool streams = watch->progress->shown;
    char *path = client_job_path(s, id, "");
    if (!path)
        return CLIENT_LOCAL;
    while (code == CLIENT_OK && !watch->interrupted && !client_job_ended(*job)) {
        const double asked = client_clock();
        if (*job && asked >= s->deadline) {
            code = CLIENT_WAIT_TIMEOUT;
            break;
        }
        if (streams)
            streams = watch_stream(s, id, job, watch);
        if (watch->interrupted || client_job_ended(*job))
            break;
        /* One look at the job, which may take a while. *job is replaced only by a newer one. */
        char prefer[40];
        json_t *newer;
        client_request request = client_request_new(s, "GET", path);
        client_hold(s, &request, watch->progress, prefer);
        if (s->options->retry_s < 0)
            request.patience_s = PATIENCE_WAITING_S;
        code = client_ask_json(s, &newer, &request);
        if (newer) {
            json_decref(*job);
            *job = newer;
        }
        if (code == CLIENT_OK)
            client_progress_show(watch->progress, *job);
        /* A server that does not hold the request must not be asked without a pause. */
        if (code == CLIENT_OK && !client_job_ended(*job) && client_clock() - asked < 0.2)
            client_http_pause(s->http, fmin(0.2, s->deadline - client_clock()));
    }
    if (watch->interrupted && !client_job_ended(*job))
        code = CLIENT_INTERRUPTED;
    client_progress_end(watch->progress);
    if (code == CLIENT_WAIT_TIMEOUT || code == CLIENT_INTERRUPTED) {
        char message[400], why[64] = "interrupted";
        if (code == CLIENT_WAIT_TIMEOUT)
            snprintf(why, sizeof why, "the job has not ended after %g s", s->options->timeout_s);
        snprintf(message, sizeof message,
                 "%s; it goes on; see it with: uzawa wait %.128s; stop it with: uzawa cancel %.128s", why, id, id);
        client_complain(s, code, message);
    }
    free(path);
    return code;
}

client_exit client_report_end(client_session *s, const json_t *job, client_exit waited)
{
    const json_t *error = json_object_get(job, "error");
    client_exit code = waited == CLIENT_OK ? client_job_exit(job) : waited;
    if (s->options->json && job) {
        if (client_print_json(s, job) != CLIENT_OK)
            code = CLIENT_LOCAL;
    } else if (waited == CLIENT_OK) {
        if (code == CLIENT_JOB_FAILED || json_is_object(error))
            client_print_problem(s->err, 0, error);
        if (!s->options->quiet) {
            client_print_summary(s->out, job);
            const client_exit shown = client_show_cases(s, job);
            code = shown == CLIENT_OK ? code : shown;
        }
    }
    return job ? client_contract(s, job, NULL, code) : code;
}

client_exit client_wait(client_session *s)
{
    json_t *job = NULL;
    client_watch watch;
    client_progress progress = client_progress_new(s->err, s->options->progress, s->options->quiet);
    client_watch_begin(&watch, s->http, &progress);
    client_exit code = client_follow(s, s->options->operand, &job, &watch);
    client_watch_end(&watch, s->http);
    code = client_report_end(s, job, code);
    json_decref(job);
    return code;
}
