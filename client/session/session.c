#include "session/session.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#define PATIENCE_S 3.0
#define SILENCE_S  60.0

/* One line of JSON on s->err. */
static void complain_json(client_session *s, client_exit code, json_t *what)
{
    json_object_set_new(what, "exit", json_integer(code));
    json_dumpf(what, s->err, JSON_COMPACT);
    fputc('\n', s->err);
    json_decref(what);
}

client_exit client_complain(client_session *s, client_exit code, const char *message)
{
    json_t *what = s->options->json ? json_pack("{s:s}", "detail", message) : NULL;
    if (what) {
        complain_json(s, code, what);
        return code;
    }
    fputs("uzawa: ", s->err);
    client_print_safe(s->err, message);
    fputc('\n', s->err);
    return code;
}

client_request client_request_new(const client_session *s, const char *method, const char *path)
{
    double patience = s->options->retry_s < 0 ? PATIENCE_S : s->options->retry_s;
    return (client_request){.method = method,
                            .path = path,
                            .repeatable = true,
                            .patience_s = patience,
                            .silence_s = SILENCE_S,
                            .deadline = s->deadline};
}

client_exit client_explain(client_session *s, client_http_end end, const client_reply *reply)
{
    if (end == CLIENT_HTTP_INTERRUPTED)
        return CLIENT_INTERRUPTED; /* whoever was waiting knows what to say */
    if (end != CLIENT_HTTP_ANSWERED) {
        char message[sizeof reply->message + 60];
        const bool nobody = reply->cause == CLIENT_CAUSE_CONNECTION;
        snprintf(message, sizeof message, "%s%s", reply->message,
                 nobody ? ". Is uzawad running there? uzawa doctor says more" : "");
        return client_complain(s, end == CLIENT_HTTP_MEMORY ? CLIENT_LOCAL : CLIENT_UNREACHABLE, message);
    }
    client_exit code = reply->status >= 400 && reply->status < 500 ? CLIENT_REFUSED : CLIENT_SERVER_ERROR;
    json_t *problem = reply->body.data ? json_loadb(reply->body.data, reply->body.len, 0, NULL) : NULL;
    if (s->options->json && json_is_object(problem))
        complain_json(s, code, json_incref(problem));
    else
        client_print_problem(s->err, reply->status, problem);
    json_decref(problem);
    return code;
}

client_exit client_ask(client_session *s, client_reply *reply, const client_request *request)
{
    client_http_end end = client_http_send(s->http, reply, request);
    bool good = end == CLIENT_HTTP_ANSWERED && reply->status >= 200 && reply->status < 300;
    return good ? CLIENT_OK : client_explain(s, end, reply);
}

client_exit client_get(client_session *s, client_reply *reply, char *path, const char *header)
{
    client_request request = client_request_new(s, "GET", path);
    request.headers[0] = header;
    *reply = (client_reply){0};
    const client_exit code = path ? client_ask(s, reply, &request) : CLIENT_LOCAL;
    free(path);
    return code;
}

client_exit client_ask_json(client_session *s, json_t **out, const client_request *request)
{
    client_reply reply;
    *out = NULL;
    client_exit code = client_ask(s, &reply, request);
    if (code == CLIENT_OK) {
        json_t *value = reply.body.data ? json_loadb(reply.body.data, reply.body.len, 0, NULL) : NULL;
        if (json_is_object(value))
            *out = value;
        else {
            json_decref(value);
            code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no JSON object; is this the right server?");
        }
    }
    client_reply_clear(&reply);
    return code;
}

client_exit client_get_json(client_session *s, json_t **out, char *path)
{
    const client_request request = client_request_new(s, "GET", path);
    *out = NULL;
    const client_exit code = path ? client_ask_json(s, out, &request) : CLIENT_LOCAL;
    free(path);
    return code;
}

char *client_job_path(client_session *s, const char *id, const char *suffix)
{
    static const char JOBS[] = "/v1/jobs/";
    client_buffer path = {0};
    bool ok = client_buffer_append(&path, JOBS, sizeof JOBS - 1) && client_http_append_escaped(&path, id) &&
              client_buffer_append(&path, suffix, strlen(suffix));
    if (!ok) {
        free(path.data);
        path.data = NULL;
        client_complain(s, CLIENT_LOCAL, "no memory");
    }
    return path.data;
}

client_exit client_print_json(client_session *s, const json_t *value)
{
    bool ok = json_dumpf(value, s->out, JSON_INDENT(2) | JSON_PRESERVE_ORDER) == 0;
    fputc('\n', s->out);
    return ok ? CLIENT_OK : CLIENT_LOCAL;
}

/* ---- SIGINT and SIGWINCH while a request is under way */

static bool woken(void *ctx)
{
    client_watch *watch = ctx;
    struct signalfd_siginfo info;
    while (read(watch->http.fd, &info, sizeof info) == (ssize_t)sizeof info)
        watch->interrupted = watch->interrupted || info.ssi_signo == SIGINT;
    return watch->interrupted;
}

static void tick(void *ctx)
{
    const client_watch *watch = ctx;
    client_progress_redraw(watch->progress);
}

void client_watch_begin(client_watch *watch, client_http *http, client_progress *progress)
{
    struct sigaction now;
    sigset_t wanted;
    *watch = (client_watch){.http = {.fd = -1, .woken = woken, .tick = tick, .ctx = watch}, .progress = progress};
    sigemptyset(&wanted);
    sigaddset(&wanted, SIGWINCH);
    if (sigaction(SIGINT, NULL, &now) == 0 && now.sa_handler != SIG_IGN)
        sigaddset(&wanted, SIGINT);
    sigprocmask(SIG_BLOCK, &wanted, &watch->before);
    watch->http.fd = signalfd(-1, &wanted, SFD_NONBLOCK | SFD_CLOEXEC);
    if (watch->http.fd < 0) /* then the signals do what they always do */
        sigprocmask(SIG_SETMASK, &watch->before, NULL);
    client_http_set_watch(http, &watch->http);
}

void client_watch_end(client_watch *watch, client_http *http)
{
    client_http_set_watch(http, NULL);
    if (watch->http.fd < 0)
        return;
    close(watch->http.fd);
    watch->http.fd = -1;
    sigprocmask(SIG_SETMASK, &watch->before, NULL);
}
