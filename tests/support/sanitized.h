/* sanitized.h: what a test does less of in a build with a sanitizer. */
#ifndef TESTS_SANITIZED_H
#define TESTS_SANITIZED_H

#include "core/sanitized.h"

/* The allocation to fail after the n-th: paths are reached by many. Of those after the first hundreds every fifth in a
 * plain build; under a sanitizer, which repeats what that has shown, every 41st. */
static inline long next_allocation(long n)
{
    return n < (SANITIZED ? 100 : 400) ? n + 1 : n + (SANITIZED ? 41 : 5);
}

/* Of so many generated cases, the first that are tried: under a sanitizer a fifth, since the plain build tries each. */
static inline int some_of(int cases)
{
    return SANITIZED ? cases / 5 : cases;
}

/* The step through many like cases of which a plain build tries each: no divisor of what often alternates in them. */
static inline int step_of_cases(void)
{
    return SANITIZED ? 5 : 1;
}

/* From one thread to the next number of them, where the answers of some are compared with that of one: a sanitizer sees
 * in the most what it would see in fewer. */
static inline int more_threads(int threads, int most)
{
    return SANITIZED && threads < most ? most : threads + 1;
}

#endif
