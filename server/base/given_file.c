#include "base/given_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <sys/stat.h>
#include <unistd.h>

FILE *given_file_open(const char *path)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat st;
    char first = 0;
    ssize_t n = -1;
    bool ok = fd >= 0 && fstat(fd, &st) == 0;
    if (ok && S_ISFIFO(st.st_mode) && (n = read(fd, &first, 1)) == 0) {
        errno = ENXIO;
        ok = false;
    }
    FILE *file = ok && fcntl(fd, F_SETFL, 0) == 0 ? fdopen(fd, "r") : NULL;
    if (!file && fd >= 0) {
        const int cause = errno;
        close(fd);
        errno = cause;
    }
    if (file && n > 0)
        ungetc((unsigned char)first, file);
    return file;
}
