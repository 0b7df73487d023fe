/* inverse_norm.c: a bound on the norm of K^-1, once per factor, that makes every later certificate half a solve
 * cheaper. It is made in half solves of a few vectors, each of which sharpens it. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

enum { VECTORS = 4 };

/* For x with independent entries spread evenly over [-1, 1] and any unit vector v, P(|v'x| < t) <= sqrt(2) t, as v'x
 * has a density of at most sqrt(2) / 2 (Ball, Proc. AMS 97 (1986), on sections of the cube). With v the eigenvector of
 * the largest eigenvalue c of B = D_K^1/2 K^-1 D_K^1/2, ||B^q x|| >= c^q |v'x|: that all of VECTORS samples fall short
 * of c^q t has a probability of at most 4 t^4, 1e-12 here (Dixon, SIAM J. Numer. Anal. 20 (1983), for the method). With
 * K = P'LL'P and q = 1/2, ||L^-1 P D_K^1/2 x|| is the same norm: one half of a solve is half a power. */
#define LEAST_SHARE 7e-4

struct uz_norm_estimate {
    double *Y; /* a block of UZ_LANES vectors, in the factor's order; those from VECTORS on are 0 */
    int half_solves;
};

uz_norm_estimate *uz_norm_estimate_new(const uz_factor *factor)
{
    uint64_t state = 0x9E3779B97F4A7C15u;
    uz_norm_estimate *norm = uz_alloc_zero(1, sizeof *norm);
    if (norm && !(norm->Y = uz_alloc_zero(factor->n * UZ_LANES, sizeof *norm->Y))) {
        free(norm);
        norm = NULL;
    }
    for (int v = 0; norm && v < VECTORS; v++)
        for (int64_t k = 0; k < factor->n; k++)
            norm->Y[k * UZ_LANES + v] = 2.0 * uz_uniform(&state) - 1.0;
    return norm;
}

void uz_norm_estimate_free(uz_norm_estimate *norm)
{
    if (norm)
        free(norm->Y);
    free(norm);
}

static void scale(double *Y, const uz_factor *factor, const uz_csc *K)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    for (int64_t k = 0; k < factor->n; k++) {
        const double root = sqrt(K->val[K->ptr[perm[k]]]);
        for (int v = 0; v < VECTORS; v++)
            Y[k * UZ_LANES + v] *= root;
    }
}

uz_status uz_norm_estimate_step(double *bound, bool *done, uz_norm_estimate *norm, const uz_factor *factor,
                                uz_factor_workspace *ws, const uz_csc *K, uz_error *err)
{
    enum { HALF_SOLVES = 6 }; /* B^3 x: more sharpens less than an eighth */
    const bool back = norm->half_solves % 2 == 1;
    if (!back)
        scale(norm->Y, factor, K);
    uz_status status = uz_factor_solve_lanes(factor, norm->Y, 1, !back, err);
    if (status == UZ_OK)
        status = uz_need_panel(ws, (size_t)factor->n, err);
    if (status != UZ_OK)
        return status;
    if (back)
        scale(norm->Y, factor, K);
    double largest = 0.0;
    for (int v = 0; v < VECTORS; v++) {
        for (int64_t k = 0; k < factor->n; k++)
            ws->panel[k] = norm->Y[k * UZ_LANES + v];
        largest = fmax(largest, uz_norm(factor->n, ws->panel));
    }
    norm->half_solves++;
    *bound = pow(largest / LEAST_SHARE, 2.0 / norm->half_solves);
    *done = norm->half_solves >= HALF_SOLVES;
    return UZ_OK;
}
