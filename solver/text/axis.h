/* axis.h: what an axis of a drawing shows, whatever it is drawn with: the range of its numbers and round steps. */
#ifndef UZ_TEXT_AXIS_H
#define UZ_TEXT_AXIS_H

#include <math.h>
#include <stdbool.h>

/* A range of numbers, empty (low > high) at first. */
typedef struct {
    double low, high;
} uz_range;
#define UZ_RANGE_NONE ((uz_range){INFINITY, -INFINITY})
/* What is not finite stays out, and what is not positive where it is for a logarithm. */
void uz_range_take(uz_range *range, double x, bool log);
/* The exponents of the powers of ten around a range of positive numbers that is not empty; at least one apart. */
uz_range uz_range_decades(uz_range range);

/* True if x has a place on an axis. */
bool uz_axis_has(double x, bool log);
/* The smallest of 1, 2, 5 times a power of ten that is at least x > 0. */
double uz_round_step(double x);

#endif
