#include "core/alloc.h"

#include <stdbool.h>
#include <stdlib.h>
#include <sys/mman.h>

static bool bytes_for(int64_t count, size_t size, size_t *bytes)
{
    if (count < 0 || __builtin_mul_overflow((size_t)count, size, bytes) || *bytes > PTRDIFF_MAX)
        return false;
    if (*bytes == 0)
        *bytes = 1;
    return true;
}

#define HUGE_PAGE ((size_t)2 << 20)

void *uz_malloc_huge(size_t bytes)
{
    void *block = NULL;
    if (bytes < UZ_HUGE_LEAST)
        return malloc(bytes);
    if (posix_memalign(&block, HUGE_PAGE, bytes) != 0)
        return NULL;
    madvise(block, bytes, MADV_HUGEPAGE); /* a wish: where it is refused, small pages do */
    return block;
}

void *uz_alloc(int64_t count, size_t size)
{
    size_t bytes;
    return bytes_for(count, size, &bytes) ? uz_malloc_huge(bytes) : NULL;
}

void *uz_alloc_zero(int64_t count, size_t size)
{
    size_t bytes;
    return bytes_for(count, size, &bytes) ? calloc(1, bytes) : NULL;
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
