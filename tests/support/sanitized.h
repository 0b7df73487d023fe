/* sanitized.h: whether a test is built with a sanitizer, under which the same work takes five to twenty times as long.
 */
#ifndef TESTS_SANITIZED_H
#define TESTS_SANITIZED_H

#ifndef __has_feature
#define __has_feature(name) 0 /* clang's way of saying what gcc says with a macro */
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || __has_feature(address_sanitizer)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

/* The allocation to fail after the n-th: every one in a plain build; under a sanitizer, which repeats what the plain
 * build has shown, every one of the first hundred and each 17th of the rest, for paths are reached by many. */
static inline long next_allocation(long n)
{
    return !SANITIZED || n < 100 ? n + 1 : n + 17;
}

#endif
