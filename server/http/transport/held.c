/* held.c: one thread for all connections that wait. */
#include "http/transport/held.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#define PIECE    16384 /* bytes that a source is asked for at once */
#define CHUNK    16    /* room for a chunk's length and line ends */
#define PIECES   16    /* of one connection in a row */
#define LINGER_S 2.0   /* for the client to read the end: closing a socket with unread bytes resets the connection */
#define EVENTS   64

typedef struct held {
    struct held *previous, *next, *next_ready;
    http_request *rq;
    reply_source source;
    listener *listener;
    int fd;
    char *out; /* what the socket has not taken yet, from `at` to len */
    size_t at, len;
    double due; /* on CLOCK_MONOTONIC: when it must be served, whatever happens */
    uint32_t watched;
    bool chunked, last, ending, over, is_ready;
    /* last: nothing follows `out`; ending: all was sent, the client closes */
} held;

struct holder {
    double patience_s;
    holder_over tell;
    void *ctx;
    pthread_t thread;
    int epoll, wake;
    pthread_mutex_t lock; /* the next two */
    held *arriving;
    bool stop;
    /* The thread's own. */
    held *first, *ready, *buried;
    double soonest; /* no due is earlier */
    char buffer[PIECE + CHUNK];
};

/* ---- what is watched */

/* A pointer's lowest bit tells the listener's descriptor from the socket. */
static bool watch(const holder *h, int operation, int fd, uint32_t events, const held *one, bool is_listener)
{
    struct epoll_event e = {.events = events, .data.u64 = (uintptr_t)one | (is_listener ? 1 : 0)};
    return epoll_ctl(h->epoll, operation, fd, &e) == 0;
}

static void watch_socket(const holder *h, held *one)
{
    uint32_t events = EPOLLRDHUP | (one->ending ? EPOLLIN : one->out ? EPOLLOUT : 0u);
    if (events != one->watched)
        watch(h, EPOLL_CTL_MOD, one->fd, events, one, false);
    one->watched = events;
}

/* ---- the end of one */

/* Events of the same round may still name it: freed after them. */
static void end_held(holder *h, held *one, bool completed)
{
    if (one->previous)
        one->previous->next = one->next;
    else
        h->first = one->next;
    if (one->next)
        one->next->previous = one->previous;
    epoll_ctl(h->epoll, EPOLL_CTL_DEL, one->fd, NULL);
    epoll_ctl(h->epoll, EPOLL_CTL_DEL, feed_descriptor(one->listener), NULL);
    one->over = true;
    one->source.free(one->source.ctx);
    free(one->out);
    close(one->fd);
    h->tell(h->ctx, one->rq, completed);
    one->next = h->buried;
    h->buried = one;
}

static void free_buried(holder *h)
{
    for (held *one = h->buried, *next; one; one = next) {
        next = one->next;
        free(one);
    }
    h->buried = NULL;
}

/* ---- sending */

/* Sends what it can of these bytes and keeps the rest. False: the connection is broken, or there is no memory. */
static bool send_some(held *one, const char *data, size_t len)
{
    ssize_t n = send(one->fd, data, len, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0 && errno != EAGAIN && errno != EINTR)
        return false;
    size_t sent = n > 0 ? (size_t)n : 0;
    if (sent == len)
        return true;
    one->out = malloc(len - sent);
    if (!one->out)
        return false;
    memcpy(one->out, data + sent, len - sent);
    one->at = 0;
    one->len = len - sent;
    return true;
}

/* What was kept. False as above. */
static bool flush(const holder *h, held *one)
{
    ssize_t n = one->out ? send(one->fd, one->out + one->at, one->len - one->at, MSG_NOSIGNAL | MSG_DONTWAIT) : 0;
    if (n < 0)
        return (errno == EAGAIN || errno == EINTR) && clock_seconds(CLOCK_MONOTONIC) < one->due;
    one->at += (size_t)n;
    if (n > 0)
        one->due = clock_seconds(CLOCK_MONOTONIC) + h->patience_s;
    if (one->at == one->len) {
        free(one->out);
        one->out = NULL;
        one->at = one->len = 0;
    }
    return true;
}

