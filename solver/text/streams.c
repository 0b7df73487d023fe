/* streams.c: the standard streams of a program. */
#include "text/streams.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

void uz_hold_standard_streams(void)
{
    for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; fd++)
        if (fcntl(fd, F_GETFD) < 0 && errno == EBADF) /* the least free number is the next one (POSIX, open) */
            (void)!open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}
