/* aside.c: threads that look for a part of a share for a moment, as the next one often follows at once, and sleep then.
 *
 * Which part is to be begun next is one number with the share that it is of, so that a thread takes it by one exchange,
 * and none that was late takes one of another share. Whoever asked takes parts too, until all are begun: a thread that
 * the system does not let run delays nothing but the part that it is in. */
#include "core/aside.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>

enum { LOOKS = 2000 }; /* some 50 microseconds */

/* One for the process, as are the settings of its threads. */
static struct {
    pthread_mutex_t mutex; /* guards the task, its state, and all waiting */
    pthread_cond_t waits, done, all_done;
    uz_aside_task *task;         /* that waits or runs */
    atomic_bool runs_task;       /* it runs */
    atomic_int threads, allowed; /* beside those who ask; with them */
    atomic_int asleep;           /* threads that wait for work */
    atomic_bool shared;          /* somebody has a share; what follows is his, then of who took a part */
    atomic_uint_fast64_t next;   /* number of the share, its parts, and the part to be begun: 32, 16 and 16 bits */
    atomic_int used;             /* threads that one had, at most, so far */
    atomic_int left;             /* parts that have not ended */
    atomic_bool owner_asleep;
    void (*run)(void *ctx, int part);
    void *ctx;
} aside = {.mutex = PTHREAD_MUTEX_INITIALIZER,
           .waits = PTHREAD_COND_INITIALIZER,
           .done = PTHREAD_COND_INITIALIZER,
           .all_done = PTHREAD_COND_INITIALIZER};

/* -------------------------------------------------------------------- parts */

static int parts_of(uint64_t next)
{
    return (int)(next >> 16 & 0xffff);
}

static int part_of(uint64_t next)
{
    return (int)(next & 0xffff);
}

static bool is_open(void)
{
    const uint64_t next = atomic_load(&aside.next);
    return part_of(next) < parts_of(next);
}

/* false: there was none. */
static bool take_part(void)
{
    uint64_t next = atomic_load_explicit(&aside.next, memory_order_relaxed);
    do {
        if (part_of(next) >= parts_of(next))
            return false;
    } while (!atomic_compare_exchange_weak(&aside.next, &next, next + 1));
    aside.run(aside.ctx, part_of(next)); /* nobody begins another share before this part has ended */
    if (atomic_fetch_sub(&aside.left, 1) == 1 && atomic_load(&aside.owner_asleep)) {
        pthread_mutex_lock(&aside.mutex);
        pthread_cond_signal(&aside.all_done);
        pthread_mutex_unlock(&aside.mutex);
    }
    return true;
}

/* Between two looks. */
static inline void pause_a_moment(void)
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static void wait_for_all(void)
{
    for (int look = 0; look < LOOKS; look++) {
        if (atomic_load(&aside.left) == 0)
            return;
        pause_a_moment();
    }
    pthread_mutex_lock(&aside.mutex);
    atomic_store(&aside.owner_asleep, true);
    while (atomic_load(&aside.left) > 0)
        pthread_cond_wait(&aside.all_done, &aside.mutex);
    atomic_store(&aside.owner_asleep, false);
    pthread_mutex_unlock(&aside.mutex);
}

void uz_aside_share(void (*run)(void *ctx, int part), void *ctx, int parts)
{
    const int count = uz_aside_count(), allowed = atomic_load(&aside.allowed),
              threads = allowed < count ? allowed : count,
              most = threads < parts ? threads : parts; /* one that has a task comes when that has ended */
    bool shared = false;
    if (most < 2 || !atomic_compare_exchange_strong(&aside.shared, &shared, true)) {
        for (int part = 0; part < parts; part++)
            run(ctx, part);
        return;
    }
    aside.run = run;
    aside.ctx = ctx;
    if (atomic_load(&aside.used) < most)
        atomic_store(&aside.used, most);
    atomic_store(&aside.left, parts);
    const uint64_t share = (atomic_load(&aside.next) >> 32) + 1;
    atomic_store(&aside.next, share << 32 | (uint64_t)parts << 16);
    if (atomic_load(&aside.asleep) > 0) {
        pthread_mutex_lock(&aside.mutex);
        for (int thread = 1; thread < most; thread++)
            pthread_cond_signal(&aside.waits);
        pthread_mutex_unlock(&aside.mutex);
    }
    while (take_part())
        ;
    wait_for_all();
    atomic_store(&aside.shared, false);
}

/* -------------------------------------------------------------------- tasks */

bool uz_aside_is_idle(void)
{
    pthread_mutex_lock(&aside.mutex);
    const bool idle = atomic_load(&aside.threads) > 0 && atomic_load(&aside.allowed) > 1 && !aside.task;
    pthread_mutex_unlock(&aside.mutex);
    return idle;
}

bool uz_aside_start(uz_aside_task *task)
{
    pthread_mutex_lock(&aside.mutex);
    const bool taken = atomic_load(&aside.threads) > 0 && atomic_load(&aside.allowed) > 1 && !aside.task;
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

static bool task_waits(void)
{
    return aside.task && aside.task->state == UZ_ASIDE_WAITS;
}

/* With the mutex, which others have meanwhile. */
static void run_task(void)
{
    uz_aside_task *task = aside.task;
    task->state = UZ_ASIDE_RUNS;
    atomic_store(&aside.runs_task, true);
    pthread_mutex_unlock(&aside.mutex);
    task->run(task->ctx);
    pthread_mutex_lock(&aside.mutex);
    atomic_store(&aside.runs_task, false);
    task->state = UZ_ASIDE_DONE;
    aside.task = NULL;
    pthread_cond_broadcast(&aside.done);
}

/* ------------------------------------------------------------------ threads */

static void *work(void *unused)
{
    for (;;) {
        for (int look = 0; look < LOOKS; look++) {
            if (take_part())
                look = 0;
            pause_a_moment();
        }
        pthread_mutex_lock(&aside.mutex);
        atomic_fetch_add(&aside.asleep, 1);
        while (!task_waits() && !is_open())
            pthread_cond_wait(&aside.waits, &aside.mutex);
        atomic_fetch_sub(&aside.asleep, 1);
        if (task_waits())
            run_task();
        pthread_mutex_unlock(&aside.mutex);
    }
    return unused;
}

int uz_aside_begin(int threads)
{
    pthread_t thread;
    pthread_mutex_lock(&aside.mutex);
    while (uz_aside_count() < threads && uz_aside_count() < UZ_ASIDE_MOST &&
           pthread_create(&thread, NULL, work, NULL) == 0) {
        atomic_fetch_add(&aside.threads, 1);
        pthread_setname_np(thread, "uzawad-aside");
        pthread_detach(thread);
    }
    const int begun = uz_aside_count();
    pthread_mutex_unlock(&aside.mutex);
    return begun;
}

void uz_aside_allow(int threads)
{
    atomic_store(&aside.allowed, threads);
}

int uz_aside_count(void)
{
    return atomic_load(&aside.threads) + 1;
}

int uz_aside_used(void)
{
    const int used = atomic_exchange(&aside.used, 1);
    return used > 1 ? used : 1;
}

int uz_aside_threads(void)
{
    const int idle = uz_aside_count() - atomic_load(&aside.runs_task), allowed = atomic_load(&aside.allowed);
    return idle < 2 || allowed < 2 ? 1 : allowed < idle ? allowed : idle;
}
