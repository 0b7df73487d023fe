/* double_double.h: sums of products with about twice the precision of a double, as an unevaluated pair hi + lo
 * (Ogita, Rump, Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005): TwoSum, TwoProduct, Dot2). */
#ifndef UZ_DOUBLE_DOUBLE_H
#define UZ_DOUBLE_DOUBLE_H

typedef struct {
    double hi, lo;
} double_double;

/* a * b = product + error exactly, barring under- and overflow: Dekker's splitting, for processors without FMA. */
static inline double product_error_split(double a, double b, double product)
{
    const double splitter = 134217729.0; /* 2^27 + 1 */
    double ta = splitter * a, tb = splitter * b;
    double a_hi = ta - (ta - a), b_hi = tb - (tb - b), a_lo = a - a_hi, b_lo = b - b_hi;
    return ((a_hi * b_hi - product) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo;
}

/* s += a * b; fused: the processor has FMA and the caller is compiled for it. */
static inline __attribute__((always_inline)) void dd_add_product(double *hi, double *lo, double a, double b, int fused)
{
    double product = a * b;
    double error = fused ? __builtin_fma(a, b, -product) : product_error_split(a, b, product);
    double sum = *hi + product, back = sum - *hi;
    *lo += ((*hi - (sum - back)) + (product - back)) + error;
    *hi = sum;
}

static inline void dd_add(double_double *s, double x)
{
    double sum = s->hi + x, back = sum - s->hi;
    s->lo += (s->hi - (sum - back)) + (x - back);
    s->hi = sum;
}

#endif
