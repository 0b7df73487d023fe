/* alloc.h: overflow-checked allocation. Tests inject failures by wrapping malloc, calloc and realloc at link time. */
#ifndef UZ_CORE_ALLOC_H
#define UZ_CORE_ALLOC_H

#include <stdbool.h>
#include <stdint.h>
#include <stddef.h>

/* Uninitialised / zeroed room for `count` items of `size` bytes; NULL when count < 0, the product overflows or there
 * is no memory. A count of 0 gives a unique pointer, so NULL always means failure. Free with free(). */
void *uz_alloc(int64_t count, size_t size);
void *uz_alloc_zero(int64_t count, size_t size);

/* malloc for big blocks: from UZ_HUGE_LEAST bytes on they start on a huge page boundary and ask the kernel for huge
 * pages. A factor of 200 MB is touched once, page by page: with 4 kB pages a fifth of its time went into page faults.
 * Zeroed ones ask for them, too: what is read before it is written has two faults a page, the second of which stops
 * all threads of the process. Free with free(). */
#define UZ_HUGE_PAGE  ((size_t)2 << 20) /* of the kernel */
#define UZ_HUGE_LEAST (2 * UZ_HUGE_PAGE)
void *uz_malloc_huge(size_t bytes);

/* Grows or shrinks; on failure NULL and the old block stays. */
void *uz_realloc(void *block, int64_t count, size_t size);

/* Room for `more` items behind the first count of *list, a pointer to any type of `size` bytes: grows it and *room
 * where there is too little, by half at least. False: no memory, and the list stays. */
bool uz_grow(void *list, int64_t count, int64_t more, int64_t *room, size_t size);

/* free() of each argument, in their order. */
#define uz_free_all(...) uz_free_each((void *[]){__VA_ARGS__}, sizeof(void *[]){__VA_ARGS__} / sizeof(void *))
void uz_free_each(void *const *blocks, size_t count);

#endif
