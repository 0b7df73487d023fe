/* Connections that wait without a thread, with sources and clients of our own. */
#include "harness.h"
#include "http/transport/deadlines.h"
#include "http/transport/held.h"
#include "http/transport/peer.h"

#include <netinet/in.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* Says `text` so many times when told, or by itself. */
typedef struct {
    feed *feed;
    listener *listener;
    size_t times, at;  /* of bytes all in all; said */
    atomic_bool is_on; /* may say something */
    double every_s;
    ptrdiff_t end;
    bool held;
    atomic_int freed;
} speaker;

typedef struct {
    atomic_int over, completed;
} result;

static ptrdiff_t speak(void *ctx, char *out, size_t size)
{
    speaker *s = ctx;
    if (!s->held)
        return REPLY_STREAM_BREAKS;
    if (!atomic_load(&s->is_on))
        return 0;
    if (s->at == s->times)
        return s->end;
    size_t n = s->times - s->at < size ? s->times - s->at : size;
    for (size_t i = 0; i < n; i++)
        out[i] = (char)('a' + (s->at + i) % 23);
    s->at += n;
    return (ptrdiff_t)n;
}

static double speak_due(void *ctx, bool told)
{
    const speaker *s = ctx;
    return told ? 0.0 : clock_seconds(CLOCK_MONOTONIC) + s->every_s;
}

static void speaker_end(void *ctx)
{
    speaker *s = ctx;
    feed_unlisten(s->listener);
    atomic_fetch_add(&s->freed, 1);
}

static void is_over(void *ctx, http_request *rq, bool completed)
{
    result *r = ctx;
    atomic_fetch_add(&r->completed, completed);
    atomic_fetch_add(&r->over, 1);
    free(rq);
}

static reply_source source_of(speaker *s)
{
    s->listener = feed_listen(s->feed, "job");
    s->every_s = s->every_s > 0.0 ? s->every_s : 60.0;
    return (reply_source){
        .read = speak, .free = speaker_end, .ctx = s, .listener = s->listener, .held = &s->held, .due = speak_due};
}

/* ends[0] is the client's. */
static bool take(holder *h, int ends[2], const char *head, bool chunked, speaker *s)
{
    int small = 4096;
    http_request *rq = calloc(1, sizeof *rq);
    reply_source source = source_of(s);
    if (!rq || socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0)
        return false;
    setsockopt(ends[1], SOL_SOCKET, SO_SNDBUF, &small, sizeof small);
    rq->fd = ends[1];
    bool taken = holder_take(h, ends[1], rq, head ? strdup(head) : NULL, chunked, &source);
    close(ends[1]); /* as libmicrohttpd does: the socket lives on */
    return taken;
}

/* Until the end; the length. */
static size_t read_all(int fd, char *out, size_t size)
{
    size_t len = 0;
    for (ssize_t n = 1; n > 0 && len<size; len += n> 0 ? (size_t)n : 0)
        n = read(fd, out + len, size - len);
    return len;
}

static void wait_for(atomic_int *number, int value)
{
    for (double end = clock_seconds(CLOCK_MONOTONIC) + 20;
         atomic_load(number) != value && clock_seconds(CLOCK_MONOTONIC) < end;)
        poll(NULL, 0, 5);
}

TEST(a_stream_comes_in_chunks)
{
    char got[200];
    int ends[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = 30, .end = REPLY_STREAM_ENDS};
    CHECK(take(h, ends, "HEAD\r\n\r\n", true, &s));
    CHECK(read(ends[0], got, 8) == 8 && memcmp(got, "HEAD\r\n\r\n", 8) == 0);
    CHECK(poll(&(struct pollfd){ends[0], POLLIN, 0}, 1, 50) == 0); /* nothing until it is told */
    atomic_store(&s.is_on, true);
    feed_changed(f, "another", NULL);
    CHECK(poll(&(struct pollfd){ends[0], POLLIN, 0}, 1, 50) == 0);
    feed_changed(f, "job", NULL);
    size_t len = read_all(ends[0], got, sizeof got);
    CHECK(len == 41 && memcmp(got, "1e\r\nabcdefghijklmnopqrstuvwabcdefg\r\n0\r\n\r\n", 41) == 0);
    CHECK(atomic_load(&r.over) == 0); /* until the client closes too */
    close(ends[0]);
    wait_for(&r.over, 1);
    CHECK(atomic_load(&r.completed) == 1 && atomic_load(&s.freed) == 1);
    holder_free(h);
    feed_free(f);
}

