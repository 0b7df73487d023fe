/* failing_heap.h: a heap whose n-th allocation fails, and which knows what is left. For tests linked with malloc,
 * calloc, realloc and free wrapped: the Makefile does so for *alloc_failure programs that include this. */
#ifndef TESTS_FAILING_HEAP_H
#define TESTS_FAILING_HEAP_H

#include <stdbool.h>
#include <stddef.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *block, size_t size);
void __real_free(void *block);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *block, size_t size);
void __wrap_free(void *block);

enum { MOST_BLOCKS = 4096 };

/* Blocks that were allocated while watching and not yet freed. */
static struct {
    bool watching, failed;
    long until_failure; /* allocations that still succeed; negative: none fails */
    void *block[MOST_BLOCKS];
    int live;
} heap;

/* Watches from now on: `allowed` allocations succeed, and the next one fails. */
static void heap_watch(long allowed)
{
    heap.live = 0;
    heap.failed = false;
    heap.until_failure = allowed;
    heap.watching = true;
}

static bool fails_now(void)
{
    if (!heap.watching || heap.until_failure < 0 || heap.failed)
        return false;
    heap.failed = heap.until_failure-- == 0;
    return heap.failed;
}

static void *add_block(void *block)
{
    if (heap.watching && block && heap.live < MOST_BLOCKS)
        heap.block[heap.live++] = block;
    return block;
}

static void drop_block(const void *block)
{
    for (int k = heap.live - 1; k >= 0; k--)
        if (heap.block[k] == block) {
            heap.block[k] = heap.block[--heap.live];
            return;
        }
}

void *__wrap_malloc(size_t size)
{
    return fails_now() ? NULL : add_block(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return fails_now() ? NULL : add_block(__real_calloc(count, size));
}

void *__wrap_realloc(void *block, size_t size)
{
    if (fails_now())
        return NULL;
    void *moved = __real_realloc(block, size);
    if (moved) {
        drop_block(block);
        add_block(moved);
    }
    return moved;
}

void __wrap_free(void *block)
{
    drop_block(block);
    __real_free(block);
}

#endif
