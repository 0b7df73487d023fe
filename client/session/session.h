/* session.h: what every command needs: its options, the connection, where to print, and how a wait is interrupted. */
#ifndef CLIENT_SESSION_H
#define CLIENT_SESSION_H

#include "arguments/arguments.h"
#include "local/exit_codes.h"
#include "service/http.h"
#include "show/junit.h"
#include "show/progress.h"

#include <jansson.h>
#include <signal.h>

typedef struct {
    const client_options *options;
    client_http *http;
    FILE *out, *err;
    double deadline;      /* client_clock time after which the command gives up; INFINITY: never */
    client_suites suites; /* of the jobs so far, for --junit */
    char key[33];         /* random, of the jobs that submit makes; "": --key says it, or none is needed */
} client_session;

/* A request without body or headers that is patient as the command line says. */
client_request client_request_new(const client_session *s, const char *method, const char *path);

/* Sends it. Anything but a 2xx is explained on s->err and is the returned exit code. The caller clears *reply. */
client_exit client_ask(client_session *s, client_reply *reply, const client_request *request);
/* What is at this path, which is freed, likewise. header: one more, or NULL. path NULL: no memory, said already. */
client_exit client_get(client_session *s, client_reply *reply, char *path, const char *header);
/* What is said of anything else, and the exit code. An interrupt is left to the caller to tell. */
client_exit client_explain(client_session *s, client_http_end end, const client_reply *reply);
/* As client_ask, and the reply must be a JSON object: *out, released by the caller with json_decref, NULL on failure.
 */
client_exit client_ask_json(client_session *s, json_t **out, const client_request *request);

/* What is at this path, which is freed, as client_ask_json gives it. path NULL: no memory, said already. */
client_exit client_get_json(client_session *s, json_t **out, char *path);

/* "/v1/jobs/ID" and what follows; the caller frees. NULL: no memory, said on s->err. */
char *client_job_path(client_session *s, const char *id, const char *suffix);

/* Prints JSON on one or many lines for a person or a program. */
client_exit client_print_json(client_session *s, const json_t *value);
/* "uzawa: MESSAGE" on s->err, with --json {"detail": MESSAGE, "exit": code}; returns `code`. */
client_exit client_complain(client_session *s, client_exit code, const char *message);

/* ---- SIGINT and SIGWINCH as something to read, so that a wait ends or its line is drawn anew without a handler. */

typedef struct {
    client_http_watch http;
    client_progress *progress;
    sigset_t before;
    bool interrupted;
} client_watch;

/* From here to client_watch_end the signals are blocked and requests of `http` look after them; `watch` and `progress`
 * must stay where they are. A SIGINT that was ignored (a shell's background job) stays so. */
void client_watch_begin(client_watch *watch, client_http *http, client_progress *progress);
void client_watch_end(client_watch *watch, client_http *http);

#endif
