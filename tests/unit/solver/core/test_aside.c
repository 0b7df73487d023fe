/* The further threads of a process: tasks run once or never, and every part of a share once, whoever computes. */
#include "core/aside.h"
#include "harness.h"

#include <pthread.h>
#include <stdatomic.h>

typedef struct {
    pthread_t by;
    int count;
    pthread_mutex_t *gate; /* NULL: none */
} note;

static void take_note(void *ctx)
{
    note *n = ctx;
    if (n->gate) {
        pthread_mutex_lock(n->gate);
        pthread_mutex_unlock(n->gate);
    }
    n->by = pthread_self();
    n->count++;
}

TEST(a_task_runs_once_on_the_other_thread_or_never)
{
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
    note first = {.gate = &gate}, second = {.count = 0};
    uz_aside_task a = {.run = take_note, .ctx = &first}, b = {.run = take_note, .ctx = &second};
    CHECK(!uz_aside_start(&a) && !uz_aside_finish(&a)); /* there is no such thread */
    CHECK_INT(uz_aside_begin(2), 2);
    CHECK_INT(uz_aside_begin(2), 2);
    CHECK_INT(uz_aside_threads(), 1);
    CHECK(!uz_aside_start(&a) && !uz_aside_finish(&a)); /* it is not allowed */
    uz_aside_allow(2);
    pthread_mutex_lock(&gate);
    CHECK(uz_aside_is_idle() && uz_aside_start(&a));
    CHECK(!uz_aside_is_idle() && !uz_aside_start(&b) && !uz_aside_finish(&b));
    pthread_mutex_unlock(&gate);
    const bool ran = uz_aside_finish(&a);
    CHECK(first.count == ran && second.count == 0 && uz_aside_finish(&a) == ran);
    CHECK(!ran || !pthread_equal(first.by, pthread_self()));
    int runs = 0;
    for (int k = 0; k < 2000; k++) { /* some are taken back before they are begun */
        CHECK(uz_aside_start(&b));
        runs += uz_aside_finish(&b);
        CHECK(second.count == runs);
    }
    uz_aside_allow(1);
    CHECK(!uz_aside_is_idle() && !uz_aside_start(&b));
}

typedef struct {
    atomic_bool runs, may_end, alone;
    atomic_int begun;
} busy;

static void wait_in_task(void *ctx)
{
    busy *b = ctx;
    atomic_store(&b->runs, true);
    while (!atomic_load(&b->may_end))
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
}

static void wait_for_other(void *ctx, int part)
{
    busy *b = ctx;
    (void)part;
    atomic_fetch_add(&b->begun, 1);
    atomic_store(&b->may_end, true);
    for (int k = 0; k < 60000 && atomic_load(&b->begun) < 2; k++)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    if (atomic_load(&b->begun) < 2)
        atomic_store(&b->alone, true);
}

TEST(a_thread_that_has_a_task_comes_when_that_has_ended)
{
    busy b = {.begun = 0};
    uz_aside_task task = {.run = wait_in_task, .ctx = &b};
    CHECK_INT(uz_aside_begin(2), 2); /* no third one takes the part */
    uz_aside_allow(2);
    CHECK(uz_aside_start(&task));
    while (!atomic_load(&b.runs))
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    uz_aside_share(wait_for_other, &b, 2);
    CHECK(atomic_load(&b.begun) == 2 && !atomic_load(&b.alone));
    CHECK(uz_aside_finish(&task));
    uz_aside_allow(1);
}

enum { PARTS = 4, SHARES = 20000 };

typedef struct {
    pthread_t owner;
    int runs[PARTS];
    atomic_int elsewhere;
    bool within; /* it shares out what it does, too */
} shared;

static void count_within(void *ctx, int part)
{
    (void)part;
    (*(int *)ctx)++; /* one after the other: there is one share at a time */
}

static void count_part(void *ctx, int part)
{
    shared *s = ctx;
    int within = 0;
    if (s->within)
        uz_aside_share(count_within, &within, PARTS);
    s->runs[part] += s->within ? within / PARTS : 1;
    if (!pthread_equal(pthread_self(), s->owner))
        atomic_fetch_add(&s->elsewhere, 1);
}

TEST(every_part_of_a_share_runs_once)
{
    shared s = {.owner = pthread_self()};
    CHECK_INT(uz_aside_begin(3), 3);
    CHECK_INT(uz_aside_count(), 3);
    for (int allowed = 0; allowed < 5; allowed++) {
        uz_aside_allow(allowed);
        CHECK_INT(uz_aside_threads(), allowed < 2 ? 1 : allowed < 3 ? allowed : 3);
        for (int k = 0; k < SHARES; k++) {
            s.within = k % 3 == 0;
            uz_aside_share(count_part, &s, PARTS);
            if (k % 1000 == 0) /* long enough that they sleep */
                nanosleep(&(struct timespec){.tv_nsec = 300000}, NULL);
            for (int part = 0; part < PARTS; part++)
                CHECK_INT(s.runs[part], allowed * SHARES + k + 1);
        }
        CHECK(allowed > 1 || atomic_load(&s.elsewhere) == 0);
    }
    uz_aside_allow(1);
}

typedef struct {
    atomic_int begun;
    atomic_bool alone; /* for a minute, in a part that ends when all have begun */
} meeting;

static void meet(void *ctx, int part)
{
    meeting *m = ctx;
    (void)part;
    atomic_fetch_add(&m->begun, 1);
    for (int k = 0; k < 60000 && atomic_load(&m->begun) < 3; k++)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    if (atomic_load(&m->begun) < 3)
        atomic_store(&m->alone, true);
}

TEST(parts_run_beside_each_other)
{
    CHECK_INT(uz_aside_begin(3), 3);
    uz_aside_allow(3);
    for (int k = 0; k < 10; k++) {
        meeting m = {.alone = false};
        uz_aside_share(meet, &m, 3);
        CHECK(atomic_load(&m.begun) == 3 && !atomic_load(&m.alone));
    }
    uz_aside_allow(1);
}

static void *share_often(void *ctx)
{
    shared *s = ctx;
    s->owner = pthread_self();
    for (int k = 0; k < SHARES; k++)
        uz_aside_share(count_part, s, PARTS);
    return NULL;
}

TEST(several_who_share_do_not_meet)
{
    enum { OWNERS = 3 };
    shared s[OWNERS] = {{.within = false}};
    pthread_t thread[OWNERS];
    CHECK_INT(uz_aside_begin(2), uz_aside_count());
    uz_aside_allow(2);
    for (int k = 0; k < OWNERS; k++)
        CHECK_INT(pthread_create(&thread[k], NULL, share_often, &s[k]), 0);
    for (int k = 0; k < OWNERS; k++)
        pthread_join(thread[k], NULL);
    for (int k = 0; k < OWNERS; k++)
        for (int part = 0; part < PARTS; part++)
            CHECK_INT(s[k].runs[part], SHARES);
    uz_aside_allow(1);
}
