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

/* The first ones of the queue, which begins with the caller's own. */
static batch_change *take_list(batch *b)
{
    pthread_mutex_lock(&b->lock);
    batch_change *list = b->queue, *last = list;
    for (int n = 1; n < BATCH_MOST && last->next; n++)
        last = last->next;
    b->queue = last->next;
    if (!b->queue)
        b->queue_end = &b->queue;
    last->next = NULL;
    pthread_mutex_unlock(&b->lock);
    return list;
}

/* Who is first among those that came meanwhile goes on. */
static void hand_over(batch *b)
{
    pthread_mutex_lock(&b->lock);
    batch_change *next = b->queue;
    b->leading = next != NULL;
    pthread_mutex_unlock(&b->lock);
    if (next)
        sem_post(&next->turn);
}

/* Each owner sleeps on a semaphore of its own and takes no lock when it is woken: thirty that wake for one lock would
 * stop each other as often. */
static void lead(batch *b, batch_change *me)
{
    batch_change *list = take_list(b), *next;
    b->run(b->ctx, list);
    hand_over(b);
    for (; list; list = next) {
        next = list->next; /* its owner may go as soon as it is done */
        if (list == me)
            continue;
        list->done = true;
        sem_post(&list->turn);
    }
}

void batch_do(batch *b, batch_change *me)
{
    me->next = NULL;
    me->done = false;
    sem_init(&me->turn, 0, 0);
    pthread_mutex_lock(&b->lock);
    *b->queue_end = me;
    b->queue_end = &me->next;
    const bool first = !b->leading;
    b->leading = true;
    pthread_mutex_unlock(&b->lock);
    while (!first && sem_wait(&me->turn) != 0)
        ; /* a signal's handler ran */
    if (!me->done)
        lead(b, me);
    sem_destroy(&me->turn);
}