TEST(a_message_comes_as_it_is)
{
    char got[200];
    int ends[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = 100, .end = REPLY_STREAM_ENDS, .every_s = 0.02};
    CHECK(take(h, ends, NULL, false, &s));
    atomic_store(&s.is_on, true); /* it is asked again although nothing was told */
    CHECK(read_all(ends[0], got, sizeof got) == 100 && got[99] == 'a' + 99 % 23);
    CHECK(write(ends[0], "more", 4) == 4); /* what still comes is dropped */
    close(ends[0]);
    wait_for(&r.over, 1);
    CHECK(atomic_load(&r.completed) == 1);
    holder_free(h);
    feed_free(f);
}

TEST(a_broken_stream_has_no_end)
{
    char got[200];
    int ends[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = 5, .end = REPLY_STREAM_BREAKS, .is_on = true};
    CHECK(take(h, ends, "H", true, &s));
    size_t len = read_all(ends[0], got, sizeof got);
    CHECK(len == 11 && memcmp(got, "H5\r\nabcde\r\n", 11) == 0);
    wait_for(&r.over, 1);
    CHECK(atomic_load(&r.completed) == 0);
    close(ends[0]);
    holder_free(h);
    feed_free(f);
}

TEST(much_goes_through_a_narrow_socket)
{
    enum { MUCH = 1000000 };
    char *got = malloc(MUCH + 1);
    int ends[2], other[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = MUCH, .end = REPLY_STREAM_ENDS, .is_on = true};
    speaker beside = {.feed = f, .times = 7, .end = REPLY_STREAM_ENDS, .is_on = true};
    CHECK(take(h, ends, NULL, false, &s));
    CHECK(take(h, other, NULL, false, &beside)); /* is not kept waiting by one that does not read */
    CHECK(read_all(other[0], got, 100) == 7);
    CHECK(read_all(ends[0], got, MUCH + 1) == MUCH);
    size_t wrong = 0;
    for (size_t i = 0; i < MUCH; i++)
        wrong += got[i] != (char)('a' + i % 23);
    CHECK(wrong == 0);
    close(ends[0]);
    close(other[0]);
    wait_for(&r.over, 2);
    CHECK(atomic_load(&r.completed) == 2);
    holder_free(h);
    feed_free(f);
    free(got);
}

