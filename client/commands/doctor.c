/* doctor.c: the way to the service, the token and the service itself, each with a line that says what helps. */
#include "show/report.h"
#include "commands/run.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define CLOCK_OFF_S     5.0
#define CERTIFICATE_S   (14 * 86400.0)
#define DISK_LEAST      1e9
#define QUEUE_NEAR_FULL 0.9

typedef enum { FINE, WARNING, WRONG } verdict;

typedef struct {
    client_session *s;
    json_t *lines;    /* with --json: {"check", "state", "about", "remedy"} */
    client_exit code; /* of the first thing that is wrong */
} doctor;

/* A line about a check; `remedy` is what helps, "" where all is well. */
__attribute__((format(printf, 5, 6))) static void say(doctor *d, verdict v, const char *check, const char *remedy,
                                                      const char *format, ...)
{
    static const char *const STATES[] = {"ok", "warning", "wrong"};
    char about[400];
    va_list args;
    va_start(args, format);
    vsnprintf(about, sizeof about, format, args);
    va_end(args);
    if (d->lines) {
        json_array_append_new(d->lines, json_pack("{s:s, s:s, s:s, s:s}", "check", check, "state", STATES[v], "about",
                                                  about, "remedy", remedy));
        return;
    }
    if (v == FINE && d->s->options->quiet)
        return;
    FILE *to = d->s->out;
    fprintf(to, "%-8s %-12s ", STATES[v], check);
    client_print_safe(to, about);
    fputc('\n', to);
    if (*remedy)
        fprintf(to, "%22s%s\n", "", remedy);
}

static void fail(doctor *d, client_exit code)
{
    d->code = d->code == CLIENT_OK ? code : d->code;
}

/* Any reply counts; false: there is none. The caller clears *reply and *json. */
static bool ask(doctor *d, client_reply *reply, json_t **json, const char *method, const char *path, const char *body)
{
    client_request request = client_request_new(d->s, method, path);
    request.body = body;
    request.body_len = body ? strlen(body) : 0;
    request.certificate = true;
    if (d->s->options->retry_s < 0)
        request.patience_s = 0; /* how it is now */
    bool answered = client_http_send(d->s->http, reply, &request) == CLIENT_HTTP_ANSWERED;
    *json = answered && reply->body.data ? json_loadb(reply->body.data, reply->body.len, 0, NULL) : NULL;
    return answered;
}

/* ----------------------------------------------------------------- the way */

