#include "work/segment.h"

#include <fcntl.h>
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>

#define STEP ((size_t)2 << 20) /* it grows by whole steps */

/* A process that is confined may look at no file but by its descriptor, and fstat(3) asks by name. */
static size_t size_of(const segment *s)
{
    const off_t end = s->fd >= 0 ? lseek(s->fd, 0, SEEK_END) : 0;
    return end > 0 ? (size_t)end : 0;
}

bool segment_make(segment *s, size_t bytes)
{
    bytes = bytes < SEGMENT_KEPT ? SEGMENT_KEPT : bytes;
    *s = (segment){.fd = memfd_create("uzawad", MFD_CLOEXEC | MFD_ALLOW_SEALING)};
    return s->fd >= 0 && ftruncate(s->fd, (off_t)bytes) == 0 && fcntl(s->fd, F_ADD_SEALS, F_SEAL_SHRINK) == 0 &&
           segment_reach(s, bytes, false);
}

bool segment_attach(segment *s, int fd)
{
    *s = (segment){.fd = fd};
    return segment_reach(s, size_of(s), false);
}

void segment_close(segment *s)
{
    if (s->at)
        munmap(s->at, s->mapped);
    if (s->fd > 0)
        close(s->fd);
    *s = (segment){.fd = -1};
}

bool segment_reach(segment *s, size_t bytes, bool grow)
{
    if (bytes <= s->mapped)
        return true;
    if (bytes > PTRDIFF_MAX / 2)
        return false;
    const size_t there = size_of(s), wanted = there >= bytes ? bytes : (bytes + STEP - 1) / STEP * STEP;
    if (there < bytes && (!grow || ftruncate(s->fd, (off_t)wanted) != 0))
        return false;
    void *at = s->at ? mremap(s->at, s->mapped, wanted, MREMAP_MAYMOVE)
                     : mmap(NULL, wanted, PROT_READ | PROT_WRITE, MAP_SHARED, s->fd, 0);
    if (at == MAP_FAILED)
        return false;
    s->at = at;
    s->mapped = wanted;
    return true;
}

void segment_rest(segment *s, size_t most, bool give_back)
{
    const size_t size = give_back ? size_of(s) : 0;
    if (size > most)
        fallocate(s->fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, (off_t)most, (off_t)(size - most));
    if (s->mapped > most && mremap(s->at, s->mapped, most, 0) == s->at)
        s->mapped = most;
}
