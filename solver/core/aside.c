#include "core/aside.h"

#include <pthread.h>

/* One for the process, as are the settings of its threads. */
static struct {
    pthread_mutex_t mutex; /* guards the rest, and the state of the task */
    pthread_cond_t waits, done;
    uz_aside_task *task; /* that waits or runs */
    bool begun, allowed;
} aside = {.mutex = PTHREAD_MUTEX_INITIALIZER, .waits = PTHREAD_COND_INITIALIZER, .done = PTHREAD_COND_INITIALIZER};

static void *work(void *unused)
{
    pthread_mutex_lock(&aside.mutex);
    for (;;) {
        uz_aside_task *task = aside.task;
        if (!task) {
            pthread_cond_wait(&aside.waits, &aside.mutex);
            continue;
        }
        task->state = UZ_ASIDE_RUNS;
        pthread_mutex_unlock(&aside.mutex);
        task->run(task->ctx);
        pthread_mutex_lock(&aside.mutex);
        task->state = UZ_ASIDE_DONE;
        aside.task = NULL;
        pthread_cond_broadcast(&aside.done);
    }
    return unused;
}

bool uz_aside_begin(void)
{
    pthread_t thread;
    pthread_mutex_lock(&aside.mutex);
    if (!aside.begun && pthread_create(&thread, NULL, work, NULL) == 0) {
        aside.begun = true;
        pthread_setname_np(thread, "uzawad-aside");
        pthread_detach(thread);
    }
    const bool begun = aside.begun;
    pthread_mutex_unlock(&aside.mutex);
    return begun;
}

void uz_aside_allow(bool allowed)
{
    pthread_mutex_lock(&aside.mutex);
    aside.allowed = allowed;
    pthread_mutex_unlock(&aside.mutex);
}

bool uz_aside_is_idle(void)
{
    pthread_mutex_lock(&aside.mutex);
    const bool idle = aside.begun && aside.allowed && !aside.task;
    pthread_mutex_unlock(&aside.mutex);
    return idle;
}

bool uz_aside_start(uz_aside_task *task)
{
    pthread_mutex_lock(&aside.mutex);
    const bool taken = aside.begun && aside.allowed && !aside.task;
    task->state = taken ? UZ_ASIDE_WAITS : UZ_ASIDE_NEVER;
    if (taken) {
        aside.task = task;
        pthread_cond_signal(&aside.waits);
    }
    pthread_mutex_unlock(&aside.mutex);
    return taken;
}

bool uz_aside_finish(uz_aside_task *task)
{
    pthread_mutex_lock(&aside.mutex);
    if (task->state == UZ_ASIDE_WAITS) {
        aside.task = NULL;
        task->state = UZ_ASIDE_NEVER;
    }
    while (task->state == UZ_ASIDE_RUNS)
        pthread_cond_wait(&aside.done, &aside.mutex);
    const bool done = task->state == UZ_ASIDE_DONE;
    pthread_mutex_unlock(&aside.mutex);
    return done;
}