TEST(who_does_not_read_is_left)
{
    int ends[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(0.1, is_over, &r);
    speaker s = {.feed = f, .times = 10000000, .end = REPLY_STREAM_ENDS, .is_on = true};
    CHECK(take(h, ends, NULL, true, &s));
    wait_for(&r.over, 1);
    CHECK(atomic_load(&r.over) == 1 && atomic_load(&r.completed) == 0 && s.at < s.times);
    close(ends[0]);
    holder_free(h);
    feed_free(f);
}

TEST(a_client_that_leaves_is_seen)
{
    int ends[2], half[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = 5}, two = {.feed = f, .times = 5};
    CHECK(take(h, ends, "H", true, &s) && take(h, half, "H", true, &two));
    close(ends[0]);
    shutdown(half[0], SHUT_WR);
    wait_for(&r.over, 2);
    CHECK(atomic_load(&r.over) == 2 && atomic_load(&r.completed) == 0);
    CHECK(atomic_load(&s.freed) == 1 && atomic_load(&two.freed) == 1);
    feed_changed(f, "job", NULL); /* nobody listens any more */
    close(half[0]);
    holder_free(h);
    feed_free(f);
}

TEST(the_end_says_what_is_left)
{
    char got[200];
    int ends[2], silent[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f, .times = 5, .end = REPLY_STREAM_ENDS}, none = {.feed = f, .times = 5};
    CHECK(take(h, ends, NULL, true, &s) && take(h, silent, NULL, true, &none));
    poll(NULL, 0, 20);
    atomic_store(&s.is_on, true);
    holder_free(h);
    CHECK(atomic_load(&r.over) == 2 && atomic_load(&r.completed) == 1);
    CHECK(read_all(ends[0], got, sizeof got) == 15 && memcmp(got, "5\r\nabcde\r\n0\r\n\r\n", 15) == 0);
    CHECK(read_all(silent[0], got, sizeof got) == 0);
    close(ends[0]);
    close(silent[0]);
    feed_free(f);
    holder_free(NULL);
}

TEST(what_cannot_be_taken_is_left)
{
    int ends[2];
    result r = {0};
    feed *f = feed_new();
    holder *h = holder_new(5.0, is_over, &r);
    speaker s = {.feed = f};
    reply_source source = source_of(&s);
    http_request rq = {.fd = -1};
    CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    CHECK(!holder_take(h, -1, &rq, NULL, false, &source)); /* no socket */
    CHECK(rq.fd == -1 && !s.held && atomic_load(&s.freed) == 0);
    feed_unlisten(s.listener);
    close(ends[0]);
    close(ends[1]);
    holder_free(h);
    CHECK(atomic_load(&r.over) == 0);
    feed_free(f);
}

TEST(connections_are_counted_by_address)
{
    peers room = {.lock = PTHREAD_MUTEX_INITIALIZER}, *all = &room;
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(0x7f000001)}, .sin_port = 1}, b = a;
    struct sockaddr_in6 six = {.sin6_family = AF_INET6};
    struct sockaddr unknown = {.sa_family = AF_UNIX};
    a.sin_port = 2; /* does not matter */
    b.sin_addr.s_addr = htonl(0x7f000002);
    peer *p[5] = {
        peer_begin(all, (struct sockaddr *)&a),
        peer_begin(all, (struct sockaddr *)&b),
        peer_begin(all, (struct sockaddr *)&a),
        peer_begin(all, (struct sockaddr *)&six),
        peer_begin(all, NULL),
    };
    CHECK(peers_count(all, NULL) == 5 && peers_count(all, (struct sockaddr *)&a) == 2);
    CHECK(peers_count(all, (struct sockaddr *)&b) == 1 && peers_count(all, (struct sockaddr *)&six) == 1);
    CHECK(peers_count(all, &unknown) == 0);
    peer_end(p[2]);
    CHECK(peers_count(all, NULL) == 4 && peers_count(all, (struct sockaddr *)&a) == 1);
    peer_end(p[0]);
    peer_end(p[4]);
    CHECK(peers_count(all, (struct sockaddr *)&a) == 0 && peers_count(all, (struct sockaddr *)&b) == 1);
    peer_end(p[1]);
    peer_end(p[3]);
    peer_end(NULL);
    CHECK(peers_count(all, NULL) == 0);
    struct sockaddr_in6 near = six, far = six, mapped = six;
    near.sin6_addr.s6_addr[15] = 9; /* one client has all of a network of 64 bits */
    far.sin6_addr.s6_addr[7] = 1;
    memcpy(mapped.sin6_addr.s6_addr, "\0\0\0\0\0\0\0\0\0\0\xff\xff\x7f\0\0\1", 16);
    p[0] = peer_begin(all, (struct sockaddr *)&six);
    p[1] = peer_begin(all, (struct sockaddr *)&a);
    CHECK(peers_count(all, (struct sockaddr *)&near) == 1 && peers_count(all, (struct sockaddr *)&far) == 0);
    CHECK(peers_count(all, (struct sockaddr *)&mapped) == 1);
    peer_end(p[0]);
    peer_end(p[1]);
}