/* Asks the source once, for a piece with room before and after it in the buffer. False: the connection is broken. */
static bool say(holder *h, held *one, bool *more)
{
    char *piece = h->buffer + CHUNK - 2, size[CHUNK];
    const ptrdiff_t n = one->source.read(one->source.ctx, piece, PIECE);
    *more = n > 0;
    if (n > 0 && one->chunked) {
        const int digits = snprintf(size, sizeof size, "%zx\r\n", (size_t)n);
        memcpy(piece - digits, size, (size_t)digits);
        memcpy(piece + n, "\r\n", 2);
        return send_some(one, piece - digits, (size_t)digits + (size_t)n + 2);
    }
    if (n > 0)
        return send_some(one, piece, (size_t)n);
    if (n == 0) {
        one->due = one->source.due(one->source.ctx, false);
        return true;
    }
    one->last = true;
    return n == REPLY_STREAM_ENDS && (!one->chunked || send_some(one, "0\r\n\r\n", 5));
}

/* Does what can be done now. False: it is over. */
static bool serve(holder *h, held *one)
{
    bool more = true;
    if (one->ending) {
        /* Drops what still comes, some of it at a time: who sends without end keeps nobody else waiting. It is over
         * when the client has closed too, or had its time. */
        ssize_t n = 1;
        for (int i = 0; n > 0 && i < PIECES; i++)
            n = recv(one->fd, h->buffer, PIECE, MSG_DONTWAIT);
        const bool open = n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR));
        return open && clock_seconds(CLOCK_MONOTONIC) < one->due;
    }
    bool waits = !one->out && !one->last && clock_seconds(CLOCK_MONOTONIC) < one->due;
    for (int i = 0; !waits && more && !one->last && i < PIECES; i++) {
        if (!flush(h, one))
            return false;
        if (one->out)
            break;
        if (!say(h, one, &more))
            return false;
        if (one->out)
            one->due = clock_seconds(CLOCK_MONOTONIC) + h->patience_s;
    }
    if (!flush(h, one))
        return false;
    if (one->last && !one->out) {
        one->ending = true;
        one->due = clock_seconds(CLOCK_MONOTONIC) + LINGER_S;
        shutdown(one->fd, SHUT_WR);
    } else if (more && !waits && !one->out)
        one->due = 0.0; /* it has more to say, after the others */
    watch_socket(h, one);
    h->soonest = fmin(h->soonest, one->due);
    return true;
}

/* ---- the thread */

static void make_ready(holder *h, held *one)
{
    if (one->is_ready)
        return;
    one->is_ready = true;
    one->next_ready = h->ready;
    h->ready = one;
}

/* False: the thread is to end. */
static bool receive(holder *h)
{
    pthread_mutex_lock(&h->lock);
    held *one = h->arriving;
    bool stop = h->stop;
    h->arriving = NULL;
    pthread_mutex_unlock(&h->lock);
    for (held *next; one; one = next) {
        next = one->next;
        one->previous = NULL;
        one->next = h->first;
        if (one->next)
            one->next->previous = one;
        h->first = one;
        watch(h, EPOLL_CTL_MOD, feed_descriptor(one->listener), EPOLLIN, one, true);
        watch_socket(h, one);
        make_ready(h, one);
    }
    return !stop;
}

