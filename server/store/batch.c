#include "store/batch.h"

void batch_begin(batch *b, void (*run)(void *ctx, batch_change *list), void *ctx)
{
    *b = (batch){.run = run, .ctx = ctx};
    b->queue_end = &b->queue;
    pthread_mutex_init(&b->lock, NULL);
}

void batch_end(batch *b)
{
    pthread_mutex_destroy(&b->lock);
}

/* Under the lock, which it gives up meanwhile: carries out the first ones of the queue, which begins with the caller's
 * own. */
static void lead(batch *b)
{
    batch_change *list = b->queue, *last = list, *next;
    for (int n = 1; n < BATCH_MOST && last->next; n++)
        last = last->next;
    b->queue = last->next;
    if (!b->queue)
        b->queue_end = &b->queue;
    last->next = NULL;
    b->leading = true;
    pthread_mutex_unlock(&b->lock);
    b->run(b->ctx, list);
    pthread_mutex_lock(&b->lock);
    b->leading = false;
    for (; list; list = next) {
        next = list->next; /* its owner may go as soon as it is done */
        list->done = true;
        pthread_cond_signal(&list->turn);
    }
    if (b->queue)
        pthread_cond_signal(&b->queue->turn);
}

void batch_do(batch *b, batch_change *me)
{
    me->next = NULL;
    me->done = false;
    pthread_cond_init(&me->turn, NULL);
    pthread_mutex_lock(&b->lock);
    *b->queue_end = me;
    b->queue_end = &me->next;
    while (!me->done) {
        if (!b->leading && b->queue == me)
            lead(b);
        else
            pthread_cond_wait(&me->turn, &b->lock);
    }
    pthread_mutex_unlock(&b->lock);
    pthread_cond_destroy(&me->turn);
}
