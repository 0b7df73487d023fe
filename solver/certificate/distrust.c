#include "certificate/distrust.h"

#include "certificate/bound.h"
#include "certificate/residual.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VECTORS = 8, POWERS = 8, POWERS_OF_LARGE = 3, LARGE = 20000 };

/* For x with independent standard normal entries and a unit vector v, P(|v'x| < t) < 0.8 t. With v the eigenvector of
 * the eigenvalue of M that is largest in magnitude, ||M^q x|| >= ||M||^q |v'x|: that all of VECTORS samples fall short
 * of ||M||^q t has a probability below (0.8 t)^8, 1e-12 here (Dixon, SIAM J. Numer. Anal. 20 (1983), for the method).
 */
#define LEAST_SHARE 0.04

/* Smaller than this it does not matter any more. */
#define ENOUGH 1e-2

/* y'K y / x'x for y = S^-T x is known to about eps times the root of the condition. */
#define SURELY_NEGATIVE (-1e-6)

typedef struct {
    const uz_csc *K;
    uz_csc no_rows; /* 0 x d */
    double *zero;   /* d */
    uz_residuals res;
    double *X, *Y; /* d x VECTORS: M^q x, K S^-T M^(q-1) x */
} room;

/* X = M X. */
static uz_status apply(room *w, uz_half_solve half, void *ctx, uz_error *err)
{
    const int64_t d = w->K->cols;
    memcpy(w->Y, w->X, (size_t)(d * VECTORS) * sizeof *w->Y);
    uz_status status = half(ctx, w->Y, VECTORS, true, err);
    for (int v = 0; status == UZ_OK && v < VECTORS; v++) {
        double *y = w->Y + v * d;
        status = uz_equilibrium_residual(&w->res, w->K, &w->no_rows, w->zero, y, w->zero, NULL, err);
        if (status == UZ_OK)
            memcpy(y, w->res.e_u, (size_t)d * sizeof *y);
    }
    if (status == UZ_OK)
        status = half(ctx, w->Y, VECTORS, false, err);
    for (int v = 0; status == UZ_OK && v < VECTORS; v++) {
        double *x = w->X + v * d, *y = w->Y + v * d, square = 0.0, energy = 0.0;
        for (int64_t j = 0; j < d; j++) {
            square += x[j] * x[j];
            energy += x[j] * y[j];
            x[j] -= y[j];
        }
        if (energy < SURELY_NEGATIVE * square)
            status = uz_fail(err, UZ_ERR_NOT_SPD, "K",
                             "K is not positive definite: there is a displacement u with u'K u < 0, hidden by the "
                             "rounding of the factorization. Support the body so that it can't move freely, or give K "
                             "with more digits, or without dofs that nearly depend on each other.");
    }
    return status;
}

uz_status uz_distrust(double *norm, const uz_csc *K, uz_half_solve half, void *ctx, const uz_stop *stop, uz_error *err)
{
    const int64_t d = K->cols;
    const int most = d < LARGE ? POWERS : POWERS_OF_LARGE;
    uint64_t state = 0xD1B54A32D192ED03u;
    room w = {.K = K};
    double **of_d[] = {&w.zero, &w.res.e, &w.res.e_u, &w.res.Ku, &w.res.Kc};
    bool ok = (w.X = uz_alloc(d * VECTORS, sizeof(double))) && (w.Y = uz_alloc(d * VECTORS, sizeof(double)));
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = ok && (*of_d[k] = uz_alloc_zero(d, sizeof(double)));
    *norm = INFINITY;
    uz_status status = ok ? uz_csc_init(&w.no_rows, 0, d, 0, err)
                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)d);
    for (int64_t k = 0; status == UZ_OK && k < d * VECTORS; k++)
        w.X[k] = uz_normal(&state);
    for (int power = 1; status == UZ_OK && *norm > ENOUGH && power <= most; power++) {
        double largest = 0.0;
        status = uz_stop_is_due(stop)
                     ? uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the rounding of the factor was known")
                     : apply(&w, half, ctx, err);
        for (int v = 0; status == UZ_OK && v < VECTORS; v++) {
            const double size = uz_bound_norm(w.X + v * d, d);
            largest = size <= largest ? largest : size; /* NaN stays */
        }
        const double bound = pow(largest / LEAST_SHARE, 1.0 / power);
        if (status == UZ_OK && bound < *norm)
            *norm = bound;
    }
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        free(*of_d[k]);
    uz_free_all(w.X, w.Y);
    uz_csc_clear(&w.no_rows);
    return status;
}
