#include "core/order.h"
#include "core/alloc.h"

int64_t *uz_order_of(const int64_t *number, int64_t n)
{
    int64_t(*pair)[2] = uz_alloc(n, sizeof *pair), *order = uz_alloc(n, sizeof *order);
    if (pair && order) {
        for (int64_t i = 0; i < n; i++) {
            pair[i][0] = number[i];
            pair[i][1] = i;
        }
        qsort(pair, (size_t)n, sizeof *pair, uz_ascending_pairs);
        for (int64_t i = 0; i < n; i++)
            order[i] = pair[i][1];
    } else {
        free(order);
        order = NULL;
    }
    free(pair);
    return order;
}

int64_t uz_order_seek(const int64_t *number, const int64_t *order, int64_t n, int64_t least)
{
    int64_t low = 0, high = n;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (number[order ? order[middle] : middle] < least)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}