/* False: nothing more can be asked. */
static bool check_way(doctor *d)
{
    static const char *const REMEDIES[] = {
        [CLIENT_CAUSE_NAME] = "check the host's name in --server or $UZAWA_SERVER, and the name service",
        [CLIENT_CAUSE_CONNECTION] =
            "check host and port in --server or $UZAWA_SERVER; is uzawad running, is a firewall between?",
        [CLIENT_CAUSE_CERTIFICATE] =
            "name the authority's certificates (PEM) in $UZAWA_CA, or use the host's name that the certificate has",
        [CLIENT_CAUSE_TLS] = "does the service speak TLS there? Without it the URL begins with http://",
        [CLIENT_CAUSE_SILENCE] = "something listens there and says nothing: a proxy, or another kind of service?",
        [CLIENT_CAUSE_OTHER] = "does an HTTP service listen there? With TLS the URL begins with https://",
    };
    client_reply reply;
    json_t *health;
    bool answered = ask(d, &reply, &health, "GET", "/healthz", NULL);
    const char *status = client_json_text(health, "status");
    bool good = answered && json_is_object(json_object_get(health, "jobs"));
    if (!answered) {
        say(d, WRONG, "connection", REMEDIES[reply.cause ? reply.cause : CLIENT_CAUSE_OTHER], "%s", reply.message);
        fail(d, CLIENT_UNREACHABLE);
    } else if (!good) {
        say(d, WRONG, "service", "check the URL: this is another service, or a proxy before it",
            "%s answers /healthz with status %ld and not as a contact solver does", reply.address, reply.status);
        fail(d, CLIENT_SERVER_ERROR);
    } else {
        say(d, FINE, "connection", "", "%s, %s", d->s->options->server, reply.address);
        const double left = reply.cert_until > 0 ? difftime(reply.cert_until, time(NULL)) : NAN;
        const double ahead = reply.date < 0 ? NAN : difftime(time(NULL), reply.date);
        const bool tls = strncmp(d->s->options->server, "https:", 6) == 0;
        if (tls && !isfinite(left))
            say(d, FINE, "certificate", "", "trusted");
        else if (tls)
            say(d, left < CERTIFICATE_S ? WARNING : FINE, "certificate",
                left < CERTIFICATE_S ? "renew it, and send the service SIGHUP or restart it" : "",
                "%s, trusted, %.0f days left", reply.cert_subject, left / 86400);
        if (!isfinite(ahead))
            say(d, WARNING, "clock", "", "the server does not say what time it is");
        else if (fabs(ahead) > CLOCK_OFF_S)
            say(d, WARNING, "clock", "set both by NTP: times of jobs and certificates are judged by it",
                "this machine is %.0f s %s the server", fabs(ahead), ahead > 0 ? "ahead of" : "behind");
        else
            say(d, FINE, "clock", "", "as on the server");
        say(d, strcmp(status, "ok") == 0 ? FINE : WRONG, "alive",
            strcmp(status, "ok") == 0 ? "" : "see the server's log", "%s, %.0f workers", status,
            client_json_number(health, "workers"));
        if (strcmp(status, "ok") != 0)
            fail(d, CLIENT_SERVER_ERROR);
    }
    json_decref(health);
    client_reply_clear(&reply);
    return good;
}

/* ------------------------------------------------------------------- token */

/* Two springs, one of them stopped: valid, and only checked, never solved. */
static const char PROBE[] =
    "{\"problem\": {\"kind\": \"matrices\", \"K\": \"%%MatrixMarket matrix coordinate real symmetric\\n"
    "2 2 2\\n1 1 2\\n2 2 1\\n\", \"p\": [2, 2]}}";

static bool try_scope(doctor *d, const char *scope, const char *method, const char *path, const char *body)
{
    client_reply reply;
    json_t *answer;
    const char *token = getenv("UZAWA_TOKEN");
    bool answered = ask(d, &reply, &answer, method, path, body), allowed = answered && reply.status == 200;
    if (allowed)
        say(d, FINE, scope, "", "allowed");
    else if (answered && reply.status == 401)
        say(d, WRONG, scope,
            token && *token ? "put the right one into $UZAWA_TOKEN; the service's --token-file lists them"
                            : "put a token into $UZAWA_TOKEN; the service's --token-file lists them",
            token && *token ? "the service does not know the token" : "the service wants a token, and none is set");
    else if (answered && reply.status == 403)
        say(d, WRONG, scope, "a token with that scope is needed in $UZAWA_TOKEN", "the token does not allow it");
    else
        say(d, WRONG, scope, "see the server's log", "%s",
            answered ? client_json_text(answer, "detail") : reply.message);
    if (!allowed)
        fail(d, answered && reply.status < 500 ? CLIENT_REFUSED : CLIENT_SERVER_ERROR);
    json_decref(answer);
    client_reply_clear(&reply);
    return allowed;
}

/* ----------------------------------------------------------------- service */

/* The number behind "name " at the beginning of a line of Prometheus text, NAN if there is none. */
static double metric(const char *text, const char *name)
{
    size_t len = strlen(name);
    for (const char *line = text; line && *line; line = strchr(line, '\n'), line = line ? line + 1 : NULL)
        if (strncmp(line, name, len) == 0 && line[len] == ' ')
            return strtod(line + len, NULL);
    return NAN;
}

