/* order.h: the order of numbers, for qsort and bsearch. */
#ifndef UZ_CORE_ORDER_H
#define UZ_CORE_ORDER_H

#include <stdint.h>

static inline int uz_ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

#endif
