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

/* Of pairs: by the first number, then by the second. */
static inline int uz_ascending_pairs(const void *a, const void *b)
{
    const int64_t *x = a, *y = b;
    return x[0] != y[0] ? (x[0] > y[0]) - (x[0] < y[0]) : (x[1] > y[1]) - (x[1] < y[1]);
}

/* A list that is short or nearly in order, as a rule. */
static inline void uz_sort_32(int32_t *value, int64_t count)
{
    if (count > 32) {
        qsort(value, (size_t)count, sizeof *value, uz_ascending_32);
        return;
    }
    for (int64_t s = 1; s < count; s++) {
        const int32_t own = value[s];
        int64_t t = s;
        for (; t > 0 && value[t - 1] > own; t--)
            value[t] = value[t - 1];
        value[t] = own;
    }
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

/* The indices of n numbers in ascending order of these, of equal ones as they stand. Free with free(); NULL: no
 * memory. */
int64_t *uz_order_of(const int64_t *number, int64_t n);

/* The first place in that order whose number is not less than `least`; n: there is none. order NULL: the numbers ascend
 * as they stand. */
int64_t uz_order_seek(const int64_t *number, const int64_t *order, int64_t n, int64_t least);

#endif
