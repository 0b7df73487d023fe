/* inverse_norm.c: a bound on the norm of K^-1, from one linear solve with UZ_LANES random vectors, once per factor. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

/* For x with independent entries spread evenly over [-1, 1] and any unit vector v, P(|v'x| < t) <= sqrt(2) t, as v'x
 * has a density of at most sqrt(2) / 2 (Ball, Proc. AMS 97 (1986), on sections of the cube). With v the eigenvector of
 * the largest eigenvalue c of B = D_K^1/2 K^-1 D_K^1/2, ||B x|| >= c |v'x|: that all of eight samples fall short of c t
 * has a probability of at most 16 t^8, 1e-12 here (Dixon, SIAM J. Numer. Anal. 20 (1983), for the method). */
#define LEAST_SHARE 0.022
_Static_assert(UZ_LANES == 8, "the probability is that of eight vectors");

/* The sums of squares of each lane, and the largest; NaN where one is. */
static double add_squares(double squares[UZ_LANES], const double *X, int64_t n)
{
    double largest = 0.0;
    for (int l = 0; l < UZ_LANES; l++)
        squares[l] = 0.0;
    for (int64_t k = 0; k < n; k++)
        for (int l = 0; l < UZ_LANES; l++)
            squares[l] += X[k * UZ_LANES + l] * X[k * UZ_LANES + l];
    for (int l = 0; l < UZ_LANES; l++)
        largest = squares[l] <= largest ? largest : squares[l];
    return largest;
}

uz_status uz_bound_inverse(uz_factor *factor, const uz_csc *K, cholmod_common *common, uz_error *err)
{
    const int64_t n = factor->n;
    const SuiteSparse_long *perm = factor->L.Perm;
    uint64_t state = 0x9E3779B97F4A7C15u;
    double half[UZ_LANES], whole[UZ_LANES], *root = uz_alloc(n, sizeof *root);
    double *X = cholmod_l_malloc((size_t)(n * UZ_LANES), sizeof *X, common); /* where factors have their memory */
    uz_status status =
        X && root ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
    for (int64_t k = 0; status == UZ_OK && k < n; k++) {
        root[k] = sqrt(K->val[K->ptr[perm[k]]]);
        for (int l = 0; l < UZ_LANES; l++)
            X[k * UZ_LANES + l] = root[k] * (2.0 * uz_uniform(&state) - 1.0);
    }
    if (status == UZ_OK)
        status = uz_factor_solve_lanes(factor, X, 1, true, err);
    if (status == UZ_OK) {
        add_squares(half, X, n); /* x'B x */
        status = uz_factor_solve_lanes(factor, X, 1, false, err);
    }
    for (int64_t k = 0; status == UZ_OK && k < n; k++)
        for (int l = 0; l < UZ_LANES; l++)
            X[k * UZ_LANES + l] *= root[k];
    if (status == UZ_OK) {
        const double bound = sqrt(add_squares(whole, X, n)) / LEAST_SHARE;
        factor->info.inverse_bound = bound < INFINITY ? bound : INFINITY;
        for (int l = 0; l < UZ_LANES; l++) /* x'B^2 x / x'B x <= c */
            if (half[l] / whole[l] < factor->info.rcond)
                factor->info.rcond = half[l] / whole[l];
    }
    cholmod_l_free((size_t)(n * UZ_LANES), sizeof *X, X, common);
    free(root);
    return status;
}
