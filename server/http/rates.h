/* rates.h: rates of clients with a token, over all daemons that share a store. */
#ifndef SERVER_HTTP_RATES_H
#define SERVER_HTTP_RATES_H

#include "http/rate.h"
#include "store/store.h"

typedef struct rates rates;
/* Exchanges them until rates_stop. NULL: there is one daemon, or no limit; or no thread, and each counts for itself. */
rates *rates_start(store *s, rate *of);
void rates_stop(rates *r); /* NULL is fine */

#endif
