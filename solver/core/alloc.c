#include "core/alloc.h"

#include "core/aside.h"

#include <errno.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

/* What one thread clears by itself: some 200 microseconds. Of smaller blocks pages that nobody has touched stay so. */
#define CLEARED_ALONE UZ_HUGE_PAGE

static bool bytes_for(int64_t count, size_t size, size_t *bytes)
{
    if (count < 0 || __builtin_mul_overflow((size_t)count, size, bytes) || *bytes > PTRDIFF_MAX)
        return false;
    if (*bytes == 0)
        *bytes = 1;
    return true;
}

/* Asks for huge pages wherever the block has a part of one: beside it is heap, which other blocks have, or nothing,
 * which is told as ENOMEM and is no lack of memory. Where that is refused small pages do. */
static void ask_for_huge_pages(void *block, size_t bytes)
{
    const uintptr_t first = (uintptr_t)block & ~(UZ_HUGE_PAGE - 1),
                    end = ((uintptr_t)block + bytes + UZ_HUGE_PAGE - 1) & ~(UZ_HUGE_PAGE - 1);
    const int error = errno;
    madvise((void *)first, end - first, MADV_HUGEPAGE);
    errno = error;
}

void *uz_malloc_huge(size_t bytes)
{
    void *block = NULL;
    if (bytes < UZ_HUGE_LEAST)
        return malloc(bytes);
    if (posix_memalign(&block, UZ_HUGE_PAGE, bytes) != 0)
        return NULL;
    ask_for_huge_pages(block, bytes);
    return block;
}

void *uz_alloc(int64_t count, size_t size)
{
    size_t bytes;
    return bytes_for(count, size, &bytes) ? uz_malloc_huge(bytes) : NULL;
}

/* A block as the threads that clear it see it. */
typedef struct {
    char *block;
    size_t bytes;
    int parts;
} clearing;

static void clear_part(void *ctx, int part)
{
    const clearing *c = ctx;
    const size_t each = c->bytes / (size_t)c->parts, begin = each * (size_t)part,
                 end = part + 1 == c->parts ? c->bytes : begin + each;
    memset(c->block + begin, 0, end - begin);
}

void *uz_alloc_zero(int64_t count, size_t size)
{
    size_t bytes;
    if (!bytes_for(count, size, &bytes))
        return NULL;
    const int threads = bytes < CLEARED_ALONE ? 1 : uz_aside_threads();
    void *block = threads < 2 ? calloc(1, bytes) : malloc(bytes);
    if (block && bytes >= UZ_HUGE_PAGE)
        ask_for_huge_pages(block, bytes);
    if (block && threads > 1)
        uz_aside_share(clear_part, &(clearing){block, bytes, threads}, threads);
    return block;
}

void *uz_realloc(void *block, int64_t count, size_t size)
{
    size_t bytes;
    return bytes_for(count, size, &bytes) ? realloc(block, bytes) : NULL;
}

bool uz_grow(void *list, int64_t count, int64_t more, int64_t *room, size_t size)
{
    void **block = list;
    if (more <= *room - count)
        return true;
    const int64_t wanted = count + more + count / 2 + 64;
    void *grown = uz_realloc(*block, wanted, size);
    if (!grown)
        return false;
    *block = grown;
    *room = wanted;
    return true;
}

void uz_free_each(void *const *blocks, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(blocks[i]);
}
