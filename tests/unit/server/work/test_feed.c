/* The feed of changes: what is told, to whom, and what is kept. */
#include "harness.h"
#include "work/feed.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* The number of the last change. */
static uint64_t last_of(feed *f)
{
    feed_change none;
    size_t count;
    uint64_t seen;
    CHECK(!feed_since(f, UINT64_MAX, &none, 0, &count, &seen) && count == 0);
    return seen;
}

TEST(changes_are_numbered_and_kept)
{
    feed *f = feed_new();
    feed_change got[8];
    size_t count;
    uint64_t seen;
    CHECK(last_of(f) == 0);
    CHECK(feed_since(f, 0, got, 8, &count, &seen) && count == 0 && seen == 0);
    CHECK(!feed_since(f, 1, got, 8, &count, &seen)); /* not told yet */
    feed_changed(f, "a", NULL);
    feed_changed(f, "b", NULL);
    feed_changed(f, "a", NULL);
    CHECK(last_of(f) == 3);
    CHECK(feed_since(f, 0, got, 8, &count, &seen) && count == 2 && seen == 3); /* the first of "a" is past */
    CHECK(got[0].number == 2 && strcmp(got[0].id, "b") == 0 && got[1].number == 3 && strcmp(got[1].id, "a") == 0);
    CHECK(feed_since(f, 0, got, 1, &count, &seen) && count == 1 && seen == 2);
    CHECK(feed_since(f, 2, got, 1, &count, &seen) && count == 1 && got[0].number == 3);
    feed_moved(f, "a");
    CHECK(last_of(f) == 3);
    feed_free(f);
}

TEST(old_changes_are_missed_not_forgotten)
{
    feed *f = feed_new();
    feed_change got[1];
    size_t count;
    uint64_t seen;
    char id[33];
    for (int i = 0; i < FEED_KEPT; i++) {
        snprintf(id, sizeof id, "%032x", (unsigned)i);
        feed_changed(f, id, NULL);
    }
    CHECK(feed_since(f, 0, got, 1, &count, &seen) && count == 1 && got[0].number == 1);
    feed_changed(f, "one more", NULL);
    CHECK(!feed_since(f, 0, got, 1, &count, &seen) && count == 0);
    CHECK(feed_since(f, 1, got, 1, &count, &seen) && got[0].number == 2);
    CHECK(!feed_since(f, UINT64_MAX, got, 1, &count, &seen));
    feed_free(f);
}

TEST(who_listens_is_woken)
{
    feed *f = feed_new();
    listener *a = feed_listen(f, "a"), *b = feed_listen(f, "b"), *all = feed_listen(f, NULL);
    CHECK(!feed_wait(a, -1, 0) && !feed_wait(all, -1, 0));
    feed_changed(f, "a", NULL);
    CHECK(feed_wait(a, -1, 60) && !feed_wait(b, -1, 0) && feed_wait(all, -1, 60));
    CHECK(!feed_wait(a, -1, 0)); /* once */
    feed_moved(f, "b");
    CHECK(feed_wait(b, -1, 60) && !feed_wait(a, -1, 0) && !feed_wait(all, -1, 0));
    feed_wake_all(f);
    CHECK(feed_wait(a, -1, 60) && feed_wait(b, -1, 60) && feed_wait(all, -1, 60));
    feed_unlisten(a);
    feed_changed(f, "a", NULL); /* nobody */
    feed_unlisten(all);
    feed_unlisten(b);
    feed_unlisten(NULL);
    feed_free(f);
    feed_free(NULL);
}

/* Who waits for the end is not woken by what is none, and learns of one that came before he listened. */
TEST(an_end_is_waited_for_without_looks_between)
{
    feed *f = feed_new();
    feed_changed(f, "a", NULL);
    const uint64_t since = feed_last(f);
    CHECK(since == 1);
    feed_goes_on(f, "a");
    listener *end = feed_listen_end(f, "a", since), *any = feed_listen(f, "a");
    feed_goes_on(f, "a");
    feed_moved(f, "a");
    CHECK(feed_wait(any, -1, 60) && !feed_wait(end, -1, 0));
    feed_changed(f, "a", NULL);
    CHECK(feed_wait(end, -1, 60) && !feed_wait(end, -1, 0));
    listener *late = feed_listen_end(f, "a", since), *none = feed_listen_end(f, "a", feed_last(f));
    CHECK(feed_wait(late, -1, 60) && !feed_wait(late, -1, 0) && !feed_wait(none, -1, 0));
    feed_wake_all(f);
    CHECK(feed_wait(none, -1, 60) && feed_wait(end, -1, 60));
    feed_unlisten(end);
    feed_unlisten(any);
    feed_unlisten(late);
    feed_unlisten(none);
    feed_free(f);
}

/* The wait ends when the client leaves, long before its time. */
TEST(a_client_that_leaves_ends_the_wait)
{
    feed *f = feed_new();
    listener *l = feed_listen(f, "a");
    int ends[2];
    CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    close(ends[1]);
    CHECK(!feed_wait(l, ends[0], 1e6));
    close(ends[0]);
    feed_unlisten(l);
    feed_free(f);
}

enum { TELLERS = 4, TOLD = 5000 };

static void *tell(void *ctx)
{
    for (int i = 0; i < TOLD; i++)
        feed_changed(ctx, i % 2 ? "odd" : "even", NULL);
    return NULL;
}

/* Whatever the interleaving, who waits and reads ends with the last number. */
TEST(nothing_is_missed_by_threads)
{
    feed *f = feed_new();
    listener *l = feed_listen(f, NULL);
    pthread_t tellers[TELLERS];
    feed_change got[16];
    size_t count;
    uint64_t seen = 0;
    int gaps = 0;
    for (int i = 0; i < TELLERS; i++)
        CHECK(pthread_create(&tellers[i], NULL, tell, f) == 0);
    while (seen < TELLERS * TOLD) {
        if (!feed_since(f, seen, got, 16, &count, &seen)) {
            gaps++;
        } else if (count == 0 && seen == last_of(f) && seen < TELLERS * TOLD) {
            CHECK(feed_wait(l, -1, 60));
        }
    }
    for (int i = 0; i < TELLERS; i++)
        pthread_join(tellers[i], NULL);
    CHECK(last_of(f) == TELLERS * TOLD && gaps <= TELLERS * TOLD / FEED_KEPT + 1);
    feed_unlisten(l);
    feed_free(f);
}
