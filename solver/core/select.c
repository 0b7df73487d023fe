#include "core/select.h"

#include "core/random.h"

#include <stdbool.h>

static bool is_before(uz_placed a, uz_placed b)
{
    return a.along != b.along ? a.along < b.along : a.item < b.item;
}

void uz_select_first(uz_placed *list, int64_t n, int64_t left)
{
    uint64_t state = 1;
    for (int64_t low = 0, high = n - 1; low < high;) {
        int64_t i = low, j = high;
        const uz_placed pivot = list[low + (int64_t)(uz_uniform(&state) * (double)(high - low))];
        while (i <= j) {
            while (is_before(list[i], pivot))
                i++;
            while (is_before(pivot, list[j]))
                j--;
            if (i <= j) {
                const uz_placed other = list[i];
                list[i++] = list[j];
                list[j--] = other;
            }
        }
        if (left <= j)
            high = j;
        else if (left >= i)
            low = i;
        else
            break;
    }
}
