#include "local/files.h"
#include "text/utf8.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool client_buffer_append(client_buffer *buffer, const void *bytes, size_t count)
{
    if (count >= SIZE_MAX - buffer->len)
        return false;
    size_t needed = buffer->len + count + 1;
    if (needed > buffer->capacity) {
        size_t capacity = buffer->capacity ? buffer->capacity : 4096;
        while (capacity < needed)
            capacity = capacity > SIZE_MAX / 2 ? needed : capacity * 2;
        char *grown = realloc(buffer->data, capacity);
        if (!grown)
            return false;
        buffer->data = grown;
        buffer->capacity = capacity;
    }
    if (count)
        memcpy(buffer->data + buffer->len, bytes, count);
    buffer->len += count;
    buffer->data[buffer->len] = '\0';
    return true;
}

static bool complain(char *message, size_t size, const char *doing, const char *path)
{
    snprintf(message, size, "cannot %s %s: %s", doing, path, strerror(errno));
    return false;
}

bool client_file_read(client_buffer *out, const char *path, char *message, size_t size)
{
    char block[1 << 16];
    client_buffer read_in = {0};
    bool standard = strcmp(path, "-") == 0;
    *out = (client_buffer){0};
    int fd = standard ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    bool ok = fd >= 0;
    while (ok) {
        ssize_t got = read(fd, block, sizeof block);
        if (got < 0 && errno == EINTR)
            continue;
        ok = got >= 0;
        if (ok && !client_buffer_append(&read_in, block, (size_t)got)) {
            errno = ENOMEM;
            ok = false;
        }
        if (got == 0)
            break;
    }
    if (ok)
        *out = read_in;
    else {
        complain(message, size, "read", standard ? "standard input" : path);
        free(read_in.data);
    }
    if (fd >= 0 && !standard)
        close(fd);
    return ok;
}

static bool write_all(int fd, const char *bytes, size_t count)
{
    while (count > 0) {
        ssize_t done = write(fd, bytes, count);
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            return false;
        bytes += done;
        count -= (size_t)done;
    }
    return true;
}

bool client_file_write(const char *path, const char *bytes, size_t count, char *message, size_t size)
{
    struct stat st;
    if (strcmp(path, "-") == 0)
        return (fwrite(bytes, 1, count, stdout) == count && fflush(stdout) == 0) ||
               complain(message, size, "write to", "standard output");
    /* A regular file is written beside its place, into which it then goes whole; all else as it is. */
    const bool regular = lstat(path, &st) != 0 || S_ISREG(st.st_mode);
    char *beside = NULL;
    if (regular && asprintf(&beside, "%s.part-%ld", path, (long)getpid()) < 0) {
        errno = ENOMEM;
        return complain(message, size, "write", path);
    }
    const int fd = regular ? open(beside, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)
                           : open(path, O_WRONLY | O_TRUNC | O_CLOEXEC);
    bool ok = fd >= 0 && write_all(fd, bytes, count) && (!regular || fsync(fd) == 0);
    if (fd >= 0)
        ok = close(fd) == 0 && ok && (!regular || rename(beside, path) == 0);
    const int why = errno;
    if (regular && fd >= 0 && !ok)
        unlink(beside);
    free(beside);
    errno = why;
    return ok || complain(message, size, "write", path);
}

void client_print_safe(FILE *to, const char *text)
{
    for (const char *end = text + strlen(text); text < end;) {
        const size_t unsafe = uz_utf8_unsafe(text, (size_t)(end - text));
        fputc(unsafe ? '?' : *text, to);
        text += unsafe ? unsafe : 1;
    }
}
