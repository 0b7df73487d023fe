#include "core/alloc.h"

#include <stdbool.h>
#include <stdlib.h>

static bool bytes_for(int64_t count, size_t size, size_t *bytes)
{
    if (count < 0 || __builtin_mul_overflow((size_t)count, size, bytes) || *bytes > PTRDIFF_MAX)
        return false;
    if (*bytes == 0)
        *bytes = 1;
    return true;
}

void *uz_alloc(int64_t count, size_t size)
{
    size_t bytes;
    return bytes_for(count, size, &bytes) ? malloc(bytes) : NULL;
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
