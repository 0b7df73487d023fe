/* rate.h: how often each client may ask: a token bucket for each of the clients seen last. Room is fixed: where it is
 * short, the client that was quiet longest is forgotten, and begins with a full bucket when it comes again. */
#ifndef SERVER_HTTP_RATE_H
#define SERVER_HTTP_RATE_H

#include <stddef.h>

typedef struct rate rate;
/* `per_s` requests per second and twice as many at once. NULL: no memory. */
rate *rate_new(int per_s);
void rate_free(rate *r); /* NULL is fine */

/* One request of the client key[0..len) at time `now`, seconds: 0 if it may go on, else seconds until one may. */
double rate_take(rate *r, const void *key, size_t len, double now);

#endif
