/* wait.c: those who wait for a job to end, and the clock that they wait by. */
#include "work/internal.h"

#include <errno.h>
#include <string.h>
#include <time.h>

#define LOOK_AGAIN_S 2.0 /* work_wait asks the store at least this often */

/* ---- time */

double work_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void work_deadline(struct timespec *deadline, double seconds)
{
    double s = seconds > 0.0 ? seconds : 0.0; /* NaN: now */
    clock_gettime(CLOCK_MONOTONIC, deadline);
    s = s < 1e8 ? s : 1e8;
    time_t whole = (time_t)s;
    long nanoseconds = deadline->tv_nsec + (long)(1e9 * (s - (double)whole));
    deadline->tv_sec += whole + nanoseconds / 1000000000;
    deadline->tv_nsec = nanoseconds % 1000000000;
}

void work_init_condition(pthread_cond_t *condition)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(condition, &attributes);
    pthread_condattr_destroy(&attributes);
}

/* ---- waiters */

void work_notify(work *w, const char *id)
{
    pthread_mutex_lock(&w->lock);
    for (waiter *it = w->waiters; it; it = it->next)
        if (!id || strcmp(it->id, id) == 0) {
            it->look = true;
            pthread_cond_signal(&it->changed);
        }
    pthread_mutex_unlock(&w->lock);
}

static bool has_ended(work *w, const char *id)
{
    job j;
    store_status status = store_get(w->store, id, &j);
    bool ended =
        status == STORE_NOT_FOUND || (status == STORE_OK && j.status != JOB_ACCEPTED && j.status != JOB_RUNNING);
    job_clear(&j);
    return ended;
}

/* Waits until there is a reason to look at the job again; false: the time is over or the service stops. */
static bool wait_for_change(work *w, waiter *me, double until)
{
    struct timespec deadline;
    double left = until - work_clock();
    work_deadline(&deadline, left < LOOK_AGAIN_S ? left : LOOK_AGAIN_S);
    pthread_mutex_lock(&w->lock);
    while (!me->look && !w->stopping && pthread_cond_timedwait(&me->changed, &w->lock, &deadline) != ETIMEDOUT)
        continue;
    bool look = me->look || (!w->stopping && work_clock() < until);
    me->look = false;
    pthread_mutex_unlock(&w->lock);
    return look;
}

static void add_waiter(work *w, waiter *me)
{
    pthread_mutex_lock(&w->lock);
    me->next = w->waiters;
    w->waiters = me;
    pthread_mutex_unlock(&w->lock);
}

static void remove_waiter(work *w, waiter *me)
{
    pthread_mutex_lock(&w->lock);
    waiter **at = &w->waiters;
    while (*at != me)
        at = &(*at)->next;
    *at = me->next;
    pthread_mutex_unlock(&w->lock);
}

bool work_wait(work *w, const char *id, double seconds)
{
    waiter me = {.id = id};
    double until = work_clock() + seconds;
    work_init_condition(&me.changed);
    add_waiter(w, &me); /* before the first look, so that no end is missed */
    bool ended = has_ended(w, id);
    while (!ended && wait_for_change(w, &me, until))
        ended = has_ended(w, id);
    remove_waiter(w, &me);
    pthread_cond_destroy(&me.changed);
    return ended;
}
