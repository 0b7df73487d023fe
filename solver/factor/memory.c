/* memory.c: where CHOLMOD gets its memory. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/reserve.h"

#include <stdlib.h>
#include <string.h>
#include <suitesparse/SuiteSparse_config.h>

static uz_reserve *reserve; /* set once, before threads start: CHOLMOD's hooks, which are as global, have no context */

/* Entries of a factor over those of K, rather too few: plane bodies of 20,000 dofs have 10, of 240,000 13; solids have
 * more. */
#define FILL_IN 8

static void *allocate(size_t bytes)
{
    return reserve && bytes >= UZ_HUGE_LEAST ? uz_reserve_take(reserve, bytes) : uz_malloc_huge(bytes);
}

static void *allocate_zero(size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes))
        return NULL;
    if (bytes < UZ_HUGE_LEAST)
        return calloc(count, size);
    void *block = allocate(bytes);
    if (block)
        memset(block, 0, bytes);
    return block;
}

static void release(void *block)
{
    if (!reserve || !uz_reserve_give(reserve, block))
        free(block);
}

static void *resize(void *block, size_t bytes)
{
    const size_t before = block ? uz_reserve_size(reserve, block) : 0;
    if (before == 0)
        return realloc(block, bytes); /* what grows is small */
    void *moved = allocate(bytes);
    if (moved) {
        memcpy(moved, block, bytes < before ? bytes : before);
        release(block);
    }
    return moved;
}

void uz_expect_factor(const uz_csc *K)
{
    const size_t bytes = 8 * FILL_IN * (size_t)K->ptr[K->cols];
    if (reserve && bytes >= UZ_HUGE_LEAST)
        uz_reserve_expect(reserve, bytes);
}

void uz_factor_expect_none(size_t bytes)
{
    if (reserve)
        uz_reserve_give_to_heap(reserve, bytes);
}

void uz_factor_use_huge_pages(void)
{
    SuiteSparse_config.malloc_func = allocate;
    SuiteSparse_config.calloc_func = allocate_zero;
}

void uz_factor_use_reserve(uz_reserve *used)
{
    reserve = used;
    SuiteSparse_config.realloc_func = resize;
    SuiteSparse_config.free_func = release;
}
