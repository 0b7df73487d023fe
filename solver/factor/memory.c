/* memory.c: where CHOLMOD gets its memory. */
#include "factor/factor.h"

#include "core/alloc.h"

#include <stdlib.h>
#include <string.h>
#include <suitesparse/SuiteSparse_config.h>

static void *calloc_huge(size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes))
        return NULL;
    if (bytes < UZ_HUGE_LEAST)
        return calloc(count, size);
    void *block = uz_malloc_huge(bytes);
    if (block)
        memset(block, 0, bytes);
    return block;
}

void uz_factor_use_huge_pages(void)
{
    SuiteSparse_config.malloc_func = uz_malloc_huge;
    SuiteSparse_config.calloc_func = calloc_huge;
}
