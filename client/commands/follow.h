/* follow.h: staying with a job until it has ended. */
#ifndef CLIENT_FOLLOW_H
#define CLIENT_FOLLOW_H

#include "commands/run.h"

/* How long the next question may be held by the server: whole seconds within the deadline. */
double client_hold_seconds(const client_session *s, const client_progress *progress);
/* Lets the request be held for so long (header[1], in the buffer that must live as long). */
void client_hold(client_request *request, char *header, size_t size, double seconds);

/* Until *job, which may be NULL at first, has ended; *job is the newest state in any case. CLIENT_OK says that it has
 * ended, however. A timeout and an interrupt are told on s->err, with how to come back. */
client_exit client_follow(client_session *s, const char *id, json_t **job, client_watch *watch);
/* What the user sees of a job (NULL: nothing is known of it) after client_follow, which returned `waited`; the exit
 * code says how it ended. */
client_exit client_report_end(client_session *s, const json_t *job, client_exit waited);

#endif
