/* webhooks.h: whom to tell of the end of which job. What is due stands in the store from the transaction that ends the
 * job until somebody was told, so that no crash forgets it; a crash in between may tell twice. */
#ifndef SERVER_STORE_WEBHOOKS_H
#define SERVER_STORE_WEBHOOKS_H

#include "store/store.h"

typedef struct {
    char job[33];
    char *url;    /* freed by the caller */
    int attempts; /* made yet */
} webhook_due;

/* The one that has been due for longest, STORE_NOT_FOUND: none is. */
store_status store_webhook_next(store *s, webhook_due *out);

typedef enum { WEBHOOK_TOLD = 2, WEBHOOK_GIVEN_UP = 3, WEBHOOK_AGAIN = 1 } webhook_end;
/* Is there anybody to be told, now or later? */
store_status store_webhooks_open(store *s, bool *any);
/* All that is due at this address waits for delay_s: nobody answers there. */
store_status store_webhook_postpone(store *s, const char *url, double delay_s);
/* How an attempt ended; again: not before delay_s are over. */
store_status store_webhook_attempted(store *s, const char *id, webhook_end end, double delay_s);

#endif
