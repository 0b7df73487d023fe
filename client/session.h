/* session.h: what every command needs: its options, the connection and where to print. */
#ifndef CLIENT_SESSION_H
#define CLIENT_SESSION_H

#include "arguments.h"
#include "exit_codes.h"
#include "http.h"
#include "junit.h"

#include <jansson.h>

#define CLIENT_VERSION_TEXT "0.1.0"

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
/* What is said of anything else, and the exit code. An interrupt is left to the caller to tell. */
client_exit client_explain(client_session *s, client_http_end end, const client_reply *reply);
/* As client_ask, and the reply must be a JSON object: *out, released by the caller with json_decref, NULL on failure.
 */
client_exit client_ask_json(client_session *s, json_t **out, const client_request *request);

/* "/v1/jobs/ID" and what follows; the caller frees. NULL: no memory, said on s->err. */
char *client_job_path(client_session *s, const char *id, const char *suffix);

/* The cases of an ended job whose summary says that it has some, as a table on s->out; else nothing. */
client_exit client_show_cases(client_session *s, const json_t *job);

/* What --baseline and --junit ask for about a job that was waited for: prints the comparison, writes the report with
 * the checks of all jobs so far. label: which of several jobs of one command, NULL: the only one. code: how the job
 * ended; returns that, or what is to be told besides. */
client_exit client_contract(client_session *s, const json_t *job, const char *label, client_exit code);

/* Prints JSON on one or many lines for a person or a program. */
client_exit client_print_json(client_session *s, const json_t *value);
/* "uzawa: MESSAGE" on s->err, with --json {"detail": MESSAGE, "exit": code}; returns `code`. */
client_exit client_complain(client_session *s, client_exit code, const char *message);

/* The commands. */
client_exit client_submit(client_session *s);
client_exit client_upload(client_session *s);
client_exit client_refine(client_session *s);
client_exit client_verify(client_session *s);
client_exit client_wait(client_session *s);
client_exit client_status(client_session *s);
client_exit client_list(client_session *s);
client_exit client_cancel(client_session *s);
client_exit client_result(client_session *s);
client_exit client_picture(client_session *s);
client_exit client_history(client_session *s);
client_exit client_plot(client_session *s);
client_exit client_delete(client_session *s);
client_exit client_factors(client_session *s);
client_exit client_doctor(client_session *s);

#endif
