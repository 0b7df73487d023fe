#include "http/transport/reading.h"

#include <errno.h>
#include <gnutls/gnutls.h>
#include <sys/socket.h>
#include <sys/types.h>

/* The thread's own, since neither function has a context. */
static _Thread_local struct {
    reading_place place;
    bool any, tls; /* place is set; what recv reads is for gnutls */
    bool (*take)(void *ctx, const char *data, size_t size);
    void *ctx;
} mine;

/* False: the reader is to be told of an error. */
static bool note(int fd, const void *data, ssize_t size)
{
    if (!mine.any || mine.place.fd != fd)
        mine.place = (reading_place){.fd = fd};
    mine.any = true;
    if (size <= 0)
        return true;
    mine.place.total += (uint64_t)size;
    mine.place.end = (const char *)data + size;
    return !mine.take || mine.take(mine.ctx, data, (size_t)size);
}

/* Named by its label alone: <sys/socket.h> may declare the function inline. */
ssize_t reading_recv(int fd, void *to, size_t size, int flags) __asm__("recv");
ssize_t reading_recv(int fd, void *to, size_t size, int flags)
{
    const ssize_t got = recvfrom(fd, to, size, flags, NULL, NULL);
    const int reason = errno;
    if (mine.any && mine.place.fd != fd) /* a library's that is called while a request is answered: a database's */
        return got;
    if (!mine.tls && !note(fd, to, got)) {
        errno = ECONNRESET;
        return -1;
    }
    errno = reason;
    return got;
}

ssize_t gnutls_record_recv(gnutls_session_t session, void *to, size_t size)
{
    if (!mine.tls)
        mine.any = false; /* what was counted so far is the handshake */
    mine.tls = true;
    const ssize_t got = gnutls_record_recv_seq(session, to, size, NULL);
    return note(gnutls_transport_get_int(session), to, got) ? got : GNUTLS_E_PULL_ERROR;
}

reading_place reading_last(void)
{
    return mine.any ? mine.place : (reading_place){.fd = -1};
}

void reading_watch(bool (*take)(void *ctx, const char *data, size_t size), void *ctx)
{
    mine.take = take;
    mine.ctx = ctx;
}
