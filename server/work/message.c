#include "work/message.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

bool message_send(int socket, const packet *m, int fd)
{
    struct iovec part = {.iov_base = (void *)(uintptr_t)m, .iov_len = sizeof *m};
    union {
        struct cmsghdr head;
        char room[CMSG_SPACE(sizeof(int))];
    } control;
    struct msghdr head_of = {.msg_iov = &part, .msg_iovlen = 1};
    if (fd >= 0) {
        memset(&control, 0, sizeof control);
        head_of.msg_control = control.room;
        head_of.msg_controllen = sizeof control.room;
        control.head.cmsg_level = SOL_SOCKET;
        control.head.cmsg_type = SCM_RIGHTS;
        control.head.cmsg_len = CMSG_LEN(sizeof fd);
        memcpy(CMSG_DATA(&control.head), &fd, sizeof fd);
    }
    for (;;) {
        const ssize_t sent = sendmsg(socket, &head_of, MSG_NOSIGNAL);
        if (sent >= 0 || errno != EINTR)
            return sent == (ssize_t)sizeof *m;
    }
}

bool message_receive(int socket, packet *m, int *fd)
{
    struct iovec part = {.iov_base = m, .iov_len = sizeof *m};
    union {
        struct cmsghdr head;
        char room[CMSG_SPACE(sizeof(int))];
    } control;
    struct msghdr head_of = {.msg_iov = &part, .msg_iovlen = 1};
    head_of.msg_control = control.room;
    head_of.msg_controllen = sizeof control.room;
    ssize_t got;
    int taken = -1;
    if (fd)
        *fd = -1;
    do
        got = recvmsg(socket, &head_of, MSG_CMSG_CLOEXEC);
    while (got < 0 && errno == EINTR);
    const struct cmsghdr *head = got > 0 ? CMSG_FIRSTHDR(&head_of) : NULL;
    if (head && head->cmsg_level == SOL_SOCKET && head->cmsg_type == SCM_RIGHTS &&
        head->cmsg_len == CMSG_LEN(sizeof taken))
        memcpy(&taken, CMSG_DATA(head), sizeof taken);
    const bool good = got == (ssize_t)sizeof *m && !(head_of.msg_flags & MSG_TRUNC);
    if (taken >= 0 && (!fd || !good))
        close(taken);
    else if (fd)
        *fd = taken;
    return good;
}
