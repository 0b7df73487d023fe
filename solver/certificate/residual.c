#include "certificate/residual.h"

#include "certificate/twofold.h"
#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* hi + lo += A x and y += A c for symmetric A by its lower triangle: A is read once. */
static inline __attribute__((always_inline)) void symmetric_product(double *hi, double *lo, double *y, const uz_csc *A,
                                                                    const double *x, const double *c, int fused)
{
    for (int64_t j = 0; j < A->cols; j++) {
        double x_j = x[j], c_j = c[j], sum_hi = hi[j], sum_lo = lo[j], sum = y[j];
        int64_t k = A->ptr[j];
        if (k < A->ptr[j + 1] && A->idx[k] == j) {
            sum += A->val[k] * c_j;
            twofold_add_product(&sum_hi, &sum_lo, A->val[k++], x_j, fused);
        }
        for (; k < A->ptr[j + 1]; k++) {
            int64_t i = A->idx[k];
            double a = A->val[k];
            sum += a * c[i];
            y[i] += a * c_j;
            twofold_add_product(&sum_hi, &sum_lo, a, x[i], fused);
            twofold_add_product(&hi[i], &lo[i], a, x_j, fused);
        }
        hi[j] = sum_hi;
        lo[j] = sum_lo;
        y[j] = sum;
    }
}

__attribute__((target("fma"))) static void symmetric_product_fused(double *hi, double *lo, double *y, const uz_csc *A,
                                                                   const double *x, const double *c)
{
    symmetric_product(hi, lo, y, A, x, c, 1);
}

static void symmetric_product_split(double *hi, double *lo, double *y, const uz_csc *A, const double *x,
                                    const double *c)
{
    symmetric_product(hi, lo, y, A, x, c, 0);
}

/* hi + lo -= p + N'r in column j */
static twofold subtract_forces(twofold sum, int64_t j, const uz_csc *N, const double *p, const double *r)
{
    twofold_add(&sum, -p[j]);
    for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
        twofold_add_product(&sum.hi, &sum.lo, -N->val[k], r[N->idx[k]], 0);
    return sum;
}

uz_status uz_equilibrium_residual(uz_residuals *out, const uz_csc *K, const uz_csc *N, const double *p, const double *u,
                                  const double *c, const double *r, uz_error *err)
{
    int64_t d = K->rows;
    double *lo = uz_alloc_zero(d, sizeof *lo), *hi = out->Ku;
    if (!lo)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a residual of %lld dofs", (long long)d);
    memset(hi, 0, (size_t)d * sizeof *hi);
    memset(out->Kc, 0, (size_t)d * sizeof *hi);
    if (__builtin_cpu_supports("fma"))
        symmetric_product_fused(hi, lo, out->Kc, K, u, c);
    else
        symmetric_product_split(hi, lo, out->Kc, K, u, c);
    for (int64_t j = 0; j < d; j++) {
        twofold sum = subtract_forces((twofold){hi[j], lo[j]}, j, N, p, r);
        out->e_u[j] = sum.hi + sum.lo;
        twofold_add(&sum, out->Kc[j]);
        out->e[j] = sum.hi + sum.lo;
        hi[j] += lo[j];
    }
    free(lo);
    return UZ_OK;
}

double uz_gap_of_row(const uz_csc *Nt, int64_t i, const double *h, const double *u, const double *c)
{
    twofold sum = {h[i], 0.0};
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++) {
        twofold_add_product(&sum.hi, &sum.lo, -Nt->val[k], u[Nt->idx[k]], 0);
        if (c)
            twofold_add_product(&sum.hi, &sum.lo, -Nt->val[k], c[Nt->idx[k]], 0);
    }
    return sum.hi + sum.lo;
}
