#include "stream.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

int stream_open(const char *where)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const size_t length = strlen(where);
    if (where[0] != '@') {
        char *end;
        const long number = strtol(where, &end, 10);
        return *where && !*end && number >= 0 && number < 1024 ? (int)number : -1;
    }
    if (length > sizeof address.sun_path)
        return -1;
    memcpy(address.sun_path + 1, where + 1, length - 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)&address, size) == 0)
        return fd;
    if (fd >= 0)
        close(fd);
    return -1;
}

bool stream_read(int fd, void *to, size_t size)
{
    for (char *at = to; size > 0;) {
        const ssize_t got = read(fd, at, size);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        at += got;
        size -= (size_t)got;
    }
    return true;
}

bool stream_write(int fd, const void *from, size_t size)
{
    for (const char *at = from; size > 0;) {
        const ssize_t sent = send(fd, at, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            return false;
        at += sent;
        size -= (size_t)sent;
    }
    return true;
}
