/* webhook.h: tells the outside that a job has ended: POSTs it to the address that its request names, if that is one of
 * those that the service may call.
 *
 * The body is the job as GET /v1/jobs/{id} gives it. With a secret there is a header field
 *   X-Uzawa-Signature: t=UNIX_SECONDS,v1=HEX
 * where HEX is the HMAC-SHA256 (RFC 2104) of "UNIX_SECONDS.BODY" under the secret: the receiver computes it too,
 * compares, and refuses a time that is long ago. X-Uzawa-Delivery is the job's id and the number of the attempt: a
 * receiver may be told more than once. Any status 2xx ends it; 410 too; everything else is tried again, later each
 * time. */
#ifndef SERVER_WORK_WEBHOOK_H
#define SERVER_WORK_WEBHOOK_H

#include "base/log.h"
#include "base/metrics.h"
#include "store/store.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct webhooks webhooks;

typedef struct {
    const char *const *allow; /* n_allow of "HOST" (the scheme's own port) or "HOST:PORT"; 0: there are no webhooks */
    size_t n_allow;
    char *secret; /* secret_len bytes; NULL: nothing is signed */
    size_t secret_len;
    metrics *metrics;     /* may be NULL */
    double first_retry_s; /* doubled after each attempt, up to an hour; 0: 5 s */
} webhook_options;

/* The secret of a file: its bytes, without a line end at the end. False: message. */
bool webhook_read_secret(webhook_options *out, const char *path, char *message, size_t size);
void webhook_forget_secret(webhook_options *options); /* {.secret = NULL} is fine */

/* Starts the threads where there is something to allow, or to give up. NULL: message. What options point to must
 * outlive it. */
webhooks *webhooks_start(store *s, const webhook_options *options, server_log *log, char *message, size_t size);
/* Cuts off what is on its way; it is told again after the next start. NULL is fine. */
void webhooks_stop(webhooks *all);

/* False, and why for a person, if the address may not be called. */
bool webhooks_allow(const webhooks *all, const char *url, const char **why);

#endif
