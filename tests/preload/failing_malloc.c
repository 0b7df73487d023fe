/* failing_malloc.c: a heap for a whole process whose n-th allocation fails, once or from then on. LD_PRELOAD it; the
 * process that tests maps the file FAILING_MALLOC names and sets when. It stands before the heap of all
 * libraries but those that end the process when there is no memory, and counts the blocks that are held. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The file: eight-byte numbers in the machine's order. */
typedef struct {
    atomic_llong watching; /* 0: nothing fails and nothing is counted */
    atomic_llong allowed;  /* allocations that still succeed */
    atomic_llong lasting;  /* 1: all fail after the first that does */
    atomic_llong seen;     /* allocations since the tester set it to 0 */
    atomic_llong failed;
    atomic_llong held; /* blocks of the process, always counted */
} control;

/* glibc's own names of what is replaced here: dlsym would allocate. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *block);

static control nobody, *heap = &nobody;

__attribute__((constructor)) static void map_control(void)
{
    const char *path = getenv("FAILING_MALLOC");
    int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    void *at = fd >= 0 ? mmap(NULL, sizeof *heap, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
    if (fd >= 0)
        close(fd);
    if (at == MAP_FAILED)
        return;
    atomic_store(&((control *)at)->held, atomic_load(&nobody.held));
    heap = at;
}

/* OpenMP's runtime and the dynamic loader print a message and exit. */
static bool gives_up(const void *caller)
{
    Dl_info at;
    return dladdr(caller, &at) == 0 || strstr(at.dli_fname, "libgomp") || strstr(at.dli_fname, "ld-linux") ||
           strstr(at.dli_fname, "libc.so");
}

static bool fails_now(const void *caller)
{
    if (!atomic_load_explicit(&heap->watching, memory_order_relaxed) || gives_up(caller))
        return false;
    atomic_fetch_add(&heap->seen, 1);
    long long left = atomic_fetch_sub(&heap->allowed, 1);
    if (left > 0 || (left < 0 && !atomic_load(&heap->lasting)))
        return false;
    atomic_fetch_add(&heap->failed, 1);
    errno = ENOMEM;
    return true;
}

static void *hold(void *block)
{
    if (block)
        atomic_fetch_add_explicit(&heap->held, 1, memory_order_relaxed);
    return block;
}

void *malloc(size_t size)
{
    return fails_now(__builtin_return_address(0)) ? NULL : hold(__libc_malloc(size));
}

void *calloc(size_t count, size_t size)
{
    return fails_now(__builtin_return_address(0)) ? NULL : hold(__libc_calloc(count, size));
}

void *realloc(void *block, size_t size)
{
    if (fails_now(__builtin_return_address(0)))
        return NULL;
    void *moved = __libc_realloc(block, size);
    if (!block)
        hold(moved);
    else if (size == 0 && !moved)
        atomic_fetch_sub_explicit(&heap->held, 1, memory_order_relaxed);
    return moved;
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return fails_now(__builtin_return_address(0)) ? NULL : hold(__libc_memalign(alignment, size));
}

void *memalign(size_t alignment, size_t size)
{
    return fails_now(__builtin_return_address(0)) ? NULL : hold(__libc_memalign(alignment, size));
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
    void *block = fails_now(__builtin_return_address(0)) ? NULL : hold(__libc_memalign(alignment, size));
    if (block)
        *out = block;
    return block ? 0 : ENOMEM;
}

void free(void *block)
{
    if (block)
        atomic_fetch_sub_explicit(&heap->held, 1, memory_order_relaxed);
    __libc_free(block);
}
