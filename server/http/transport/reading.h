/* reading.h: the bytes that libmicrohttpd reads, seen as they come.
 *
 * libmicrohttpd 0.9.75 takes a bare LF for the end of any line of chunked framing and has no way to show that framing:
 * its callbacks get the data alone, and what it has read ahead is gone from the socket. Its calls of recv(2), and over
 * TLS of gnutls_record_recv, therefore come here first (the program's own symbol goes before that of a library) and go
 * on to recvfrom(2) and gnutls_record_recv_seq, which do the same. Each connection has a thread of its own, and what is
 * known of its reading is that thread's, and of the socket that it read first: other threads, libcurl's for one, and
 * other sockets, libpq's, are passed through. */
#ifndef SERVER_HTTP_READING_H
#define SERVER_HTTP_READING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of what this thread has read: from which socket (-1: none yet), how many bytes of plain text in all, and where the
 * last of them were put. */
typedef struct {
    int fd;
    uint64_t total;
    const char *end;
} reading_place;
reading_place reading_last(void);

/* From now on take(ctx, ...) sees what this thread reads before its reader does; false: the reader gets an error, as if
 * the client had reset the connection. NULL: nobody looks. */
void reading_watch(bool (*take)(void *ctx, const char *data, size_t size), void *ctx);

#endif
