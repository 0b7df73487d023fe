/* condition.c: what the pivots of a factor and one linear solve with UZ_LANES random vectors say about K: an estimate
 * of its condition, and a bound on the norm of K^-1. Once per factor; of one that is used briefly the pivots alone, and
 * one vector where somebody asks. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/random.h"

#include <float.h>
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

/* Below this times n the factor's own rounding errors are as large as its smallest pivot: of a body that is free to
 * move, rounding was seen to leave up to half of n eps. */
#define RCOND_LEAST DBL_EPSILON

uz_status uz_find_least_pivot(uz_factor *factor, const uz_csc *K, uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *perm = L->Perm;
    const double *x = L->x;
    const int64_t n = factor->n;
    /* min_j L_jj^2 / K_jj: what elimination left of each diagonal entry. It does not depend on the units of single
     * dofs, and the accuracy of a Cholesky factorization is governed by the condition after diagonal scaling (Demmel
     * 1989; Higham 2002, section 10.1). */
    double least = 1.0;
    for (size_t s = 0; s < L->nsuper; s++)
        for (int64_t k = super[s]; k < super[s + 1]; k++) {
            int64_t j = k - super[s], rows = pi[s + 1] - pi[s];
            double pivot = x[px[s] + j + j * rows], share = pivot * pivot / K->val[K->ptr[perm[k]]];
            least = share < least || isnan(share) ? share : least;
        }
    factor->info.rcond = least;
    factor->info.inverse_bound = INFINITY;
    if (!(least >= RCOND_LEAST * (double)n))
        return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                       "K is singular to working precision (reciprocal condition %.2g): the body can move without "
                       "resistance, or its stiffnesses differ by more than double precision can hold",
                       least);
    return UZ_OK;
}

/* The pivots alone may be short by any factor (Kahan's matrix). */
uz_status uz_find_condition(uz_factor *factor, const uz_csc *K, cholmod_common *common, uz_error *err)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    const int64_t n = factor->n;
    uint64_t state = 0x9E3779B97F4A7C15u;
    double half[UZ_LANES], whole[UZ_LANES], *root = uz_alloc(n, sizeof *root);
    const size_t entries = (size_t)(n * UZ_LANES);
    double *X = cholmod_l_malloc(2 * entries, sizeof *X, common); /* where factors have their memory */
    uz_status status =
        X && root ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
    for (int64_t k = 0; status == UZ_OK && k < n; k++) {
        root[k] = sqrt(K->val[K->ptr[perm[k]]]);
        for (int l = 0; l < UZ_LANES; l++)
            X[k * UZ_LANES + l] = root[k] * (2.0 * uz_uniform(&state) - 1.0);
    }
    if (status == UZ_OK)
        status = uz_factor_solve_shares(factor, X, X + entries, true, err);
    if (status == UZ_OK) {
        add_squares(half, X, n); /* x'B x */
        status = uz_factor_solve_shares(factor, X, X + entries, false, err);
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
    cholmod_l_free(2 * entries, sizeof *X, X, common);
    free(root);
    return status;
}

/* Of one of the vectors above. */
uz_status uz_factor_estimate_rcond(double *rcond, const uz_factor *factor, const uz_csc *K, uz_error *err)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    const int64_t n = factor->n;
    uint64_t state = 0x9E3779B97F4A7C15u;
    double half = 0.0, whole = 0.0, *x = uz_alloc(n, sizeof *x);
    uz_factor_workspace *ws = uz_factor_workspace_new();
    uz_status status =
        x && ws ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
    *rcond = factor->info.rcond;
    for (int64_t k = 0; status == UZ_OK && k < n; k++)
        x[k] = sqrt(K->val[K->ptr[perm[k]]]) * (2.0 * uz_uniform(&state) - 1.0);
    if (status == UZ_OK)
        status = uz_factor_solve_one(factor, ws, x, true, err);
    for (int64_t k = 0; status == UZ_OK && k < n; k++)
        half += x[k] * x[k];
    if (status == UZ_OK)
        status = uz_factor_solve_one(factor, ws, x, false, err);
    for (int64_t k = 0; status == UZ_OK && k < n; k++)
        whole += K->val[K->ptr[perm[k]]] * x[k] * x[k];
    if (status == UZ_OK && half / whole < *rcond)
        *rcond = half / whole;
    uz_factor_workspace_free(ws);
    free(x);
    return status;
}
