/* order.h: the order of numbers, for qsort and bsearch; lists of them. */
#ifndef UZ_CORE_ORDER_H
#define UZ_CORE_ORDER_H

#include <stdint.h>
#include <stdlib.h>

static inline int uz_ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static inline int uz_ascending_32(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

static inline int uz_ascending_real(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts a list and leaves each number once; returns how many there are then. */
static inline int64_t uz_sort_unique(int64_t *value, int64_t count)
{
    int64_t kept = 0;
    if (count > 1)
        qsort(value, (size_t)count, sizeof *value, uz_ascending);
    for (int64_t i = 0; i < count; i++)
        if (i == 0 || value[i] != value[kept - 1])
            value[kept++] = value[i];
    return kept;
}

#endif
