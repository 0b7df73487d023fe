/* inverse_norm.c: a bound on the norm of K^-1, once per factor, that makes every later certificate half a solve
 * cheaper. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

enum { VECTORS = 8, POWER = 2 };

/* For x with independent standard normal entries and any unit vector v, P(|v'x| < t) < 0.8 t. With v the eigenvector of
 * the largest eigenvalue c of B, ||B^q x|| >= c^q |v'x|: that all of VECTORS samples fall short of c^q t has a
 * probability below (0.8 t)^8, 1e-12 here (Dixon, SIAM J. Numer. Anal. 20 (1983), for the method). */
#define LEAST_SHARE 0.04

/* Y = B Y in the factor's order, B = D_K^1/2 K^-1 D_K^1/2; root: the square roots of diag(K) in that order. */
static uz_status apply_scaled(double *Y, const uz_factor *factor, uz_factor_workspace *ws, const double *root,
                              const uz_stop *stop, uz_error *err)
{
    for (int v = 0; v < VECTORS; v++)
        for (int64_t k = 0; k < factor->n; k++)
            Y[k + v * factor->n] *= root[k];
    uz_status status = uz_factor_forward(factor, ws, Y, VECTORS, err);
    if (status == UZ_OK && uz_stop_is_due(stop))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the norm of the inverse was known");
    if (status == UZ_OK)
        status = uz_factor_backward(factor, ws, Y, VECTORS, err);
    for (int v = 0; status == UZ_OK && v < VECTORS; v++)
        for (int64_t k = 0; k < factor->n; k++)
            Y[k + v * factor->n] *= root[k];
    return status;
}

uz_status uz_factor_inverse_norm(double *bound, const uz_factor *factor, uz_factor_workspace *ws, const uz_csc *K,
                                 const uz_stop *stop, uz_error *err)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    uint64_t state = 0x9E3779B97F4A7C15u;
    double *Y = uz_alloc(factor->n * VECTORS, sizeof *Y), *root = uz_alloc(factor->n, sizeof *root);
    uz_status status = UZ_OK;
    *bound = INFINITY;
    if (Y && root) {
        for (int64_t k = 0; k < factor->n; k++)
            root[k] = sqrt(K->val[K->ptr[perm[k]]]);
        for (int64_t k = 0; k < factor->n * VECTORS; k++)
            Y[k] = uz_normal(&state);
        for (int power = 0; status == UZ_OK && power < POWER; power++)
            status = uz_stop_is_due(stop)
                         ? uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the norm of the inverse was known")
                         : apply_scaled(Y, factor, ws, root, stop, err);
    } else {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to bound the inverse of %lld dofs", (long long)factor->n);
    }
    double largest = 0.0;
    for (int v = 0; status == UZ_OK && v < VECTORS; v++)
        largest = fmax(largest, uz_norm(factor->n, Y + v * factor->n));
    if (status == UZ_OK)
        *bound = pow(largest / LEAST_SHARE, 1.0 / POWER);
    free(Y);
    free(root);
    return status;
}
