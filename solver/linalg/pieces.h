/* pieces.h: loops over long vectors, which threads share (core/aside.h). Every number is computed alike whoever does
 * it, and sums are made of pieces that the length alone decides, in order: results do not depend on how many threads
 * there are. */
#ifndef UZ_LINALG_PIECES_H
#define UZ_LINALG_PIECES_H

#include "uzawa.h"

#include <stdint.h>

/* run(ctx, begin, end) for ranges that make up 0..n; of a short vector for all of it. */
void uz_by_pieces(void (*run)(void *ctx, int64_t begin, int64_t end), void *ctx, int64_t n);
/* run(ctx, begin, end) for ranges that make up the columns of a lower triangle, rows ascending in each: what runs at
 * once has no row in common, and in which order a row meets its columns the matrix alone decides. */
void uz_by_columns(void (*run)(void *ctx, int64_t begin, int64_t end), void *ctx, const uz_csc *A);
/* The sum of of(ctx, begin, end) for ranges that make up 0..n. */
double uz_sum_by_pieces(double (*of)(void *ctx, int64_t begin, int64_t end), void *ctx, int64_t n);
/* to = from. */
void uz_long_copy(int64_t n, double *to, const double *from);
/* x'y. */
double uz_long_dot(int64_t n, const double *x, const double *y);
/* The same of single numbers, their products and sums in double precision. */
double uz_long_dot_single(int64_t n, const float *x, const float *y);
/* The largest |x_j|, but for those that are no numbers; 0 where there is none. */
double uz_long_max(int64_t n, const double *x);
/* The largest |x_j y_j|, likewise. */
double uz_long_max_product(int64_t n, const double *x, const double *y);

#endif
