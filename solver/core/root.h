/* root.h: where a function of one variable changes its sign. */
#ifndef UZ_CORE_ROOT_H
#define UZ_CORE_ROOT_H

/* Where f goes from below zero at `low` to above it at `high`, to rounding, or to within `width`; an end where it does
 * not. Illinois (Dowell and Jarratt, BIT 11 (1971) 168-174), halving every fourth time, so that a jump through zero is
 * found, too. */
double uz_root_between(double (*f)(const void *ctx, double x), const void *ctx, double low, double high, double width);

#endif
