/* follow.h: staying with a job until it has ended. */
#ifndef CLIENT_FOLLOW_H
#define CLIENT_FOLLOW_H

#include "commands/run.h"

/* Lets the server hold the request for whole seconds within the deadline, shorter while progress is shown. header: the
 * text of headers[1], which must live as long as the request. */
void client_hold(const client_session *s, client_request *request, const client_progress *progress, char header[40]);

/* Until *job, which may be NULL at first, has ended; *job is the newest state in any case. CLIENT_OK says that it has
 * ended, however. A timeout and an interrupt are told on s->err, with how to come back. */
client_exit client_follow(client_session *s, const char *id, json_t **job, client_watch *watch);
/* What the user sees of a job (NULL: nothing is known of it) after client_follow, which returned `waited`; the exit
 * code says how it ended. */
client_exit client_report_end(client_session *s, const json_t *job, client_exit waited);

#endif