/* Of which release it is, and how much room it has. */
static void check_service(doctor *d)
{
    static const char NAME[] = "uzawad_build_info{version=\"";
    client_reply metrics, reply;
    json_t *none, *limits;
    bool told = ask(d, &metrics, &none, "GET", "/metrics", NULL) && metrics.status == 200;
    const char *text = told ? metrics.body.data : NULL, *at = text ? strstr(text, NAME) : NULL;
    bool listed = ask(d, &reply, &limits, "GET", "/v1/limits", NULL) && reply.status == 200;
    char version[32] = "";
    if (at)
        snprintf(version, sizeof version, "%.*s", (int)strcspn(at + sizeof NAME - 1, "\""), at + sizeof NAME - 1);
    if (!*version)
        say(d, WARNING, "version", "the service's option metrics tells it", "client %s, service unknown",
            CLIENT_VERSION_TEXT);
    else if (strcmp(version, CLIENT_VERSION_TEXT) != 0)
        say(d, WARNING, "version", "use the client of the service's release", "client %s, service %s",
            CLIENT_VERSION_TEXT, version);
    else
        say(d, FINE, "version", "", "client and service %s", version);
    const double depth = text ? metric(text, "uzawad_queue_depth") : NAN;
    const double limit = client_json_number(limits, "limits.max_queue.value");
    if (isfinite(depth) && isfinite(limit) && depth >= limit) {
        say(d, WRONG, "queue", "wait, or raise the service's --max-queue or --workers", "full: %.0f of %.0f jobs wait",
            depth, limit);
        fail(d, CLIENT_SERVER_ERROR);
    } else if (isfinite(depth) && isfinite(limit) && depth >= QUEUE_NEAR_FULL * limit)
        say(d, WARNING, "queue", "it is nearly full", "%.0f of %.0f jobs wait", depth, limit);
    else if (isfinite(depth))
        say(d, FINE, "queue", "", isfinite(limit) ? "%.0f of at most %.0f jobs wait" : "%.0f jobs wait", depth, limit);
    const double left = text ? metric(text, "uzawad_store_free_bytes") : NAN;
    const bool little = left < DISK_LEAST;
    if (isfinite(left))
        say(d, little ? WARNING : FINE, "disk",
            little ? "delete old jobs (uzawa delete, --keep-days) or make room" : "",
            "%.1f GB are free where the service keeps its jobs", left / 1e9);
    if (listed)
        say(d, FINE, "limits", "", "request %.0f MB, upload %.0f MB, memory of a problem %.1f GB, time of a job %.0f s",
            client_json_number(limits, "limits.max_body.value") / 1e6,
            client_json_number(limits, "limits.max_upload.value") / 1e6,
            client_json_number(limits, "limits.memory.value") / 1e9,
            client_json_number(limits, "limits.max_solve_s.value"));
    json_decref(none);
    json_decref(limits);
    client_reply_clear(&metrics);
    client_reply_clear(&reply);
}

client_exit client_doctor(client_session *s)
{
    doctor d = {.s = s, .lines = s->options->json ? json_array() : NULL, .code = CLIENT_OK};
    if (check_way(&d)) {
        client_reply reply;
        json_t *answer;
        const bool ready = ask(&d, &reply, &answer, "GET", "/readyz", NULL) && reply.status == 200;
        const char *code = client_json_text(answer, "code");
        const char *remedy = strcmp(code, "store_unavailable") == 0
                                 ? "is the disk full, or the database file not writable? See the server's log"
                             : strcmp(code, "draining") == 0 ? "it is shutting down: wait until it is back"
                                                             : "see the server's log";
        if (ready)
            say(&d, FINE, "ready", "", "it solves, and it writes to its store");
        else {
            say(&d, WRONG, "ready", remedy, "%s: %s", client_json_text(answer, "title"),
                client_json_text(answer, "detail"));
            fail(&d, CLIENT_SERVER_ERROR);
        }
        json_decref(answer);
        client_reply_clear(&reply);
        if (try_scope(&d, "reading", "GET", "/v1/jobs?limit=1", NULL)) {
            try_scope(&d, "submitting", "POST", "/v1/jobs?validate=true", PROBE);
            check_service(&d);
        }
    }
    if (d.lines && client_print_json(s, d.lines) != CLIENT_OK)
        d.code = CLIENT_LOCAL;
    json_decref(d.lines);
    return d.code;
}