static void *hold(void *argument)
{
    holder *h = argument;
    struct epoll_event events[EVENTS];
    while (receive(h)) {
        held *one = h->ready;
        h->ready = NULL;
        for (held *next; one; one = next) {
            next = one->next_ready;
            one->is_ready = false;
            if (!one->over && !serve(h, one))
                end_held(h, one, one->ending);
        }
        const double now = clock_seconds(CLOCK_MONOTONIC);
        const bool due = now >= h->soonest;
        if (due)
            h->soonest = INFINITY;
        for (held *next, *at = due ? h->first : NULL; at; at = next) {
            next = at->next;
            if (at->due <= now && !at->over && !serve(h, at))
                end_held(h, at, at->ending);
            if (!at->over)
                h->soonest = fmin(h->soonest, at->due);
        }
        free_buried(h);
        const double left = h->soonest - clock_seconds(CLOCK_MONOTONIC);
        int n = epoll_wait(h->epoll, events, EVENTS, left <= 0.0 ? 0 : (int)fmin(ceil(left * 1e3), 1e6));
        for (int i = 0; i < n; i++) {
            const uint64_t of = events[i].data.u64;
            held *at = (held *)(uintptr_t)(of & ~(uint64_t)1); /* NOLINT(performance-no-int-to-ptr) */
            eventfd_t unused;
            if (!at)
                eventfd_read(h->wake, &unused);
            if (!at || at->over)
                continue;
            if (of & 1) {
                feed_wait(at->listener, -1, 0.0);
                if (!at->out && !at->last)
                    at->due = fmin(at->due, at->source.due(at->source.ctx, true));
            } else if (!at->ending && (events[i].events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR))) {
                end_held(h, at, false);
                continue;
            }
            make_ready(h, at);
        }
    }
    while (h->first) {
        held *one = h->first;
        one->due = 0.0;
        bool alive = one->out || one->ending || serve(h, one);
        end_held(h, one, alive && one->ending);
    }
    free_buried(h);
    return NULL;
}

/* ---- from other threads */

holder *holder_new(double patience_s, holder_over over, void *ctx)
{
    holder *h = calloc(1, sizeof *h);
    if (!h)
        return NULL;
    h->patience_s = patience_s;
    h->tell = over;
    h->ctx = ctx;
    h->soonest = INFINITY;
    h->epoll = epoll_create1(EPOLL_CLOEXEC);
    h->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    pthread_mutex_init(&h->lock, NULL);
    if (h->epoll >= 0 && h->wake >= 0 && watch(h, EPOLL_CTL_ADD, h->wake, EPOLLIN, NULL, false) &&
        pthread_create(&h->thread, NULL, hold, h) == 0)
        return h;
    if (h->epoll >= 0)
        close(h->epoll);
    if (h->wake >= 0)
        close(h->wake);
    pthread_mutex_destroy(&h->lock);
    free(h);
    return NULL;
}

void holder_free(holder *h)
{
    if (!h)
        return;
    pthread_mutex_lock(&h->lock);
    h->stop = true;
    pthread_mutex_unlock(&h->lock);
    eventfd_write(h->wake, 1);
    pthread_join(h->thread, NULL);
    close(h->epoll);
    close(h->wake);
    pthread_mutex_destroy(&h->lock);
    free(h);
}

bool holder_take(holder *h, int fd, http_request *rq, char *head, bool chunked, const reply_source *source)
{
    held *one = calloc(1, sizeof *one);
    const int wake = feed_descriptor(source->listener);
    int yes = 1;
    if (!one)
        return false;
    *one = (held){.rq = rq, .source = *source, .chunked = chunked, .listener = source->listener};
    if (wake < 0 || !watch(h, EPOLL_CTL_ADD, wake, 0, NULL, false)) {
        free(one);
        return false;
    }
    /* The socket under a new descriptor, watched for nothing yet; another socket takes its old one. */
    const int taken = fcntl(fd, F_DUPFD_CLOEXEC, 0), other = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool watched = taken >= 0 && other >= 0 && watch(h, EPOLL_CTL_ADD, taken, 0, NULL, false);
    const bool done = watched && dup3(other, fd, O_CLOEXEC) == fd;
    if (other >= 0)
        close(other);
    if (!done) {
        if (taken >= 0) {
            epoll_ctl(h->epoll, EPOLL_CTL_DEL, taken, NULL);
            close(taken);
        }
        epoll_ctl(h->epoll, EPOLL_CTL_DEL, wake, NULL);
        free(one);
        return false;
    }
    setsockopt(taken, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    rq->fd = one->fd = taken;
    *source->held = true;
    one->out = head;
    one->len = head ? strlen(head) : 0;
    one->due = head ? clock_seconds(CLOCK_MONOTONIC) + h->patience_s : 0.0;
    pthread_mutex_lock(&h->lock);
    one->next = h->arriving;
    h->arriving = one;
    pthread_mutex_unlock(&h->lock);
    eventfd_write(h->wake, 1);
    return true;
}
