/* The reserve of touched pages: blocks are whole and their own, pages of a freed block serve the next one, and no more
 * is kept than was allowed.
 * in the ordinary build too, pages_: a sanitizer has a heap of its own */
#include "core/reserve.h"
#include "core/alloc.h"
#include "harness.h"
#include "qp_fixture.h"
#include "sanitized.h"

#include <limits.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#define MB ((size_t)1 << 20)

static long faults(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt;
}

static void write_all(unsigned char *block, size_t bytes, int value)
{
    memset(block, value, bytes);
}

static bool has_only(const unsigned char *block, size_t bytes, int value)
{
    for (size_t i = 0; i < bytes; i++)
        if (block[i] != value)
            return false;
    return true;
}

TEST(pages_of_freed_blocks_serve_larger_ones)
{
    uz_reserve *reserve = uz_reserve_new(64 * MB, 0);
    unsigned char *a = uz_reserve_take(reserve, 20 * MB), *b = uz_reserve_take(reserve, 30 * MB + 5);
    CHECK(a && b && (size_t)a % (2 * MB) == 0 && (size_t)b % (2 * MB) == 0);
    CHECK(uz_reserve_size(reserve, b) == 32 * MB);
    write_all(a, 20 * MB, 1);
    write_all(b, 32 * MB, 2);
    CHECK(has_only(a, 20 * MB, 1));
    CHECK(uz_reserve_give(reserve, a) && uz_reserve_give(reserve, b));
    CHECK(uz_reserve_bytes(reserve) == 52 * MB);
    long before = faults();
    unsigned char *c = uz_reserve_take(reserve, 46 * MB); /* neither was as large */
    CHECK(c && uz_reserve_bytes(reserve) == 6 * MB);
    write_all(c, 46 * MB, 3);
    CHECK_MSG(SANITIZED || faults() - before < 64, "%ld page faults on pages that were there", faults() - before);
    unsigned char *d = uz_reserve_take(reserve, 10 * MB); /* 6 kept, 4 fresh */
    CHECK(d && uz_reserve_bytes(reserve) == 0);
    write_all(d, 10 * MB, 4);
    CHECK(has_only(c, 46 * MB, 3) && has_only(d, 10 * MB, 4));
    CHECK(uz_reserve_give(reserve, c) && uz_reserve_give(reserve, d));
    uz_reserve_free(reserve);
}

TEST(no_more_is_kept_than_allowed)
{
    uz_reserve *reserve = uz_reserve_new(16 * MB, 12 * MB);
    unsigned char *a = uz_reserve_take(reserve, 40 * MB), *b = uz_reserve_take(reserve, 8 * MB);
    int own = 0;
    CHECK(a && b);
    CHECK(!uz_reserve_give(reserve, &own) && uz_reserve_size(reserve, &own) == 0);
    CHECK(uz_reserve_give(reserve, a));
    CHECK(uz_reserve_bytes(reserve) == 8 * MB); /* and 8 are in use */
    CHECK(uz_reserve_give(reserve, b));
    CHECK(uz_reserve_bytes(reserve) == 16 * MB);
    uz_reserve_empty(reserve);
    CHECK(uz_reserve_bytes(reserve) == 0);
    CHECK(!uz_reserve_fill(reserve) && uz_reserve_bytes(reserve) == 0); /* nothing was asked for since */
    a = uz_reserve_take(reserve, 40 * MB);
    CHECK(uz_reserve_give(reserve, a));
    uz_reserve_empty(reserve);
    a = uz_reserve_take(reserve, 10 * MB);
    CHECK(uz_reserve_give(reserve, a) && uz_reserve_bytes(reserve) == 10 * MB);
    a = uz_reserve_take(reserve, 2 * MB);
    while (uz_reserve_fill(reserve))
        ;
    CHECK(uz_reserve_bytes(reserve) == 10 * MB); /* as much as the largest took */
    CHECK(uz_reserve_take(reserve, SIZE_MAX) == NULL && uz_reserve_take(reserve, PTRDIFF_MAX) == NULL);
    CHECK(uz_reserve_give(reserve, a));
    uz_reserve_free(reserve);
}

TEST(what_is_kept_is_left_to_others)
{
    uz_reserve *reserve = uz_reserve_new(64 * MB, 40 * MB);
    unsigned char *a = uz_reserve_take(reserve, 10 * MB), *b = uz_reserve_take(reserve, 30 * MB);
    CHECK(a && b && uz_reserve_give(reserve, a) && uz_reserve_give(reserve, b));
    CHECK(uz_reserve_bytes(reserve) == 40 * MB);
    uz_reserve_give_to_heap(reserve, 13 * MB); /* whole pages of it */
    CHECK(uz_reserve_lent(reserve) == 12 * MB);
    CHECK(uz_reserve_bytes(reserve) == 28 * MB);
    CHECK(!uz_reserve_fill(reserve) && uz_reserve_bytes(reserve) == 28 * MB); /* so much is enough now */
    a = uz_reserve_take(reserve, 32 * MB);
    CHECK(a && uz_reserve_bytes(reserve) == 0);
    memset(a, 7, 32 * MB);
    CHECK(has_only(a, 32 * MB, 7) && uz_reserve_give(reserve, a));
    while (uz_reserve_fill(reserve))
        ;
    CHECK(uz_reserve_bytes(reserve) == 32 * MB); /* as much as a block has taken since */
    uz_reserve_give_to_heap(reserve, SIZE_MAX);
    CHECK(uz_reserve_bytes(reserve) == 0 && uz_reserve_lent(reserve) == 44 * MB);
    uz_reserve_empty(reserve);
    CHECK(uz_reserve_lent(reserve) == 0);
    uz_reserve_free(reserve);
}

