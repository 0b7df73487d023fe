/* select.h: the least of many, in any order. */
#ifndef UZ_CORE_SELECT_H
#define UZ_CORE_SELECT_H

#include <stdint.h>

/* Something by where it is along a line; equal ones by number. */
typedef struct {
    double along;
    int64_t item;
} uz_placed;

/* The first `left` of n to the front, in any order. O(n) on an average, whatever the order was: pivots are scattered,
 * and the same each time. Source: C. A. R. Hoare, "Algorithm 65: find", Commun. ACM 4 (1961) 321-322. */
void uz_select_first(uz_placed *list, int64_t n, int64_t left);

#endif
