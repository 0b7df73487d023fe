/* batch.h: changes that come while another one is under way are carried out together, for engines whose transactions
 * cost more than what they do. Whoever is first among those that wait carries out all of them. */
#ifndef SERVER_STORE_BATCH_H
#define SERVER_STORE_BATCH_H

#include <pthread.h>
#include <semaphore.h>
#include <stdbool.h>

#define BATCH_MOST 32 /* so that the first of them does not wait for ever */

/* A change that waits for its turn, the first member of an engine's own; on its caller's stack. */
typedef struct batch_change {
    struct batch_change *next;
    sem_t turn; /* posted once: it is done, or it is first in the queue with nobody at work */
    bool done;
} batch_change;

typedef struct {
    pthread_mutex_t lock; /* what follows; held by nobody while changes are carried out */
    batch_change *queue, **queue_end;
    bool leading;                               /* somebody carries out changes, or was told to */
    void (*run)(void *ctx, batch_change *list); /* 1 to BATCH_MOST of them, by one thread at a time */
    void *ctx;
} batch;

void batch_begin(batch *b, void (*run)(void *ctx, batch_change *list), void *ctx);
void batch_end(batch *b);
/* Returns when `me` was carried out. */
void batch_do(batch *b, batch_change *me);

#endif