static bool is_there(void *at, size_t bytes)
{
    unsigned char pages[8192];
    bool all = bytes / 4096 <= sizeof pages && mincore(at, bytes, pages) == 0;
    for (size_t k = 0; all && k < bytes / 4096; k++)
        all = pages[k] & 1;
    return all;
}

/* Within so many tenths of a second. */
enum { PATIENCE = 100 };

TEST(pages_are_there_before_they_are_touched)
{
    const struct timespec tenth = {.tv_nsec = 100000000};
    uz_reserve *reserve = uz_reserve_new(64 * MB, 12 * MB);
    uz_reserve_expect(reserve, 10 * MB);
    for (int k = 0; k < PATIENCE && uz_reserve_bytes(reserve) < 10 * MB; k++)
        nanosleep(&tenth, NULL);
    CHECK(uz_reserve_bytes(reserve) == 10 * MB);
    uz_reserve_expect(reserve, 40 * MB); /* no more than `ready` */
    for (int k = 0; k < PATIENCE && uz_reserve_bytes(reserve) < 12 * MB; k++)
        nanosleep(&tenth, NULL);
    CHECK(uz_reserve_bytes(reserve) == 12 * MB);
    unsigned char *a = uz_reserve_take(reserve, 30 * MB); /* 18 of them fresh */
    write_all(a, MB, 1);
    for (int k = 0; k < PATIENCE && !is_there(a, 30 * MB); k++)
        nanosleep(&tenth, NULL);
    const bool asks = madvise(a, 2 * MB, MADV_POPULATE_WRITE) == 0; /* Linux 5.14 */
    CHECK((is_there(a, 30 * MB) || !asks) && has_only(a, MB, 1));
    CHECK(uz_reserve_give(reserve, a) && uz_reserve_bytes(reserve) == 30 * MB);
    for (int k = 0; k < 20; k++) { /* gone before anybody has touched it */
        a = uz_reserve_take(reserve, 48 * MB);
        CHECK(uz_reserve_give(reserve, a));
        uz_reserve_empty(reserve);
    }
    uz_reserve_free(reserve);
}

/* As in processes of the daemon, whose heap is one and keeps what is freed. */
TEST(pages_that_the_heap_is_given_serve_it)
{
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
    uz_reserve *reserve = uz_reserve_new(64 * MB, 0);
    unsigned char *a = uz_reserve_take(reserve, 20 * MB), *b = uz_reserve_take(reserve, 30 * MB);
    CHECK(a && b);
    write_all(a, 20 * MB, 1);
    write_all(b, 30 * MB, 2);
    CHECK(uz_reserve_give(reserve, a) && uz_reserve_give(reserve, b));
    uz_reserve_give_to_heap(reserve, SIZE_MAX);
    CHECK(uz_reserve_bytes(reserve) == 0 && uz_reserve_lent(reserve) == 50 * MB);
    unsigned char *all = uz_malloc_huge(30 * MB);
    const bool there = is_there(all, 30 * MB); /* before anybody writes */
    unsigned char *zero = calloc(1, 2 * MB);
    CHECK(SANITIZED || there);
    CHECK(all && zero && has_only(zero, 2 * MB, 0)); /* what is not fresh is cleared */
    write_all(all, 30 * MB, 3);
    unsigned char *more = uz_malloc_huge(30 * MB); /* beyond them the heap grows as ever */
    CHECK(more != NULL);
    write_all(more, 30 * MB, 4);
    CHECK(has_only(all, 30 * MB, 3) && has_only(zero, 2 * MB, 0));
    free(all);
    free(zero);
    free(more);
    malloc_trim(0);
    CHECK((all = uz_malloc_huge(80 * MB)) != NULL);
    write_all(all, 80 * MB, 5);
    CHECK(has_only(all, 80 * MB, 5));
    free(all);
    uz_reserve_free(reserve);
}

/* Random sizes and lives; each block is filled with its own number and checked before it goes. */
TEST(blocks_keep_to_themselves)
{
    enum { BLOCKS = 12, ROUNDS = 400 };
    qp_random rng = {7};
    uz_reserve *reserve = uz_reserve_new(48 * MB, 16 * MB);
    unsigned char *block[BLOCKS] = {NULL};
    size_t bytes[BLOCKS] = {0};
    for (int round = 0; round < ROUNDS; round++) {
        const int k = round * 7 % BLOCKS;
        if (block[k]) {
            CHECK(block[k][0] == k && block[k][bytes[k] / 2] == k && block[k][bytes[k] - 1] == k);
            CHECK(uz_reserve_size(reserve, block[k]) >= bytes[k]);
            CHECK(uz_reserve_give(reserve, block[k]));
        }
        bytes[k] = (size_t)(1.0 + 12.0 * random_unit(&rng) * (double)MB);
        block[k] = uz_reserve_take(reserve, bytes[k]);
        CHECK(block[k] != NULL);
        for (size_t at = 0; at < bytes[k]; at += 4096)
            block[k][at] = (unsigned char)k;
        block[k][bytes[k] / 2] = block[k][bytes[k] - 1] = (unsigned char)k;
        if (round % 17 == 0)
            uz_reserve_fill(reserve);
    }
    for (int k = 0; k < BLOCKS; k++)
        CHECK(!block[k] || uz_reserve_give(reserve, block[k]));
    CHECK(uz_reserve_bytes(reserve) <= 48 * MB);
    uz_reserve_free(reserve);
}
