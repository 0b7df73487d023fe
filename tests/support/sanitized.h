/* sanitized.h: what a test does less of in a build with a sanitizer. */
#ifndef TESTS_SANITIZED_H
#define TESTS_SANITIZED_H

#include "base/sanitized.h"

/* The allocation to fail after the n-th: every one in a plain build; under a sanitizer, which repeats what the plain
 * build has shown, every one of the first hundred and each 17th of the rest, for paths are reached by many. */
static inline long next_allocation(long n)
{
    return !SANITIZED || n < 100 ? n + 1 : n + 17;
}

#endif
