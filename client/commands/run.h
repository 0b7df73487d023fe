/* run.h: the commands, and what those share that wait for a job. */
#ifndef CLIENT_RUN_H
#define CLIENT_RUN_H

#include "session/session.h"

/* The cases of an ended job whose summary says that it has some, as a table on s->out; else nothing. */
client_exit client_show_cases(client_session *s, const json_t *job);

/* What --baseline and --junit ask for about a job that was waited for: prints the comparison, writes the report with
 * the checks of all jobs so far. label: which of several jobs of one command, NULL: the only one. code: how the job
 * ended; returns that, or what is to be told besides. */
client_exit client_contract(client_session *s, const json_t *job, const char *label, client_exit code);

/* The commands. */
client_exit client_submit(client_session *s);
client_exit client_import(client_session *s);
client_exit client_refine(client_session *s);
client_exit client_verify(client_session *s);
client_exit client_wait(client_session *s);
client_exit client_status(client_session *s);
client_exit client_list(client_session *s);
client_exit client_result(client_session *s);
client_exit client_path(client_session *s);
client_exit client_picture(client_session *s);
client_exit client_history(client_session *s);
client_exit client_plot(client_session *s);
client_exit client_report(client_session *s);
client_exit client_request_of(client_session *s);
client_exit client_delete(client_session *s);
client_exit client_factors(client_session *s);
client_exit client_nodes(client_session *s);
client_exit client_doctor(client_session *s);
client_exit client_mcp(client_session *s);

#endif
